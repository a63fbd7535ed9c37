"""What a laboratory does at an operator's request: start, stop in order, stop at once, reset, hold, resume.

`ORDERS` holds every request that there is, with the roles that answer it. `rths.perform.operate` sends one, numbers it
and collects the answers; its docstring says how.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from common.errors import EmergencyStopError
from common.lab.laboratory import Laboratory
from common.protocol.messages import Answer, Operator
from common.roles import MASTER

START, STOP, EMERGENCY, RESET = "start", "stop", "emergency", "reset"
HOLD, RESUME = "hold", "resume"


class OperatorOrder(NamedTuple):
    """A request that an operator may make of a test."""

    word: str  # in messages and in the recording
    says: str  # what it does, as a short text that continues "rths ..."
    everywhere: bool = True  # whether every laboratory does and answers it, or the master alone

    def answered_by(self, slaves: Sequence[str]) -> tuple[str, ...]:
        """The roles that answer it in a test with these slaves."""
        return (MASTER, *slaves) if self.everywhere else (MASTER,)


ORDERS: Mapping[str, OperatorOrder] = {
    order.word: order
    for order in (
        OperatorOrder(START, "begin a test whose armed laboratories wait for it", everywhere=False),
        OperatorOrder(STOP, "bring all rigs to rest in order and end the test"),
        OperatorOrder(EMERGENCY, "stop all rigs at once, without a ramp; latched until reset"),
        OperatorOrder(RESET, "let laboratories leave their latched safe state once its cause is gone"),
        OperatorOrder(HOLD, "let the earthquake's time slow down and stand still", everywhere=False),
        OperatorOrder(RESUME, "let the earthquake's time of a held test go on", everywhere=False),
    )
}


class Operated(Protocol):
    """A laboratory's loop as an operator sees it."""

    lab: Laboratory

    def start(self) -> tuple[bool, str]:
        """Begin a test that waits for the operator's start; whether it did, and a sentence; the master's alone."""

    def end(self, reason: str) -> None:
        """End the test in order."""

    def emergency(self, error: EmergencyStopError) -> None:
        """Stop the rig at once."""

    def hold(self) -> tuple[bool, str]:
        """Hold the test; return whether that is possible now, and a sentence."""

    def resume(self) -> tuple[bool, str]:
        """Resume a held test; return whether it was held, and a sentence."""

    def standing(self) -> str:
        """Why the cause of a latched state persists, empty where it is gone."""


def obey(loop: Operated, wish: Operator) -> None:
    """Obey a request of this test's operator once per press, and answer each repetition of it."""
    lab, order = loop.lab, ORDERS.get(wish.word)
    if wish.plan != lab.plan.digest() or order is None or lab.name not in order.answered_by(lab.plan.roles):
        return
    if lab.safety.pressed(wish.press):
        lab.answers[wish.press] = _done(loop, wish)
        why = f" ({wish.reason})" if wish.reason else ""
        lab.note("operator", f"{wish.word}{why}: {lab.answers[wish.press][1]}", tick=lab.tick)
    accepted, text = lab.answers[wish.press]
    lab.answered_ns = lab.clock.now()
    lab.endpoint.send(Answer(0, wish.press, int(accepted), text))


def _done(loop: Operated, wish: Operator) -> tuple[bool, str]:
    """Do what is requested; return whether it was done, and a sentence."""
    lab, reason = loop.lab, wish.reason or "no reason given"
    if wish.word == START:
        return loop.start()
    if wish.word == RESET:
        return _reset(loop)
    if wish.word == EMERGENCY:
        loop.emergency(EmergencyStopError(f"emergency stop by the operator: {reason}."))
        return True, f"{lab.safety.mode.value}."
    if lab.exchange.ended:
        return False, "The test is over already."
    if wish.word in (HOLD, RESUME):
        return loop.hold() if wish.word == HOLD else loop.resume()
    loop.end(f"stopped by the operator: {reason}.")
    return True, f"{lab.safety.mode.value}."


def _reset(loop: Operated) -> tuple[bool, str]:
    safety = loop.lab.safety
    if not safety.latched:
        return False, f"There is nothing to reset: the laboratory is {safety.mode.value}."
    if standing := loop.standing():
        return False, f"The cause is still there: {standing}"
    safety.reset()
    return True, "The laboratory is idle."
