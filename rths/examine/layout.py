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

if TYPE_CHECKING:
    from common.recording.run import Run
    from laboratories.kind import Hysteresis
    from report.facts.laboratories import LaboratoryFacts

EVENT = "event"
SCRIPT_TOPICS = "/studio_script/rths_"  # the viewers allow scripts only topics that begin like this
# Bins of the histogram: a hundredth of the interval each, up to two intervals, beyond which a force is two ticks old.
BINS_PER_INTERVAL, BINNED_INTERVALS = 100, 2

TIMES = ("Plot!histogram", "Plot!round_trip")
BESIDE = ("StateTransitions!states", "RawMessages!events")
SHARE_OF_ROWS = 70  # % of the width for the plots; states and events need only lines of text

SCRIPT = (
    Path(__file__).with_name("layouts") / "histogram.ts"
)  # counts the histogram, for which viewers have no panel


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `layout`."""
    cli.recording_argument(parser, "; without it: of the default test", nargs="?")
    cli.output_argument(parser, "OUT.json", "the layout file to write", required=True)
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
        line = json.dumps(
            {"file": str(args.output), "test": subject.test, "panels": list(made["configById"])}
        )
    else:
        line = f"{args.output}: {len(made['configById'])} panels for recordings of the test '{subject.test}'"
    outputs.aside(args.output).write(shown(line) + "\n")
    return 0


@dataclass(frozen=True)
class Subject:
    """The test that a layout shows: its name, its slaves' roles, its interval in s, its last tick.

    `fields` are the names of the signals of its topics, `labs` its laboratories, those of one kind together.
    """

    test: str
    roles: tuple[str, ...]
    interval: float
    last: int
    fields: dict[str, frozenset[str]]
    labs: Sequence[Sequence[LaboratoryFacts]]

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
    from common.plan import read as plans
    from common.recording.run import Run
    from laboratories import kinds
    from report.facts.laboratories import alike, laboratories

    path = cli.plan_path(None)
    test = plans.load(path)
    fields = {topic: frozenset(row.name for row in rows) for topic, rows in kinds.topics(test).items()}
    labs = alike(laboratories(Run(path, roles=test.roles, columns={topic: {} for topic in fields})))
    return Subject(test.test.name, test.roles, test.test.interval, test.ticks - 1, fields, labs)


def of_recording(path: Path) -> Subject:
    """The test in a recording; raises InputError where it cannot be read."""
    from common.plan.plan import Plan
    from common.recording.reader import read
    from report.facts.laboratories import alike, laboratories, plan_of

    found = read(path)
    plan, labs = plan_of(found) or Plan(), alike(laboratories(found))
    fields = {topic: frozenset(columns) for topic, columns in found.columns.items() if found.has(topic)}
    if found.events:
        fields[EVENT] = frozenset(found.events[0])
    return Subject(found.test, found.roles, plan.test.interval, last_tick(found), fields, labs)


def last_tick(found: Run) -> int:
    """The last tick of which there is a latency of every slave."""
    topics = [latency_topic(role) for role in found.roles if found.has(latency_topic(role))]
    return min((int(found.sequences[topic][-1]) for topic in topics), default=0)


def layout(subject: Subject) -> dict[str, Any]:
    """The layout as the viewers read it.

    Raises:
        InputError: the test has no signal for any panel.
    """
    above, below = motions(subject), forces(subject)
    panels = {
        **above,
        **below,
        "Plot!round_trip": round_trips(subject),
        "Plot!histogram": histogram(subject),
        "StateTransitions!states": states(subject),
        "RawMessages!events": events(subject),
    }
    shown = {name: panel for name, panel in panels.items() if panel}
    if not shown:
        raise InputError(f"The recording of '{subject.test}' holds no signal for any panel of a layout.")
    rows = [stacked("row", [name for name in row if name in shown]) for row in (above, below, TIMES)]
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
    """Parts beside or below each other as nested pairs, None without parts; `share` (%) is the first one's size."""
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


def plot(title: str, drawn: Sequence[dict[str, Any]], **axis: Any) -> dict[str, Any]:
    """A plot; none where it has no line."""
    if not drawn:
        return {}
    return {
        **titled(title),
        "paths": [{**line, "showLine": True, "lineSize": 1} for line in drawn],
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
    """The horizontal axis of a plot over another signal than time."""
    return {"xAxisVal": "custom", "xAxisPath": {"value": path, "enabled": True}}


def label(topic: str, field: str) -> str:
    """The entry in the legend: the slave's name, if it has one, and the signal."""
    return f"{name_of(topic)} {field}".strip()


def motions(subject: Subject) -> dict[str, dict[str, Any]]:
    """Plots of each laboratory's motion and target, by panel; slaves of one kind share a panel."""
    return {
        f"Plot!{labs[0].name}": over_time(
            subject,
            f"{labs[0].name.capitalize()}: {labs[0].pictured.position} (m)",
            labs,
            (labs[0].channels.target.name, labs[0].channels.position),
        )
        for labs in subject.labs
    }


def forces(subject: Subject) -> dict[str, dict[str, Any]]:
    """Plots of what each laboratory tests: force over imposed motion, or the device's motion and force over time."""
    found: dict[str, dict[str, Any]] = {}
    for labs in subject.labs:
        channels = labs[0].channels
        effort = (channels.effort.name,) if channels.effort else ()
        for loop in labs[0].pictured.loops:
            title = (loop.name + labs[0].letter).capitalize()
            if loop.motion == channels.position:
                for lab in labs:
                    slave = f" of {name_of(lab.role)}" if len(labs) > 1 else ""
                    name = f"Plot!hysteresis{lab.letter}{slave}"
                    found[unlike(name, found)] = hysteresis(subject, title + slave, lab, loop)
                continue
            stroke, force = (
                (f"{title}: {loop.across} (m)", (loop.motion,)),
                (f"{title}: force (N)", (*effort, loop.force)),
            )
            found[unlike(f"Plot!{loop.across}", found)] = over_time(subject, stroke[0], labs, stroke[1])
            found[unlike("Plot!force", found)] = over_time(subject, force[0], labs, force[1])
    return found


def unlike(name: str, others: Iterable[str]) -> str:
    """A panel's name that no other has."""
    return unlike(f"{name}'", others) if name in others else name


def over_time(
    subject: Subject, title: str, labs: Iterable[LaboratoryFacts], names: Sequence[str]
) -> dict[str, Any]:
    """Signals of laboratories over time."""
    return plot(title, lines(subject, (lab.topic for lab in labs), names))


def lines(subject: Subject, topics: Iterable[str], names: Iterable[str]) -> list[dict[str, Any]]:
    """A line for each signal of each topic that is recorded."""
    return [
        series(subject.path(topic, f".{name}"), label(topic, name))
        for topic in topics
        for name in names
        if name in subject.fields.get(topic, ())
    ]


def round_trips(subject: Subject) -> dict[str, Any]:
    """The round trip with every slave, and the interval."""
    found = lines(subject, subject.topics(LATENCY), ("round_trip",))
    if found:
        found.append(series(f"{subject.interval!r}", "interval"))  # a number is a line across
    return plot("Latency: round trip and interval (s)", found)


def hysteresis(subject: Subject, title: str, lab: LaboratoryFacts, loop: Hysteresis) -> dict[str, Any]:
    """A laboratory's force over its motion."""
    if not {loop.force, loop.motion} <= subject.fields.get(lab.topic, frozenset()):
        return {}
    axis = against(subject.path(lab.topic, f".{loop.motion}"))
    return plot(
        f"{title}: force (N) over {loop.across} (m)", lines(subject, (lab.topic,), (loop.force,)), **axis
    )


def timed(subject: Subject) -> list[str]:
    """The topics with a histogram."""
    return [topic for topic in subject.topics(LATENCY) if "round_trip" in subject.fields[topic]]


def script_topic(topic: str) -> str:
    """The topic on which the script publishes the histogram of a latency topic."""
    return SCRIPT_TOPICS + topic.replace(".", "_")


def histogram(subject: Subject) -> dict[str, Any]:
    """Number of ticks over the round trip."""
    topics = [(topic, script_topic(topic)) for topic in timed(subject)]
    if not topics:
        return {}
    found = [series(f"{made}.ticks[:]", label(topic, "ticks")) for topic, made in topics]
    axis = against(f"{topics[0][1]}.time[:]")  # the bins of all are the same
    return plot("Latency: ticks over round trip (s)", found, **axis)


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
    found = []
    if EVENT in subject.fields:
        for role in (MASTER, *subject.roles):
            found.append(series(subject.path(EVENT, where(lab=role, code="mode"), ".text"), role))
        for level in ("error", "warning"):
            found.append(series(subject.path(EVENT, where(level=level), ".text"), f"{level}s"))
    found += [
        series(subject.path(topic, ".deadline_missed"), label(topic, "deadline_missed"))
        for topic in subject.topics(LATENCY)
        if "deadline_missed" in subject.fields[topic]
    ]
    return {**titled("States and errors"), "paths": found, "isSynced": True} if found else {}


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
