"""How the test stands: laboratories, time, late ticks, round trip; and what has happened."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from bokeh.models.widgets import Div

from common.roles import title
from common.safety.modes import Mode
from rths.figure import COLOURS
from rths.live.feed import Feed
from rths.terminal import microseconds

SHOWN = 40  # events
GREY, BLUE, ORANGE, RED = "#595959", COLOURS[0], "#8a5a00", "#b3261e"  # legible on white
IN_MODE = {
    Mode.ARMED.value: BLUE,
    Mode.RUNNING.value: BLUE,
    Mode.HOLDING.value: ORANGE,
    Mode.RAMPING.value: ORANGE,
    Mode.SAFE.value: RED,
    Mode.EMERGENCY_STOP.value: RED,
}
AT_LEVEL = {"info": GREY, "warning": ORANGE, "error": RED}


class Status:
    """Tiles of facts, the whole state in words, and the newest events."""

    def __init__(self) -> None:
        self.tiles = Div(sizing_mode="stretch_width", name="tiles")
        self.events = Div(sizing_mode="stretch_width", name="events")
        self._listed = -1

    def update(self, feed: Feed, role: str) -> None:
        """Show what is new; `role` is that of the slave whose exchange counts."""
        self.tiles.text = tiles(feed, role)  # the same text again is not sent
        if feed.happened != self._listed:
            self._listed = feed.happened
            self.events.text = listing(feed)


def tiles(feed: Feed, role: str) -> str:
    """The facts as HTML."""
    timing = feed.timing(role)
    share = f" ({100 * timing.late / timing.ticks:.2g} %)" if timing.ticks else ""
    duration = f" / {feed.plan.test.duration:g}" if feed.plan else ""
    facts = [(title(lab), *standing(feed, lab)) for lab in feed.labs]
    facts += [
        ("test time", f"{feed.t:.1f}{duration} s", ""),
        ("late ticks", f"{timing.late}{share}", ORANGE if timing.late else ""),
        ("round trip", f"{microseconds(timing.newest).strip()} µs", ""),
        ("longest round trip", f"{microseconds(timing.longest).strip()} µs", ""),
    ]
    return (
        f"<div style='font-size:15px;margin-bottom:8px'><b>{escape(feed.state)}</b></div>"
        "<div style='display:flex;flex-wrap:wrap;gap:8px'>"
        + "".join(tile(*fact) for fact in facts)
        + "</div>"
    )


def standing(feed: Feed, lab: str) -> tuple[str, str]:
    """A laboratory's safety mode and its colour."""
    mode = feed.modes.get(lab, "–")
    return mode.replace("_", " "), IN_MODE.get(mode, GREY)


def tile(name: str, value: str, colour: str) -> str:
    """One fact as HTML."""
    edge = colour or "#c8c8c8"
    return (
        f"<div style='border-left:4px solid {edge};padding:2px 12px 2px 8px;min-width:92px'>"
        f"<div style='font-size:12px;color:{GREY}'>{escape(name)}</div>"
        f"<div style='font-size:17px;font-variant-numeric:tabular-nums;color:{colour or '#1a1a1a'}'>"
        f"{escape(value)}</div></div>"
    )


def listing(feed: Feed) -> str:
    """The newest events as HTML, the newest first."""
    rows = "".join(row(event) for event in list(feed.events)[: -SHOWN - 1 : -1])
    return (
        "<table style='border-collapse:collapse;font-size:13px;line-height:1.5'>"
        f"{rows or '<tr><td>nothing yet</td></tr>'}</table>"
    )


def row(event: Mapping[str, Any]) -> str:
    """One event as a row of a table."""
    level = str(event["level"])
    word = "" if level == "info" else f"<b>{escape(level)}:</b> "
    colour = AT_LEVEL.get(level, GREY)
    cells = (f"{event['t']:.2f}&nbsp;s", escape(title(str(event["lab"]))), word + escape(str(event["text"])))
    styles = (f"text-align:right;color:{GREY}", f"color:{GREY}", f"color:{'#1a1a1a' if not word else colour}")
    return (
        "<tr style='vertical-align:top'>"
        + "".join(
            f"<td style='padding:0 10px 0 0;{style}'>{cell}</td>"
            for style, cell in zip(styles, cells, strict=True)
        )
        + "</tr>"
    )
