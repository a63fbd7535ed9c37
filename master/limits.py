"""What the master checks before its rig moves: the measurements it read and the commands it computed."""

from __future__ import annotations

from common.plan.limits import Guard, LimitViolation, Standstill
from common.plan.plan import Plan
from common.signals import OF_STOREYS
from laboratories import kinds
from laboratories.limits import LaboratoryLimits, NoLimits, sent_guard
from master.energy import EnergyMonitor
from master.step import Outputs, Sent


class MasterLimits:
    """The plan's limits on the master's own laboratory, on the building, and on what is sent to the slaves.

    `violation` is asked once in every tick; `written` is told of every command that went to the rig.
    """

    def __init__(self, plan: Plan) -> None:
        own = kinds.own(plan)
        storeys = tuple(name for name in OF_STOREYS for _ in range(plan.storeys))
        self._own = LaboratoryLimits(own, plan) if own else NoLimits()
        self._sent = [sent_guard(kinds.kind_of(plan, role), plan.of(role)) for role in plan.roles]
        self._storeys = Guard(vars(plan.limits), storeys)
        self._energy = EnergyMonitor(plan)
        self.written = self._own.written
        self.standing = self._own.standing

    def violation(
        self, measured: tuple[float, ...], wanted: tuple[float, ...], outputs: Outputs
    ) -> LimitViolation | Standstill | None:
        """The first value beyond its limit, None where there is none; `wanted` is the command for its own rig."""
        motion = self._own.motion(measured, wanted, outputs.target)
        energy = self._energy.violation(measured, outputs)
        return (
            self._own.readings(measured)
            or self._own.commands(wanted)
            or self._beyond(outputs.sent)
            or self._storeys.violation(outputs.storeys)
            or motion
            or energy
        )

    def _beyond(self, sent: list[Sent]) -> LimitViolation | None:
        """The first value beyond its limit of what goes to the slaves."""
        for guard, values in zip(self._sent, sent, strict=True):
            if violation := guard.violation(values):
                return violation
        return None
