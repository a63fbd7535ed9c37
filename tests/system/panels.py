"""Operator's panels as processes, and what the tests of their pages share."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.browser import Page
from tests.processes import HANG_S, environment

LINKED = "document.getElementById('test').textContent.includes(', linked')"
ENABLED = "document.querySelector('button[data-word=%s]').getAttribute('aria-disabled') === 'false'"
ORDERS = "[...document.querySelectorAll('#orders li')].map((one) => one.textContent.replace(/^[0-9:]+ /, ''))"


class Panels:
    """Starts panels, and ends those that run."""

    def __init__(self, folder: Path, into: Sequence[str] = ()) -> None:
        self.folder = folder
        self._into = into  # the words with which a command gets to where they run
        self.running: list[subprocess.Popen[str]] = []

    def start(self, *options: str) -> str:
        """The address of a new panel."""
        words = [*self._into, sys.executable, "-m", "rths", "panel", "--no-browser", *options]
        process = subprocess.Popen(
            words, cwd=self.folder, stdout=subprocess.PIPE, text=True, env=environment()
        )
        self.running.append(process)
        assert process.stdout is not None
        return process.stdout.readline().split()[-1]

    def end(self) -> None:
        """End all of them."""
        for process in self.running:
            process.terminate()
            assert process.wait(HANG_S) == 0
            assert process.stdout is not None
            process.stdout.close()
        self.running = []


def press(page: Page, word: str) -> None:
    """Press a button with the mouse."""
    page._page.click(f"button[data-word={word}]")


def orders_that(page: Page, begin: str) -> list[str]:
    """The orders on a page that begin with these words."""
    return [one for one in page.evaluate(ORDERS) if one.startswith(begin)]
