"""Laboratory A on its way to rest: the actuator comes to a hold, then unloads the specimen."""

from __future__ import annotations

from common.errors import RigError
from common.laboratory import Laboratory
from common.rig import ColumnCommand, ColumnMeasurement, GuardedRig
from common.roles import ramp_topic
from common.safety.ramp import MotionRamp


class ColumnDescent:
    """Knows the last commands written, from which the ramp begins."""

    def __init__(self, lab: Laboratory, rig: GuardedRig) -> None:
        self._lab = lab
        self._rig = rig
        self._last = self._before = 0.0
        self._ramp: MotionRamp | None = None
        self._begun = 0

    def wrote(self, command: float) -> None:
        """A command (m) went to the rig."""
        self._before, self._last = self._last, command

    def ease(self, tick: int) -> None:
        """One interval: read, move on, write."""
        try:
            measured = self._rig.read()
        except RigError:  # it comes to a hold blind; its cause is known
            measured = None
        self.step(tick, measured)

    def step(self, tick: int, measured: ColumnMeasurement | None) -> None:
        """One interval of which the measurement is known, None where the rig gives none."""
        ramp = self._ramp or self._begin(tick)
        command = ramp.step(measured.column_force if measured else None)
        try:
            self._rig.write(ColumnCommand(command))
        except RigError as error:  # it can be moved no more: it rests where it is
            self._lab.note("ramp", str(error), level="warning", tick=tick)
            ramp.done = True
        if ramp.done:
            duration = (tick + 1 - self._begun) * self._lab.plan.test.interval
            self._lab.come_to_rest(
                tick, {"duration": duration, "travel": ramp.travel, "actuator_command": command}
            )
        self._lab.sample_ramp(ramp_topic(self._lab.name), tick, command, *(measured or (float("nan"),) * 2))

    def _begin(self, tick: int) -> MotionRamp:
        plan = self._lab.plan
        velocity = (self._last - self._before) / plan.test.interval
        self._begun = tick
        self._ramp = MotionRamp(
            plan.safety, plan.test.interval, self._last, velocity, unload=plan.safety.unload
        )
        return self._ramp
