"""The server of a live view or an operator's panel, with everything the page needs in the package.

A live view is served on this machine's loopback alone, a panel under the name that it is given.
"""

from __future__ import annotations

import errno
import logging
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.util import bind_sockets
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop, PeriodicCallback

from common.errors import InputError
from report.live.feed import Feed
from report.live.page import Page
from report.panel.guard import LOOPBACK, Guard
from report.panel.handlers import guarded

if TYPE_CHECKING:
    from report.panel.panel import Panel

MOST_BODY = 1 << 16  # bytes of a request: an order has some hundred
LINGER_S = 1.5  # s after the end of a test, for the pages to receive it: fifteen updates


class Server:
    """Serves a feed's page at `url`; `rate` (Hz) is how often the feed is read and the pages brought up to date.

    With a `panel`, made for the port that was found, its feed is shown, and its guard decides who is answered.
    """

    def __init__(
        self,
        feed: Feed | None,
        port: int,
        rate: float,
        *,
        host: str = LOOPBACK,
        panel: Callable[[int], Panel] | None = None,
    ) -> None:
        logging.getLogger("bokeh").setLevel(
            logging.ERROR
        )  # bokeh would warn of every reader who closes the page
        logging.getLogger("tornado.access").setLevel(logging.ERROR)  # and tornado of every request refused
        self._period = 1e3 / rate
        try:
            sockets, self._port = bind_sockets(host, port)
        except OSError as error:
            reason = "it is in use" if error.errno == errno.EADDRINUSE else error.strerror
            where, other = ("", "port") if host == LOOPBACK else (f" under {host}", "--host or --port")
            raise InputError(
                f"Cannot serve the {'panel' if panel else 'live view'}{where} on port {port}: {reason}; "
                f"give another {other}."
            ) from None
        self._panel = panel(self._port) if panel else None
        self._guard = self._panel.guard if self._panel else Guard(host, self._port)
        self._still = feed
        pages = {"/": Application(FunctionHandler(self._page))}
        patterns = self._panel.patterns if self._panel else []
        self._loop = IOLoop.current()
        # no other site's page may read along
        self._bokeh = BokehTornado(
            pages, extra_websocket_origins=sorted(self._guard.hosts), extra_patterns=patterns
        )
        self._http = HTTPServer(guarded(self._guard, self._bokeh), max_body_size=MOST_BODY)
        self._http.add_sockets(sockets)
        self._server = BaseServer(self._loop, self._bokeh, self._http)

    @property
    def url(self) -> str:
        """The address of the page."""
        return self._guard.url

    @property
    def _feed(self) -> Feed:
        """What the pages show at present."""
        feed = self._panel.feed if self._panel else self._still
        assert feed is not None  # noqa: S101 - without a panel a feed is given
        return feed

    def _page(self, document: Document) -> None:
        page = Page(document, self._feed, self._panel)
        document.add_periodic_callback(page.update, round(self._period))

    def run(self, stopping: Callable[[], str], *, leave: bool) -> None:
        """Serve until `stopping` gives a reason, or, where it shall `leave`, until a moment after the test's end."""
        self._server.start()
        until = [float("inf")]
        look = PeriodicCallback(partial(self._look, stopping, until, leave=leave), self._period)
        look.start()
        try:
            self._loop.start()
        finally:
            look.stop()
            self._server.stop()
            self._http.stop()
            self._loop.close()

    def _look(self, stopping: Callable[[], str], until: list[float], *, leave: bool) -> None:
        (self._panel or self._feed).look()
        now = time.monotonic()
        if leave and self._feed.ended:
            until[0] = min(until[0], now + LINGER_S)
        if stopping() or now >= until[0]:
            self._loop.stop()
