"""The unexplained rest of a gap as an error of the predicted signals, which grows beyond the observed motion.

The error of a signal is a share of its analytic signal with a random phase: it has the frequencies of the signal, and
rises and falls with its envelope.
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

# Ratio of a predicted motion to the largest one seen above which the prediction warns that it goes beyond the diagnosed
# recording. Up to 10 % more, the scatter of the draws alone would cause the warning.
BEYOND = 1.1
# Share of a target's energy outside the frequencies seen above which the prediction says so: five times the share that
# lies outside them in the diagnosed recording itself.
OUTSIDE = 0.05
# Share of the plan's tolerance that is added per multiple of the largest motion seen. A fitted law extrapolates far
# better than a nominal model: with the whole tolerance, bands of 90 % held 98 % of the time at twice the motion
# (tests/diagnosis/test_bands.py).
NEW = 0.1


@dataclass(frozen=True)
class RangeSeen:
    """How far a laboratory's predicted motion goes beyond the diagnosed recording."""

    role: str
    signal: str  # the reading with the largest ratio
    ratios: Array  # (ticks,) largest magnitude so far over the largest one seen
    band: tuple[float, float]  # Hz, seen
    outside: float  # share of the energy of the target that lies outside the band

    @property
    def ratio(self) -> float:
        """The largest ratio of the test."""
        return float(self.ratios[-1]) if self.ratios.size else 0.0

    def since(self, interval: float) -> float | None:
        """The time (s) from which on the motion is beyond the observed range; None where it never is."""
        return float(np.argmax(self.ratios > BEYOND)) * interval if self.ratio > BEYOND else None


def reaches(plan: Plan, rollout: Rollout, spread: Spread) -> dict[str, RangeSeen]:
    """How far every laboratory goes beyond the diagnosed recording, by role."""
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
    """The factor on the unexplained share of a signal of a role, and the share that is added to it, tick by tick.

    Beyond the amplitudes seen, the share grows as the amplitude does. `NEW` times the `tolerance` of the plan's nominal
    models is added per multiple of the amplitude, and for energy at frequencies that were not seen.
    """
    chosen = [of[role]] if role in of and role != MASTER else list(of.values())
    if not chosen:
        return 1.0, 0.0
    far = np.maximum(1.0, np.max([one.ratios for one in chosen], axis=0))
    outside = max(one.outside for one in chosen)
    new = np.sqrt(outside) if outside > OUTSIDE else 0.0
    return far, NEW * tolerance * (far - 1.0 + new)


def share_of(spread: Spread, role: str, name: str) -> float:
    """The unexplained share of a signal's envelope; for one that was not recorded, the largest share of the others."""
    known = spread.rest.get(role, {})
    if name in known:
        return known[name]
    every = known or {
        str(place): share for place, of in enumerate(spread.rest.values()) for share in of.values()
    }
    return max(every.values(), default=0.0)


def errors(series: Array, share: Array | float, random: np.random.Generator) -> Array:
    """A random error for each row of `series` (draws, ticks, …), whose rms is a share of the row's envelope."""
    if series.shape[1] < 2 or not np.any(share):
        return np.zeros_like(series)
    phases = random.standard_normal((2, series.shape[0], *[1] * (series.ndim - 1)))
    shaped = np.reshape(share, (1, -1, *[1] * (series.ndim - 2))) if np.ndim(share) else share
    result: Array = shaped * (phases[0] * series + phases[1] * np.imag(hilbert(series, axis=1)))
    return result


def sentences(of: Mapping[str, RangeSeen], interval: float) -> list[str]:
    """Where a prediction goes beyond the diagnosed recording, in sentences."""
    result = []
    for role, one in of.items():
        at = one.since(interval)
        if at is not None:
            result.append(
                f"In the laboratory of the {title(role)} {one.signal} reaches {one.ratio:.2g} times its largest value "
                f"in the diagnosed recording, and exceeds that value from t = {at:.2f} s on: the band is wider there, "
                "and does not include an effect that only shows beyond that value."
            )
        if one.outside > OUTSIDE:
            low, high = one.band
            result.append(
                f"In the laboratory of the {title(role)} {100 * one.outside:.0f} % of the target's energy lies outside "
                f"the {low:.2g} to {high:.2g} Hz of the diagnosed recording, which makes the band wider."
            )
    return result
