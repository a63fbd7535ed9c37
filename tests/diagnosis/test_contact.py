"""End stops that are sought on both sides of where the motion ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from diagnosis.fits.contact import by_law
from models.registry import Array


@dataclass(frozen=True)
class Found:
    """A fit with what tells its law."""

    values: dict[str, dict[str, float]]
    reduced: Array


def test_two_starts_that_end_at_the_same_stop_are_told_apart_by_their_law_alone() -> None:
    """Fits hold arrays, which cannot be compared as a whole."""
    place = {"position": 0.03}
    fits: list[Any] = [Found({"stop": {**place, "law": law}}, np.zeros(3)) for law in (0.0, 0.0, 1.0)]
    springs, others = by_law(cast(Any, fits), "stop")
    assert [id(one) for one in springs] == [id(one) for one in fits[:2]]
    assert [id(one) for one in others] == [id(fits[2])]
