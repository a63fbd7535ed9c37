"""The probability of a verdict, learned from judged cases."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from diagnosis.findings.certainty.trust import SIGNS
from validation.blind import learn
from validation.blind.learn import Verdicts

COUNT = 400
DRAW = np.random.default_rng(4)
DRAWN = np.column_stack([DRAW.normal(1.0, 2.0, COUNT), DRAW.integers(0, 3, COUNT)])
TRUE = 1.0 / (1.0 + np.exp(-(0.5 + 1.2 * DRAWN[:, 0] + 0.6 * DRAWN[:, 1])))
RIGHT = (DRAW.random(COUNT) < TRUE).astype(np.float64)
GIVEN = Verdicts(DRAWN, RIGHT, np.full(COUNT, 0.98), ("pair",) * COUNT)


def case(status: str = "explained", **changed: Any) -> dict[str, Any]:
    return {
        "status": status,
        "signs": dict.fromkeys(SIGNS, 1.0),
        "probability": 0.9,
        "truth": ["column.friction"],
        "asked": 1,
        "listed": 1,
        "surplus": 0,
        "kind": "catalogue",
    } | changed


def test_weights_are_those_that_the_verdicts_were_drawn_with() -> None:
    weights, _, _ = learn.learn(GIVEN)
    assert weights.signs["clear"] == pytest.approx(1.2, abs=0.4)


def test_a_sign_that_only_seems_to_speak_the_other_way_has_no_weight() -> None:
    weights, _, _ = learn.learn(GIVEN)
    assert weights.signs["names"] == 0.0


def test_learned_probabilities_are_better_than_a_constant_on_withheld_verdicts() -> None:
    _, apart, _ = learn.learn(GIVEN)
    spread = RIGHT.mean() * (1.0 - RIGHT.mean())
    assert np.mean((apart - RIGHT) ** 2) < 0.85 * spread


def test_the_table_has_a_row_by_kind_of_case() -> None:
    kinds = tuple("pair" if place % 2 else "catalogue" for place in range(COUNT))
    rows = learn.table(GIVEN._replace(kinds=kinds), TRUE)
    assert [row[0] for row in rows] == ["catalogue", "pair", "all"]
    assert rows[-1][1] == str(COUNT)


def test_only_verdicts_that_name_something_are_learned_from_and_partly_ones_apart() -> None:
    cases = [
        case(),
        case(signs={}),
        case(kind="unknown", listed=0),
        case("partly_explained", listed=0),
        case(probability=None),
        case(surplus=1),
        case(truth=["column.friction", "damper.friction"]),  # of which one is too small to be found
    ]
    assert learn.verdicts(cases, partly=False).right.tolist() == [1.0, 0.0, 0.0, 1.0]
    assert learn.verdicts(cases, partly=True).right.tolist() == [0.0]
