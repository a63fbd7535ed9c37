"""The state of the test: what stopped it, laboratories, time, late ticks, round trip; and the newest events."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from bokeh.models.widgets import Div

from common.lab.operation import EMERGENCY
from common.roles import title
from common.safety.modes import LATCHED, Mode
from common.terminal.plain_report import microseconds
from report.live.feed import SILENT_NS, Feed, Timing
from report.page import block_of
from report.pictures.figure import COLOURS
from report.text.formats import percent

SHOWN = 40  # events in the list, which scrolls
STOPS = 4  # causes in the banner: one for each laboratory of a usual test
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

    def __init__(self, *, laboratories: bool = True) -> None:
        self._laboratories = laboratories  # whether the tiles show them, which a panel does itself
        self.banner = Div(sizing_mode="stretch_width", name="banner", visible=False, styles=dict(LOUD))
        self.tiles = Div(sizing_mode="stretch_width", name="tiles")
        self.events = Div(sizing_mode="stretch_width", name="events")
        self._listed = -1

    def forget(self) -> None:
        """List the next test's events from the begin."""
        self._listed = -1

    def update(self, feed: Feed, role: str) -> None:
        """Show what is new; `role` is that of the slave whose exchange counts."""
        self.banner.text = banner(feed)
        self.banner.visible = bool(self.banner.text)
        self.tiles.text = tiles(
            feed, role, laboratories=self._laboratories
        )  # the same text again is not sent
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
    causes = [(title(stop.lab), f"{stop.t:.2f}", stop.text) for stop in stops[:STOPS]]
    latched = feed.standing.latched and not feed.ended
    called = "EMERGENCY STOP" if emergency else "TEST STOPPED"
    return str(block_of("live.html", "banner", called, causes, latched))


def tiles(feed: Feed, role: str, *, laboratories: bool = True) -> str:
    """The facts as HTML."""
    timing = feed.timing(role)
    share = f" ({percent(timing.late / timing.ticks)})" if timing.ticks else ""
    duration = f" / {feed.plan.test.duration:g}" if feed.plan else ""
    facts = [(title(lab), *standing(feed, lab)) for lab in feed.labs if laboratories]
    facts += [
        ("test time", f"{feed.t:.1f}{duration} s", "", ""),
    ]
    if role:
        facts += [("late ticks", f"{timing.late}{share}", ORANGE if timing.late else "", ""), *trips(timing)]
    return str(block_of("live.html", "tiles", heading(feed), facts))


def trips(timing: Timing) -> list[tuple[str, str, str, str]]:
    """The facts on round trips; in virtual time that messages take none."""
    if timing.instant:
        return [("round trip", "0 (virtual time)", "", "")]
    return [
        ("round trip", f"{microseconds(timing.newest).strip()} µs", "", ""),
        ("longest round trip", f"{microseconds(timing.longest).strip()} µs", "", ""),
    ]


def heading(feed: Feed) -> str:
    """How the test stands; why it ended only where the banner does not say that already."""
    stated = {f"ended: {stop.text}" for stop in feed.standing.stops[:STOPS]}
    return "ended" if feed.state in stated else feed.state


def standing(feed: Feed, lab: str) -> tuple[str, str, str]:
    """A laboratory's safety mode, its colour, and how old that news is."""
    mode = feed.standing.modes.get(lab, "–")
    word, colour = mode.replace("_", " "), IN_MODE.get(mode, GREY)
    t = feed.standing.last(lab)
    if t is None or feed.ended:
        return word, colour, ""
    age = feed.standing.age(lab)
    if age * 1e9 <= SILENT_NS or (mode != "–" and Mode(mode) in LATCHED):
        return word, colour, f"as of t = {t:.2f} s, {age:.1f} s ago"
    return word, colour if colour == RED else ORANGE, f"no news for {age:.0f} s, since t = {t:.2f} s"


class EventLine(NamedTuple):
    """An event as the page lists it."""

    t: str
    lab: str
    word: str  # its level, where it is no plain news
    text: str
    colour: str


def listing(feed: Feed) -> str:
    """The newest events as HTML, the newest first; those of several laboratories come in no order of time."""
    newest = sorted(feed.events, key=lambda item: item["t"])[: -SHOWN - 1 : -1]
    return str(block_of("live.html", "listing", [line(event) for event in newest]))


def line(event: Mapping[str, Any]) -> EventLine:
    """One event."""
    level = str(event["level"])
    plain = level == "info"
    colour = "#1a1a1a" if plain else AT_LEVEL.get(level, GREY)
    return EventLine(
        f"{event['t']:.2f}", title(str(event["lab"])), "" if plain else level, str(event["text"]), colour
    )
