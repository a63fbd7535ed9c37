"""The latency in a recording: the segments of every exchange, late ticks, and the state of the machines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from common.recording.run import Run, Values
from common.roles import MASTER, latency_topic, name_of
from report.budget.limits import PERCENTILES, WAITS
from report.facts.circumstances import NO_LATENCY, VIRTUAL, clock_of

Numbers = NDArray[np.float64]
RECORD = "real_time"
BARE = "bare_loop"
FLUSH_NS = 1_000_000_000  # ns that a cut-off recording may lack at its end: the recorder's longest time between flushes
LEAST = 1e-9  # s, the resolution of the clocks, in place of percentiles of zero, which have no logarithm


@dataclass(frozen=True)
class Bare:
    """Lateness of the bare timing loop (s); `late` ticks passed before it woke and are not counted in `ticks`."""

    ticks: int
    late: int
    interval: float
    percentiles: dict[str, float]
    most: float

    @property
    def late_share(self) -> float:
        """Share of its ticks that passed before it woke."""
        return self.late / (self.ticks + self.late)

    @property
    def longest_gap(self) -> int:
        """Ticks that its longest lateness spans."""
        return math.ceil(self.most / self.interval - 1e-9)

    def plain(self) -> dict[str, float]:
        """The same as plain values."""
        counted = {
            "ticks": self.ticks,
            "late": self.late,
            "late_share": self.late_share,
            "interval": self.interval,
        }
        return counted | self.percentiles | {"max": self.most}

    def share_beyond(self, lateness: float) -> float:
        """Share of the ticks that did not pass before it woke in which it was later than this (s).

        A power law between the percentiles, down to a single tick at the maximum; late ticks lie beyond the interval.
        """
        known = [
            (self.percentiles[name], 1.0 - rank / 100.0 - self.late_share)
            for name, rank in PERCENTILES.items()
            if self.percentiles[name] < self.interval and 1.0 - rank / 100.0 > self.late_share
        ]
        end, least = min(self.most, self.interval), 1.0 / self.ticks
        if lateness >= end:
            return 0.0
        if not known or lateness < known[0][0]:
            return 1.0
        at = np.log(np.maximum([*(value for value, _ in known), end], LEAST))
        shares = np.log([*(max(share / (1.0 - self.late_share), least) for _, share in known), least])
        return float(np.exp(np.interp(math.log(max(lateness, LEAST)), at, shares)))


@dataclass(frozen=True)
class ExchangeTicks:
    """The ticks of the master with one slave; `name` is empty where there is only one.

    A tick without a row of latency counts as late, since nothing shows that it was answered.
    """

    name: str
    ticks: int
    unrecorded: int  # of these, ticks without a row
    # s, per tick in order, NaN where it was not measured; segments that were never measured are left out
    segments: dict[str, Numbers]
    late: NDArray[np.bool_] | None  # per tick, in order
    missed: NDArray[np.bool_] | None  # per row, in order

    @property
    def silent(self) -> bool:
        """Whether the recording has no row at all."""
        return self.unrecorded == self.ticks

    def calm(self, interval: float) -> NDArray[np.bool_]:
        """Ticks at whose start and at the end of which the master woke within an interval (s); all where unknown."""
        wake = self.segments.get("wake_lateness", np.zeros(self.ticks))
        in_time: NDArray[np.bool_] = ~(wake >= interval)
        in_time[:-1] &= in_time[1:].copy()
        return in_time

    def label(self, text: str) -> str:
        """`text`, led by the slave's name where there are several."""
        return f"{self.name}/{text}" if self.name else text


@dataclass(frozen=True)
class Figures:
    """Everything in a recording that a budget judges; `stolen` and `schedulers` by laboratory."""

    recording: str
    exchanges: list[ExchangeTicks]
    bare: Bare | None = None
    stolen: dict[str, float] = field(default_factory=dict)
    schedulers: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    virtual: bool = False


def figures(run: Run) -> Figures:
    """The figures of a recording.

    Raises:
        InputError: it has no latency of any tick.
    """
    topics = [latency_topic(role) for role in run.roles]
    if not topics:
        raise InputError(
            f"{run.path} is of a test without slaves, which has no latency: a budget judges the exchange with them."
        )
    if not any(run.has(topic) for topic in topics):
        raise InputError(
            f"{run.path} holds no latency of any tick: give the recording of a whole test, as rths run makes it."
        )
    ticks = np.unique(np.concatenate([numbers(run, topic) for topic in (MASTER, *topics)]))
    exchanges = [exchange(run, topic, expected(run, topic, ticks)) for topic in topics]
    record = run.metadata.get(RECORD) or from_events(run)
    stolen = {lab: number(record, f"{lab}.stolen_share") for lab in labs(record, "stolen_share")}
    return Figures(
        str(run.path),
        exchanges,
        bare_loop(record),
        {lab: share for lab, share in stolen.items() if share is not None},
        {lab: record[f"{lab}.scheduler"] for lab in labs(record, "scheduler")},
        warnings(run, ticks, exchanges),
        clock_of(run) == VIRTUAL,
    )


def from_events(run: Run) -> dict[str, str]:
    """The numbers of the metadata record, from the events in which the laboratories reported them to the recorder."""
    found: dict[str, str] = {}
    for event in run.events:
        if event["code"] == BARE:
            found |= {f"{BARE}.{name}": repr(value) for name, value in event["values"].items()}
        elif event["code"] == "machine" and "stolen_share" in event["values"]:
            found[f"{event['lab']}.stolen_share"] = repr(event["values"]["stolen_share"])
        elif event["code"] == RECORD and "priority" in event["values"]:
            priority = event["values"]["priority"]
            found[f"{event['lab']}.scheduler"] = f"fifo {priority:.0f}" if priority else "other"
    return found


def labs(record: Mapping[str, str], key: str) -> list[str]:
    """Laboratories of which a metadata record has a key."""
    return sorted(name.removesuffix(f".{key}") for name in record if name.endswith(f".{key}"))


def numbers(run: Run, topic: str) -> Values:
    """The ticks of which a topic has a row, in the order of the file."""
    return run.sequences[topic] if run.has(topic) else np.array([], dtype=np.int64)


def expected(run: Run, topic: str, ticks: Values) -> Values:
    """The ticks for which a topic of latency should have a row: all but those that a cut-off recording had not written.

    These are the last ticks without a row, within the last second of the master's ticks.
    """
    if run.finished or not (run.has(MASTER) and run.has(topic)):
        return ticks
    times = run.log_ns[MASTER]
    written = run.sequences[MASTER][times <= times.max() - FLUSH_NS].max(initial=-1)
    due: Values = ticks[ticks <= max(written, run.sequences[topic].max())]
    return due


def exchange(run: Run, topic: str, ticks: Values) -> ExchangeTicks:
    """The latency of one topic, its rows in order, with those of `ticks` (rising) that it lacks."""
    columns = run.columns[topic] if run.has(topic) else {}
    found = numbers(run, topic)
    absent = np.setdiff1d(ticks, found)
    order = np.argsort(np.concatenate([found, absent]), kind="stable")

    def per_tick(name: str, otherwise: float) -> Values:
        values: Values = np.concatenate([columns[name], np.full(absent.size, otherwise)])[order]
        return values

    segments = {name: per_tick(name, np.nan) for name in WAITS if name in columns}
    late = per_tick("deadline_missed", True).astype(bool) if "deadline_missed" in columns else None
    return ExchangeTicks(
        name=name_of(topic),
        ticks=order.size,
        unrecorded=absent.size,
        segments={name: values for name, values in segments.items() if np.isfinite(values).any()},
        late=order >= found.size if late is None and absent.size else late,
        missed=columns["command_sent_ns"][np.argsort(found, kind="stable")] == 0
        if "command_sent_ns" in columns
        else None,
    )


def measured(values: Numbers) -> Numbers:
    """The values of the ticks in which a segment was measured."""
    return values[np.isfinite(values)]


def number(record: Mapping[str, str], key: str) -> float | None:
    """A number of a metadata record, None where it is absent or none."""
    try:
        value = float(record[key])
    except (KeyError, ValueError):
        return None
    return value if math.isfinite(value) else None


def bare_loop(record: Mapping[str, str]) -> Bare | None:
    """The bare loop of a recording, None where none ran or its numbers are not all there."""
    names = ("ticks", "late", "interval", "max", *PERCENTILES)
    found = {name: number(record, f"{BARE}.{name}") for name in names}
    known = {name: value for name, value in found.items() if value is not None and value >= 0.0}
    if len(known) < len(names) or not known["interval"] or not known["ticks"]:
        return None
    percentiles = {name: known[name] for name in PERCENTILES}
    return Bare(int(known["ticks"]), int(known["late"]), known["interval"], percentiles, known["max"])


def warnings(run: Run, ticks: Values, exchanges: list[ExchangeTicks]) -> list[str]:
    """Sentences on why the figures are not those of the whole test; `ticks` are those with a row of the master."""
    found = (
        [] if run.finished else ["The recording was cut off before its end; its ticks until then are judged."]
    )
    if clock_of(run) == VIRTUAL:
        found.append(f"{NO_LATENCY}: the times above come from the interval and the link's model alone.")
    planned = number(run.metadata.get("summary", {}), "ticks_expected")
    end = int(ticks[-1]) + 1
    if run.finished and planned is not None and end < planned:
        found.append(
            f"The recording ends after {end} of {planned:.0f} planned ticks; its ticks until then are judged."
        )
    if holes := end - ticks.size:
        found.append(f"{holes} ticks are missing from the recording and are not judged.")
    for item in exchanges:
        where = f" with {item.name}" if item.name else ""
        if item.silent:
            found.append(
                f"The recording has no latency of any of the {item.ticks} ticks{where}, which is over any budget."
            )
        elif item.unrecorded:
            found.append(
                f"{item.unrecorded} of {item.ticks} ticks{where} have no row of latency and count as late."
            )
    return found
