"""The panel beside the live page: it follows the recording of the test that runs, and takes the pages' orders."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from markupsafe import Markup

from common.host.clock import Clock
from common.recording.reader import Tail
from report.live.feed import Feed
from report.page import block_of
from report.panel.desk import Desk, OrderExecutor
from report.panel.guard import Guard
from report.panel.handlers import OrderHandler, StateHandler
from report.panel.snapshot import Snapshot
from report.panel.view import PanelView
from report.panel.words import WORDS

NO_TEST = Path("no test")  # stands for the recording while there is none


class Panel:
    """The state of one panel; `watched` returns what its executor sees at the moment."""

    def __init__(
        self,
        executor: OrderExecutor,
        watched: Callable[[], Snapshot],
        guard: Guard,
        window: float,
        clock: Clock,
    ) -> None:
        self.guard = guard
        self.desk = Desk(executor, clock)
        self.watched = watched
        self.view = PanelView(self.desk, clock)
        self._window, self._clock = window, clock
        self._tail = Tail(NO_TEST)
        self.feed = Feed(self._tail, window, clock)
        self._test = ""

    def look(self) -> None:
        """Follow the recording of the test that runs, from its begin on."""
        shown = self.watched().shown
        if shown is not None and shown.recording is not None and shown.test != self._test:
            self._test = shown.test
            self.close()
            self._tail = Tail(shown.recording)
            self.feed = Feed(self._tail, self._window, self._clock, since_ns=shown.since_ns)
        self.feed.look()

    def state(self, session: str) -> dict[str, Any]:
        """Everything that a page shows."""
        return self.view.state(self.watched(), self.feed, session)

    def html(self) -> Markup:
        """The operator's part of a new page, under a session of its own."""
        return block_of("panel.html", "panel", self.desk.enter(), [*WORDS.values()], self.watched().file)

    def close(self) -> None:
        """Close the recording."""
        self._tail.__exit__(None, None, None)

    @property
    def patterns(self) -> list[Any]:
        """The addresses that the server answers beside the page's own."""
        return [
            ("/state", StateHandler, {"state": self.state}),
            ("/order", OrderHandler, {"guard": self.guard, "desk": self.desk}),
        ]
