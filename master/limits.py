"""The limits that the master checks at each tick, on the measurements read and on the commands computed."""

from __future__ import annotations

from itertools import chain

from common.plan.limits import LimitViolation, Standstill
from common.plan.plan import Plan
from common.signals import OF_STOREYS
from laboratories import kinds
from laboratories.limits import TickLimits, limited, of_commands, of_readings, of_sent
from master.building import Outputs
from master.energy import UNKNOWN, Energies, EnergyMonitor


class MasterLimits:
    """The plan's limits on the master's own laboratory, on the building, and on what is sent to the slaves.

    `violation` must be called once in every tick, and `written` with every command that is written to the rig.
    """

    def __init__(self, plan: Plan) -> None:
        own = kinds.own(plan)
        readings, commands = (of_readings(own, plan), of_commands(own, plan)) if own else ([], [])
        sent = [limit for role in plan.roles for limit in of_sent(kinds.kind_of(plan, role), plan.of(role))]
        moved = () if plan.served else OF_STOREYS  # a client's building is unknown here
        storeys = limited(vars(plan.limits), (name for name in moved for _ in range(plan.storeys)))
        values = [*readings, *commands, *sent, *storeys]
        self._tick = TickLimits(own, plan, values, commands=len(readings))
        self._energy = None if plan.served else EnergyMonitor(plan)
        self.written = self._tick.written
        self.standing = self._tick.standing

    @property
    def energies(self) -> Energies:
        """The energy put in, and that of errors which the plan allows at present."""
        return self._energy.energies if self._energy else UNKNOWN

    def violation(
        self, measured: tuple[float, ...], wanted: tuple[float, ...], outputs: Outputs
    ) -> LimitViolation | Standstill | None:
        """The first value beyond its limit, None where there is none; `wanted` is the command for its own rig."""
        sent = outputs.sent[0] if len(outputs.sent) == 1 else chain.from_iterable(outputs.sent)
        beyond = self._tick.violation(outputs.target, *measured, *wanted, *sent, *outputs.storeys)
        energy = self._energy.violation(measured, outputs) if self._energy else None
        return beyond or energy
