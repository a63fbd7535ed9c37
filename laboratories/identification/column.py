"""Stiffness and dissipation of the column from a cyclic loading protocol."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from laboratories.identification import checks, estimate
from laboratories.identification.estimate import Estimate, Identified
from models.registry import Array

LEAST = 20  # samples of a regression line: with fewer its interval is very uncertain
RETURN = 0.3  # share of the smallest amplitude by which the motion must reverse to count: above noise, below a cycle
# Relative deviation of a cycle's amplitude from the protocol's: the paper's amplitudes differ by 20 % and more.
MATCH = 0.2
# samples of a cycle per sample of the average at its peaks, in which a sine falls by 2e-5 of its amplitude
SMOOTH = 250
INCOMPLETE = 0.1  # of the smallest amplitude: a last cycle that ends farther from zero is not complete


class Cycle(NamedTuple):
    """One cycle of the protocol."""

    begin: int  # tick of its beginning
    end: int  # tick after its end
    nominal: float  # amplitude of the protocol, m
    amplitude: float  # half of peak to peak, m
    stiffness: float  # secant, peak to peak, N/m
    area: float  # dissipated, J
    damping_ratio: float  # equivalent viscous, area/(2π·k_s·a²)


@dataclass(frozen=True)
class CyclicTest:
    """The results of a cyclic test."""

    stiffness: Estimate  # elastic, N/m
    cycles: tuple[Cycle, ...]


def cycles(deformation: Array, force: Array, amplitudes: Sequence[float]) -> CyclicTest:
    """Elastic stiffness and, cycle by cycle, secant stiffness, dissipated energy and equivalent damping.

    `deformation` (m) and `force` (N) have one value per tick of a protocol that swings about zero with the
    `amplitudes` (m), each any number of times, in either direction first. The elastic stiffness is the
    slope of the regression through the cycles of the smallest amplitude. A cycle goes from zero over both
    peaks to zero and is found from the deformation itself; peaks are averages over 1/250 of a cycle.

    Raises:
        InputError: too short, unequal lengths, not finite, constant, amplitudes not positive, an amplitude
            without a complete cycle, or a cycle of an amplitude that is not named.

    Source: section 2.2 of Yokoyama et al. (17WCEE, 2020); Chopra, Dynamics of Structures, section 3.9.
    """
    deformation, force = checks.signals(LEAST, deformation=deformation, force=force)
    checks.moves("deformation", deformation)
    checks.moves("force", force)
    if not amplitudes:
        raise InputError("No amplitude is given: name those of the protocol.")
    for amplitude in amplitudes:
        checks.positive("amplitude of the protocol", float(amplitude))
    found = tuple(
        measure(deformation, force, begin, end, amplitudes)
        for begin, end in split(deformation, min(amplitudes))
    )
    for amplitude in amplitudes:
        if not any(cycle.nominal == amplitude for cycle in found):
            raise InputError(
                f"The deformation holds no complete cycle of {1e3 * amplitude:g} mm: "
                "name the amplitudes of the protocol, or record its end."
            )
    smallest = [cycle for cycle in found if cycle.nominal == min(amplitudes)]
    ticks = np.concatenate([np.arange(cycle.begin, cycle.end) for cycle in smallest])
    return CyclicTest(slope(deformation[ticks], force[ticks]), found)


def slope(deformation: Array, force: Array) -> Estimate:
    """Slope (N/m) of the regression line of the force, with its interval."""
    return regression({"stiffness": (deformation, "N/m")}, force)["stiffness"]


def regression(causes: Mapping[str, tuple[Array, str]], force: Array) -> Identified:
    """The force (n,) N as a constant and a sum of multiples of causes (n,), by name with the multiple's unit.

    The misfit of a force that does not move is that of its rounding, 0.
    """
    base = np.column_stack([*(values for values, _ in causes.values()), np.ones(force.size)])
    weights = np.linalg.lstsq(base, force, rcond=None)[0]
    missed = base @ weights - force
    deviations, freedom = estimate.deviations(base, missed, [force.size])
    rows = zip(causes.items(), weights, deviations, strict=False)
    found = {
        name: estimate.around(float(weight), float(deviation), unit, freedom)
        for (name, (_, unit)), weight, deviation in rows
    }
    return Identified(found, float(np.std(missed) / (np.std(force) or 1.0)))


def reversals(signal: Array, threshold: float) -> list[int]:
    """Ticks of the extremes between which the signal moves by more than the threshold, in turn."""
    places: list[int] = []
    extreme, direction = 0, 0
    low, high = 0, 0
    for k in range(1, signal.size):
        value = signal[k]
        if direction == 0:
            low = k if value < signal[low] else low
            high = k if value > signal[high] else high
            if signal[high] - signal[low] > threshold:
                direction = 1 if high > low else -1
                extreme = max(low, high)
        elif direction * (value - signal[extreme]) > 0.0:
            extreme = k
        elif direction * (signal[extreme] - value) > threshold:
            places.append(extreme)
            extreme, direction = k, -direction
    if abs(signal[extreme]) > threshold:  # a record that ends on a peak
        places.append(extreme)
    return places


def split(deformation: Array, smallest: float) -> list[tuple[int, int]]:
    """First tick, and tick after the last, of each complete cycle."""
    threshold = RETURN * smallest
    peaks = [k for k in reversals(deformation, threshold) if abs(deformation[k]) > threshold]
    if not peaks:
        return []
    sign = 1.0 if deformation[peaks[0]] > 0.0 else -1.0
    motion = sign * deformation
    result = []
    begin = quiet(motion[: peaks[0] + 1])
    i = 0
    while i + 1 < len(peaks):
        first, second = peaks[i], peaks[i + 1]
        if not motion[first] > 0.0 > motion[second]:
            i += 1  # a reversal before the peak
            begin = quiet(motion[: peaks[i] + 1])
            continue
        stop = peaks[i + 2] if i + 2 < len(peaks) else motion.size
        back = np.flatnonzero(motion[second:stop] >= 0.0)
        if back.size:
            end = second + int(back[0]) + 1
        else:
            end = second + int(np.argmax(motion[second:stop])) + 1
            if motion[end - 1] < -INCOMPLETE * smallest:
                break
        result.append((begin, end))
        begin = end - 1
        i += 2
    return result


def quiet(motion: Array) -> int:
    """Last tick at or below zero before a rise, or else the tick of the smallest value."""
    under = np.flatnonzero(motion <= 0.0)
    return int(under[-1]) if under.size else int(np.argmin(motion))


def measure(deformation: Array, force: Array, begin: int, end: int, amplitudes: Sequence[float]) -> Cycle:
    """The results of the cycle from tick `begin` to before tick `end`; raises InputError for an unknown amplitude."""
    x, f = deformation[begin:end], force[begin:end]
    half = (x.size // SMOOTH) // 2
    top = slice(max(int(np.argmax(x)) - half, 0), int(np.argmax(x)) + half + 1)
    bottom = slice(max(int(np.argmin(x)) - half, 0), int(np.argmin(x)) + half + 1)
    stretch = float(x[top].mean() - x[bottom].mean())
    amplitude = stretch / 2.0
    nominal = min(amplitudes, key=lambda value: abs(value - amplitude))
    if abs(amplitude - nominal) > MATCH * nominal:
        raise InputError(
            f"The cycle from tick {begin} has an amplitude of {1e3 * amplitude:.3g} mm, which the protocol does "
            "not name: give all of its amplitudes."
        )
    stiffness = float(f[top].mean() - f[bottom].mean()) / stretch
    area = 0.5 * float(np.sum((f + np.roll(f, -1)) * (np.roll(x, -1) - x)))
    ratio = area / (2.0 * np.pi * stiffness * amplitude**2)
    return Cycle(begin, end, float(nominal), amplitude, stiffness, area, float(ratio))
