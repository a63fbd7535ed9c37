"""The page of a live view: one document per reader, all fed by the same recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from bokeh.document import Document
from bokeh.events import ConnectionLost
from bokeh.models.callbacks import CustomJS
from bokeh.models.widgets import Div, Select
from bokeh.themes import Theme
from jinja2 import Template

from common.roles import MASTER, name_of
from report.live.feed import Feed
from report.live.latency import Latency
from report.live.motion import looks, motions
from report.live.status import ORANGE, Status
from report.live.stream import Streams
from report.page import block_of

if TYPE_CHECKING:
    from report.panel.panel import Panel

TEMPLATE = Path(__file__).with_name("page.html")
TEXT = {"text_font_size": "12px"}
THEME = Theme(
    json={
        "attrs": {
            "Plot": {"outline_line_color": None},
            "Title": TEXT,
            "Axis": {
                "axis_label_text_font_style": "normal",
                "axis_label_text_font_size": "12px",
                "major_label_text_font_size": "12px",
                "minor_tick_line_color": None,
            },
            "Grid": {"grid_line_alpha": 0.5},
            "Legend": {
                "border_line_color": None,
                "label_text_font_size": "12px",
                "padding": 0,
                "margin": 0,
                "spacing": 16,
            },
        }
    }
)


def parting(feed: Feed, *, panel: bool) -> Div:
    """The sentence that the page shows by itself when the server has ended."""
    text = str(block_of("live.html", "left" if panel else "parting", feed.path))
    style: dict[str, str | None] = {"color": ORANGE, "font-size": "14px", "overflow-wrap": "anywhere"}
    return Div(text=text, visible=False, sizing_mode="stretch_width", styles=style, name="parting")


class Page:
    """All views in a document, and the choice of the slave where there are several.

    With a `panel` its part stands above them, and its feed is followed from test to test.
    """

    def __init__(self, document: Document, feed: Feed, panel: Panel | None = None) -> None:
        self._document = document
        self._feed = feed
        self._panel = panel
        self._labs = looks(feed.laboratories)
        self.streams = Streams(feed)
        self.status = Status(laboratories=panel is None)
        window = None if feed.whole else feed.window
        self.latency = Latency(self.streams, window)
        self._motions = motions(self.streams, feed.laboratories, window)
        self.plots = {name: each.figure for name, each in self._motions.items()}
        if feed.roles and not all(feed.timing(role).instant for role in feed.roles):
            self.plots |= self.latency.parts
        self._heading = Div(sizing_mode="stretch_width", name="heading")
        self._parting = parting(feed, panel=panel is not None)
        self.slave = Select(title="slave", options=[], visible=False, width=200, name="slave")
        for name, figure in self.plots.items():
            figure.name = name
            code = "document.getElementById(cell).hidden = !plot.visible"
            figure.js_on_change("visible", CustomJS(args={"plot": figure, "cell": f"cell {name}"}, code=code))
        texts = (
            self._heading,
            self._parting,
            self.status.banner,
            self.status.tiles,
            self.slave,
            self.status.events,
        )
        for root in (*texts, *self.plots.values()):
            document.add_root(root)
        self._set_up(document)
        self.update()

    def _set_up(self, document: Document) -> None:
        document.config.update(reconnect_session=False, notify_connection_status=False)
        document.js_on_event(
            ConnectionLost,
            CustomJS(args={"text": self._parting}, code="text.visible = true; window.heard = 0"),
        )
        self.status.tiles.js_on_change("tags", CustomJS(code="window.heard = Date.now()"))
        self._heading.js_on_change("tags", CustomJS(code="location.reload()"))
        document.theme = THEME
        document.template = Template(TEMPLATE.read_text(encoding="utf-8"))
        document.template_variables["plots"] = self.plots
        document.template_variables["panel"] = self._panel.html() if self._panel else ""
        for model in document.models:  # the ranges that a reader chooses in the browser stay as they are
            model.syncable = model is self.slave

    def update(self) -> None:
        """Bring everything up to date, in one message to the browser."""
        if self._panel is not None and self._panel.feed is not self._feed:
            self._feed = self._panel.feed
            self.latency.forget()
            self.status.forget()
        self._document.hold("collect")
        try:
            self._update(self._feed)
        finally:
            self._document.unhold()

    def _update(self, feed: Feed) -> None:
        self._head(feed)
        self.status.tiles.tags = [feed.beat]  # lets the page show for how long it has received nothing
        if len(feed.roles) > 1 and not self.slave.visible:
            options: Any = [(role, name_of(role)) for role in feed.roles]
            self.slave.update(options=options, value=feed.roles[0], visible=True)
        if self._labs != looks(feed.laboratories):
            self._heading.tags = [
                "anew"
            ]  # lets the browser load the page again, with the plots of these laboratories
        chosen = str(self.slave.value) if self.slave.visible else "".join(feed.roles[:1])
        self._choose(chosen)
        self.streams.follow(feed, chosen)
        self.latency.update(feed, chosen)
        self.status.update(feed, chosen)

    def _choose(self, role: str) -> None:
        """Show the plots of laboratory A and of those slaves that have the signals of the chosen one."""
        channels = next((lab.channels for lab in self._feed.laboratories if lab.topic == role), None)
        for each in self._motions.values():
            visible = each.lab.topic == MASTER or channels in (None, each.lab.channels)
            if each.figure.visible != visible:
                each.figure.visible = visible

    def _head(self, feed: Feed) -> None:
        test = feed.test or feed.path.stem
        state = "ended" if feed.ended else "live"
        title = f"{test}: {state}" if self._panel is None else "rths panel"
        if title != self._document.title:
            self._document.title = title
        self._heading.text = str(block_of("live.html", "heading", test, feed.path))
