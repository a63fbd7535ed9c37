"""The number of ticks that a recording should hold: all of the plan, or those until the end of a test that stopped."""

from __future__ import annotations

from collections.abc import Mapping

from common import signals
from common.plan.plan import Plan
from common.recording.holds import added, holds
from common.recording.outcome import COMPLETED, outcome
from common.recording.run import Run
from common.roles import LATENCY, MASTER, kind_of
from common.safety.modes import Mode

MOVING = tuple(float(list(Mode).index(mode)) for mode in (Mode.RUNNING, Mode.HOLDING))
WHOLE = (COMPLETED, "imported")


def due(run: Run, plan: Plan | None) -> dict[str, int]:
    """Ticks due by topic.

    In a test that ended early a laboratory's ticks were due until it began its ramp to rest, as its event says. A
    laboratory without that event, such as one that was killed, owes the ticks until the last laboratory began its ramp.
    """
    topics = [topic for topic in run.columns if kind_of(topic) in signals.TICK_TOPICS]
    begun = {topic: int(run.sequences[topic].max(initial=-1)) + 1 for topic in topics}
    if plan is None:
        return begun
    if (
        outcome(run.metadata.get("summary", {})) in WHOLE and not plan.served
    ):  # a client ends it when it likes
        return dict.fromkeys(topics, plan.ticks + held(run, plan, plan.ticks))
    ends = endings(run, plan.test.interval)
    left = {topic: max(begun[topic], ends[lab]) for topic in topics if (lab := laboratory(topic)) in ends}
    last = max([*begun.values(), *left.values()], default=0)
    most = plan.ticks + held(run, plan, last)
    return {topic: min(left.get(topic, last), most) for topic in topics}


def held(run: Run, plan: Plan, last: int) -> int:
    """Ticks by which holds have made the test longer that ended at the tick `last`."""
    return added(holds(run.events, plan.test.interval), last)


def laboratory(topic: str) -> str:
    """The laboratory whose ticks a topic counts; latency is the master's account."""
    return MASTER if kind_of(topic) == LATENCY else topic


def endings(run: Run, interval: float) -> Mapping[str, int]:
    """The tick at which each laboratory began its ramp to rest, of those that said so; `interval` in s."""
    found: dict[str, int] = {}
    for event in run.events:
        before, after = event["values"].get("from"), event["values"].get("mode")
        if event["code"] == "mode" and before in MOVING and after not in MOVING:
            found.setdefault(event["lab"], round(event["t"] / interval))
    return found
