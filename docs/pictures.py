"""The pictures of the documents: `python -m docs.pictures` makes all of them again, or those that are named.

The tutorial's and the benchmark's pictures are drawn by the commands that their pages show; `gap.png` is the top of the
tutorial's gap page in a headless Chromium. The picture of the safety machine comes from its table of states, that
of the loop from docs/loop_picture.py.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from common.safety.modes import TURNS, Mode, Turn
from docs import console, loop_picture
from tests.browser import open_page

FOLDER = Path(__file__).resolve().parent
TUTORIAL = ("hysteresis.png", "histories.png")
GAP_WINDOW = 1100, 1060  # CSS pixels: as far down the gap page as its diagram of the sites
BENCHMARK = ("compensators.png", "late_force.png")
PLACES = {
    Mode.IDLE: (0, 2),
    Mode.CONFIGURED: (1, 2),
    Mode.ARMED: (2, 2),
    Mode.RUNNING: (3, 2),
    Mode.HOLDING: (3, 1),
    Mode.RAMPING: (2, 1),
    Mode.SAFE: (1, 1),
    Mode.EMERGENCY_STOP: (0, 0),
}
ACROSS, UP = 2.4, 1.5
BEND = {
    (Mode.RUNNING, Mode.HOLDING): 0.3,
    (Mode.HOLDING, Mode.RUNNING): 0.3,
    (Mode.CONFIGURED, Mode.IDLE): 0.35,
    (Mode.ARMED, Mode.IDLE): 0.3,
}
BOX = {"boxstyle": "round,pad=0.5", "fc": "#e8f1f8", "ec": "#1d4f73"}


def tutorial() -> list[str]:
    """Run the tutorial and keep the pictures that it draws; sentences on where the page and its commands differ."""
    with tempfile.TemporaryDirectory() as folder:
        complaints = console.play(FOLDER / "tutorial.md", Path(folder))
        for name in TUTORIAL:
            shutil.copy(Path(folder) / "second" / name, FOLDER / "pictures" / name)
        with open_page((Path(folder) / "gap.html").as_uri(), *GAP_WINDOW) as page:
            page.screenshot(FOLDER / "pictures" / "gap.png", whole=False)
    return complaints


def benchmark2020() -> list[str]:
    """Run the whole benchmark and keep two of its pictures; a sentence where it misses a goal."""
    from rths.__main__ import command

    with tempfile.TemporaryDirectory() as folder:
        code = command(["benchmark2020", "-o", folder])
        for name in BENCHMARK:
            shutil.copy(Path(folder) / name, FOLDER / "pictures" / name)
    return ["the benchmark misses a goal"] if code else []


def loop() -> list[str]:
    """Draw the closed loop of the default test."""
    loop_picture.draw(FOLDER / "pictures" / "loop.svg")
    return []


def modes() -> list[str]:
    """Draw the safety machine; the emergency stop, to which every mode leads, without its arrows."""
    import matplotlib as mpl

    from report.pictures.figure import figure

    canvas = figure(8.4, 4.4)
    axes = canvas.subplots()
    axes.set_axis_off()
    axes.grid(visible=False)
    for mode in PLACES:
        axes.text(*place(mode), mode.value, ha="center", va="center", fontsize=9, bbox=BOX)
    for mode, row in TURNS.items():
        ways: dict[Mode, list[str]] = {}
        for turn, to in row.items():
            if turn is not Turn.EMERGENCY:
                ways.setdefault(to, []).append(turn.value)
        for to, turns in ways.items():
            arrow(axes, mode, to, " / ".join(turns))
    x, y = place(Mode.EMERGENCY_STOP)
    axes.text(x + 0.95, y, "emergency: from every mode", va="center", fontsize=8, style="italic")
    axes.set(xlim=(-0.9, 3 * ACROSS + 1.1), ylim=(-0.5, 2 * UP + 1.1), aspect="equal")
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "rths"}):
        canvas.savefig(FOLDER / "pictures" / "modes.svg", metadata={"Date": None})
    return []


def place(mode: Mode) -> tuple[float, float]:
    """The place of a mode in the picture."""
    column, row = PLACES[mode]
    return column * ACROSS, row * UP


def arrow(axes: Any, start: Mode, end: Mode, label: str) -> None:
    """One way from a mode to another with the turns that lead there."""
    (x0, y0), (x1, y1) = place(start), place(end)
    bend = BEND.get((start, end), 0.0)
    style = {"arrowstyle": "-|>", "color": "#444", "connectionstyle": f"arc3,rad={bend}"}
    axes.annotate("", (x1, y1), (x0, y0), arrowprops=style | {"shrinkA": 28, "shrinkB": 28})
    middle = (x0 + x1 + bend * (y1 - y0)) / 2, (y0 + y1 - bend * (x1 - x0)) / 2
    white = {"fc": "white", "ec": "none", "pad": 0.6}
    axes.text(*middle, label, ha="center", va="center", fontsize=7.5, bbox=white)


MAKERS = {"loop": loop, "modes": modes, "tutorial": tutorial, "benchmark2020": benchmark2020}


def main() -> int:
    """Make those named, or all; 1 where a page or a goal is not as it should be."""
    (FOLDER / "pictures").mkdir(exist_ok=True)
    complaints = [text for name in sys.argv[1:] or MAKERS for text in MAKERS[name]()]
    sys.stdout.write("\n".join(complaints))
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
