"""What a test is expected to tell about which of several hypotheses is true.

With prior probabilities w and expected costs D (D[i, j]: by how much hypothesis j explains the test worse than the
truth i), the probabilities after the test are those of a diagnosis, w_j·exp(-D[i, j]/2T), and the information is the
expected fall of their entropy (D. V. Lindley, Annals of Mathematical Statistics 27 (1956) 986).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from diagnosis.findings.certainty.costs import TEMPERATURE
from models.registry import Array


class Expected(NamedTuple):
    """What a test is expected to tell: information in bits, and the probability that the truth has afterwards."""

    bits: float
    certainty: float


NOTHING = Expected(0.0, 1.0)


def odds(costs: Array) -> Array:
    """Factors by which differences of cost change probabilities, as the verdict of a diagnosis weighs them."""
    return np.asarray(np.exp(-np.clip(costs / (2.0 * TEMPERATURE), 0.0, 700.0)))


def expected(weights: Array, apart: Array, names: Sequence[str] = ()) -> Expected:
    """The information of a test on hypotheses of probabilities `weights` (h,), which sum to 1; `apart` (h, h).

    Hypotheses of one of the `names` (h,) are one cause; without names each is a cause of its own.
    """
    places = np.unique(names, return_inverse=True)[1] if names else np.arange(weights.size)
    after = weights * odds(apart * (places[:, None] != places[None, :]))
    after /= after.sum(axis=1, keepdims=True)
    same = np.equal.outer(places, np.arange(places.max() + 1)).astype(np.float64)
    bits = entropy(weights[None] @ same) - weights @ entropy(after @ same)
    true = np.sum((after @ same) * same, axis=1)
    return Expected(float(bits[0]), float(weights @ true))


def together(parts: list[Expected]) -> Expected:
    """What a test tells about several parts, each of which has a cause of its own."""
    return Expected(sum(one.bits for one in parts), float(np.prod([one.certainty for one in parts])))


def entropy(chances: Array) -> Array:
    """The entropies of rows of probabilities, bits."""
    logs = np.log2(chances, where=chances > 0.0, out=np.zeros_like(chances))
    return np.asarray(-np.sum(chances * logs, axis=1))
