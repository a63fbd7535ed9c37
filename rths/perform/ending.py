"""How the processes of a test on one machine end, and which of their ends is the cause of the test's end."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Protocol

from common.errors import IncompleteError, InputError, InterlockError, LostError, RthsError
from common.lab.drive import LEAVE_NS, longest_leave
from common.plan.plan import Plan
from common.roles import MASTER, RECORDER, title
from laboratories.longest import resting
from recorder.loop import CONSEQUENCE, ROWS_LOST, SILENCE_NS

# Added to the time that a process takes by its own rules: exit handlers of Python and the system.
MARGIN_S = 1.0
LEAVE_S = LEAVE_NS * 1e-9 + MARGIN_S  # to leave while there are no rows that a recorder could ask for again
SILENCE_S = SILENCE_NS * 1e-9 + MARGIN_S
KILL_S = 3.0  # from asking to killing: a healthy process leaves within a second of being asked
# For the recorder to write its rows to a slow disk: half a minute at 1 MB/s is 30 MB, a whole test.
WRITE_S = 30.0

USED, OWN, CRASHED, LOST, KILLED, WISHED, LED, ASKED, LACKING = range(9)
STOP = "stop"
ERRORS = {2: InputError, 3: InterlockError, 4: LostError}


class Ending:
    """When each process is asked to stop, and when it is killed; it knows neither a clock nor a process.

    The laboratories agree on the end among themselves. An end that they reach by themselves keeps all rows and the true
    cause, so that a process is asked only where it would not learn of the end otherwise, or not in time:

    - A user wants to stop: the master at once, and before the start is agreed the slaves too.
    - A process ended before the start is agreed: master and slaves after `MARGIN_S`.
    - A process ended during ticks: master and slaves after the time that they need to notice it and to leave.
    - The recorder after all laboratories: `MARGIN_S` later if there are no rows, else once its own time is over.

    A process that was asked and still runs after a while is killed. A laboratory on its ramp to rest reports repeatedly
    how long the ramp still takes, and is not killed before its end, whatever the user presses. Nor is a laboratory
    whose rig may be arming, for as long as the others would wait for it.
    """

    def __init__(self, plan: Plan) -> None:
        leave = longest_leave(plan) + MARGIN_S
        # A recorder may be late itself, but it is asked before it would be killed.
        self._recorder = min(SILENCE_S + plan.recording.patience, WRITE_S - KILL_S)
        self._notice = plan.link.loss_timeout + leave + resting(plan)
        self._miss_recorder = plan.recording.patience + leave if plan.recording.required else math.inf
        self._wished = math.inf  # time at which a user first wanted to stop
        self._ask = math.inf  # time from which the laboratories are asked
        self._alone = math.inf  # time at which the last laboratory ended
        self._patience = KILL_S  # from asking to killing
        self._rest, self._leave = resting(plan), leave
        self.arming = plan.link.connect_timeout  # s that a rig may take to arm
        self._due: dict[
            str, float
        ] = {}  # time by which a laboratory that reported how long it takes has left
        self.agreed = False  # whether the start is agreed, so that there are ticks

    def look(self, now: float, wish: str, names: Sequence[str], ended: Mapping[str, int]) -> None:
        """Take note of the processes that have ended and of a user's wish to stop; `now` in s."""
        asked_before = self._ask < math.inf
        if wish:
            self._wished = min(self._wished, now)
            self._ask = min(self._ask, now + (self._notice if self.agreed else 0.0))
        if any(name != RECORDER for name in ended):
            self._ask = min(self._ask, now + (self._notice if self.agreed else MARGIN_S))
        elif RECORDER in ended:
            self._ask = min(self._ask, now + (self._miss_recorder if self.agreed else MARGIN_S))
        if all(name in ended for name in names if name != RECORDER):
            self._alone = min(self._alone, now)
        if self._ask < math.inf and not asked_before:
            self._patience = KILL_S if self.agreed else LEAVE_S + KILL_S

    def rests(self, name: str, now: float, left: float | None = None) -> None:
        """Take note that a laboratory is on its ramp to rest, for at most `left` s: it leaves after that."""
        left = self._rest if left is None else left
        self._due[name] = now + left + MARGIN_S + self._leave + KILL_S

    def arms(self, name: str, now: float) -> None:
        """Take note that a laboratory registered: while its rig arms, it does not see a wish to stop."""
        self._due[name] = now + self.arming + LEAVE_S + KILL_S

    def armed(self, name: str, now: float) -> None:
        """Take note that its rig is armed."""
        self._due[name] = now + LEAVE_S + KILL_S

    def ask_at(self, name: str) -> float:
        """The time at which a process is asked to stop, s."""
        if name == RECORDER:
            return self._alone + (self._recorder if self.agreed else MARGIN_S)
        return min(self._wished, self._ask) if name == MASTER else self._ask

    def kill_at(self, name: str) -> float:
        """The time at which a process is killed unless it has ended, s."""
        if name == RECORDER:
            return self._alone + (WRITE_S if self.agreed else MARGIN_S + KILL_S)
        return max(self._ask + self._patience, self._due.get(name, -math.inf))


class Ended(Protocol):
    """What is known of processes that have ended."""

    errors: dict[str, str]
    asked: set[str]
    killed: set[str]

    def ended(self) -> dict[str, int]:
        """Their exit codes, in the order in which they were started."""

    def complaint(self, name: str) -> str:
        """What a process has written on standard error."""


def verdict(processes: Ended, wish: str) -> RthsError | None:
    """The error that ended a test, None where all processes ended with 0; `wish` is that of a user to stop.

    It depends on how each process ended, not on which was seen to end first. The cause is the process with the first of
    these ends, and among equals the one that was started first:

    - USED: it could not use a file or an option (exit 2).
    - OWN: it reported an error of its own: a limit, a rig, the disk, or a stop that this command did not ask for.
    - CRASHED: it failed without a report, or a signal that this command did not send killed it.
    - LOST: it reported that another process fell silent or never registered (exit 4).
    - KILLED: it is a laboratory that did not end in time, so that this command killed it.
    - WISHED: it is no process but the user, who wanted to stop.
    - LED: it followed another process, as a report with the code "remote_trip" says.
    - ASKED: this command asked it to stop; a recorder that this command killed is meant too.
    - LACKING: it is the recorder, whose recording is not whole although the test is finished (exit 1).
    """
    ranks = {name: rank(processes, name, code) for name, code in processes.ended().items() if code}
    if not ranks:
        return None
    name = min(ranks, key=lambda one: ranks[one])  # the first of equals
    if wish and ranks[name] > WISHED:
        return InterlockError(wish)
    return complaint(processes, name, processes.ended()[name])


def rank(processes: Ended, name: str, code: int) -> int:
    """The rank of a process's end as the cause, from `USED` to `LACKING`."""
    reported = processes.errors.get(name, "")
    from_here = name in processes.asked or name in processes.killed
    if code == 2:
        return USED
    if name == RECORDER and reported == ROWS_LOST:
        return LACKING
    if name in processes.killed and name != RECORDER:
        return KILLED
    if from_here and (
        name == RECORDER or reported in ("", STOP)
    ):  # the recorder is only asked after the test
        return ASKED
    return reported_rank(reported, code)


def reported_rank(reported: str, code: int) -> int:
    """The rank of a process that ended by itself, by the error that it reported and its exit code."""
    if code not in ERRORS and not reported:
        return CRASHED
    if reported in ("", CONSEQUENCE):
        return LED
    return LOST if code == 4 else OWN


def killed(name: str) -> str:
    """A sentence on a process that this command killed."""
    if name == RECORDER:
        return "The recorder did not end in time and was killed; the recording holds the rows until then."
    return (
        f"The {title(name)} did not come to rest and leave in time and was killed: its rig may be loaded and armed, "
        "so make it safe by its own controls before anybody comes near."
    )


def complaint(processes: Ended, name: str, code: int) -> RthsError:
    """The last sentence of a process as an error, or a sentence on how it ended."""
    if name in processes.killed:
        return LostError(killed(name))
    if code < 0:
        return LostError(
            f"The {title(name)} was killed (signal {-code}); the recording holds the rows until then."
        )
    text = processes.complaint(name).removeprefix("rths: ").splitlines()
    if name == RECORDER and processes.errors.get(name) == ROWS_LOST:
        return IncompleteError(text[-1] if text else "The recording is not whole.")
    return ERRORS.get(code, LostError)(text[-1] if text else f"The {title(name)} stopped before its end.")
