"""`rths layout`: a layout file with which Foxglove and Lichtblick show a recording."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from common.errors import InputError
from common.roles import LATENCY, MASTER, SLAVE, latency_topic, name_of
from common.terminal import cli, outputs
from common.terminal.printable import shown
from laboratories import kinds

if TYPE_CHECKING:
    from common.recording.reader import Run

EVENT = "event"
SCRIPT_TOPICS = "/studio_script/rths_"  # the viewers give scripts topics of this beginning only
BINS_PER_INTERVAL, BINNED_INTERVALS = 100, 2

PLOTS = {
    "column": ("Column: displacement (m)", MASTER, ("column_target", "column_displacement")),
    "table": ("Table: displacement (m)", SLAVE, ("table_target", "table_displacement")),
    "stroke": ("AMD: stroke (m)", SLAVE, ("damper_stroke",)),
    "force": ("AMD: force (N)", SLAVE, ("damper_command", "damper_force")),
    "round_trip": ("Latency: round trip and interval (s)", LATENCY, ("round_trip",)),
}
ROWS = (
    ("Plot!column", "Plot!table"),
    ("Plot!hysteresis", "Plot!stroke", "Plot!force"),
    ("Plot!histogram", "Plot!round_trip"),
)
BESIDE = ("StateTransitions!states", "RawMessages!events")
SHARE_OF_ROWS = 70  # % of the width

# what the viewers have no panel for
SCRIPT = Path(__file__).with_name("layouts") / "histogram.ts"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `layout`."""
    parser.add_argument(
        "file",
        type=Path,
        nargs="?",
        metavar="FILE",
        help="a recording (MCAP); without it: of the default test",
    )
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="OUT.json", help="the layout file to write"
    )
    cli.force_argument(parser)
    cli.json_argument(parser, "say what was written as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Write a layout."""
    outputs.checked(args.output, args.force, [args.file] if args.file else [])
    subject = of_default_test() if args.file is None else of_recording(args.file)
    made = layout(subject)
    text = json.dumps(made, indent=2, ensure_ascii=False) + "\n"
    outputs.write_text(args.output, text, args.force)
    if args.json:
        said = json.dumps(
            {"file": str(args.output), "test": subject.test, "panels": list(made["configById"])}
        )
    else:
        said = f"{args.output}: {len(made['configById'])} panels for recordings of the test '{subject.test}'"
    outputs.aside(args.output).write(shown(said) + "\n")
    return 0


@dataclass(frozen=True)
class Subject:
    """What a layout is made for: a test's name, its slaves' roles, its interval in s, its last tick.

    `fields` are the names of what its topics hold.
    """

    test: str
    roles: tuple[str, ...]
    interval: float
    last: int
    fields: dict[str, frozenset[str]]

    def topics(self, kind: str) -> list[str]:
        """Its topics of a kind: one, or one per slave."""
        each = {SLAVE: self.roles, LATENCY: tuple(map(latency_topic, self.roles))}.get(kind, (kind,))
        return [topic for topic in each if topic in self.fields]

    def path(self, topic: str, *parts: str) -> str:
        """A message path: the topic, quoted where the viewers' grammar wants it, then fields or filters."""
        name = f"rths/{self.test}/{topic}"
        return (f'"{name}"' if "." in name else name) + "".join(parts)


def of_default_test() -> Subject:
    """The default test as it ships."""
    from common.plan import plan

    test = plan.load(cli.plan_path(None))
    held = kinds.topics(test)
    fields = {topic: frozenset(row.name for row in rows) for topic, rows in held.items()}
    return Subject(test.test.name, test.roles, test.test.interval, test.ticks - 1, fields)


def of_recording(path: Path) -> Subject:
    """What a recording holds; raises InputError where it cannot be read."""
    from common.plan.plan import Plan
    from common.recording.reader import read
    from report.facts.laboratories import plan_of

    found = read(path)
    plan = plan_of(found) or Plan()
    fields = {topic: frozenset(columns) for topic, columns in found.columns.items() if found.has(topic)}
    if found.events:
        fields[EVENT] = frozenset(found.events[0])
    return Subject(found.test, found.roles, plan.test.interval, last_tick(found), fields)


def last_tick(found: Run) -> int:
    """The last tick of which there is a latency of every slave."""
    topics = [latency_topic(role) for role in found.roles if found.has(latency_topic(role))]
    return min((int(found.sequences[topic][-1]) for topic in topics), default=0)


def layout(subject: Subject) -> dict[str, Any]:
    """The layout as the viewers read it.

    Raises:
        InputError: there is nothing of which it has a panel.
    """
    panels = {
        **{f"Plot!{name}": time_plot(subject, *rest) for name, rest in PLOTS.items()},
        "Plot!hysteresis": hysteresis(subject),
        "Plot!histogram": histogram(subject),
        "StateTransitions!states": states(subject),
        "RawMessages!events": events(subject),
    }
    shown = {name: panel for name, panel in panels.items() if panel}
    if not shown:
        raise InputError(f"The recording of '{subject.test}' holds nothing of which a layout has a panel.")
    rows = [stacked("row", [name for name in row if name in shown]) for row in ROWS]
    parts = [
        stacked("column", [row for row in rows if row]),
        stacked("column", [name for name in BESIDE if name in shown]),
    ]
    return {
        "configById": shown,
        "globalVariables": {},
        "userNodes": dict(scripts(subject)),
        "playbackConfig": {"speed": 1},
        "layout": stacked("row", [part for part in parts if part], SHARE_OF_ROWS),
    }


def stacked(direction: str, parts: Sequence[Any], share: float | None = None) -> Any:
    """Parts beside or below each other, as nested pairs; None where there are none.

    They are of equal size, or the first has a share in %.
    """
    if len(parts) < 2:
        return parts[0] if parts else None
    return {
        "direction": direction,
        "first": parts[0],
        "second": stacked(direction, parts[1:]),
        "splitPercentage": share or round(100 / len(parts), 3),
    }


def titled(text: str) -> dict[str, str]:
    """A panel's title: each viewer has its own key."""
    return {"foxglovePanelTitle": text, "lichtblickPanelTitle": text}


def series(path: str, label: str) -> dict[str, Any]:
    """One line of a plot or of states."""
    return {"value": path, "label": label, "enabled": True, "timestampMethod": "receiveTime"}


def plot(title: str, lines: Sequence[dict[str, Any]], **axis: Any) -> dict[str, Any]:
    """A plot; none where it has no line."""
    if not lines:
        return {}
    return {
        **titled(title),
        "paths": [{**line, "showLine": True, "lineSize": 1} for line in lines],
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": False,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "isSynced": axis.get("xAxisVal", "timestamp") == "timestamp",
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
        **axis,
    }


def against(path: str) -> dict[str, Any]:
    """The horizontal axis of a plot that is not one over time."""
    return {"xAxisVal": "custom", "xAxisPath": {"value": path, "enabled": True}}


def label(topic: str, field: str) -> str:
    """What the legend says: the slave where the test names them, and the signal."""
    return f"{name_of(topic)} {field}".strip()


def time_plot(subject: Subject, title: str, kind: str, names: Iterable[str]) -> dict[str, Any]:
    """Signals over time, of every slave."""
    lines = [
        series(subject.path(topic, f".{name}"), label(topic, name))
        for topic in subject.topics(kind)
        for name in names
        if name in subject.fields[topic]
    ]
    if lines and kind == LATENCY:
        lines.append(series(f"{subject.interval!r}", "interval"))  # a number is a line across
    return plot(title, lines)


def hysteresis(subject: Subject) -> dict[str, Any]:
    """The column's force over its displacement."""
    force, displacement = "column_force", "column_displacement"
    if not {force, displacement} <= subject.fields.get(MASTER, frozenset()):
        return {}
    lines = [series(subject.path(MASTER, f".{force}"), force)]
    axis = against(subject.path(MASTER, f".{displacement}"))
    return plot("Column: force (N) over displacement (m)", lines, **axis)


def timed(subject: Subject) -> list[str]:
    """The topics of which there is a histogram."""
    return [topic for topic in subject.topics(LATENCY) if "round_trip" in subject.fields[topic]]


def script_topic(topic: str) -> str:
    """Where the histogram of a latency topic is to be found."""
    return SCRIPT_TOPICS + topic.replace(".", "_")


def histogram(subject: Subject) -> dict[str, Any]:
    """How many ticks took how long."""
    topics = [(topic, script_topic(topic)) for topic in timed(subject)]
    if not topics:
        return {}
    lines = [series(f"{made}.ticks[:]", label(topic, "ticks")) for topic, made in topics]
    axis = against(f"{topics[0][1]}.time[:]")  # the bins of all are the same
    return plot("Latency: ticks over round trip (s)", lines, **axis)


def scripts(subject: Subject) -> Iterable[tuple[str, dict[str, str]]]:
    """The scripts that count the histograms, by identifier."""
    template = Template(SCRIPT.read_text(encoding="utf-8"))
    for topic in timed(subject):
        values = {
            "input": json.dumps(subject.path(topic).strip('"')),
            "output": json.dumps(script_topic(topic)),
            "last": subject.last,
            "width": subject.interval / BINS_PER_INTERVAL,
            "bins": BINS_PER_INTERVAL * BINNED_INTERVALS,
        }
        name = f"histogram_{topic.replace('.', '_')}"
        yield name, {"name": name, "sourceCode": template.substitute(values)}


def states(subject: Subject) -> dict[str, Any]:
    """Safety modes, what went wrong, late ticks."""
    lines = []
    if EVENT in subject.fields:
        for role in (MASTER, *subject.roles):
            lines.append(series(subject.path(EVENT, where(lab=role, code="mode"), ".text"), role))
        for level in ("error", "warning"):
            lines.append(series(subject.path(EVENT, where(level=level), ".text"), f"{level}s"))
    lines += [
        series(subject.path(topic, ".deadline_missed"), label(topic, "deadline_missed"))
        for topic in subject.topics(LATENCY)
        if "deadline_missed" in subject.fields[topic]
    ]
    return {**titled("States and errors"), "paths": lines, "isSynced": True} if lines else {}


def where(**texts: str) -> str:
    """Filters of messages by the texts of their fields."""
    return "".join(f'{{{field}=="{text}"}}' for field, text in texts.items())


def events(subject: Subject) -> dict[str, Any]:
    """The newest event at the time shown."""
    if EVENT not in subject.fields:
        return {}
    return {
        **titled("Events"),
        "topicPath": subject.path(EVENT),
        "diffEnabled": False,
        "diffMethod": "custom",
        "diffTopicPath": "",
        "showFullMessageForDiff": False,
    }
