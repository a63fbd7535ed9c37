"""Stated probabilities of verdicts, compared with the truth."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence, Sized

import numpy as np

from models.registry import Array
from validation.blind.results.calibration import brier
from validation.blind.results.scoring import Outcome

Stated = tuple[float, bool]  # probability, and whether it was true


def is_true(kind: str, truth: Sized, asked: int, listed: int, surplus: int) -> bool:
    """Whether a verdict is true: it names every effect that is large enough to be found, and none that is not there."""
    known = kind != "unknown" or listed > 0  # an unknown effect has no name but that of its mechanism
    return len(truth) > 0 and known and listed == asked and surplus == 0


def stated_verdicts(outcomes: Iterable[Outcome]) -> list[Stated]:
    """Probability and truth of every verdict that names something."""
    return [
        (item.probability, is_true(item.kind, item.truth, item.asked, item.listed, item.surplus))
        for item in outcomes
        if item.verdict and math.isfinite(item.probability)
    ]


def in_columns(stated: Sequence[Stated]) -> tuple[Array, Array]:
    """Probabilities, and 1 where they were true."""
    return np.array([p for p, _ in stated]), np.array([float(hit) for _, hit in stated])


def brier_score(stated: Sequence[Stated]) -> float:
    """Mean square of probability minus truth, NaN without verdicts."""
    return float(brier(*in_columns(stated))) if stated else math.nan


def brier_skill(stated: Sequence[Stated]) -> float:
    """1 - score/(score of the share that was true, said every time); NaN where all or none were true.

    G. W. Brier, Monthly Weather Review 78 (1950) 1-3; A. H. Murphy, J. Applied Meteorology 12 (1973) 215-223.
    """
    share = float(np.mean([hit for _, hit in stated])) if stated else 0.0
    return 1.0 - brier_score(stated) / (share * (1.0 - share)) if 0.0 < share < 1.0 else math.nan
