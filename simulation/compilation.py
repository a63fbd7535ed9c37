"""One sentence for the user where kernels are compiled, which takes minutes once for a checkout.

Numba announces each compilation that its files on disk do not save. Only these count, so that a command whose kernels
are on disk says nothing and pays nothing.
"""

from __future__ import annotations

import contextlib
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator

from numba.core import event

from common.terminal.printable import behind
from models import cache

KIND = "numba:compile"
UNSAID = 2.0  # s of compiling before the sentence: a few small kernels that are missing need no explanation
SENTENCE = (
    "compiling kernels, once for this checkout: it takes a minute or more; later commands find them compiled"
)


class CompilationNotice(event.Listener):
    """Says the sentence once in a process, when compiling has taken `UNSAID` s.

    It says nothing where all kernels of this checkout have been compiled: what is compiled then is a class of the
    user's, in seconds, and every time.
    """

    def __init__(self) -> None:
        self.say: Callable[[str], None] = said
        self._told = False
        self._depth = 0  # a kernel is compiled within the one that calls it
        self._began = 0.0
        self._spent = 0.0
        self._timer: threading.Timer | None = None

    def on_start(self, _event: object) -> None:
        """Wait until compiling has taken long enough; a thread does, since one kernel may take most of it."""
        self._depth += 1
        if self._depth > 1 or self._told or cache.warm():
            return
        self._began = time.monotonic()
        self._timer = threading.Timer(max(UNSAID - self._spent, 0.0), self.tell)
        self._timer.daemon = True
        self._timer.start()

    def on_end(self, _event: object) -> None:
        """Count the time that a kernel took."""
        self._depth -= 1
        if self._depth == 0 and self._timer is not None:
            self._timer.cancel()
            self._timer = None
            self._spent += time.monotonic() - self._began

    def tell(self) -> None:
        """Say the sentence, unless it was said."""
        if not self._told:
            self._told = True
            self.say(SENTENCE)


def said(text: str) -> None:
    """Write a line on standard error, over a line of progress where it is a terminal."""
    stream = behind(sys.stderr)
    line = f"\r{text.ljust(shutil.get_terminal_size().columns - 1)}" if stream.isatty() else text
    with contextlib.suppress(OSError, ValueError):  # the work goes on although nobody reads it
        stream.write(line + "\n")
        stream.flush()


NOTICE = CompilationNotice()


@contextlib.contextmanager
def noticed() -> Iterator[None]:
    """Within the context, the notice hears of compilations; `NOTICE.say` may be set, until its end."""
    try:
        with event.install_listener(KIND, NOTICE):
            yield
    finally:
        NOTICE.say = said
