"""Signals of a recording for the pictures: signals over time, and each transfer system's motion beside its target."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from common.recording.run import Run
from report.text.formats import milliseconds

if TYPE_CHECKING:
    from report.facts.laboratories import LaboratoryFacts

Values = NDArray[np.float64]

STRONGEST = 1.5  # s before and after the largest target: six periods of a building of 2 Hz
LATE = 1  # ticks from a command to the measurement at which it should be reached


class Curve(NamedTuple):
    """A signal over test time."""

    t: Values  # (n,) s
    values: Values  # (n,) or (n, storeys), SI


class Pair(NamedTuple):
    """A transfer system's measured motion beside the wanted one at the same moments."""

    label: str
    word: str  # which signal is wanted: the target, or the command where no target is recorded
    lab: LaboratoryFacts
    t: Values  # (n,) s, of the measurement
    wanted: Values  # (n,) m
    got: Values  # (n,) m

    @property
    def error(self) -> Values:
        """Measured less wanted, (n,) m."""
        return self.got - self.wanted

    def strongest(self) -> NDArray[np.bool_]:
        """The ticks around the largest target, (n,)."""
        middle = self.t[int(np.nanargmax(np.abs(self.wanted)))]
        return np.asarray(np.abs(self.t - middle) <= STRONGEST)


def curve(recording: Run, topic: str, name: str) -> Curve | None:
    """A signal of a topic; None where it has no value over time."""
    columns = recording.columns.get(topic, {})
    if name in columns and "t" in columns and np.isfinite(columns[name]).any():
        return Curve(columns["t"], columns[name])
    return None


def moving(recording: Run, topic: str, name: str) -> Curve | None:
    """A signal that is not constant; None for any other."""
    found = curve(recording, topic, name)
    return found if found is not None and np.nanmax(found.values) > np.nanmin(found.values) else None


def pairs(recording: Run) -> list[Pair]:
    """The transfer systems that a recording shows, at most one of each laboratory."""
    found = []
    for lab in labs_of(recording):
        options = (
            (lab.channels.target.name, "target", lab.late),
            (lab.channels.command.name, "command", LATE),
        )
        made = (matched(recording, lab, option) for option in options)
        found += [pair for pair in made if pair is not None][:1]
    return found


def matched(recording: Run, lab: LaboratoryFacts, asked: tuple[str, str, int]) -> Pair | None:
    """A laboratory's position beside the signal that asked for it; None where one of them is missing or constant."""
    topic, measured = lab.topic, lab.channels.position
    columns, (name, word, late) = recording.columns.get(topic, {}), asked
    if not {"t", name, measured} <= columns.keys():
        return None
    seq = recording.sequences[topic]
    _, before, after = np.intersect1d(seq + late, seq, return_indices=True)
    pair = Pair(lab.label, word, lab, columns["t"][after], columns[name][before], columns[measured][after])
    known = np.isfinite(pair.wanted) & np.isfinite(pair.got)
    if not known.any() or not np.ptp(pair.wanted[known]) or not np.ptp(pair.got[known]):
        return None
    return pair


def quality(pair: Pair) -> str:
    """Delay, amplitude and error of a transfer system in words, as `inspect` has them; empty where undefined."""
    from models import indicators
    from report.facts.summary import LEAST_TICKS, following

    if pair.t.size < LEAST_TICKS:
        return ""
    try:
        error = indicators.nrmse(pair.wanted, pair.got)
    except InputError:
        return ""
    path = following(pair.wanted, pair.got, interval(pair.t))
    size = "" if path["delay"] is None else f"\namplitude {path['amplitude']:.3f}"
    return f"delay {milliseconds(path['delay'])}{size}\nNRMSE {100.0 * error:.1f} %"


def interval(t: Values) -> float:
    """The usual distance of two ticks, s; NaN for a single one."""
    return float(np.median(np.diff(t))) if t.size > 1 else float("nan")


def planned(recording: Run) -> Any:
    """The plan inside a recording, None where there is none that can be read."""
    from report.facts.laboratories import plan_of

    try:
        return plan_of(recording)
    except InputError:
        return None


def labs_of(recording: Run) -> list[LaboratoryFacts]:
    """The laboratories of a recording; those of the default test where its plan cannot be read."""
    from report.facts.laboratories import laboratories

    try:
        return laboratories(recording)
    except InputError:
        return laboratories(replace(recording, metadata={}))
