"""The server of a live view: on this machine's loopback alone, with everything the page needs in the package."""

from __future__ import annotations

import errno
import logging
import os
import time
from collections.abc import Callable
from functools import partial

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

HOST = "127.0.0.1"
LINGER_S = 1.5  # s after the end of a test, for the pages to receive it: fifteen updates


class Server:
    """Serves a feed's page at `url`; `rate` (Hz) is how often the feed is read and the pages brought up to date."""

    def __init__(self, feed: Feed, port: int, rate: float) -> None:
        self._feed = feed
        logging.getLogger("bokeh").setLevel(
            logging.ERROR
        )  # bokeh would warn of every reader who closes the page
        self._period = 1e3 / rate
        try:
            sockets, self._port = bind_sockets(HOST, port)
        except OSError as error:
            reason = "it is in use" if error.errno == errno.EADDRINUSE else os.strerror(error.errno or 0)
            raise InputError(
                f"Cannot serve the live view on port {port}: {reason}; give another port."
            ) from None
        origins = [f"{HOST}:{self._port}", f"localhost:{self._port}"]  # no other site's page may read along
        pages = {"/": Application(FunctionHandler(self._page))}
        self._loop = IOLoop.current()
        self._bokeh = BokehTornado(pages, extra_websocket_origins=origins)
        self._http = HTTPServer(self._bokeh)
        self._http.add_sockets(sockets)
        self._server = BaseServer(self._loop, self._bokeh, self._http)

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"http://{HOST}:{self._port}/"

    def _page(self, document: Document) -> None:
        page = Page(document, self._feed)
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
        self._feed.look()
        now = time.monotonic()
        if leave and self._feed.ended:
            until[0] = min(until[0], now + LINGER_S)
        if stopping() or now >= until[0]:
            self._loop.stop()
