"""Single samples that stand out of their neighbours: the tails of a sensor's noise, or disturbances of its cable."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from diagnosis.signals.mask import Mask
from models.registry import Array

# Deviations of the neighbourhood; one sample of white normal noise in ten thousand is further away.
BEYOND = 6.0
NEIGHBOURS = 5  # samples whose median a sample is held against
WIDER = 25  # samples whose median smooth noise is held against
AS_MUCH = 4.0  # deviations of that: what is smooth has no spikes
AROUND = 251  # samples by which the deviation is taken: half a second, over which a motion changes little
LONGEST = 2  # samples that stand out one after the other: more of them are a motion


def deviation(apart: Array) -> Array:
    """Deviation (n,) of a normal number whose size is `apart` (n,), around each sample."""
    half = min(AROUND, apart.size) // 2
    starts = np.arange(0, apart.size, max(1, half))
    windows = np.lib.stride_tricks.sliding_window_view(apart, min(2 * half + 1, apart.size))
    whole = (starts >= half) & (starts + half < apart.size)
    medians = np.empty(starts.size)
    medians[whole] = np.partition(windows[starts[whole] - half], half, axis=1)[
        :, half
    ]  # all at once, as they are many
    medians[~whole] = [np.median(apart[max(0, k - half) : k + half + 1]) for k in starts[~whole]]
    return np.asarray(1.4826 * np.interp(np.arange(apart.size), starts, medians))


def beyond(residual: Array) -> Array:
    """How far (n,) each sample of a residual is from the median of its neighbours.

    Beyond its ends the residual is mirrored without its last sample, so that a spike there is no neighbour of its own.
    """
    return np.asarray(np.abs(residual - ndimage.median_filter(residual, NEIGHBOURS, mode="mirror")))


def spikes(residual: Array) -> Mask:
    """Where a residual (n,) has spikes: at most `LONGEST` samples in a row far from the median around them."""
    apart = beyond(residual)
    slowly = np.abs(residual - ndimage.median_filter(residual, WIDER, mode="mirror"))
    sharp, wide = deviation(apart), deviation(slowly)
    above = (apart > BEYOND * sharp) & (apart > AS_MUCH * wide) & (sharp > 0.0)
    labels, count = ndimage.label(above)
    if count == 0:
        return np.zeros(residual.size, dtype=bool)
    lengths = ndimage.sum_labels(above, labels, np.arange(1, count + 1))
    return np.asarray(above & (np.concatenate([[0], lengths])[labels] <= LONGEST))
