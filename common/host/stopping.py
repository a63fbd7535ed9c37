"""Turns signals of the user and of the system into a request to stop, which the loop reads when it may stop."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Callable
from types import FrameType
from typing import Protocol

STOPPING = ("SIGINT", "SIGTERM", "SIGHUP")  # Ctrl-C; kill, `docker stop`; a terminal that is closed
STDERR = 2


class Stopping(Protocol):
    """A request to stop as a loop sees it."""

    presses: int  # how often it was made
    number: signal.Signals  # by which it was made first

    def __call__(self) -> str:
        """The reason, empty while there is none."""


class Stopper:
    """Catches the signals by which a user asks a process to stop; from the second one on it prints `answer`.

    A loop asks for the reason when it may stop, so that a signal never cuts a rig's motion short. The handler itself
    writes the answer, past Python's buffers, so that the user sees it even while the loop waits in a call of a rig.
    """

    def __init__(self, answer: Callable[[], str] | None = None) -> None:
        self.answer = answer
        self.presses = 0
        self.number = signal.SIGINT
        self._reason = ""
        self._before = {number: signal.signal(number, self._caught) for number in taken()}

    def _caught(self, number: int, _frame: FrameType | None) -> None:
        self.presses += 1
        if not self._reason:
            self.number = signal.Signals(number)
            self._reason = f"stopped by the user ({self.number.name})."
        if self.presses > 1 and self.answer is not None:
            with contextlib.suppress(Exception):  # no failure of this message may reach the loop as an error
                os.write(STDERR, f"{self.answer()}\n".encode())

    def __call__(self) -> str:
        """The reason, empty while there is none."""
        return self._reason

    def release(self) -> None:
        """Treat the signals as before, where a command goes on after a test."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    @staticmethod
    def ignore() -> None:
        """Ignore the signals from now on, so that a finished process ends with its own exit code."""
        for number in taken():
            signal.signal(number, signal.SIG_IGN)


def taken() -> list[signal.Signals]:
    """The signals that mean a request to stop; without a hang-up that was ignored from the start (`nohup`)."""
    numbers = [getattr(signal, name) for name in STOPPING if hasattr(signal, name)]
    hang_up = getattr(signal, "SIGHUP", None)
    return [one for one in numbers if one != hang_up or signal.getsignal(one) is not signal.SIG_IGN]
