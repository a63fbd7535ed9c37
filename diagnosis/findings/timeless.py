"""A report on static data, whose rows follow one another at times without meaning: it holds no seconds and no hertz."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from diagnosis.recorded.record import Record
from diagnosis.report.evidence import Details, OverFrequency, OverTime, PartSeen, Paths, Unknown
from diagnosis.report.fields import Series
from diagnosis.report.records import PartOfGap, Report


def without_times(report: Report, record: Record) -> Report:
    """The report with rows in the place of times, and without windows of time, frequencies, delays and rates."""
    return replace(
        report,
        where=tuple(replace(place, when=(), frequency_band=None) for place in report.where),
        parts=tuple(map(without_lines, report.parts)),
        details=evidence(report.details, record.plan.test.interval),
    )


def without_lines(part: PartOfGap) -> PartOfGap:
    """What the gap of a part is made of, without the frequencies that its sensors pick up."""
    found = {name: replace(noise, lines=()) for name, noise in part.noise_model.items()}
    return replace(part, noise_model=found)


def evidence(details: Details, interval: float) -> Details:
    """The evidence over rows, which stand `interval` seconds apart in the recording."""
    unknowns = tuple(map(without_rates, details.unknowns))
    return replace(
        details,
        test=replace(details.test, static=True, duration=None, interval=None),
        parts=tuple(over_rows(part, interval) for part in details.parts),
        paths=Paths(),
        force_path=None,
        histories=tuple(replace(one, t=rows(one.t, interval)) for one in details.histories),
        unknown=unknowns[0] if unknowns else None,
        unknowns=unknowns,
    )


def over_rows(part: PartSeen, interval: float) -> PartSeen:
    """A site with its readings over rows, and nothing over time or frequency."""
    signals = tuple(replace(one, t=rows(one.t, interval)) for one in part.signals)
    return replace(part, signals=signals, windows=OverTime(), bands=OverFrequency())


def without_rates(found: Unknown) -> Unknown:
    """What no effect explains, without its frequency and its dependence on a rate."""
    kept = tuple(item for item in found.depends_on if item.on not in ("velocity", "acceleration"))
    return replace(found, frequency=None, depends_on=kept)


def rows(t: Sequence[float | None], interval: float) -> Series:
    """The rows that were laid out at these times."""
    return tuple(None if value is None else float(round(value / interval)) for value in t)
