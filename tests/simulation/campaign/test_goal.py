"""The file of a campaign: accepted contents, and refusals in one sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from common.errors import PlanError
from simulation.campaign import goal as goals

ONE: dict[str, Any] = {"candidate": [{"scales": [0.1, 0.2], "durations": [2.0, 4.0], "amd": [True, False]}]}


def read(**more: Any) -> goals.Goal:
    return goals.from_tables(ONE | more, Path())


def test_the_candidates_are_all_combinations_of_scales_durations_and_dampers() -> None:
    found = read()
    assert [(one.duration, one.amd, one.scale) for one in found.candidates] == [
        (duration, amd, scale) for duration in (2.0, 4.0) for amd in (True, False) for scale in (0.1, 0.2)
    ]
    assert [one.number for one in found.candidates] == list(range(1, 9))
    plan = goals.plan_of(found, 4, 3)
    assert (plan.test.duration, plan.ground_motion.scale, plan.control.amd) == (2.0, 0.2, False)
    assert plan.test.name == "default-03"
    assert plan.test.seed == found.plan.test.seed + 2


def test_values_of_a_campaign_may_be_given_with_units() -> None:
    found = read(limits={"drift": "12 mm", "energy": "1.5 kJ"})
    assert [found.limits.drift, found.limits.energy] == pytest.approx([0.012, 1500.0])


def test_the_digest_of_a_campaign_covers_all_but_the_hidden_reality() -> None:
    assert read().digest == read(reality="hidden.toml").digest
    assert (
        len({read().digest, read(tests=3).digest, read(limits={"drift": 0.01}).digest, read(gap=0.1).digest})
        == 4
    )


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ({"candidates": []}, "Unknown entry 'candidates': did you mean candidate?"),
        ({"candidate": []}, "no test to choose from: give at least one"),
        ({"candidate": [{"scale": 0.1}]}, "Unknown key 'scale' in [[candidate]]: did you mean scales?"),
        ({"candidate": [{"durations": "long"}]}, "durations in [[candidate]] is 'long', but must be numbers"),
        ({"candidate": [{"amd": 1}]}, "amd in [[candidate]] is 1, but must be true or false"),
        ({"candidate": [{"scales": [0.1, 0.1]}]}, "is there twice: leave one of them out"),
        ({"candidate": [{"durations": 1e-9}]}, "shorter than one interval"),
        (
            {"mode": "in the lab"},
            "mode in [campaign] is 'in the lab', but must be one of virtual, real time, by hand",
        ),
        ({"mode": "by hand", "reality": "hidden.toml"}, "leave it out"),
        ({"certain": 0.99}, "certain in [campaign] is 0.99, but must be at least 0.5 and at most 0.97"),
        ({"limits": {"drifts": 1}}, "Unknown key 'drifts' in [limits]: did you mean drift?"),
        ({"limits": {"drift": "3 N"}}, "drift in [limits]"),
    ],
)
def test_a_wrong_campaign_file_is_refused_in_one_sentence(tables: dict[str, Any], sentence: str) -> None:
    with pytest.raises(PlanError) as caught:
        read(**tables)
    assert sentence in str(caught.value)


def test_the_paths_of_a_campaigns_plan_are_valid_from_another_folder(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('[ground_motion]\nrecord = "own.csv"\ndt = 0.01\nunit = "g"\n')
    found = goals.from_tables({"plan": "own.toml", "candidate": [{}]}, tmp_path)
    assert goals.plan_of(found, 1, 1).ground_motion.record == str(tmp_path / "own.csv")
