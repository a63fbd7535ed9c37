"""The requests of the panel's pages: which are answered, and how."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import Any

from tornado.httputil import HTTPServerRequest
from tornado.routing import Matcher, Rule, RuleRouter
from tornado.web import Application, RequestHandler

from report.panel.desk import Desk, PageOrder
from report.panel.guard import Guard

ANSWER_S = (
    4.0  # s, for which an order's request waits for the outcome: longer than the laboratories' answers take
)


def guarded(guard: Guard, inner: Application) -> RuleRouter:
    """A server that passes on what may be answered, and refuses everything else."""
    gate = Application([(".*", Refusal, {"guard": guard})])
    return RuleRouter([Rule(Admitted(guard), inner), Rule(Everything(), gate)])


class Everything(Matcher):
    """Matches every request."""

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        """Nothing more to tell."""
        return {}


class Admitted(Matcher):
    """Matches requests of the panel's own pages, whose cookie holds the token where there is one."""

    def __init__(self, guard: Guard) -> None:
        self._guard = guard

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        """An empty mapping for a request that is answered, else None."""
        cookie = request.cookies.get(self._guard.cookie)
        if self._guard.stranger(request.headers) or not self._guard.admits(cookie.value if cookie else ""):
            return None
        return {}


class Refusal(RequestHandler):
    """Refuses, or takes the token with which an operator opens the page for the first time."""

    def initialize(self, guard: Guard) -> None:
        """Keep the guard."""
        self._guard = guard

    def prepare(self) -> None:
        """Answer every method in the same way."""
        complaint = self._guard.stranger(self.request.headers)
        given = self.get_query_argument("token", "")
        if not complaint and given and self._guard.admits(given):
            self.set_cookie(self._guard.cookie, given, httponly=True, samesite="Strict")
            self.redirect("/")
            return
        self.set_status(403)
        self.finish(complaint or "Give the token: the address that `rths panel` has printed holds it.")


class StateHandler(RequestHandler):
    """What a page shows, for one look."""

    def initialize(self, state: Callable[[str], dict[str, Any]]) -> None:
        """Keep what gives the state for a session."""
        self._state = state

    def get(self) -> None:
        """The state as JSON."""
        self.set_header("Cache-Control", "no-store")
        self.write(self._state(self.get_query_argument("session", "")))


class OrderHandler(RequestHandler):
    """Takes an order, and answers with what became of it."""

    def initialize(self, guard: Guard, desk: Desk) -> None:
        """Keep the guard and the desk."""
        self._guard, self._desk = guard, desk

    async def post(self) -> None:
        """The outcome as JSON: `sent` where it takes longer than `ANSWER_S`."""
        request = understood(self.request.body)
        complaint = self._guard.disorderly(self.request.headers)
        if complaint or request is None:
            self.set_status(403 if complaint else 400)
            self.finish(complaint or "This is no order.")
            return
        entry = self._desk.take(request)
        await asyncio.wait([asyncio.wrap_future(entry.settled)], timeout=ANSWER_S)
        self.set_header("Cache-Control", "no-store")
        self.write(entry.outcome._asdict())


def understood(body: bytes) -> PageOrder | None:
    """The order in a request, None where there is none: every field must be there with its own type, and no other."""
    try:
        found = json.loads(body)
    except (ValueError, RecursionError):
        return None
    kinds = {name: type(value) for name, value in PageOrder._field_defaults.items()} | {
        "session": str,
        "number": int,
        "word": str,
    }
    if not isinstance(found, dict) or {name: type(value) for name, value in found.items()} != kinds:
        return None
    return PageOrder(**found)
