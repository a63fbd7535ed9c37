"""Blocks of time: which are fitted, which are withheld, and how a statistic varies between them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from models.registry import Array

Mask = NDArray[np.bool_]

FEWEST = 5  # blocks of a record, however short


def split(n: int, interval: float, length: float = 2.0, held_share: float = 0.4) -> tuple[Mask, Mask]:
    """Samples to fit on and samples withheld: two masks (n,), one the other's complement.

    Blocks of about `length` s, at least `FEWEST`, of which every so many-th is withheld, spread evenly. The
    first is fitted on.

    Raises:
        InputError: too few samples, or a share that leaves one side empty.
    """
    if n < FEWEST or not 0.0 < held_share < 1.0:
        raise InputError(f"{n} samples with a share of {held_share:g} withheld cannot be split.")
    count = min(max(FEWEST, round(n * interval / length)), n)
    so_far = np.floor(np.arange(count + 1) * held_share + 1e-9)
    block = np.arange(n) * count // n
    held = (np.diff(so_far) > 0.5)[block]
    if held.all() or not held.any():
        raise InputError(f"{count} blocks with a share of {held_share:g} withheld leave one side empty.")
    return ~held, held


def bootstrap(
    values: Array, function: Callable[[Array], float], draws: int, seed: int, level: float = 0.9
) -> tuple[float, float]:
    """Percentile interval of a statistic of blocks, drawn with replacement.

    `values` (blocks, …): one row per block; `function` takes as many rows and gives the statistic.

    Source: Efron and Tibshirani, An Introduction to the Bootstrap (1993), ch. 13; blocks as in Künsch (1989).

    Raises:
        InputError: no blocks or no draws.
    """
    if len(values) == 0 or draws < 1:
        raise InputError(f"{draws} draws of {len(values)} blocks give no interval.")
    random = np.random.default_rng(seed)
    picks = random.integers(0, len(values), (draws, len(values)))
    low, high = np.quantile(
        [function(values[pick]) for pick in picks], [0.5 - 0.5 * level, 0.5 + 0.5 * level]
    )
    return float(low), float(high)
