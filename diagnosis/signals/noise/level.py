"""The level of white noise in a residual, robust against motions, steps and tails."""

from __future__ import annotations

import math

import numpy as np

from diagnosis.signals.noise.spikes import deviation
from models.registry import Array

BELOW = 0.8  # rms of differences over what their median says, below which these are steps: noise has no less than one
# Deviations beyond which a sample counts as this far out: of normal noise one sample in 5e8 is, and what impacts leave
# in all signals counts as little. The rms of Student's t with four degrees of freedom is then found to 2 to 6 %, where
# the median alone says 13 % too little (simulated).
OUTERMOST = 6.0


def white_rms(residual: Array, *, uneven: bool = False) -> Array:
    """Rms of the white part of each residual (ticks, signals).

    By medians, which the bends of a motion do not move. The error of steps that noise does not hide takes few values,
    of which the median may be far above the rms; no noise is louder than that. Where the noise is `uneven`, as that
    divided by a level known to some percent is, each residual has tails of its own.
    """
    apart = np.abs(np.diff(residual, n=4, axis=0))
    heavier = np.fmax(tails(apart), 1.0) if uneven else common_tails(apart)
    usual = heavier * 1.4826 * np.median(apart, axis=0)
    rms = np.sqrt(np.mean(np.square(apart), axis=0))
    return np.asarray(np.where(rms < BELOW * usual, rms, usual) / math.sqrt(70.0))


def common_tails(apart: Array) -> float:
    """The least of the `tails` of differences (samples, signals) of several signals, one at least.

    Only what all of several signals show counts: a logger treats its channels alike, while impacts and friction show in
    some. The bends of a hysteresis in a single force are no tails.
    """
    known = tails(apart)
    known = known[np.isfinite(known)]
    return max(1.0, float(np.min(known))) if known.size > 1 else 1.0


def tails(apart: Array) -> Array:
    """Rms (signals,) of noise over what the median of its size `apart` (samples, signals) says, one of normal noise.

    It is no number where there is no noise.
    """
    around = np.column_stack([deviation(column) for column in apart.T])
    known = np.all(around > 0.0, axis=0)
    ratios = np.minimum(apart / np.where(known, around, 1.0), OUTERMOST)
    return np.where(known, np.sqrt(np.mean(np.square(ratios), axis=0)), np.nan)
