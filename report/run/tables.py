"""The figures of `rths inspect` as tables of the page, and the facts that the recording holds about itself."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

from common.plan.calibration import Calibration, calibrations, day
from common.recording.outcome import outcome
from common.recording.run import CLOCK, GROUND, MACHINES, PEAKS, Run
from common.recording.writer import SIGNALS
from common.roles import MASTER, name_of
from report.facts.laboratories import plan_of
from report.facts.machine import by_itself
from report.page import breakable
from report.run.verdict import Margin, Summary, amount
from report.text.formats import MISSING, milliseconds, reading, storey_rows, tracked
from report.text.terminal import TitledTable

EVENTS = 400  # rows on the page, which stays below a megabyte; JSON of rths inspect has all
# Metadata that have a section of their own, or of which the page's tables are made.
SHOWN = ("plan", CLOCK, GROUND, MACHINES, PEAKS, SIGNALS)
FILED = (
    "laboratory",
    "operator",
    "specimen",
    "notes",
)  # keys of [report] that are shown with the facts of the test


def facts(run: Run, summary: Summary) -> list[tuple[str, str]]:
    """What was tested, under which motion, when."""
    plan, motion = plan_of(run), summary["ground_motion"]
    ended = summary["recorder"]
    found = [
        ("test", summary["test"]),
        ("recording", Path(summary["file"]).name),
        ("recorded", date(run)),
        ("time and rigs", summary["circumstances"]),
        ("ground motion", motion.get("record", "")),
        ("scale", motion.get("scale", "")),
        ("data", run.metadata.get("import", {}).get("data", "")),
        ("duration", f"{plan.test.duration:g} s" if plan else ""),
        ("interval", f"{plan.test.interval * 1e3:g} ms" if plan else ""),
        ("storeys", str(plan.storeys) if plan and not by_itself(run) else ""),
        ("slaves", ", ".join(summary["slaves"])),
        ("part tested", run.metadata.get("bench", {}).get("part", "")),
        ("outcome", outcome(ended)),
        *(((name, getattr(plan.report, name)) for name in FILED) if plan else ()),
    ]
    return [(name, text) for name, text in found if text]


def date(run: Run) -> str:
    """When the recording was begun, UTC; empty where it does not say."""
    stamp = run.metadata.get("host", {}).get("recorded_unix_ns", "")
    if not stamp.isdecimal():
        return ""
    try:
        at = datetime.datetime(1970, 1, 1) + datetime.timedelta(microseconds=int(stamp) // 1000)
    except (ValueError, OverflowError):
        return ""
    return f"{at:%Y-%m-%d %H:%M:%S} UTC"


def calibration(run: Run) -> TitledTable:
    """The calibration of each sensor, and whether it held when the recording was begun."""
    plan, begun = plan_of(run), day(date(run)[:10])
    found = calibrations(plan) if plan else []
    rows = [
        [
            one.signal,
            *map(str, (one.calibrated or MISSING, one.due or MISSING)),
            held(one, begun),
            one.by or MISSING,
            one.certificate or MISSING,
        ]
        for one in found
    ]
    return TitledTable("", ("sensor", "calibrated", "due", "held in the test", "by", "certificate"), rows)


def held(one: Calibration, begun: datetime.date | None) -> str:
    """Whether a calibration held on a day."""
    if one.due is None or begun is None:
        return MISSING
    return "no" if one.due < begun else "yes"


COUNTS = ("expected", "recorded", "missing", "repeated")


def completeness(summary: Summary) -> TitledTable:
    """Ticks expected, recorded, missing."""
    rows = [
        [topic, *(str(found[name]) for name in COUNTS), holes(found)]
        for topic, found in summary["topics"].items()
    ]
    return TitledTable("", ("topic", *COUNTS, "holes (ticks)"), rows)


def holes(found: Mapping[str, Any]) -> str:
    """The first holes of a topic."""
    return ", ".join(f"{first}…{last}" for first, last in found["holes"]) or "none"


def exchange(summary: Summary) -> TitledTable:
    """The account of all messages: sent = used + rejected + lost, and foreign messages where there were any."""
    columns = {"sent": "sent", "used": "= used", "rejected": "+ rejected", "lost": "+ lost"}
    if any(counts["foreign"] for counts in summary["exchange"].values()):
        columns["foreign"] = "not sent by it, at least"
    rows = [
        [name.replace("/", ", "), *(str(counts[key]) for key in columns)]
        for name, counts in summary["exchange"].items()
    ]
    return TitledTable("", ("messages", *columns.values()), rows)


def rejected(summary: Summary) -> TitledTable:
    """Frames that were rejected, by laboratory and reason."""
    rows = [
        [lab, reason, str(count)]
        for lab, counts in summary["rejected"].items()
        for reason, count in counts.items()
    ]
    return TitledTable("Frames rejected", ("by", "reason", "frames"), rows)


def peaks(summary: Summary) -> TitledTable:
    """Largest magnitudes."""
    rows = [
        [breakable(name), reading(found["peak"], found["unit"]), seconds(found["t"])]
        for name, found in summary["peaks"].items()
    ]
    return TitledTable("", ("signal", "peak", "at"), rows)


def storeys(summary: Summary) -> TitledTable:
    """Peaks of every storey."""
    if not summary["storeys"]:
        return TitledTable("", (), [])
    head, *rows = storey_rows(summary["storeys"])
    return TitledTable("Building", tuple(head), rows)


def seconds(t: float | None) -> str:
    """A test time."""
    return MISSING if t is None else f"{t:.3f} s"


def limits(found: list[Margin]) -> TitledTable:
    """How near recorded signals came to the limits of the plan."""
    rows = []
    for item in found:
        peak, limit = reading(item.peak, item.unit), reading(item.limit, item.unit)
        rows.append([breakable(item.signal), peak, limit, f"{100.0 * item.share:.1f} %"])
    return TitledTable("", ("signal", "peak", "limit", "share"), rows)


def tracking(summary: Summary) -> TitledTable:
    """How the transfer systems followed their targets."""
    rows = [[part, *tracked(found)] for part, found in summary["tracking"].items()]
    head = ("part", "delay", "by correlation", "amplitude", "at", "NRMSE", "peak error")
    return TitledTable("", head, rows)


def force_path(summary: Summary) -> TitledTable:
    """The force of each column against the plan's specimen at the measured displacement."""
    paths = summary["force_paths"]
    rows = [
        [
            name,
            milliseconds(found["delay"]),
            " to ".join(milliseconds(end) for end in found["interval"]),
            f"{found['gain']:.4f}",
            f"{found['frequency']:.2f} Hz",
        ]
        for name, found in paths.items()
    ]
    head = ("column of", "delay", "95 %", "gain", "at")
    first = 0 if len(paths) > 1 else 1
    return TitledTable("Force path", head[first:], [row[first:] for row in rows])


def latency(summary: Summary) -> list[TitledTable]:
    """Percentiles of the parts of a tick, a table per named slave."""
    tables = summary["latency"] if summary["slaves"] else {"": summary["latency"]}
    return [latency_of(name, segments) for name, segments in tables.items() if segments]


def latency_of(slave: str, segments: Mapping[str, Mapping[str, float]]) -> TitledTable:
    """Percentiles in the exchange with one slave, µs."""
    names = list(next(iter(segments.values())))
    rows = [
        [breakable(segment), *(f"{found[name] * 1e6:.0f}" for name in names)]
        for segment, found in segments.items()
    ]
    return TitledTable(f"Slave {slave}" if slave else "", ("µs", *names), rows)


def machines(run: Run) -> TitledTable:
    """Real-time shape and load of the laboratories' machines, and the bare timing loop beside the test."""
    recorded = run.metadata.get(MACHINES, {})
    labs = (MASTER, *run.roles, "bare_loop")
    found = {
        lab: {
            key.removeprefix(f"{lab}."): text for key, text in recorded.items() if key.startswith(f"{lab}.")
        }
        for lab in labs
    }
    kept = {lab: values for lab, values in found.items() if values}
    names = dict.fromkeys(name for values in kept.values() for name in values)
    rows = [[breakable(name), *(shortened(kept[lab].get(name, MISSING)) for lab in kept)] for name in names]
    return TitledTable("", ("", *(lab.replace("_", " ") for lab in kept)), rows)


def shortened(text: str) -> str:
    """A number in four digits, anything else as it stands."""
    try:
        return f"{float(text):.4g}"
    except ValueError:
        return text


def events(run: Run, *codes: str) -> TitledTable:
    """What happened, in the order in which it was recorded: of these codes, or all."""
    chosen = [event for event in run.events if not codes or event["code"] in codes]
    rows = [[f"{event['t']:.3f} s", event["lab"], event["level"], event["text"]] for event in chosen[:EVENTS]]
    if len(chosen) > EVENTS:
        rows.append(["", "", "", f"and {len(chosen) - EVENTS} more: rths inspect --json lists all"])
    return TitledTable("", ("time", "from", "level", "what"), rows)


def provenance(run: Run, summary: Summary) -> list[tuple[str, str]]:
    """The origin of the numbers: versions, state of the file, digest of the plan."""
    versions = run.metadata.get("versions", {})
    ground = run.attachments.get(GROUND, b"")
    whole = summary["finished"] and not summary["damage"]
    found = [
        ("recorded by", f"rths {versions['rths']}" if "rths" in versions else ""),
        ("this page by", f"rths {metadata.version('rths')}"),
        ("file", "finished, without damage that its checksums would show" if whole else amount(summary)),
        ("damage", summary["damage"]),
        ("plan's digest", run.metadata.get("plan", {}).get("digest", "")),
        ("ground motion", summary["ground_motion"].get("record", "")),
        ("its samples", f"{len(ground) // 8} numbers inside the recording" if ground else ""),
    ]
    return [(name, text) for name, text in found if text]


def kept(run: Run) -> list[tuple[str, str]]:
    """Everything else that the recording says about itself, by title, as text."""
    texts = [
        (name, "\n".join(f"{key} = {text}" for key, text in values.items()))
        for name, values in run.metadata.items()
        if name not in SHOWN
    ]
    return [(f"metadata: {name.replace('_', ' ')}", text) for name, text in texts if text]


def slave_title(role: str) -> str:
    """What stands over the pictures that concern a slave; empty for the only one."""
    return f"Slave {name_of(role)}" if name_of(role) else ""
