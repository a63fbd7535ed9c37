"""A test that runs on this machine, and the operator's link to it."""

from __future__ import annotations

import contextlib
import time
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from common.errors import RthsError
from common.host.running import Running
from common.plan.read import parse
from rths.perform.operate import OperatorLink, Outstanding, operator_link


class RunningTest:
    """A test on this machine, and the operator's link to it once that is open.

    zenoh keeps the open link: it dials the master again after an interruption, so that the same link carries orders
    then. `linked` says whether it does at present.
    """

    def __init__(self, process: int, entry: Running, opener: ThreadPoolExecutor) -> None:
        self.entry = entry
        self.plan = parse(entry.plan, Path(entry.folder))
        self.digest = self.plan.digest()
        self.name = named(entry.test, process)
        self.orders: Outstanding | None = None
        self.linked = False  # whether the master is connected to the link
        self.unlinked_at = 0  # when it ceased to be connected, own clock, ns; 0 where it did not
        self._link: OperatorLink | None = None
        self._opener = opener
        self._opening: Future[OperatorLink] | None = None

    def follow(self) -> None:
        """Open the link, attempt after attempt, and then see whether the master is connected."""
        if self._link is not None:
            linked = self._link.connected()
            if linked != self.linked:
                self.linked, self.unlinked_at = linked, 0 if linked else time.monotonic_ns()
        elif self._opening is None:
            self._opening = self._opener.submit(operator_link, self.plan, self.entry.endpoint)
        elif self._opening.done():
            opening, self._opening = self._opening, None
            with contextlib.suppress(RthsError):  # the master does not listen yet
                self._link = opening.result()
                self.orders = Outstanding(self._link.endpoint, self.plan)
                self.linked = True

    def close(self) -> None:
        """Close the link."""
        if self._opening is not None:
            self._opening.add_done_callback(closed)
        if self._link is not None:
            self._link.endpoint.close()


def closed(opening: Future[OperatorLink]) -> None:
    """Close a link that was opened too late to be used."""
    if opening.exception() is None:
        opening.result().endpoint.close()


def named(test: str, process: int) -> str:
    """The name of a test that no other on this machine has had lately."""
    return f"{test}-{process}"
