"""The entry of one recording: its facts by column, and its peaks."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from common.errors import PlanError, RthsError
from common.plan.plan import Plan
from common.plan.plan_difference import VERSION, changed
from common.recording.outcome import COMPLETED, CUT_OFF
from common.recording.reader import read
from common.recording.run import GROUND, PEAKS, Run
from common.roles import MASTER, SLAVE, kind_of
from report.catalogue.columns import CUT, DAMAGED, DRIFT, NAMES, UNREADABLE, WHOLE, Facts, Peak, notes_of
from report.facts import circumstances, storeys
from report.facts.laboratories import laboratories, whole_plan
from report.facts.summary import peaks as of_messages
from report.facts.summary import units_of

STOPPED, TRIPPED, LOST = (
    "stopped",
    "tripped",
    "lost",
)  # outcomes that follow from the code of the event that ended it
CODES: Mapping[str, str] = {
    "": CUT_OFF,
    "unknown": CUT_OFF,
    "completed": COMPLETED,
    "import": "imported",
    "simulation": "simulated",
    "stop": STOPPED,
    "stopped": STOPPED,
    "lost": LOST,
    "watchdog": LOST,
    "nobody": LOST,
    "hesitant": LOST,
}  # outcomes by the code in a recording's summary; every other code is that of a trip


class CatalogueEntry(NamedTuple):
    """What the catalogue keeps of a recording."""

    facts: Facts
    peaks: list[Peak]


def entry(path: Path, folder: Path) -> CatalogueEntry:
    """The entry of a recording, named by its path from `folder`; one that cannot be read has state and damage only."""
    facts: Facts = dict.fromkeys(NAMES) | {"file": named(path, folder)}
    try:
        facts["size"] = path.stat().st_size
        facts["tags"], facts["notes"] = noted(path)
        run = opened(path)
        facts |= of_run(run)
        return CatalogueEntry(facts, peaks(run))
    except (RthsError, OSError) as error:
        return CatalogueEntry(facts | {"state": UNREADABLE, "damage": str(error)}, [])


def named(path: Path, folder: Path) -> str:
    """The path from the folder of the catalogue, or the whole path where it lies elsewhere."""
    return str(path.relative_to(folder) if path.is_relative_to(folder) else path)


def opened(path: Path) -> Run:
    """The recording without its messages where its metadata hold the peaks of all it is asked for, else whole."""
    run = read(path, messages=False)
    noted_peaks = run.finished and not run.damage and PEAKS in run.metadata
    plan = planned(run)
    if noted_peaks and (plan is None or plan.storeys == 1):
        return run
    return read(path)


def planned(run: Run) -> Plan | None:
    """The plan inside a recording, None where it has none or one that this version cannot read."""
    try:
        return whole_plan(run)
    except PlanError:
        return None


def of_run(run: Run) -> Facts:
    """The facts that a recording contains."""
    plan, summary = planned(run), run.metadata.get("summary", {})
    motion = run.metadata.get(GROUND, {})
    ticks = [int(value) for name, value in summary.items() if name.endswith("_recorded")]
    return {
        "test": run.test,
        "started": started(run),
        "duration": plan.test.duration if plan else None,
        "clock": circumstances.clock_of(run) or None,
        "motion": ground(motion.get("record", "")) or None,
        "scale": float(motion["scale"]) if "scale" in motion else None,
        "outcome": outcome(summary) if summary or not run.damage else None,
        "cause": summary.get("cause"),
        "ticks": max(ticks or [run.ticks(topic) for topic in run.columns], default=0),
        "missing": sum(int(value) for name, value in summary.items() if name.endswith("_gaps"))
        if ticks
        else None,
        "late": int(summary["deadline_misses"]) if "deadline_misses" in summary else None,
        "state": DAMAGED if run.damage else WHOLE if run.finished else CUT,
        "damage": run.damage or None,
        "digest": run.metadata.get("plan", {}).get("digest"),
        "differs": differing(plan) if plan else None,
    }


def ground(record: str) -> str:
    """The name of a ground motion, without the remarks and figures that follow it in a recording."""
    return record.partition(" (")[0].partition(", dt ")[0]


def outcome(summary: Mapping[str, str]) -> str:
    """How a test ended, in a word."""
    if summary.get("cause") == COMPLETED:
        return COMPLETED
    return CODES.get(summary.get("outcome", ""), TRIPPED)


def started(run: Run) -> str | None:
    """Date and time (UTC) at which a recording began, to the second."""
    stamp = run.metadata.get("host", {}).get("recorded_unix_ns")
    if stamp is None:
        return None
    return datetime.fromtimestamp(int(stamp) // 1_000_000_000, UTC).strftime("%Y-%m-%d %H:%M:%S")


def differing(plan: Plan) -> str:
    """The keys of a plan that are not at their defaults, with their values."""
    return ", ".join(f"{name} = {text}" for name, text in changed(plan).items() if name != VERSION)


def peaks(run: Run) -> list[Peak]:
    """The peak of every quantity of the laboratories, and the largest drift."""
    noted_ones = run.metadata.get(PEAKS)
    found = []
    if noted_ones is None or run.damage or any(map(run.has, run.columns)):
        for name, facts in of_messages(run).items():
            topic, _, signal = name.partition("/")
            found.append(Peak(topic, signal, facts["peak"], facts["unit"]))
        return [*found, *drift(run)]
    for name, text in noted_ones.items():
        topic, _, signal = name.partition("/")
        unit = units_of(run, topic).get(signal) if kind_of(topic) in (MASTER, SLAVE) else None
        if unit is not None:
            found.append(Peak(topic, signal, float(text.split()[0]), unit))
    alone = [one._replace(name=DRIFT) for one in found if one[:2] == (MASTER, "displacement")]
    return found + alone  # of a building of one storey, whose drift is its displacement


def drift(run: Run) -> Iterator[Peak]:
    """The largest drift of all storeys, of a recording with a plan."""
    plan = planned(run)
    rows = storeys.storeys(run, plan, laboratories(run)) if plan else []
    values = [row[DRIFT]["peak"] for row in rows if row.get(DRIFT)]
    if values:
        yield Peak(MASTER, DRIFT, max(values), storeys.UNITS[DRIFT])


def noted(path: Path) -> tuple[str | None, str | None]:
    """Tags and notes from the file beside a recording; a sentence in place of notes that cannot be read."""
    beside = notes_of(path)
    if not beside.exists():
        return None, None
    try:
        found = tomllib.loads(beside.read_text(encoding="utf-8"))
        tags, notes = found.pop("tags", []), found.pop("notes", "")
    except (OSError, ValueError) as error:
        return None, f"Cannot read the notes in {beside.name}: {error}."
    texts = isinstance(notes, str) and isinstance(tags, list) and all(isinstance(tag, str) for tag in tags)
    if found or not texts:
        return (
            None,
            f"{beside.name} must hold `notes`, a text, and `tags`, a list of texts, and nothing else.",
        )
    return " ".join(tags) or None, notes or None


def diagnosis(path: Path) -> tuple[str, Facts] | None:
    """The name of the recording that a diagnosis report (JSON) is about, and its verdict; None for another file."""
    try:
        found: Any = json.loads(path.read_text(encoding="utf-8"))
        name = str(found["details"]["test"]["file"])
        return name, {"diagnosis": str(found["status"]), "verdict": str(found["verdict"])}
    except (OSError, ValueError, KeyError, TypeError):
        return None
