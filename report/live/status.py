"""How the test stands: what stopped it, laboratories, time, late ticks, round trip; and what has happened."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from bokeh.models.widgets import Div

from common.lab.operation import EMERGENCY
from common.roles import title
from common.safety.modes import LATCHED, Mode
from common.terminal.plain_report import microseconds
from report.live.feed import SILENT_NS, Feed
from report.pictures.figure import COLOURS
from report.text.formats import percent

SHOWN = 40  # events
STOPS = 4  # causes in the banner: more than a test with a few laboratories has
RESET = "Laboratories that are latched stay so until <code>rths reset</code>."
GREY, BLUE, ORANGE, RED = "#595959", COLOURS[0], "#8a5a00", "#b3261e"  # legible on white
IN_MODE = {
    Mode.ARMED.value: BLUE,
    Mode.RUNNING.value: BLUE,
    Mode.HOLDING.value: ORANGE,
    Mode.RAMPING.value: ORANGE,
    Mode.SAFE.value: RED,
    Mode.EMERGENCY_STOP.value: RED,
}
LOUD: dict[str, str | None] = {
    "background": RED,
    "color": "#fff",
    "padding": "10px 14px",
    "margin": "8px 0",
    "font-size": "14px",
    "overflow-wrap": "anywhere",
}
AT_LEVEL = {"info": GREY, "warning": ORANGE, "error": RED}


class Status:
    """A banner where a laboratory has stopped the test, tiles of facts, the whole state in words, the newest events."""

    def __init__(self) -> None:
        self.banner = Div(sizing_mode="stretch_width", name="banner", visible=False, styles=dict(LOUD))
        self.tiles = Div(sizing_mode="stretch_width", name="tiles")
        self.events = Div(sizing_mode="stretch_width", name="events")
        self._listed = -1

    def update(self, feed: Feed, role: str) -> None:
        """Show what is new; `role` is that of the slave whose exchange counts."""
        self.banner.text = banner(feed)
        self.banner.visible = bool(self.banner.text)
        self.tiles.text = tiles(feed, role)  # the same text again is not sent
        if feed.happened != self._listed:
            self._listed = feed.happened
            self.events.text = listing(feed)


def banner(feed: Feed) -> str:
    """What stopped the test as HTML: laboratory, time and cause of each; empty where nothing did."""
    stops = feed.standing.stops
    if not stops:
        return ""
    emergency = Mode.EMERGENCY_STOP.value in feed.standing.modes.values() or any(
        stop.code == EMERGENCY for stop in stops
    )
    causes = "".join(
        f"<div><b>{escape(title(stop.lab))}</b>, t = {stop.t:.2f} s: {escape(stop.text)}</div>"
        for stop in stops[:STOPS]
    )
    return (
        "<div role='alert'><div style='font-size:18px;font-weight:bold'>"
        f"{'EMERGENCY STOP' if emergency else 'TEST STOPPED'}</div>"
        f"{causes}{f'<div>{RESET}</div>' if feed.standing.latched and not feed.ended else ''}</div>"
    )


def tiles(feed: Feed, role: str) -> str:
    """The facts as HTML."""
    timing = feed.timing(role)
    share = f" ({percent(timing.late / timing.ticks)})" if timing.ticks else ""
    duration = f" / {feed.plan.test.duration:g}" if feed.plan else ""
    facts = [(title(lab), *standing(feed, lab)) for lab in feed.labs]
    facts += [
        ("test time", f"{feed.t:.1f}{duration} s", "", ""),
        ("late ticks", f"{timing.late}{share}", ORANGE if timing.late else "", ""),
        ("round trip", f"{microseconds(timing.newest).strip()} µs", "", ""),
        ("longest round trip", f"{microseconds(timing.longest).strip()} µs", "", ""),
    ]
    return (
        f"<div style='font-size:15px;margin-bottom:8px'><b>{escape(heading(feed))}</b></div>"
        "<div style='display:flex;flex-wrap:wrap;gap:8px'>"
        + "".join(tile(*fact) for fact in facts)
        + "</div>"
    )


def heading(feed: Feed) -> str:
    """How the test stands; why it ended only where the banner does not say that already."""
    told = {f"ended: {stop.text}" for stop in feed.standing.stops[:STOPS]}
    return "ended" if feed.state in told else feed.state


def standing(feed: Feed, lab: str) -> tuple[str, str, str]:
    """A laboratory's safety mode, its colour, and how old that news is."""
    mode = feed.standing.modes.get(lab, "–")
    said, colour = mode.replace("_", " "), IN_MODE.get(mode, GREY)
    t = feed.standing.last(lab)
    if t is None or feed.ended:
        return said, colour, ""
    age = feed.standing.age(lab)
    if age * 1e9 <= SILENT_NS or (mode != "–" and Mode(mode) in LATCHED):
        return said, colour, f"as of t = {t:.2f} s, {age:.1f} s ago"
    return said, colour if colour == RED else ORANGE, f"no news for {age:.0f} s, since t = {t:.2f} s"


def tile(name: str, value: str, colour: str, below: str) -> str:
    """One fact as HTML, with a line in small letters below it."""
    edge = colour or "#c8c8c8"
    return (
        f"<div style='border-left:4px solid {edge};padding:2px 12px 2px 8px;min-width:92px'>"
        f"<div style='font-size:12px;color:{GREY}'>{escape(name)}</div>"
        f"<div style='font-size:17px;font-variant-numeric:tabular-nums;color:{colour or '#1a1a1a'}'>"
        f"{escape(value)}</div>"
        f"<div style='font-size:12px;color:{GREY}'>{escape(below)}</div></div>"
    )


def listing(feed: Feed) -> str:
    """The newest events as HTML, the newest first; those of several laboratories come in no order of time."""
    rows = "".join(row(event) for event in sorted(feed.events, key=lambda item: item["t"])[: -SHOWN - 1 : -1])
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
