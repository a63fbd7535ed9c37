"""The low-pass filter that readings of a logger passed, from what they would be without it.

What a model errs by is a part of the residual, band by band of the spectrum, so that only what all frequencies say
together speaks for a filter. Hypotheses are weighed by Whittle's likelihood of a residual of unknown spectrum:

    2·Σ lines of a band · log(mean square residual of the band) + Σ z²

Source: P. Whittle, Arkiv för Matematik 2 (1953).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.recording.imported import NOTHING_STATED, ImportedChannel
from common.recording.logger.low_pass import FILTERS, LoggerFilter
from diagnosis.signals.mask import Mask
from models.registry import Array

Lines = NDArray[np.complex128]

# Types and orders of filters: of slow motion one of these passes as much as one with a ripple does, to half a per cent.
KINDS = FILTERS[:2]
SHAPES = tuple(itertools.product(KINDS, range(1, 9)))
USUAL = 4  # order by which the delay is found before others are tried
# s, by which a filter delays slow motion: from a quarter of a usual interval to one of the eighth order and 20 Hz.
LATES = tuple(float(late) for late in np.geomspace(5e-4, 0.04, 10))
# Hz, lowest frequency that tells of a filter and highest one at which a laboratory moves, and bands between them.
LOWEST, HIGHEST, BANDS = 0.5, 80.0, 16
# Independent lines per line of a spectrum behind Hann's window, whose neighbours share energy (F. J. Harris,
# Proceedings of the IEEE 66 (1978), 51-83).
OWN = 2.0 / 3.0
NARROW = 4  # lines, over which what a filter passes changes by little
ROUNDS = 2  # of fits, each weighted by what the one before it leaves
FREE = 1e-6  # of what a known parameter weighs, weight of one that may have any value
SMALLEST = 1e-4  # of a reading, residual that counts: four digits of a text file
GOLDEN, DIVISIONS = 0.5 * (math.sqrt(5.0) - 1.0), 7  # which leave a thirtieth of a range


class ReadSpectra(NamedTuple):
    """Spectra of readings of one laboratory."""

    frequency: Array  # (lines,) Hz
    read: Lines  # (lines, readings)
    true: Lines  # (lines, readings) without a filter
    # (2, lines · readings, parameters) real and imaginary parts of these over parameters that err by about one
    slopes: Array
    starts: NDArray[np.int64]  # (bands,) first line of each band
    bins: NDArray[
        np.int64
    ]  # (bins,) first line of each of the bins in bands over which no filter changes much
    products: Array  # (bins, readings, parameters, parameters) of slopes with one another, summed over bins
    noisy: bool  # whether the readings without a filter hold noise that those recorded need not have
    rounds: int = ROUNDS  # of fits of the parameters, one where these are nearly at their best


def spectra(
    read: Array,
    true: Array,
    slopes: Array,
    interval: float,
    highest: float = HIGHEST,
    bands: int = BANDS,
    *,
    noisy: bool = False,
) -> ReadSpectra:
    """Spectra up to `highest` (Hz) of readings as recorded and without a filter (ticks, readings).

    `slopes` (ticks, readings, parameters) are those of the latter over parameters that err by about one. Where the
    latter are `noisy`, a band tells of a filter only as far as the two go together.
    """
    frequency: Array = np.asarray(np.fft.rfftfreq(len(read), interval), dtype=np.float64)
    kept = (frequency >= LOWEST) & (frequency <= highest)
    window = np.hanning(len(read))

    def lines(values: Array) -> Lines:
        shaped = values * window.reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray(np.fft.rfft(shaped, axis=0)[kept])

    frequency = frequency[kept]
    edges = np.geomspace(frequency[0], frequency[-1], bands + 1)[:-1]
    starts = np.unique(np.searchsorted(frequency, edges))
    bins = np.union1d(starts, np.arange(0, frequency.size, NARROW))
    moved = lines(slopes)
    products = np.add.reduceat(np.einsum("frp,frq->frpq", moved.conj(), moved).real, bins)
    flat = moved.reshape(moved.shape[0] * moved.shape[1], moved.shape[2])
    parts = np.stack([flat.real, flat.imag])
    return ReadSpectra(frequency, lines(read), lines(true), parts, starts, bins, products, noisy)


def surprise(of: ReadSpectra, channel: ImportedChannel) -> float:
    """−2·log of how probable the readings are behind a filter or delay, at the best parameters, up to a constant."""
    return weighed(of, behind(of, channel))


def surprise_as_is(of: ReadSpectra) -> float:
    """The same without a filter or delay, and with the parameters where they are."""
    level = np.maximum(squares(of, of.read - of.true), SMALLEST**2 * squares(of, of.read))
    return weighed(of, Unlike(level, 0.0))


def surprises(of: Sequence[ReadSpectra], channel: ImportedChannel) -> float:
    """The same of several readings that passed one filter or delay."""
    return sum(surprise(one, channel) for one in of)


def surprise_unknown(of: ReadSpectra) -> float:
    """The same without a filter or delay where any one parameter may have any value, the best of them."""
    return min(weighed(of, behind(of, NOTHING_STATED, free)) for free in range(of.slopes.shape[2]))


def missed(of: ReadSpectra, channel: ImportedChannel) -> float:
    """Largest share of a reading's rms that is left behind a filter or delay, at the best parameters."""
    rest, whole = (counts(of) @ level for level in (behind(of, channel).level, squares(of, of.read)))
    return float(np.sqrt(np.max(rest / whole)))


class Unlike(NamedTuple):
    """What readings differ by from what they would be."""

    level: Array  # (bands, readings) mean square
    prior: float  # Σ z² of the parameters


def behind(of: ReadSpectra, channel: ImportedChannel, free: int | None = None) -> Unlike:
    """What is left of readings behind a filter or delay, at the best parameters, of which one may be `free`."""
    passed = channel.response(of.frequency)[:, None]
    left = of.read - passed * of.true
    least, most = SMALLEST**2 * squares(of, of.read), highest(of)
    known = np.arange(of.slopes.shape[2]) != free
    found = [Unlike(np.maximum(squares(of, left), least), 0.0)]
    for _ in range(of.rounds):
        # a band whose noise hides how the two go together tells nothing of a parameter, which would shrink that noise
        level = np.where(found[-1].level < most, found[-1].level, math.inf)
        z = fitted(of, passed, left, level, known)
        real, imaginary = (of.slopes @ z).reshape(2, *left.shape)
        rest = left - passed * (real + 1j * imaginary)
        found.append(Unlike(np.maximum(squares(of, rest), least), float(z[known] @ z[known])))
    return min(found, key=lambda one: weighed(of, one))


def highest(of: ReadSpectra) -> Array:
    """Mean square (bands, readings) from which on nothing of a reading goes together with what it would be."""
    return squares(of, of.read) if of.noisy else np.full((of.starts.size, of.read.shape[1]), math.inf)


def weighed(of: ReadSpectra, left: Unlike) -> float:
    """−2·log of the probability of what is left, and of the parameters."""
    level = np.minimum(left.level, highest(of))
    return 2.0 * OWN * float(np.sum(counts(of) @ np.log(level))) + left.prior


def likelier_whole(of: ReadSpectra, less: ReadSpectra) -> float:
    """2·log of how much likelier what readings would be is by itself than with what was taken from it in `less`.

    What takes away a part of a signal leaves less, and what was recorded of that part with noise of its own adds this.
    """
    whole, rest = (
        np.maximum(squares(one, one.true), SMALLEST**2 * squares(of, of.read)) for one in (of, less)
    )
    return 2.0 * OWN * float(np.sum(counts(of) @ np.log(rest / whole)))


def counts(of: ReadSpectra) -> NDArray[np.int64]:
    """Lines of each band (bands,)."""
    return np.diff(np.append(of.starts, of.frequency.size))


def squares(of: ReadSpectra, values: Lines) -> Array:
    """Mean square of each band (bands, readings)."""
    energy = np.add.reduceat(np.square(values.real) + np.square(values.imag), of.starts)
    return np.asarray(energy / counts(of)[:, None])


def fitted(of: ReadSpectra, passed: Lines, left: Lines, level: Array, known: Mask) -> Array:
    """Parameters (parameters,) that leave the least behind what `passed` (lines, 1), of what is `left` without them.

    `level` (bands, readings) are mean squares of the rest. Parameters that are not `known` may err by anything.
    """
    power = np.square(passed.real) + np.square(passed.imag)
    weights = 2.0 * OWN / level
    lines = np.diff(np.append(of.bins, of.frequency.size))[:, None]
    own = np.add.reduceat(power, of.bins) / lines * weights[np.searchsorted(of.starts, of.bins, "right") - 1]
    square = np.einsum("br,brpq->pq", own, of.products) + np.diag(np.where(known, 1.0, FREE))
    back = np.repeat(weights, counts(of), axis=0) * passed.conj() * left
    along = back.real.ravel() @ of.slopes[0] + back.imag.ravel() @ of.slopes[1]
    return np.asarray(np.linalg.solve(square, along))


Shape = Callable[[float], ImportedChannel]  # a filter by the time (s) that it delays slow motion by


def like(one: LoggerFilter) -> Shape:
    """Filters of the type, order and ripple of one."""
    usual = ImportedChannel(replace(one, cutoff=1.0)).late
    return lambda late: ImportedChannel(replace(one, cutoff=usual / late))


def shape(kind: str, order: int) -> Shape:
    """Filters of a type and an order, or delays alone where the order is 0."""
    if order == 0:
        return lambda late: ImportedChannel(delay=late)
    return like(LoggerFilter(kind, order, 1.0))


def means(times: int) -> Shape:
    """Means of means over time, so many times."""
    return lambda late: ImportedChannel(average=2.0 * late / times, means=times)


ROUGH = (shape("", 0), *(shape(kind, USUAL) for kind in KINDS))


class Said(NamedTuple):
    """What readings say of the filter that they passed."""

    late: float  # s, by which it delays slow motion, of those that are tried
    surprise: float
    gain: float  # by how much less surprising they are behind it than with nothing


def roughly(*of: ReadSpectra) -> Said:
    """The likeliest filter of a usual order, or delay alone, that readings passed."""
    tried = {late: min(surprises(of, one(late)) for one in ROUGH) for late in LATES}
    late = min(tried, key=lambda late: tried[late])
    return Said(late, tried[late], surprises(of, NOTHING_STATED) - tried[late])


def likeliest(late: float, beyond: float, *of: ReadSpectra) -> ImportedChannel:
    """The filter or mean behind which readings are least surprising, of those that delay by about `late` s.

    It is a delay alone where none makes them less surprising by more than `beyond`.
    """
    place = LATES.index(late)
    low, high = LATES[max(0, place - 1)], LATES[min(place + 1, len(LATES) - 1)]
    alone, *filters = (
        closest(partial(surprises, of), one, low, high)
        for one in (shape("", 0), means(1), *itertools.starmap(shape, SHAPES))
    )
    best = min(filters, key=lambda item: item[1])
    return best[0] if best[1] < alone[1] - beyond else alone[0]


def delay(of: ReadSpectra) -> ImportedChannel:
    """The delay alone behind which readings are least surprising."""
    said, alone = partial(surprise, of), shape("", 0)
    place = min(range(len(LATES)), key=lambda place: said(alone(LATES[place])))
    low, high = LATES[max(0, place - 1)], LATES[min(place + 1, len(LATES) - 1)]
    return closest(said, alone, low, high)[0]


def closest(
    said: Callable[[ImportedChannel], float], of: Shape, low: float, high: float
) -> tuple[ImportedChannel, float]:
    """The filter of a shape, late by `low` to `high` s, of which least is said, and that, by golden sections."""

    def of_late(late: float) -> tuple[ImportedChannel, float]:
        channel = of(late)
        return channel, said(channel)

    places = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    inner = list(map(of_late, places))
    for _ in range(DIVISIONS):
        if inner[0][1] < inner[1][1]:
            high = places[1]
            places = [high - GOLDEN * (high - low), places[0]]
            inner = [of_late(places[0]), inner[0]]
        else:
            low = places[0]
            places = [places[1], low + GOLDEN * (high - low)]
            inner = [inner[1], of_late(places[1])]
    return min(inner, key=lambda item: item[1])
