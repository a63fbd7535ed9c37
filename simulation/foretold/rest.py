"""What a diagnosis left unexplained, as an error of the predicted signals that grows beyond what was seen.

The error of a signal is a share of its analytic signal with a phase at random: it has the signal's own frequencies
and rises and falls with its envelope.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import hilbert

from common.plan.plan import Plan
from common.reality.spread import SeenRange, Spread
from common.roles import MASTER, title
from laboratories.kinds import kinds_of
from loop.closed_loop import Rollout
from loop.signals import by_role
from models.registry import Array

# Ratio of a predicted motion to the largest one seen from which on the prediction says that it leaves what was seen:
# below it noise alone would do so.
BEYOND = 1.1
# Share of the energy of a target outside the frequencies seen from which on it is said: five times what lies outside
# of them in the recording itself.
OUTSIDE = 0.05
# Share of the plan's tolerance that is added per multiple of the largest motion seen. A law that was found goes on
# beyond what was seen far better than a nominal model: with the whole tolerance, bands of 90 % held 98 % of the time at
# twice the motion (tests/diagnosis/test_bands.py).
NEW = 0.1


@dataclass(frozen=True)
class RangeSeen:
    """How far a laboratory's predicted motion leaves what was seen of it."""

    role: str
    signal: str  # the reading that goes farthest beyond
    ratios: Array  # (ticks,) largest magnitude so far over the largest one seen
    band: tuple[float, float]  # Hz, seen
    outside: float  # share of the energy of the target that lies outside the band

    @property
    def ratio(self) -> float:
        """The largest ratio of the test."""
        return float(self.ratios[-1]) if self.ratios.size else 0.0

    def since(self, interval: float) -> float | None:
        """The time (s) from which on the motion is beyond what was seen; None where it never is."""
        return float(np.argmax(self.ratios > BEYOND)) * interval if self.ratio > BEYOND else None


def reaches(plan: Plan, rollout: Rollout, spread: Spread) -> dict[str, RangeSeen]:
    """How far every laboratory leaves what was seen of it, by role."""
    columns, result = by_role(plan, rollout), {}
    for role, kind in kinds_of(plan).items():
        seen = spread.seen.get(role)
        if seen is None:
            continue
        ratios = {
            name: np.maximum.accumulate(np.abs(columns[role][name])) / top
            for name, top in seen.amplitudes.items()
            if name in columns[role] and top > 0.0
        }
        if ratios:
            farthest = max(ratios, key=lambda name: float(ratios[name][-1]))
            target = columns[role][kind.channels.target.name]
            share = energy_outside(target, seen, plan.test.interval)
            result[role] = RangeSeen(role, farthest, np.max(list(ratios.values()), axis=0), seen.band, share)
    return result


def energy_outside(target: Array, seen: SeenRange, interval: float) -> float:
    """Share of the energy of a target (ticks,) that lies outside the frequencies seen."""
    energy = np.square(np.abs(np.fft.rfft(target - np.mean(target))))
    frequencies = np.fft.rfftfreq(target.size, interval)
    low, high = seen.band
    total = float(energy.sum())
    return float(energy[(frequencies < low) | (frequencies > high)].sum()) / total if total > 0.0 else 0.0


def growth(of: Mapping[str, RangeSeen], role: str, tolerance: float) -> tuple[Array | float, Array | float]:
    """By what the share left of a signal of a role is multiplied at every tick, and what is added to it.

    Beyond the amplitudes seen a share grows as the amplitude does. A part of the `tolerance` of the plan's nominal
    models is added per multiple of the amplitude, and for frequencies not seen.
    """
    chosen = [of[role]] if role in of and role != MASTER else list(of.values())
    if not chosen:
        return 1.0, 0.0
    far = np.maximum(1.0, np.max([one.ratios for one in chosen], axis=0))
    outside = max(one.outside for one in chosen)
    new = np.sqrt(outside) if outside > OUTSIDE else 0.0
    return far, NEW * tolerance * (far - 1.0 + new)


def share_of(spread: Spread, role: str, name: str) -> float:
    """What is left of a signal over its envelope; of one that was not recorded as much as of the worst that was."""
    known = spread.rest.get(role, {})
    if name in known:
        return known[name]
    every = known or {
        str(place): share for place, of in enumerate(spread.rest.values()) for share in of.values()
    }
    return max(every.values(), default=0.0)


def errors(series: Array, share: Array | float, random: np.random.Generator) -> Array:
    """An error drawn for every row of `series` (draws, ticks, …), whose rms is a share of the envelope."""
    if series.shape[1] < 2 or not np.any(share):
        return np.zeros_like(series)
    phases = random.standard_normal((2, series.shape[0], *[1] * (series.ndim - 1)))
    shaped = np.reshape(share, (1, -1, *[1] * (series.ndim - 2))) if np.ndim(share) else share
    result: Array = shaped * (phases[0] * series + phases[1] * np.imag(hilbert(series, axis=1)))
    return result


def sentences(of: Mapping[str, RangeSeen], interval: float) -> list[str]:
    """Where a prediction leaves what was seen, in sentences."""
    result = []
    for role, one in of.items():
        at = one.since(interval)
        if at is not None:
            result.append(
                f"In the laboratory of the {title(role)} {one.signal} reaches {one.ratio:.2g} times the largest value "
                f"seen in the diagnosed recording, from t = {at:.2f} s on: beyond what was seen the band is wider, and "
                "an effect that only shows there is not in it."
            )
        if one.outside > OUTSIDE:
            low, high = one.band
            result.append(
                f"In the laboratory of the {title(role)} {100 * one.outside:.0f} % of the energy of the target lies "
                f"outside the {low:.2g} to {high:.2g} Hz that were seen: the band is wider for it."
            )
    return result
