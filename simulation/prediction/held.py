"""Whether a prediction held: which signals of a recording left their bands, when and how far, and what follows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from common.errors import InputError
from common.recording.holds import before_hold
from common.recording.run import Run, Values
from common.roles import MASTER, name_of
from simulation.prediction import file
from simulation.prediction.bands import HELD
from simulation.prediction.shape import ErrorShape, shape_of

# Mean share of the time, over all signals, that must lie inside a band of 90 % for a prediction to hold. It is less
# than 90 %, because the error of a signal changes slowly, so that the share scatters from test to test.
ENOUGH = HELD - 0.1
# The same for each single signal: a parameter at the end of its interval still leaves a signal inside for more than
# half of the time.
LEAST = 0.5
GAP = 0.1  # s, between two times outside that count as one departure: a fifth of a period of the default building
SHORT = 0.02  # s, longest departure that is ignored, because sensor noise alone causes it now and then
# Width of a band over the peak of its signal below which the signal counts as exact and has no band: rounding only.
NARROW = 1e-6


class Departure(NamedTuple):
    """A time in which a signal lay outside its band, s, and its largest distance over the band's half width."""

    start: float
    end: float
    distance: float


class HeldSignal(NamedTuple):
    """How one signal compares with its band."""

    topic: str
    inside: float  # share of the time inside the band
    departures: tuple[Departure, ...]  # those longer than `SHORT`, in the order of time
    farthest: float  # largest distance from the band over its half width, 0 where it was never left
    farthest_at: float  # s
    unit: str
    peak: float  # largest magnitude that was measured
    shape: ErrorShape  # of its error against the prediction


class Band(NamedTuple):
    """The prediction of one signal, each (ticks, storeys or slaves)."""

    low: Values
    middle: Values
    high: Values


class Held(NamedTuple):
    """How a recording compares with a prediction."""

    ticks: int
    signals: dict[str, HeldSignal]
    inside: float  # mean share over the signals
    held: bool  # whether the prediction held
    figures: Mapping[str, Any]  # those that the prediction's file holds
    same_plan: bool  # whether the test and the prediction have the same plan
    stood: float | None = None  # test time (s) of the first hold, up to which is compared; None without one


def held(measured: Run, predicted: Run) -> Held:
    """Compare a recording, up to its first hold, with a prediction.

    Raises:
        InputError: `predicted` is no prediction, or it has no tick and signal in common with `measured`.
    """
    figures = file.about(predicted)
    if file.ABOUT in measured.metadata:
        raise InputError(
            f"{measured.path} is itself a prediction: give the recording of the test that was run."
        )
    measured, stood = before_hold(measured)
    found: dict[str, HeldSignal] = {}
    ticks = 0
    for topic in (MASTER, *measured.roles):
        if not (measured.has(topic) and predicted.has(file.band_topic(file.LOWER, topic))):
            continue
        count, signals = of_topic(measured, predicted, topic)
        ticks = max(ticks, count)
        found |= {name: one for name, one in signals.items() if name not in found}
    if not found:
        raise InputError(f"{measured.path} and {predicted.path} have no tick and signal in common.")
    inside = float(np.mean([one.inside for one in found.values()]))
    fine = inside >= ENOUGH and all(one.inside >= LEAST for one in found.values())
    return Held(ticks, found, inside, fine, figures, same_plan(measured, predicted), stood)


def of_topic(measured: Run, predicted: Run, topic: str) -> tuple[int, dict[str, HeldSignal]]:
    """The ticks in common and the signals of one topic by name, those of a named slave as `NAME.signal`."""
    ends = [*(file.band_topic(end, topic) for end in (file.LOWER, file.UPPER)), topic]
    ticks, mine, theirs = np.intersect1d(
        measured.sequences[topic], predicted.sequences[ends[0]], return_indices=True
    )
    if not ticks.size:
        return 0, {}
    times = measured.columns[topic]["t"][mine]
    result = {}
    for name, unit in measured.units[topic].items():
        low, high, middle = (predicted.columns[end].get(name) for end in ends)
        values = measured.columns[topic].get(name)
        if unit in ("", "s") or low is None or high is None or middle is None or values is None:
            continue
        if values.shape[1:] != low.shape[1:] or not np.issubdtype(values.dtype, np.floating):
            continue
        band = Band(*(end[theirs].reshape(ticks.size, -1) for end in (low, middle, high)))
        if np.max(band.high - band.low) > NARROW * max(float(np.max(np.abs(band.high))), 1e-300):
            label = f"{name_of(topic)}.{name}" if name_of(topic) else name
            result[label] = of_signal(times, values[mine].reshape(ticks.size, -1), band, topic, unit)
    return int(ticks.size), result


def of_signal(t: Values, values: Values, band: Band, topic: str, unit: str) -> HeldSignal:
    """Compare one signal, (ticks, storeys or slaves), with its band."""
    low, middle, high = band
    half = 0.5 * (high - low)
    usual = float(np.median(half)) or float(np.max(half))
    beyond = np.maximum(np.maximum(low - values, values - high), 0.0)
    distance = np.max(beyond / np.maximum(half, 0.1 * usual), axis=1)
    outside = np.any(beyond > 0.0, axis=1)
    share = float(np.mean(beyond <= 0.0))
    at = int(np.argmax(distance))
    return HeldSignal(
        topic,
        share,
        tuple(departures(t, outside, distance)),
        float(distance[at]),
        float(t[at]),
        unit,
        float(np.max(np.abs(values))),
        shape_of(values, middle, t),
    )


def departures(t: Values, outside: Values, distance: Values) -> list[Departure]:
    """The times outside the band that last longer than `SHORT`; those at most `GAP` apart count as one."""
    places = np.flatnonzero(outside)
    if not places.size:
        return []
    interval = float(np.median(np.diff(t))) if t.size > 1 else 0.0
    breaks = np.flatnonzero(np.diff(places) > 1)
    runs = [
        (int(run[0]), int(run[-1]))
        for run in np.split(places, breaks + 1)
        if (run[-1] - run[0] + 1) * interval > SHORT
    ]
    joined: list[tuple[int, int]] = []
    for first, last in runs:
        if joined and t[first] - t[joined[-1][1]] <= GAP:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return [
        Departure(float(t[first]), float(t[last]), float(np.max(distance[first : last + 1])))
        for first, last in joined
    ]


def same_plan(measured: Run, predicted: Run) -> bool:
    """Whether a test and a prediction have the same plan."""
    one, other = (run.metadata.get("plan", {}).get("digest") for run in (measured, predicted))
    return bool(one == other)


def plain(found: Held) -> dict[str, Any]:
    """The comparison as plain values for JSON."""
    return {
        "ticks": found.ticks,
        "held": found.held,
        "inside": found.inside,
        "signals": {
            name: {
                "inside": one.inside,
                "farthest": one.farthest,
                "farthest_at": one.farthest_at,
                "peak": one.peak,
                "error": one.shape._asdict(),
                "outside": [departure._asdict() for departure in one.departures],
            }
            for name, one in found.signals.items()
        },
    }
