"""The level of white noise in a residual, robust against motions, steps and tails."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from common.recording.imported import ImportedChannel
from diagnosis.signals.noise.spikes import deviation
from models.registry import Array

BELOW = 0.8  # rms of differences over what their median says, below which these are steps: noise has no less than one
# Deviations beyond which a sample counts as this far out: of normal noise one sample in 5e8 is, and what impacts leave
# in all signals counts as little. The rms of Student's t with four degrees of freedom is then found to 2 to 6 %, where
# the median alone says 13 % too little (simulated).
OUTERMOST = 6.0
ORDER = 4  # of the differences of samples, which show noise apart from motions
LINES = 512  # frequencies over which what a filter left of noise is summed
# Share of noise that two filters leave at a common cutoff: where less is left, what is measured passed none of them.
LEAST = 0.5


def white_rms(residual: Array) -> Array:
    """Rms of the white part of each residual (ticks, signals).

    By medians, which the bends of a motion do not move. The error of steps that noise does not hide takes few values,
    of which the median may be far above the rms; no noise is louder than that.
    """
    apart = np.abs(np.diff(residual, n=ORDER, axis=0))
    usual = tails(apart) * 1.4826 * np.median(apart, axis=0)
    rms = np.sqrt(np.mean(np.square(apart), axis=0))
    return np.asarray(np.where(rms < BELOW * usual, rms, usual) / math.sqrt(math.comb(2 * ORDER, ORDER)))


def tails(apart: Array) -> float:
    """Rms of noise over what the median of its size `apart` (samples, signals) says; one for normal noise.

    Only what all of several signals show counts: a logger treats its channels alike, while impacts and friction show in
    some. The bends of a hysteresis in a single force are no tails.
    """
    ratios = []
    for column in apart.T:
        around = deviation(column)
        if np.all(around > 0.0):
            ratios.append(float(np.sqrt(np.mean(np.square(np.minimum(column / around, OUTERMOST))))))
    return max(1.0, min(ratios)) if len(ratios) > 1 else 1.0


def left_behind(channels: Sequence[ImportedChannel], sizes: Sequence[int], interval: float) -> Array:
    """Shares (channels,) of the rms of white noise that `white_rms` of sums of `sizes` samples finds behind filters.

    It looks at the highest frequencies of such sums, of which a filter may have taken some below its cutoff. The noise
    came before the filters, and the ticks are an interval (s) apart. A share is no less than `LEAST`.
    """
    turns = math.pi * (np.arange(LINES) + 0.5) / (2 * LINES)  # to a half of the rate of the ticks
    found = []
    for channel, size in zip(channels, sizes, strict=True):
        seen = np.square(np.sin(size * turns)) ** (ORDER + 1) / np.square(np.sin(turns))
        passed = np.square(np.abs(channel.response(turns / (math.pi * interval))))
        found.append(float(np.sqrt(np.sum(passed * seen) / np.sum(seen))))
    return np.maximum(found, LEAST)
