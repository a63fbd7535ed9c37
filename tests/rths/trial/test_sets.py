"""Sets of the trial: the drawing of cases, right names of materials, the oracle, and the best possible score."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan import read as plans
from common.reality import reality as realities
from common.roles import MASTER
from diagnosis.report import read as read_report
from tests import opensees
from tests.rths.diagnosis_report.pieces import bare
from tests.rths.trial.test_scoring import CABLE, RUB, SOFT, answer, case, judged
from validation.blind import oracle
from validation.blind.best import best_closed
from validation.blind.cases.basis import TrialBasis, basis
from validation.blind.cases.case import Case, Laid
from validation.blind.draw import begin, draw
from validation.blind.labs import materials
from validation.blind.labs.material_lab import material
from validation.blind.logger.loggers import IN_STEP, Logger
from validation.blind.results.rows import case_rows
from validation.blind.sets import MILD, SETS

SECONDS = 2.0


@cache
def trial() -> TrialBasis:
    return basis(duration=SECONDS)


def drawn(set_: str, count: int, *only: str) -> list[Case]:
    return draw(count, 4, set_, trial=trial(), only=only)


def moves(item: Case, *names: str) -> list[float]:
    tables = (name.split(".") for name in names)
    return [item.truths[table][key] / item.plan[table][key] - 1.0 for table, key in tables]


@pytest.mark.long
def test_normal_tolerances_are_standard_deviations() -> None:
    names = ("actuator.gain", "actuator.delay", "actuator.time_constant", "table.frequency", "damper.mass")
    found = np.array([moves(item, *names) for item in drawn("normal", 40)]).ravel() / 0.02
    assert 0.8 < np.std(found) < 1.2
    assert np.max(np.abs(found)) > 2.0
    inside = np.array([moves(item, *names) for item in drawn("judge", 10)]).ravel() / 0.02
    assert np.max(np.abs(inside)) <= 1.0


def test_a_laboratory_of_many_faults_has_up_to_nine_mild_ones_each_once() -> None:
    begun = [begin(index, 4, "many", trial().library) for index in range(300)]
    counts = [len(item.names) for item in begun if item.kind == "many"]
    assert (min(counts), max(counts)) == (1, MILD)
    assert all(len(set(item.names)) == len(item.names) for item in begun)
    strong = {"damper.friction": 3.0}  # N, the middle of its range on a logarithmic scale is below
    for item in drawn("many", 20, "many"):
        for one in item.laid:
            assert one.parameters.get("force", 0.0) <= strong.get(one.name, math.inf)


def test_clean_and_pair_cases_of_the_independent_set_use_the_independent_laboratories() -> None:
    for item in (*drawn("independent", 2, "clean"), *drawn("independent", 3, "pair")):
        reality = item.reality()
        labs = {role: reality[role]["rig"]["class"] for role in ("master", "slave")}
        assert all(name.startswith("validation.blind.labs.") for name in labs.values())
        assert "effect" not in reality
        laid = [one["name"] for role in labs for one in reality[role]["rig"]["options"]["effects"]]
        assert sorted(laid) == sorted(one.name for one in item.laid)
        plan = plans.from_tables(item.plan, Path())
        assert realities.from_reality(reality, plan, Path()).seed == item.seed


def test_materials_are_used_in_turn_in_place_of_the_column() -> None:
    count = len(materials.MATERIALS)
    assert count >= 12
    begun = [begin(index, 4, "materials", trial().library) for index in range(count)]
    assert [item.names for item in begun] == [(f"opensees.{name}",) for name in materials.MATERIALS]
    (first,) = drawn("materials", 1)
    assert first.other["ground_motion"] != first.plan["ground_motion"]
    assert {**first.other, "ground_motion": None} == {**first.plan, "ground_motion": None}
    reality = first.reality()
    assert reality["master"]["rig"]["class"].endswith(":MaterialLab")
    assert reality["master"]["rig"]["options"]["effects"][0]["name"] == "opensees.Steel01"
    for name, item in materials.MATERIALS.items():
        values = {key: math.sqrt(low * high) for key, (low, high) in item.ranges.items()}
        assert json.loads(json.dumps(materials.calls(name, 12.5e6, {"d": 1e-3, **values})))


def served(name: str, way: Any) -> list[float]:
    ranges = materials.MATERIALS[name].ranges
    values = {key: math.sqrt(low * high) for key, (low, high) in ranges.items()}
    process = material(name, {"d": 1e-3, **values}, 12.5e6)
    try:
        return [process.force([place]) for place in way]
    finally:
        process.close()


@pytest.mark.skipif(bool(opensees.lacking()), reason=opensees.lacking())
@pytest.mark.parametrize("name", materials.MATERIALS)
def test_every_material_gives_a_force(name: str) -> None:
    forces = served(name, 3e-3 * np.sin(np.linspace(0.0, 2.0 * math.pi, 401)[1:]))
    assert all(map(math.isfinite, forces))
    assert forces[99] > 0.0 > forces[299]


def test_a_material_is_named_by_its_mechanism() -> None:
    steel = Laid("opensees.Steel02", "column", {"d": 1e-3, "b": 0.05}, {}, role="master")
    hidden = case("material", steel)
    assert judged(hidden, answer("explained", "column.yielding", site="column")).right
    wrong = judged(hidden, answer("explained", "column.stiffness", site="column"))
    assert [row.name for row in case_rows([wrong])] == ["opensees.Steel02", "all cases"]
    assert not wrong.named
    assert wrong.surplus == 1


def test_partly_explained_counts_for_an_unknown_effect_only_without_a_certain_name() -> None:
    hidden = case("unknown", CABLE)
    assert judged(hidden, answer("unknown_effect", site="damper")).right
    assert judged(hidden, answer("partly_explained", "damper.friction", site="damper", probability=0.3)).right
    assert not judged(hidden, answer("partly_explained", "damper.friction", site="damper")).named


def test_only_the_visible_ones_of_many_effects_have_to_be_named() -> None:
    hidden = case("many", RUB, SOFT)
    found = judged(hidden, answer("explained", "damper.friction", site="damper"), 5.0, 0.5)
    assert (found.named, found.asked, found.listed) == (True, 1, 1)
    found = judged(hidden, answer("explained", "damper.friction", site="damper"), 5.0, 3.0)
    assert (found.named, found.asked, found.listed) == (False, 2, 1)


def test_the_best_possible_closure_is_that_of_the_true_laboratory() -> None:
    signal = {"nrmse": 0.5, "noise_floor": 0.1, "peak_error": 1.0, "unit": "m"}
    far = {"before": 0.5, "after": 0.1, "closed": 1.0, "closed_interval": None, "noise_floor": 0.1}
    report = bare("explained")
    report["gap"]["signals"] = {"column_displacement": signal}
    report["how_far"] = report["how_far"] | far
    told = read_report.report(report)
    assert best_closed([told], {"column_displacement": 0.3}) == pytest.approx(0.5)
    assert best_closed([told], {"column_displacement": 0.05}) == pytest.approx(1.0)
    assert math.isnan(best_closed([told], {"column_displacement": 0.49}))  # a gap of chance


def test_the_oracle_sees_less_through_a_logger_that_adds_noise_at_the_signals_frequency() -> None:
    t = np.arange(5000) * 0.002
    wave = {"column_force": 10.0 * np.sin(2.0 * math.pi * 2.0 * t)}
    noise = {"column_force": (100.0, "N")}

    def size(logger: str, values: Any = wave) -> float:
        hidden = replace(case("catalogue", RUB), plan={"test": {"interval": 0.002}}, logger=logger)
        change = oracle.whitening(hidden, wave, noise)(values)
        return math.sqrt(float(change @ change))

    white = math.sqrt(5000 * 0.5) * 10.0 / 100.0  # energy over the variance
    assert size("") == pytest.approx(white, rel=0.01)
    assert size("pink") < 0.5 * white  # its power is where the wave is
    assert size("low_pass_50") < white
    assert size("250_hz") == pytest.approx(white / math.sqrt(2.0), rel=0.01)  # half as many rows as ticks
    hum = {"column_force": 10.0 * np.sin(2.0 * math.pi * 50.0 * t)}
    assert size("hum", hum) < 0.01 * size("", hum)
    assert oracle.amplitude(Logger("", printed=True), 0.0, "N", np.asarray(t), 0.002)[0] == pytest.approx(
        math.sqrt(1 / 12)
    )


def test_the_oracle_holds_an_effect_against_the_nearest_laboratory_without_it() -> None:
    """One parameter that is 20 % off does what the effect does, and no less than that does it."""
    (clean,) = drawn("judge", 1, "clean")
    true = clean.truths["column"]["stiffness"]

    def apart(other: Case) -> np.ndarray[Any, Any]:
        return np.array([1e5 * (math.exp(4.0 * other.truths["column"]["stiffness"] / true) - math.exp(4.8))])

    assert oracle.nearest(clean, MASTER, apart) == pytest.approx(0.2 / (0.02 / math.sqrt(3.0)), rel=0.01)


def test_every_set_states_its_question() -> None:
    assert all(chosen.text for chosen in SETS.values())
    assert set(SETS) == {
        "judge",
        "tune",
        "loggers",
        "out_of_step",
        "normal",
        "many",
        "independent",
        "unlisted",
        "unlisted_tune",
        "materials",
    }
    assert len(IN_STEP) == 15
