"""Records the machine that a laboratory's process runs on: real-time settings, load, a bare timing loop.

It records the event `real_time` when the ticks begin. When they end it records `machine`, `rejected` if frames were
rejected, and, at the master, `bare_loop`.
"""

from __future__ import annotations

from collections.abc import Mapping

from common.host.bare_loop import BareLoop
from common.host.machine import Watch, facts
from common.host.realtime import Granted
from common.lab.laboratory import Laboratory
from common.lab.preflight import Gate
from common.link.rejections import told

CODES = ("real_time", "machine", "bare_loop", "rejected")


class Surroundings:
    """Watches from the first tick to the last; where `timed`, a bare timing loop runs beside the test.

    `rejected` holds the counts of rejected frames by reason, and `gate` the results of the pre-flight.
    """

    def __init__(
        self,
        lab: Laboratory,
        granted: Granted,
        rejected: Mapping[str, int],
        *,
        timed: bool,
        gate: Gate | None = None,
    ) -> None:
        self._gate = gate or Gate()
        self._lab = lab
        self._granted = granted
        self._rejected = rejected
        self._timed = timed
        self._bare = BareLoop()
        self._watch: Watch | None = None

    def begin(self) -> None:
        """Record the settings and start the measurement; called before the first tick."""
        level = "warning" if self._granted.missing and not self._lab.plan.emulated else "info"
        self._lab.note("real_time", sentence(self._granted), level=level, values=self._granted.values())
        self._gate.note(self._lab)
        if self._timed:
            self._bare.start(self._lab.interval_ns, self._granted)
        self._watch = Watch()

    def end(self, tick: int) -> None:
        """Record the results after the last tick; nothing is recorded of a test that never began."""
        if self._watch is None:
            return
        text = ", ".join(f"{name} {value}" for name, value in facts().items())
        self._lab.note("machine", text, tick=tick, values=self._watch.values())
        if counts := told(self._rejected):
            text = ", ".join(f"{count} by {reason}" for reason, count in counts.items())
            values = {reason: float(count) for reason, count in counts.items()}
            self._lab.note(
                "rejected", f"Frames were rejected: {text}.", level="warning", tick=tick, values=values
            )
        if self._timed and (found := self._bare.stop()):
            text = (
                f"bare timing loop beside the test: {found['late']:.0f} late, p99 {found['p99'] * 1e6:.0f} µs"
            )
            self._lab.note("bare_loop", text, tick=tick, values=found)


def sentence(granted: Granted) -> str:
    """What was granted, and what is missing and why."""
    priority = f"FIFO priority {granted.priority}" if granted.priority else "ordinary priority"
    place = f"processor {granted.processor}" if granted.processor >= 0 else "any processor"
    memory = "memory locked" if granted.memory_locked else "memory not locked"
    return " ".join((f"real time: {priority}, {place}, {memory}.", *granted.missing))


def described(lab: str, code: str, values: Mapping[str, float]) -> dict[str, str]:
    """An event's values as the recording's metadata has them: `<lab>.<name>`.

    The bare loop's are `bare_loop.<name>`, the counts of rejected frames `<lab>.rejected.<reason>`.
    """
    prefix = {"bare_loop": code, "rejected": f"{lab}.{code}"}.get(code, lab)
    result = {f"{prefix}.{name}": repr(value) for name, value in values.items()}
    if code == "real_time" and "priority" in values:
        priority = values["priority"]
        result[f"{prefix}.scheduler"] = f"fifo {priority:.0f}" if priority else "other"
    return result
