"""Laboratory B on its way to rest: the table comes to a hold, the damper's motor force to zero."""

from __future__ import annotations

from common.errors import RigError
from common.laboratory import Laboratory
from common.rig import GuardedRig, TableCommand, TableMeasurement
from common.roles import ramp_topic
from common.safety.ramp import ForceRelease, MotionRamp

AT_REST = TableCommand(0.0, 0.0)


class TableDescent:
    """Knows the last commands written, from which the ramp begins."""

    def __init__(self, lab: Laboratory, rig: GuardedRig) -> None:
        self._lab = lab
        self._rig = rig
        self._last = self._before = AT_REST
        self._ramp: tuple[MotionRamp, ForceRelease] | None = None
        self._begun = 0

    def wrote(self, command: TableCommand) -> None:
        """A command went to the rig."""
        self._before, self._last = self._last, command

    def ease(self, tick: int) -> None:
        """One interval: read, move on, write."""
        try:
            measured = self._rig.read()
        except RigError:  # it comes to a hold blind; its cause is known
            measured = None
        self.step(tick, measured)

    def step(self, tick: int, measured: TableMeasurement | None) -> None:
        """One interval of which the measurement is known, None where the rig gives none."""
        table, motor = self._ramp or self._begin(tick)
        command = TableCommand(table.step(None), motor.step())
        try:
            self._rig.write(command)
            done = table.done and motor.done
        except RigError as error:  # it can be moved no more: it rests where it is
            self._lab.note("ramp", str(error), level="warning", tick=tick)
            done = True
        if done:
            duration = (tick + 1 - self._begun) * self._lab.plan.test.interval
            self._lab.come_to_rest(
                tick, {"duration": duration, "travel": table.travel, "table_command": command.table_command}
            )
        self._lab.sample_ramp(ramp_topic(self._lab.name), tick, *command, *(measured or (float("nan"),) * 4))

    def _begin(self, tick: int) -> tuple[MotionRamp, ForceRelease]:
        plan = self._lab.plan
        interval = plan.test.interval
        velocity = (self._last.table_command - self._before.table_command) / interval
        self._begun = tick
        self._ramp = (
            MotionRamp(plan.safety, interval, self._last.table_command, velocity, unload=False),
            ForceRelease(plan.safety, interval, self._last.damper_command),
        )
        return self._ramp
