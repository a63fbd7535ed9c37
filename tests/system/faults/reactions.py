"""What the laboratories of a fault test did, from its recording, and what they had to do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.recording.run import Run
from tests.faults.rows import motion_bound
from tests.system.faults.bench import INTERVAL, PAUSE, WATCHDOG, Bench, DisturbedError


class Reaction(NamedTuple):
    """How a laboratory came to rest."""

    cause: str  # code of the event
    seconds: float  # from the last valid message, when it was used, to the first command of the ramp
    motion: float  # m, after the last valid command, by the recording
    rig_seconds: float  # the same two by the rig's own log
    rig_motion: float
    duration: float  # s of the ramp
    modes: tuple[str, ...]
    text: str  # of the cause


def reaction(run: Run, bench: Bench, lab: str, *, held: bool = False) -> Reaction:
    """The way of a laboratory from its last valid message to rest.

    Raises:
        DisturbedError: the machine paused within it.
    """
    last = last_valid(run, lab)
    ramp = run.ramps[lab]
    name = "actuator_command" if lab == "master" else "table_command"
    columns = run.columns[lab]
    from_there = columns[name][columns["seq"] == last][0]
    later = np.concatenate([columns[name][columns["seq"] > last], ramp[name]])
    first = int(ramp["seq"][0])
    cause = first_error(run.events, lab)
    rig_seconds, rig_motion = by_rig(bench, lab, last, first, held=held)
    safe = [event for event in run.events if event["code"] == "safe" and event["lab"] == lab]
    return Reaction(
        cause["code"],
        (first - last) * INTERVAL,
        float(np.max(np.abs(later - from_there), initial=0.0)),
        rig_seconds,
        rig_motion,
        safe[0]["values"]["duration"] if safe else float("nan"),
        tuple(modes_of(run, lab)),
        cause["text"],
    )


def last_valid(run: Run, lab: str) -> int:
    """The tick that used the last valid message."""
    columns = run.columns[lab]
    used = columns["command_seq" if lab == "slave" else "damper_force_seq"]
    return int(columns["seq"][np.flatnonzero(used == used[-1])[0]])


def by_rig(bench: Bench, lab: str, last: int, first: int, *, held: bool) -> tuple[float, float]:
    """Time and motion from the command of a tick by the rig's log, which has one command per tick up to the ramp.

    A laboratory that was `held` up wrote nothing meanwhile.
    """
    written = bench.logs[lab].written()
    if held:
        first = last + int(np.argmax(np.diff(written.ns[last:]))) + 1
    late = written.ns[last - 20 : first + 1] - np.arange(first - last + 21) * INTERVAL * 1e9
    if not held and np.ptp(late) > PAUSE * 1e9:
        raise DisturbedError(f"a command of the {lab} was {np.ptp(late) * 1e-6:.1f} ms later than another")
    motion = np.max(np.abs(written.displacement[last:] - written.displacement[last]))
    return float(written.ns[first] - written.ns[last]) * 1e-9, float(motion)


def first_error(events: Sequence[Mapping[str, Any]], lab: str) -> Mapping[str, Any]:
    """The event that ended the test for a laboratory."""
    return next(event for event in events if event["lab"] == lab and event["level"] == "error")


def modes_of(run: Run, lab: str) -> list[str]:
    """A laboratory's changes of the safety mode, as recorded."""
    return [event["text"] for event in run.events if event["code"] == "mode" and event["lab"] == lab]


def exchanged(run: Run, lab: str) -> Mapping[str, float]:
    """What a laboratory says became of the messages."""
    found = [event["values"] for event in run.events if event["code"] == "exchange" and event["lab"] == lab]
    return dict(found[0])


def expect(cause: str, allowed: Sequence[str], text: str = "") -> None:
    """The cause is the fault's; raises DisturbedError where a pause of this machine came first."""
    if cause == "overrun" and "overrun" not in allowed:
        raise DisturbedError(f"a laboratory was held up: {text}")
    assert cause in allowed, text


def judge(
    run: Run, bench: Bench, lab: str, causes: Sequence[str], most: float = WATCHDOG + INTERVAL
) -> Reaction:
    """Assert that a laboratory came to its latched safe state for one of these causes, in time and within bounds."""
    expect(first_error(run.events, lab)["code"], causes, str(first_error(run.events, lab)))
    found = reaction(run, bench, lab, held="overrun" in causes)
    assert any("ramping (trip)" in text for text in found.modes), found
    assert found.modes[-1] in ("ramping → safe (secured)", "safe → idle (reset)"), found
    assert found.seconds <= most + 1e-9, found
    assert found.rig_seconds <= most + PAUSE, found
    bound = motion_bound(bench.plan, lab)
    assert found.motion <= bound, found
    assert found.rig_motion <= bound, found
    return found


def later(upset: NDArray[np.bool_], quiet: NDArray[np.bool_], name: str) -> None:
    """Raise DisturbedError where more of the ticks were late under a fault than without it, beyond what chance does.

    A machine that is shared makes ticks late in both: three standard deviations of the difference, and one tick in
    a thousand, count as the same.
    """
    chance = np.sqrt(quiet.mean() * (1.0 / upset.size + 1.0 / quiet.size))
    if upset.mean() > quiet.mean() + 0.001 + 3.0 * chance:
        raise DisturbedError(f"{upset.mean():.4f} of the ticks late with {name}, {quiet.mean():.4f} without")


def worst(found: Mapping[str, Reaction]) -> tuple[float, float]:
    """The longest time and the longest way of several laboratories, for a row."""
    return max(one.seconds for one in found.values()), max(
        max(one.motion, one.rig_motion) for one in found.values()
    )


def evidence(found: Mapping[str, Reaction]) -> str:
    """The causes and the ramps to rest, for a row."""
    return "; ".join(
        f"{lab}: {one.cause}, at rest after {one.duration * 1e3:.0f} ms" for lab, one in found.items()
    )
