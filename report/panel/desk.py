"""The desk: it takes the orders of all open pages, each once, and keeps what became of them.

A page has a session, a name that nobody can guess, and numbers its orders from 1 on. An order that repeats a number
gets what the first one got, whatever else it says. An order that brings a rig nearer to motion must be a fresh wish:
the highest number of its session, made on a state that is not older than `FRESH_S`, for the test and the plan that the
page showed. A stop is carried out in whatever order it comes; it is refused only where it is old and for another test.
"""

from __future__ import annotations

import secrets
from collections import OrderedDict, deque
from concurrent.futures import Future
from typing import NamedTuple, Protocol

from common.host.clock import Clock
from report.panel.words import WORDS, Word

FRESH_S = 3.0  # s: an operator's glance, and three times the longest pause of a page that is well
PAGES = 200  # sessions that are kept: pages that are open, or were lately
KEPT = 2000  # orders of one session whose outcome is kept; a lower number is refused
SHOWN = 12  # orders in the list on the page
NUMBER = 2**53  # above every number of a page, which counts in floats

SENT, DONE, REFUSED, UNHEARD = "sent", "done", "refused", "not heard"


class OrderOutcome(NamedTuple):
    """What became of an order: `sent` while it is under way, then `done`, `refused` or `not heard`."""

    state: str
    text: str


class PageOrder(NamedTuple):
    """An order of a page; `test` and the plan's `digest` are what it showed, `seen` (ms, server's clock) says when."""

    session: str
    number: int
    word: str
    test: str = ""
    digest: str = ""
    seen: int = 0
    reason: str = ""


class Present(NamedTuple):
    """The test that runs, by a name of its own, and the digests of its plan and of the plan that could be armed."""

    test: str = ""
    digest: str = ""
    armable: str = ""


class OrderExecutor(Protocol):
    """Carries orders out."""

    @property
    def present(self) -> Present:
        """What is there at this moment."""

    def carry_out(self, word: str, digest: str, reason: str) -> Future[OrderOutcome]:
        """Begin with an order; the outcome comes later, from another thread."""


class TakenOrder:
    """An order that was taken, and what became of it."""

    def __init__(self, request: PageOrder, page: int, at: int, settled: Future[OrderOutcome]) -> None:
        self.request = request
        self.page = page  # number of the page that gave it, for readers
        self.at = at  # ns
        self.settled = settled

    @property
    def outcome(self) -> OrderOutcome:
        """What is known of it at this moment."""
        if not self.settled.done():
            return OrderOutcome(SENT, "")
        return self.settled.result()


class Session:
    """The orders of one page, by their numbers."""

    def __init__(self, page: int) -> None:
        self.page = page
        self.entries: OrderedDict[int, TakenOrder] = OrderedDict()
        self.highest = 0
        self.forgotten = 0  # the highest number whose outcome is not kept any more

    def keep(self, entry: TakenOrder) -> TakenOrder:
        """Keep an order and let the oldest go."""
        number = entry.request.number
        self.entries[number] = entry
        self.highest = max(self.highest, number)
        while len(self.entries) > KEPT:
            self.forgotten = max(self.forgotten, self.entries.popitem(last=False)[0])
        return entry


class Desk:
    """Takes the orders of all pages; `clock` is that of the server."""

    def __init__(self, executor: OrderExecutor, clock: Clock) -> None:
        self._executor = executor
        self._clock = clock
        self._sessions: OrderedDict[str, Session] = OrderedDict()
        self._pages = 0
        self.newest: deque[TakenOrder] = deque(maxlen=SHOWN)

    def enter(self) -> str:
        """The session of a new page."""
        name = secrets.token_urlsafe(24)
        self._pages += 1
        self._sessions[name] = Session(self._pages)
        while len(self._sessions) > PAGES:
            self._sessions.popitem(last=False)
        return name

    def page(self, session: str) -> int:
        """The number of a session's page, 0 where there is no such session; one that asks is kept."""
        if session not in self._sessions:
            return 0
        self._sessions.move_to_end(session)
        return self._sessions[session].page

    def take(self, request: PageOrder) -> TakenOrder:
        """Carry an order out, refuse it, or find what became of the same number before."""
        session = self._sessions.get(request.session)
        if session is None:
            return refused(
                request, 0, self._clock.now(), "This page belongs to a panel that has ended: load it anew."
            )
        if request.number in session.entries:
            return session.entries[request.number]
        if complaint := self._complaint(request, session):
            entry = refused(request, session.page, self._clock.now(), complaint)
        else:
            carried = self._executor.carry_out(request.word, request.digest, request.reason)
            entry = TakenOrder(request, session.page, self._clock.now(), carried)
        if session.forgotten < request.number < NUMBER:
            session.keep(entry)
        self.newest.appendleft(entry)
        return entry

    def _complaint(self, request: PageOrder, session: Session) -> str:
        """Why an order is not carried out, empty where it is."""
        word, present = WORDS.get(request.word), self._executor.present
        if word is None or not session.forgotten < request.number < NUMBER:
            return "This is no order of this page."
        if word.of_test and not present.test:
            return "No test runs on this machine."
        age = (self._clock.now() // 1_000_000 - request.seen) * 1e-3
        stale = (
            ""
            if 0.0 <= age <= FRESH_S
            else f"The page showed a state that is {age:.0f} s old: look and press again."
        )
        other = "" if request.test == present.test else "The page showed another test: look and press again."
        if not word.moves:
            return stale and other if word.of_test else ""
        if request.number < session.highest:
            return "It came after a later order of the same page: press again."
        return stale or other or unplanned(request, word, present)


def refused(request: PageOrder, page: int, now: int, text: str) -> TakenOrder:
    """An order that is not carried out."""
    settled: Future[OrderOutcome] = Future()
    settled.set_result(OrderOutcome(REFUSED, text))
    return TakenOrder(request, page, now, settled)


def unplanned(request: PageOrder, word: Word, present: Present) -> str:
    """Why an order is not for the plan that the page showed, empty where it is or where it is for no plan."""
    digest = present.digest if word.of_test else present.armable
    if word.planned and (not digest or request.digest != digest):
        return "The plan is not the one that the page showed: check it and press again."
    return ""
