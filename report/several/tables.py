"""Tables of several recordings: peaks, indicators of tracking, and keys in which their plans differ."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from common.plan.plan import Plan
from common.plan.plan_difference import VERSION, leaves
from models.indicators import nrmse
from report.several.runs import ChosenSignal, OneRun
from report.text.formats import quantity, tracked
from report.text.terminal import TitledTable

NOTHING = "–"
DEFAULT = "default"


def shown(value: float, unit: str, signal: ChosenSignal) -> str:
    """A value (SI) in the unit chosen, or with the prefix that suits it."""
    return f"{value / signal.factor:.4g} {signal.unit}" if signal.unit else quantity(value, unit)


def all_of(runs: Sequence[OneRun], signals: Sequence[ChosenSignal]) -> list[TitledTable]:
    """All tables that have rows."""
    found = (peaks(runs, signals), differences(runs, signals), followed(runs), plans(runs))
    return [one for one in found if one.rows]


def peaks(runs: Sequence[OneRun], signals: Sequence[ChosenSignal]) -> TitledTable:
    """The circumstances of each recording and the largest magnitude of each signal."""
    rows = []
    for run in runs:
        cells = [
            shown(value, run.units[one.name], one) if (value := peak(run, one.name)) is not None else NOTHING
            for one in signals
        ]
        rows.append([run.label, *(run.facts[name] or NOTHING for name in run.facts), *cells])
    return TitledTable("Peaks", ["recording", *runs[0].facts, *(one.name for one in signals)], rows)


def peak(run: OneRun, name: str) -> float | None:
    """The largest magnitude of a signal (SI); None where the recording does not contain it."""
    if name not in run.signals:
        return None
    return float(np.nanmax(np.abs(run.signals[name]), initial=0.0))


def differences(runs: Sequence[OneRun], signals: Sequence[ChosenSignal]) -> TitledTable:
    """The rms of each signal's difference from the first recording over the rms there, at times that both have."""
    first = runs[0]
    rows = [[run.label, *(share(differing(first, run, one.name)) for one in signals)] for run in runs[1:]]
    return TitledTable(
        f"Differences from {first.label} (NRMSE)", ["recording", *(one.name for one in signals)], rows
    )


def differing(first: OneRun, run: OneRun, name: str) -> float | None:
    """The NRMSE of one signal, None where one lacks it or the first is zero; other intervals are interpolated."""
    if name not in first.signals or name not in run.signals:
        return None
    time = first.time[name][first.time[name] <= run.time[name][-1]]
    wanted, got = first.signals[name][: time.size], np.interp(time, run.time[name], run.signals[name])
    both = np.isfinite(wanted) & np.isfinite(got)
    return float(nrmse(wanted[both], got[both])) if both.any() and np.any(wanted[both]) else None


def share(value: float | None) -> str:
    """An NRMSE as text."""
    return NOTHING if value is None else f"{value:.4g}"


def followed(runs: Sequence[OneRun]) -> TitledTable:
    """How each transfer system followed its target, as `rths inspect` says it."""
    rows = [[run.label, part, *tracked(facts)] for run in runs for part, facts in run.tracking.items()]
    head = ["recording", "system", "delay", "by correlation", "amplitude", "at", "NRMSE", "peak error"]
    return TitledTable("Tracking", head, rows)


def plans(runs: Sequence[OneRun]) -> TitledTable:
    """The keys in which the plans differ, a column for each recording; a plan may have no such key."""
    known = dict(leaves(Plan().tables()))
    keys = [key for key in dict.fromkeys(key for run in runs for key in run.plan) if key != VERSION]
    rows = [
        [key, *(run.plan.get(key, DEFAULT if key in known else NOTHING) for run in runs)]
        for key in sorted(keys)
    ]
    rows = [row for row in rows if len(set(row[1:])) > 1]
    return TitledTable("Plans", ["key", *(run.label for run in runs)], rows)


def long(
    runs: Sequence[OneRun], signals: Sequence[ChosenSignal]
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """All histories as one table for other programs, and the units of its columns.

    The columns are `recording`, `t` (s since the start) and the signals in their units; the times are those of
    the first signal of each recording, at which others are interpolated.
    """
    parts = []
    for run in runs:
        here = [one for one in signals if one.name in run.signals]
        if here:
            time = run.time[here[0].name]
            parts.append(
                (
                    run,
                    time,
                    {one.name: np.interp(time, run.time[one.name], run.signals[one.name]) for one in here},
                )
            )
    columns = {
        "recording": np.concatenate([np.full(time.size, run.label, dtype=object) for run, time, _ in parts]),
        "t": np.concatenate([time for _, time, _ in parts]),
    }
    for one in signals:
        values = [found.get(one.name, np.full(time.size, np.nan)) / one.factor for _, time, found in parts]
        columns[one.name] = np.concatenate(values)
    units = {name: unit for run in runs for name, unit in run.units.items()}
    return columns, {"t": "s"} | {one.name: one.unit or units[one.name] for one in signals}


def plain(runs: Sequence[OneRun], signals: Sequence[ChosenSignal]) -> list[dict[str, Any]]:
    """All figures of the tables as plain values in SI units, one record for each recording."""
    return [
        {"recording": run.label, **run.facts}
        | {"peaks": {one.name: peak(run, one.name) for one in signals}}
        | {"units": {one.name: run.units.get(one.name) for one in signals}}
        | {"nrmse": {one.name: differing(runs[0], run, one.name) for one in signals}}
        | {"tracking": run.tracking, "plan": run.plan}
        for run in runs
    ]
