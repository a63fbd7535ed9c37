"""Carries out the orders of the panel in a thread of its own, which also watches the test that runs on this machine.

Orders to laboratories go over the operator's link, as those of `rths stop` do, and none waits for the answers to
another. The link is opened as soon as a test is there, so that a stop takes milliseconds.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from queue import Empty, Queue
from typing import NamedTuple

from common.errors import RthsError
from common.host import running
from common.lab.operation import EMERGENCY, STOP
from common.plan.plan import Plan
from common.roles import title
from report.panel.desk import DONE, REFUSED, UNHEARD, OrderOutcome, Present
from report.panel.snapshot import CheckResult, RunReports, Shown, Snapshot
from report.panel.words import ARM, CHECK, MACHINE
from rths.panel.child import Check, RunCommand
from rths.panel.running_test import RunningTest, named
from rths.perform.operate import PATIENCE_S, Given, Outstanding

TURN_S = 0.01  # s between two turns while answers are awaited
IDLE_S = 0.05  # s between two turns while none is; a new order ends the wait at once
LOOK_S = 0.3  # s between two looks for tests on this machine
STOPS = (STOP, EMERGENCY)
BUSY = "A test runs, which a check would disturb."
INTERRUPTED = "The test's command ends it in order, as by Ctrl-C: its laboratories are not linked."
OVER = OrderOutcome(UNHEARD, "This part of the panel has ended: start `rths panel` again.")


class Job(NamedTuple):
    """An order that was handed over, and where its outcome is awaited."""

    word: str
    digest: str
    reason: str
    settled: Future[OrderOutcome]
    until: float  # s, when it is given up for want of a link
    interrupted: bool = False  # whether the test's command was asked to end the test too


class Options(NamedTuple):
    """What the panel was started with: the plan with its options, and the words of the commands that use it."""

    load: Callable[[], Plan]
    file: str
    plan: Sequence[str]  # the plan and the options that change it
    run: Sequence[str]  # further options of `rths run`
    doctor: Sequence[str]  # options of `rths doctor`


class PanelExecutor:
    """The panel's executor; `snapshot` and `present` may be read from any thread."""

    def __init__(self, options: Options) -> None:
        self._options = options
        self._queue: Queue[Job] = Queue()
        self._waiting: list[Job] = []  # for a link
        self._given: dict[int, Job] = {}  # by press
        self._test: RunningTest | None = None
        self._command: RunCommand | None = None
        self._armed: Plan | None = None  # the plan with which the command was started
        self._digest = ""  # of that plan
        self._arming: Job | None = None
        self._checks: dict[str, tuple[Check, Job]] = {}
        self._checked = {CHECK: CheckResult(), MACHINE: CheckResult()}
        self._last: tuple[tuple[str, str], ...] = ()
        self._ending = ""
        self._shown: Shown | None = None
        self._sought = 0.0
        self._closing = threading.Event()
        self._unsettled: list[Future[OrderOutcome]] = []
        self._ended = False
        self._handing = (
            threading.Lock()
        )  # over both of these: an order is settled at the end, or finds it ended
        self._opener = ThreadPoolExecutor(1)
        self._thread = threading.Thread(target=self._run, name="executor")
        self._thread.start()

    # -- what others see --------------------------------------------------------------------------

    @property
    def snapshot(self) -> Snapshot:
        """Everything at this moment."""
        checked = self._checked
        return Snapshot(
            self._options.file, self._shown, checked[CHECK], checked[MACHINE], self._last, self._ending
        )

    @property
    def present(self) -> Present:
        """The test that runs, and the digests of its plan and of the plan that was checked."""
        shown, armable = self._shown, str(self._checked[CHECK].found.get("digest", ""))
        return Present(shown.test, shown.digest, armable) if shown else Present(armable=armable)

    def carry_out(self, word: str, digest: str, reason: str) -> Future[OrderOutcome]:
        """Begin with an order at the next turn."""
        settled: Future[OrderOutcome] = Future()
        with self._handing:
            if self._ended:
                settled.set_result(OVER)
                return settled
            self._unsettled = [one for one in self._unsettled if not one.done()] + [settled]
        self._queue.put(Job(word, digest, reason, settled, time.monotonic() + PATIENCE_S))
        return settled

    def close(self) -> str:
        """End the thread; a sentence on a test that goes on, empty where there is none."""
        self._closing.set()
        self._thread.join()
        self._opener.shutdown()
        if self._command is None or self._command.over:
            return ""
        if not self._command.moved:
            self._command.interrupt()
            return "The armed test was not started, and is asked to end."
        return "The test goes on as planned: `rths stop` ends it, and `rths panel` finds it again."

    # -- the thread -------------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            while not self._closing.is_set():
                self._turn()
        finally:
            self._let_go()

    def _let_go(self) -> None:
        """Leave no order without an outcome, no check and no link behind."""
        with self._handing:
            self._ended = True
        for settled in self._unsettled:
            if not settled.done():
                settled.set_result(OVER)
        for check, _ in self._checks.values():
            check.end()
        if self._test is not None:
            self._test.close()

    def _turn(self) -> None:
        with contextlib.suppress(Empty):
            self._begin(self._queue.get(block=not self._given, timeout=IDLE_S))
            while True:
                self._begin(self._queue.get_nowait())
        self._follow_command()
        self._follow_checks()
        if time.monotonic() - self._sought >= LOOK_S:
            self._sought = time.monotonic()
            self._seek()
        self._exchange()
        self._shown = self._present_test()

    @property
    def _linked(self) -> bool:
        return self._test is not None and self._test.linked

    def _begin(self, job: Job) -> None:
        match job.word:
            case _ if job.word in (CHECK, MACHINE):
                self._check(job)
            case _ if job.word == ARM:
                self._arm(job)
            case _ if job.word in STOPS and not self._linked and self._command is not None:
                self._command.interrupt()
                if self._test is not None and self._test.orders is not None:
                    self._waiting.append(job._replace(interrupted=True))  # the link may come back in time
                else:
                    job.settled.set_result(OrderOutcome(DONE, INTERRUPTED))
            case _:
                self._waiting.append(job)

    # -- checks -----------------------------------------------------------------------------------

    def _check(self, job: Job) -> None:
        if self._command is not None or self._test is not None:
            job.settled.set_result(OrderOutcome(REFUSED, BUSY))
            return
        if self._checks:
            job.settled.set_result(OrderOutcome(REFUSED, "A check is under way already."))
            return
        words = {CHECK: ["check", *self._options.plan], MACHINE: ["doctor", *self._options.doctor]}
        check = Check(words[job.word])
        self._checks[job.word] = check, job
        self._checked = {**self._checked, job.word: check.busy}

    def _follow_checks(self) -> None:
        for word, (check, job) in list(self._checks.items()):
            if (found := check.found) is None:
                continue
            del self._checks[word]
            self._checked = {**self._checked, word: found}
            if found.complaint:
                job.settled.set_result(OrderOutcome(REFUSED, found.complaint))
            else:
                job.settled.set_result(OrderOutcome(DONE, "See what was found."))

    # -- the test's command -----------------------------------------------------------------------

    def _arm(self, job: Job) -> None:
        complaint = self._not_to_arm(job)
        if complaint:
            job.settled.set_result(OrderOutcome(REFUSED, complaint))
            return
        self._arming = job
        self._last, self._ending = (), ""
        self._command = RunCommand([*self._options.plan, *self._options.run])

    def _not_to_arm(self, job: Job) -> str:
        """Why no test is armed, empty where one is."""
        if self._command is not None or self._test is not None:
            return "A test runs already."
        if self._checks:
            return "A check is under way."
        try:
            self._armed = self._options.load()
        except RthsError as error:
            return str(error)
        self._digest = self._armed.digest()
        if self._digest != job.digest:
            return "The plan has changed since it was checked: check it again."
        return ""

    def _follow_command(self) -> None:
        command, arming = self._command, self._arming
        if command is None:
            return
        if arming is not None and command.ready:
            self._arming = None
            arming.settled.set_result(
                OrderOutcome(DONE, "All laboratories are armed; nothing moves before Start.")
            )
        if command.over:
            reports = command.reports
            self._last = reports.causes
            self._ending = " ".join(reports.lines[-1:]) if command.code else ""
            self._command = None
            if arming is not None and self._arming is not None:
                self._arming = None
                arming.settled.set_result(
                    OrderOutcome(REFUSED, " ".join(reports.lines[-1:]) or "The test ended.")
                )

    # -- the laboratories -------------------------------------------------------------------------

    def _seek(self) -> None:
        """Find the test of this machine: the panel's own, or else the newest."""
        found = running.by_process()
        own = self._command.process if self._command else 0
        process = own if own in found else next(reversed(found), 0) if not own else 0
        entry = found.get(process)
        if self._test is not None and (entry is None or named(entry.test, process) != self._test.name):
            self._leave_test(self._test)
        if entry is not None and self._test is None:
            with contextlib.suppress(RthsError):  # its plan needs what is not there any more
                self._test = RunningTest(process, entry, self._opener)
                self._same_plan(self._test)
                if process != own:
                    self._last, self._ending = (), ""

    def _leave_test(self, test: RunningTest) -> None:
        """Let a test that has ended go; what was answered until then is told."""
        if test.orders is not None:
            self._look(test.orders, 0.0)
            for given in test.orders.unsettled:
                self._given.pop(given.wish.press).settled.set_result(unanswered(given))
        test.close()
        self._test = None

    def _same_plan(self, test: RunningTest) -> None:
        """End a test of the panel's own whose plan is not the one that was checked and shown."""
        if self._command is None or self._armed is None or test.digest == self._digest:
            return
        self._command.interrupt()
        if self._arming is not None:
            text = "The plan has changed since it was checked: the test is ended before anything moves."
            self._arming.settled.set_result(OrderOutcome(REFUSED, text))
            self._arming = None

    def _exchange(self) -> None:
        """Send orders and take the answers to them."""
        if self._test is not None:
            self._test.follow()
        orders = self._test.orders if self._test else None
        for job in list(self._waiting):
            if orders is not None:
                self._waiting.remove(job)
                self._given[orders.give(job.word, job.reason)] = job
            elif time.monotonic() >= job.until:
                self._waiting.remove(job)
                job.settled.set_result(OrderOutcome(UNHEARD, "There is no link to the laboratories."))
        if orders is not None:
            self._look(orders, TURN_S if self._given else 0.0)

    def _look(self, orders: Outstanding, timeout: float) -> None:
        """Settle the orders whose answers have come, or have not come in time."""
        for given in orders.look(timeout):
            job = self._given.pop(given.wish.press)
            found = outcome(given)
            if job.interrupted and found.state == UNHEARD:
                found = OrderOutcome(UNHEARD, f"{found.text} {INTERRUPTED}")
            job.settled.set_result(found)

    def _present_test(self) -> Shown | None:
        """The test that the pages show."""
        command, test = self._command, self._test
        if test is not None:
            entry = test.entry
            own = command is not None and named(entry.test, command.process) == test.name
            return Shown(
                test=test.name,
                name=entry.test,
                plan=test.plan,
                digest=test.digest,
                recording=Path(entry.recording) if entry.recording else None,
                own=own,
                linked=test.linked,
                unlinked_at=test.unlinked_at,
                reports=command.reports if own and command is not None else RunReports(),
                since_ns=round(entry.since * 1e9),
            )
        if command is None or self._armed is None:
            return None
        name = self._armed.test.name
        return Shown(
            named(name, command.process), name, self._armed, self._digest, None, True, False, command.reports
        )


def outcome(given: Given) -> OrderOutcome:
    """What became of an order to the laboratories."""
    if given.silent:
        complaint = f"No answer came from the {silent(given)} within {PATIENCE_S:g} s."
        return OrderOutcome(UNHEARD, " ".join([complaint, *answers(given)]))
    accepted = all(one.accepted for one in given.answers.values())
    return OrderOutcome(DONE if accepted else REFUSED, " ".join(answers(given)))


def unanswered(given: Given) -> OrderOutcome:
    """What is known of an order to a test that ended before all laboratories had answered."""
    complaint = f"The test ended before an answer came from the {silent(given)}."
    return OrderOutcome(UNHEARD, " ".join([complaint, *answers(given)]))


def silent(given: Given) -> str:
    """The laboratories that have not answered, in words."""
    return " and the ".join(map(title, given.silent))


def answers(given: Given) -> list[str]:
    """The answers that have come, a sentence each."""
    return [
        f"{title(role)}: {'' if one.accepted else 'refused: '}{one.text}"
        for role in given.due
        if (one := given.answers.get(role)) is not None
    ]
