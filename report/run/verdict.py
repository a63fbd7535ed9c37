"""The verdict on a run in sentences with figures, and a sentence on what its recording lacks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from common.recording.run import Run
from common.roles import LATENCY, MASTER, SLAVE, kind_of, name_of, title
from report.facts.laboratories import laboratories, whole_plan
from report.facts.late import said_beside_client
from report.facts.limits import limits
from report.text import holds
from report.text.force_path import sentence as force_sentence
from report.text.formats import apart, milliseconds, quantity

Summary = Mapping[str, Any]
ENDS = {
    "completed": "The test ran to its end.",
    "imported": "The data were imported, not recorded by a test.",
}
NO_END = "The recording does not say how the test ended."


class Margin(NamedTuple):
    """The peak of a recorded signal and its limit in the plan."""

    signal: str
    peak: float
    limit: float
    unit: str

    @property
    def share(self) -> float:
        """The peak over the limit."""
        return self.peak / self.limit

    @property
    def words(self) -> str:
        """The signal's name in words, and whose it is."""
        topic, _, name = self.signal.partition("/")
        return name.replace("_", " ") + (f" of the {title(topic)}" if name_of(topic) else "")


def lost(summary: Summary) -> str:
    """What is lost of a recording, and what to do, in a sentence; empty for a whole one."""
    file = Path(summary["file"]).name
    if summary["damage"]:
        return (
            f"This recording is damaged {summary['damage']}, so the page shows the part before; "
            f"rths recover {file} saves the intact data behind it. {amount(summary)}"
        )
    if not summary["finished"]:
        return (
            "This recording was cut off before its end, so the page shows what had been written; "
            f"rths recover {file} makes a finished recording of it. {amount(summary)}"
        )
    return ""


def amount(summary: Summary) -> str:
    """How many ticks of how many are there."""
    planned, topics = summary["ticks_planned"], summary["topics"]
    if not planned or not topics:
        return "It does not say how many ticks there should be."
    counts = ", ".join(f"{facts['recorded']} of the {topic}" for topic, facts in topics.items())
    return f"Of the {planned} ticks planned it holds {counts}."


def sentences(run: Run, summary: Summary) -> list[str]:
    """The verdict: one sentence for each criterion of a test that the recording has data for."""
    found = [
        outcome(summary),
        *summary["warnings"],
        *holds.sentences(summary["holds"]),
        completeness(summary),
        *exchange(summary),
        rejected(summary),
        lateness(run, summary),
        summary["patience"],
        *tracking(summary),
        *force_paths(summary),
        energy(summary),
        nearest(run, summary),
    ]
    return [text for text in found if text]


def outcome(summary: Summary) -> str:
    """How the test ended."""
    ended = summary["recorder"]
    cause = ended.get("cause") or ended.get("outcome")
    if not cause:
        return NO_END
    return ENDS.get(cause, f"The test ended: {cause.rstrip('.')}.")


def completeness(summary: Summary) -> str:
    """Ticks recorded and missing."""
    expected, planned, topics = summary["ticks_expected"], summary["ticks_planned"], summary["topics"]
    if not planned or not topics:
        return ""
    begin = "The recording ends" if outcome(summary) == NO_END else "The test stopped"
    gaps = {topic: facts["missing"] for topic, facts in topics.items() if facts["missing"]}
    names = ", ".join(topics)
    if not gaps:
        if expected < planned:
            return f"{begin} at tick {expected} of {planned}; all ticks until then are recorded ({names})."
        return f"All {expected} ticks are recorded ({names})."
    counts = " and ".join(f"the {topic} lacks {count}" for topic, count in gaps.items())
    if expected < planned:
        return f"{begin} at tick {expected} of {planned}; until then {counts}."
    return f"The test ran for all of its {planned} ticks; {counts}."


def exchange(summary: Summary) -> list[str]:
    """What became of the messages, by direction."""
    return [
        f"Exchange with the {title(role)}, {direction}: {counts['sent']} sent, of which {counts['used']} used, "
        f"{counts['rejected']} rejected as late or out of order, {counts['lost']} lost{apart(counts)}."
        for (role, _, direction), counts in (
            (name.partition("/"), counts) for name, counts in summary["exchange"].items()
        )
    ]


def rejected(summary: Summary) -> str:
    """How many frames were rejected: damaged ones, and those that do not belong to the test."""
    counts = {lab: sum(reasons.values()) for lab, reasons in summary["rejected"].items()}
    if not counts:
        return ""
    return "Frames rejected: " + ", ".join(f"{count} by the {lab}" for lab, count in counts.items()) + "."


def lateness(run: Run, summary: Summary) -> str:
    """Ticks in which a deadline was missed, or the displacement of the building's client."""
    late, missed = summary["late_ticks"], summary["missed_ticks"]
    if late is None or (not late and not summary["latency"]):
        return said_beside_client(summary["beside_client"])
    ticks = max(run.ticks(topic) for topic in run.columns if kind_of(topic) == LATENCY)
    return f"{late} of {ticks} ticks were late, {missed} of them missed altogether."


def tracking(summary: Summary) -> list[str]:
    """How the transfer systems followed their targets."""
    return [followed(of_whom(name), facts) for name, facts in summary["tracking"].items()]


def of_whom(name: str) -> str:
    """The name of a transfer system in words: `table of slave roof` for `table.roof`."""
    system, _, slave = name.partition(".")
    if slave == SLAVE:
        return f"{system} of the slave"
    return f"{system} of slave {slave}" if slave else system


def followed(name: str, facts: Mapping[str, Any]) -> str:
    """How one transfer system followed its target."""
    error = f"rms error {100.0 * facts['nrmse']:.2f} % of the target's rms"
    if facts["delay"] is None:
        return f"The delay of the {name} is not determined: {facts['undetermined']}; {error}."
    way = "lead" if facts["delay"] < 0.0 else "delay"
    return (
        f"The {name} followed its target with a {way} of {milliseconds(abs(facts['delay']))} and "
        f"{facts['amplitude']:.4f} of its amplitude at {facts['frequency']:.2f} Hz; {error}."
    )


def force_paths(summary: Summary) -> list[str]:
    """How late the measured force of each column was; the tracking of displacements does not show it."""
    paths = summary["force_paths"]
    lead = {name: f"{of_whom(name).capitalize()}: " if len(paths) > 1 else "" for name in paths}
    return [
        lead[name] + force_sentence(found["delay"], found["interval"], found["gain"])
        for name, found in paths.items()
    ]


def energy(summary: Summary) -> str:
    """The energy that errors of the column's transfer system put in or took out."""
    share = summary["error_energy"]
    if share is None:
        return ""
    did = "put in" if share > 0.0 else "took out"
    return (
        f"Tracking errors at {summary['error_energy_at']} {did} up to {abs(share) * 100.0:.2f} % of the energy that "
        "the ground motion gave."
    )


def margins(run: Run, summary: Summary) -> list[Margin]:
    """Recorded signals with a limit of their own, the nearest to it first."""
    peaks, plan = summary["peaks"], whole_plan(run)
    if plan is None:
        return []
    labs = {lab.topic: lab for lab in laboratories(run)}
    channels = labs[MASTER].channels if MASTER in labs else None
    own = (channels.target.name, *channels.drives, *channels.names) if channels else ()
    of_slaves = {name.partition("/")[2] for name in peaks if name.startswith(SLAVE)}.difference(own)
    found = []
    for name, facts in peaks.items():
        topic, _, signal = name.partition("/")
        of_all_slaves = topic == MASTER and signal in of_slaves  # one row for all slaves together
        limit = limits(plan, labs.get(topic)).get(signal)
        if limit is not None and not of_all_slaves and math.isfinite(facts["peak"]):
            found.append(Margin(name, facts["peak"], limit, facts["unit"]))
    return sorted(found, key=lambda item: -item.share)


def nearest(run: Run, summary: Summary) -> str:
    """The signal that came nearest to its limit."""
    found = margins(run, summary)
    if not found:
        return ""
    first = found[0]
    unit, twice = first.unit, [item for item in found if item.words == first.words]
    of = f" of the {first.signal.partition('/')[0]}" if len(twice) > 1 else ""
    return (
        f"Nearest to its limit came the {first.words}{of}: {quantity(first.peak, unit)} of "
        f"{quantity(first.limit, unit)} "
        f"({100.0 * first.share:.0f} %)."
    )
