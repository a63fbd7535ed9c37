"""The slave's computation of one tick: from the target received to the command of the table."""

from __future__ import annotations

from common.plan.plan import Plan
from common.protocol.messages import Command
from common.rig import TableMeasurement
from models import compensators
from models.compiled import plain


class SlaveStep:
    """The table's compensator, moving on tick by tick."""

    def __init__(self, plan: Plan) -> None:
        chosen = plan.table.compensator
        interval = self._interval = plan.test.interval
        self._built = plain(compensators.build(chosen.kind, chosen.parameters, interval, plan.follows_in))
        self._target = 0.0  # of t_k

    def __call__(self, command: Command, measured: TableMeasurement) -> float:
        """Command (m) for the interval's end, from the target in force and the measurement at t_k."""
        present, self._target = self._target, command.table_target
        result: float = compensators.enter(
            self._built,
            command.table_target,
            command.table_target_velocity,
            command.table_target_acceleration,
            command.table_target_jerk,
            present,
            measured.table_displacement,
            self._interval,
        )
        return result
