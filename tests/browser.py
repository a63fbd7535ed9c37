"""Opens a page in headless Chromium: its console errors, its picture, and the values of JavaScript expressions."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome")
# a container's root needs the first two; the last makes pictures the same on every machine
OPTIONS = ("--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--font-render-hinting=none")
LIMIT_S = 60.0  # for a browser to start, a page to load, a picture to be made


def chromium() -> str | None:
    """The path of this machine's browser, None where there is none."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


class Page:
    """An open page; `errors` holds the errors of its console and scripts, `requests` the addresses it requested."""

    def __init__(self, page: Any) -> None:
        self._page = page
        self.errors: list[str] = []
        self.requests: list[str] = []
        page.on("console", self._console)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("requestfailed", lambda request: self.errors.append(f"{request.url}: {request.failure}"))
        page.on("request", lambda request: self.requests.append(request.url))

    def _console(self, message: Any) -> None:
        if message.type in ("error", "warning"):
            self.errors.append(f"{message.type}: {message.text}")

    def evaluate(self, script: str) -> Any:
        """The value of a JavaScript expression, or what a function `() => …` returns."""
        return self._page.evaluate(script)

    def wait(self, script: str, seconds: float = 20.0) -> None:
        """Return when a JavaScript expression is true; raises TimeoutError of the library where it never is."""
        self._page.wait_for_function(script, timeout=seconds * 1e3)

    def screenshot(self, path: Path, *, whole: bool = True) -> Path:
        """The page as PNG, the whole of it or what a screen of its size shows."""
        self._page.screenshot(path=path, full_page=whole)
        return path

    def pdf(self, path: Path) -> Path:
        """The page as it prints on A4."""
        self._page.pdf(path=path, format="A4", print_background=True)
        return path


@contextlib.contextmanager
def open_page(url: str, width: int = 1280, height: int = 900, program: Path | None = None) -> Iterator[Page]:
    """A page (http or file) in a window of `width` by `height` CSS pixels, until the end of the block.

    `program` is started in place of the browser: it may start that elsewhere.
    """
    with sync_playwright() as library:
        browser = library.chromium.launch(
            executable_path=program or chromium(), args=list(OPTIONS), timeout=LIMIT_S * 1e3
        )
        try:
            page = Page(browser.new_page(viewport={"width": width, "height": height}))
            page._page.set_default_timeout(LIMIT_S * 1e3)
            page._page.goto(url, wait_until="load")
            yield page
        finally:
            browser.close()
