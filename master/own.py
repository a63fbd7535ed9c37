"""The interface between the master's loop and its own laboratory, of any kind or none."""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter
from typing import Any

from common.named import maker
from common.plan.plan import Plan
from common.rig import NothingCommand, command_of
from common.roles import MASTER
from common.safety.ramp import Ramp
from common.signals import Channels
from laboratories import kinds
from laboratories.kind import Follows
from master.building import Outputs

NOWHERE = (0.0, 0.0)  # position and force for a master without a laboratory


class NoRigAtRest:
    """The ramp to rest of a laboratory without a rig, which ends at once."""

    done, travel, left = True, 0.0, 0.0

    def step(self, _measured: tuple[float, ...] | None) -> tuple[float, ...]:
        """An empty command."""
        return ()

    def doing(self, _measured: tuple[float, ...] | None) -> str:
        """The text for a master without a rig."""
        return "no rig has to come to rest"


class OwnLaboratory:
    """The commands for the master's own laboratory, the measurements used from it, and its recorded values."""

    def __init__(self, plan: Plan) -> None:
        self._plan, self._kind = plan, kinds.own(plan)
        self.channels: Channels | None = self._kind.channels if self._kind else None
        self.felt: Callable[[Any], tuple[float, float]] = lambda _: NOWHERE
        self.command: Callable[[Outputs], Any] = lambda _: self.zero
        self.zero: Any = NothingCommand()
        if self.channels is not None:
            names, make = self.channels.names, maker(command_of(self.channels))
            self.felt = itemgetter(names.index(self.channels.position), names.index(self.channels.force))
            self.command = (
                (lambda outputs: make((outputs.command, outputs.effort)))
                if self.channels.effort
                else (lambda outputs: make((outputs.command,)))
            )
            self.zero = make((0.0,) * len(self.channels.drives))
        self._storey, self._ratio = watched(plan)

    def ramp(self, last: tuple[float, ...], before: tuple[float, ...]) -> Ramp:
        """The ramp to rest from the last two commands."""
        return self._kind.ramp(self._plan, last, before) if self._kind else NoRigAtRest()

    def row(self, outputs: Outputs, command: Any, measured: tuple[float, ...]) -> tuple[float, ...]:
        """Its recorded values: target, motor's force, command, measurements.

        Empty for a master without a laboratory.
        """
        if self.channels is None:
            return ()
        return (outputs.target, *command[1:], command[0], *measured)

    def force(self, measured: tuple[float, ...]) -> dict[str, float]:
        """Its force (N) by the channel's name; empty for a master without a laboratory."""
        return (
            {}
            if self.channels is None
            else {self.channels.force: self.felt(measured)[1] if measured else 0.0}
        )

    def drift(self, outputs: Outputs) -> float:
        """Drift (m) of the storey in the progress report."""
        if self._ratio:
            return outputs.target / self._ratio
        if not outputs.storeys:  # of a client's building, which is not known here
            return 0.0
        moved, storey = outputs.storeys, self._storey  # the displacements come first
        return moved[storey - 1] - (moved[storey - 2] if storey > 1 else 0.0)


def watched(plan: Plan) -> tuple[int, float]:
    """The storey whose drift is reported, and target over drift if the master's own laboratory follows it, else 0.

    It is the first storey that a laboratory follows, the master's before the slaves', or else the lowest one.
    """
    for role, kind in kinds.kinds_of(plan).items():
        coupling = kind.coupling(plan.of(role))
        if coupling.follows is Follows.DRIFT:
            return coupling.place, coupling.ratio if role == MASTER else 0.0
    return 1, 0.0
