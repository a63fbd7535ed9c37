"""What a recording says about latency: the segments of every exchange, late ticks, and the machine they ran on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from common.recording.reader import Run
from rths.latency_budget.limits import PERCENTILES, WAITS

Numbers = NDArray[np.float64]
TOPIC = "latency"
RECORD = "real_time"
BARE = "bare_loop"
LEAST = 1e-9  # s: percentiles of zero have no logarithm


@dataclass(frozen=True)
class Bare:
    """Lateness of the bare timing loop (s); `late` ticks passed before it woke and are none of its `ticks`."""

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
class Exchange:
    """The ticks of the master with one slave; `name` is empty where there is only one."""

    name: str
    ticks: int
    segments: dict[
        str, Numbers
    ]  # s, per tick in order, NaN where it was not measured; only those measured at all
    late: NDArray[np.bool_] | None  # per tick, in order
    missed: NDArray[np.bool_] | None

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
    """All of a recording that a budget is about; `stolen` and `schedulers` by laboratory."""

    recording: str
    exchanges: list[Exchange]
    bare: Bare | None = None
    stolen: dict[str, float] = field(default_factory=dict)
    schedulers: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)


def figures(run: Run) -> Figures:
    """The figures of a recording.

    Raises:
        InputError: it has no latency of any tick.
    """
    topics = [name for name in run.columns if name == TOPIC or name.startswith(f"{TOPIC}.")]
    exchanges = [exchange(run, topic) for topic in topics if run.has(topic)]
    if not exchanges:
        raise InputError(
            f"{run.path} holds no latency of any tick: give one of a whole test, as rths run makes it."
        )
    record = run.metadata.get(RECORD) or from_events(run)
    stolen = {lab: number(record, f"{lab}.stolen_share") for lab in labs(record, "stolen_share")}
    return Figures(
        str(run.path),
        exchanges,
        bare_loop(record),
        {lab: share for lab, share in stolen.items() if share is not None},
        {lab: record[f"{lab}.scheduler"] for lab in labs(record, "scheduler")},
        warnings(run, exchanges),
    )


def from_events(run: Run) -> dict[str, str]:
    """The same numbers as the metadata record's, from the events by which the laboratories told the recorder."""
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


def exchange(run: Run, topic: str) -> Exchange:
    """The latency of one topic, its ticks in order."""
    columns, order = run.columns[topic], np.argsort(run.sequences[topic], kind="stable")
    segments = {name: columns[name][order].astype(np.float64) for name in WAITS if name in columns}
    return Exchange(
        name=topic.removeprefix(TOPIC).removeprefix("."),
        ticks=order.size,
        segments={name: values for name, values in segments.items() if np.isfinite(values).any()},
        late=columns["deadline_missed"][order].astype(bool) if "deadline_missed" in columns else None,
        missed=columns["command_sent_ns"][order] == 0 if "command_sent_ns" in columns else None,
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


def warnings(run: Run, exchanges: list[Exchange]) -> list[str]:
    """What makes the figures less than those of the whole test, a sentence each."""
    found = [] if run.finished else ["The recording was cut off before its end: judged as far as it goes."]
    for item in exchanges:
        sequence = run.sequences[f"{TOPIC}.{item.name}" if item.name else TOPIC]
        missing = int(np.ptp(sequence)) + 1 - np.unique(sequence).size
        if missing:
            where = f" of {item.name}" if item.name else ""
            found.append(f"{missing} ticks{where} are missing from the recording and are not judged.")
    return found
