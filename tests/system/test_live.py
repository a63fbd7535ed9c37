"""The live view in a real browser: every plot is drawn, without errors and without requests to other hosts."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.browser import Page, chromium, open_page
from tests.helpers import ROOT

pytestmark = pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine (Debian: chromium)")

PLOTS = 5  # of the motion; those of the round trip are hidden in virtual time
WIDE, NARROW = 1280, 390  # of a screen, CSS pixels
SECONDS = 4.0  # in which the recording grows
# colours that a plot's canvas holds, as many as make a drawing: the canvases are in shadow trees
DRAWN = """() => {
  const found = [];
  const walk = (node) => {
    if (node.shadowRoot) walk(node.shadowRoot);
    if (node.tagName === "CANVAS" && node.width > 50) {
      const data = node.getContext("2d").getImageData(0, 0, node.width, node.height).data;
      const colours = new Set();
      for (let i = 0; i < data.length; i += 4)
        if (data[i + 3] > 200) colours.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
      found.push([...colours]);
    }
    for (const child of node.children || []) walk(child);
  };
  walk(document.body);
  return found;
}"""
TEXT = """() => {
  let text = "";
  const walk = (node) => {
    if (node.shadowRoot) walk(node.shadowRoot);
    if (node.tagName === "DIV" && node.className.includes("bk-clearfix")) text += node.textContent + "\\n";
    for (const child of node.children || []) walk(child);
  };
  walk(document.body);
  return text;
}"""
CURVES = {0x0072B2, 0x009E73, 0xCC79A7}  # one of them in each plot


@pytest.fixture
def served(
    tmp_path: Path, virtual_recording: Path
) -> Iterator[tuple[str, threading.Thread, threading.Event]]:
    """A view of a recording that does not exist yet, what makes it grow, and an event for which it waits halfway."""
    path, content = tmp_path / "growing.mcap", virtual_recording.read_bytes()
    shown = threading.Event()

    def grow() -> None:
        steps = round(SECONDS / 0.05)
        with path.open("wb", buffering=0) as stream:
            for step in range(steps):
                if step == steps // 2:
                    shown.wait()
                stream.write(content[len(content) * step // steps : len(content) * (step + 1) // steps])
                time.sleep(0.05)

    growing = threading.Thread(target=grow)
    words = [sys.executable, "-m", "rths", "live", str(path), "--wait", "--no-browser"]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().split()[-1], growing, shown
        finally:
            process.terminate()
            shown.set()
            if growing.ident:
                growing.join()
    assert process.returncode == 0


@pytest.mark.slow
def test_a_test_is_shown_during_its_run_and_after_its_end_on_any_screen(
    served: tuple[str, threading.Thread, threading.Event], tmp_path: Path
) -> None:
    url, growing, shown = served
    with open_page(url, WIDE, 900) as page:
        page.wait(f"({TEXT})().includes('waiting for the recording to begin')")
        growing.start()
        page.wait("document.title === 'default: live'")
        page.wait(f"({TEXT})().includes('running')")
        shown.set()
        page.wait("document.title === 'default: ended'", 40.0)
        assert faults(page, WIDE, url, tmp_path) == []
    with open_page(url, NARROW, 844) as page:
        page.wait("document.title === 'default: ended'")
        assert faults(page, NARROW, url, tmp_path) == []


def faults(page: Page, width: int, url: str, folder: Path) -> list[str]:
    """What is wrong with the page of an ended test: plots without a curve, its width, its complaints, foreign hosts."""
    page.wait(f"({TEXT})().includes('running → ramping (end)')")
    drawings = [set(colours) & CURVES for colours in page.evaluate(DRAWN) if len(colours) > 5]
    curves = sum(map(bool, drawings))
    wide = page.evaluate("document.documentElement.scrollWidth")
    hosts = {request.split("/")[2] for request in page.requests}
    return [
        *[f"{len(drawings)} plots" for _ in range(len(drawings) < PLOTS)],
        *[f"{curves} plots have a curve" for _ in range(curves < PLOTS)],
        *[f"{wide} pixels wide" for _ in range(wide > width)],
        *["an empty picture" for _ in range(page.screenshot(folder / "page.png").stat().st_size <= 20_000)],
        *page.errors,
        *(hosts - {url.split("/")[2]}),
    ]
