"""A page as PDF, printed by a browser of this machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from common.errors import InputError

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
# No network is asked for anything; a container has little shared memory.
OPTIONS = (
    "--headless",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--no-pdf-header-footer",
)
LIMIT_S = 120.0  # for a browser to start and to print; a long page takes some seconds on a loaded machine


def browser() -> str:
    """The browser that prints; raises InputError where there is none."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        raise InputError(
            "A PDF is printed by Chromium or Chrome, and there is none on this machine: install one, or print the page "
            "from another browser."
        )
    return found


def write(page: str, output: Path) -> None:
    """Print a page's text into a file; raises InputError where the browser does not."""
    program = browser()
    sandbox = ("--no-sandbox",) if os.geteuid() == 0 else ()  # which no browser has for the superuser
    with tempfile.TemporaryDirectory() as folder:
        source, printed = Path(folder, "page.html"), Path(folder, "page.pdf")
        source.write_text(page, encoding="utf-8")
        command = [
            program,
            *OPTIONS,
            *sandbox,
            f"--user-data-dir={folder}/profile",
            f"--print-to-pdf={printed}",
            source.as_uri(),
        ]
        try:
            done = subprocess.run(command, capture_output=True, timeout=LIMIT_S, check=False)
        except subprocess.TimeoutExpired:
            raise InputError(
                f"{program} has not printed {output} within {LIMIT_S:g} s: try again, or print the page by hand."
            ) from None
        if not printed.is_file():
            errors = done.stderr.decode(errors="replace").strip().splitlines()
            raise InputError(
                f"{program} could not print {output}: {errors[-1] if errors else 'it does not say why'}."
            )
        shutil.copyfile(printed, output)
