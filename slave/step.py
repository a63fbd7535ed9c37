"""A slave's computation of a tick, from the target received to the command of its transfer system."""

from __future__ import annotations

from common.plan.plan import Plan
from common.protocol.messages import Command
from laboratories.kind import Kind
from models import compensators
from models.compiled import bound


class SlaveStep:
    """The compensator that the slave's plan chooses for a kind; each call computes a tick."""

    def __init__(self, plan: Plan, kind: Kind) -> None:
        chosen = kind.compensator(plan)
        interval = self._interval = plan.test.interval
        built = compensators.build(chosen.kind, chosen.parameters, interval, chosen.where)
        self._command = bound(compensators.enter, built, *compensators.STILL, interval)
        self._position = kind.channels.names.index(kind.channels.position)
        self._target = 0.0  # of t_k

    def __call__(self, command: Command, measured: tuple[float, ...]) -> float:
        """Command (m) for the interval's end, from the command in force and the measurement at t_k."""
        present, self._target = self._target, command.target
        result: float = self._command(
            command.target,
            command.velocity,
            command.acceleration,
            command.jerk,
            present,
            measured[self._position],
            self._interval,
        )
        return result
