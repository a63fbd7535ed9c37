"""`rths faults` as a user calls it."""

from __future__ import annotations

import argparse
import json

import pytest

from common.errors import InputError
from rths.__main__ import parser_for
from rths.prove import faults
from validation.faults import schedule, trial
from validation.faults.invariants import InvariantViolation
from validation.faults.lab import Simulation


def parsed(*words: str) -> argparse.Namespace:
    return parser_for("faults").parse_args(words)


def test_a_schedule_without_faults_passes_and_prints_its_course(capsys: pytest.CaptureFixture[str]) -> None:
    assert faults.run(parsed("--schedule", "seed=4 duration=0.3")) == 0
    told = capsys.readouterr().out
    assert "seed=4 duration=0.3 slaves=1 recorded=0" in told
    assert "master: completed" in told
    assert "violations: 0 in 0 schedules" in told


def test_many_schedules_are_reported_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    code = faults.run(parsed("--seed", "3", "--schedules", "3", "--duration", "1", "--json"))
    found = json.loads(capsys.readouterr().out)
    assert code == bool(found["violations"])
    assert found["schedules"] == 3
    assert found["virtual_time"] > 0.0
    assert sum(found["faults"].values()) == sum(len(schedule.draw(seed, 1.0).faults) for seed in (3, 4, 5))


def test_a_violation_gives_exit_code_1_and_the_line_that_repeats_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def judge(_simulation: Simulation) -> list[InvariantViolation]:
        return [InvariantViolation("nothing_holds", "it is wrong.")]

    monkeypatch.setattr(trial, "judge", judge)
    assert faults.run(parsed("--seed", "7", "--duration", "1")) == 1
    told = capsys.readouterr().out
    assert "nothing_holds: it is wrong.\n    rths faults --duration 1 --seed 7\n" in told
    assert "violations: 1 in 1 schedules" in told


@pytest.mark.parametrize(
    ("words", "chosen"),
    [
        (["--seed", "5"], [5]),
        (["--schedules", "3"], [1, 2, 3]),
        (["--seed", "5", "--schedules", "2"], [5, 6]),
        ([], list(range(1, 101))),
    ],
)
def test_the_arguments_select_the_schedules_that_are_played(words: list[str], chosen: list[int]) -> None:
    assert [one.seed for one in faults.schedules(parsed(*words))] == chosen


@pytest.mark.parametrize(
    "words",
    [["--seed", "-1"], ["--schedules", "0"], ["--duration", "0.1"], ["--jobs", "0"], ["--schedule", "no"]],
)
def test_arguments_that_give_no_schedule_are_refused_in_one_sentence(words: list[str]) -> None:
    with pytest.raises(InputError):
        faults.schedules(parsed(*words))
