"""A diagnosis that is written as a reality and read again gives the same laboratories to the last bit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.errors import InputError, PlanError
from common.plan.laboratory_tables import CompensatorTable
from common.plan.plan import Plan
from common.plan.read import parse
from common.reality import reality
from common.reality.found import models_of
from common.recording.reader import read
from common.roles import MASTER
from diagnosis.diagnose import examine
from diagnosis.findings.for_prediction.as_reality import as_reality, changed
from diagnosis.recorded import record
from loop.realised import true_slaves, true_system
from tests.diagnosis.cases import Cases, short

FRICTION = {"damper.friction": {"force": 3.0}}


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Cases:
    """Recordings with known secrets, made on demand."""
    return Cases(tmp_path_factory)


def plan_of(path: Path) -> Plan:
    """The plan in a recording."""
    return parse(read(path).metadata["plan"]["toml"], path.parent)


@pytest.mark.long
def test_a_diagnosis_that_is_read_as_a_reality_gives_the_same_laboratories(
    cases: Cases, tmp_path: Path
) -> None:
    path = cases.file(FRICTION, duration=4.0)
    found = examine(record.build(read(path)))
    whole = as_reality({"slave": found})
    tables, known = whole.tables, whole.spread
    names = [(one.laboratory, one.effect, one.parameter) for one in known.parameters]
    assert ("slave", "damper.friction", "force") in names
    assert ("master", "", "column.stiffness") in names
    place = names.index(("slave", "damper.friction", "force"))
    assert 0.0 < np.sqrt(known.covariance[place, place]) < 0.2
    assert known.noise["master"]["column_force"] == pytest.approx(100.0, rel=0.1)
    assert known.rest["master"]["column_force"] < 0.01
    assert known.seen["master"].amplitudes["column_displacement"] > 1e-4
    assert known.seen["slave"].band[1] > 1.0
    assert tables["effect"][0]["name"] == "damper.friction"
    assert tables["effect"][0]["laboratory"] == "slave"
    truth = reality.from_reality(tables, plan_of(path), tmp_path)
    systems = found.corrected()
    assert true_system(truth).effects == systems[MASTER].effects
    assert true_system(truth).plan.column == systems[MASTER].plan.column != plan_of(path).column
    assert true_slaves(truth)["slave"].effects == systems["slave"].effects
    assert true_slaves(truth)["slave"].plan.table == systems["slave"].plan.table != plan_of(path).table


def test_learned_laws_are_read_from_the_file_next_to_the_reality(tmp_path: Path) -> None:
    law = np.linspace(0.1, 1.0, 7)
    with (tmp_path / "found.npz").open("wb") as file:
        np.savez(file, **{"master.column": law})  # type: ignore[arg-type]
    row = {"laboratory": "master", "machine": "column", "file": "found.npz"}
    truth = reality.from_reality({"learned": [row]}, short(), tmp_path)
    assert true_system(truth).effects.column.learned == tuple(law.tolist())
    assert true_slaves(truth)["slave"].effects.column.learned == ()
    with pytest.raises(InputError, match="follows no learned law"):
        true_system(replace(truth, learned=(truth.learned[0]._replace(machine="link"),)))


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ({"laboratory": "master", "machine": "column"}, "file of \\[\\[learned\\]\\] is None"),
        ({"laboratory": "other", "machine": "column", "file": "f.npz"}, "which the plan does not have"),
        ({"laboratory": "master", "machine": "column", "file": "none.npz"}, "Cannot read the law"),
        ({"laboratory": "master", "machine": "actuator", "file": "f.npz"}, "Cannot read the law"),
        ({"laboratory": "master", "machine": "column", "file": "f.npz"}, "no list of finite numbers"),
        ({"laboratory": "master", "machine": "column", "file": "text.npz"}, "Cannot read the law"),
    ],
)
def test_a_wrong_learned_law_is_refused_in_one_sentence(
    row: dict[str, str], says: str, tmp_path: Path
) -> None:
    with (tmp_path / "f.npz").open("wb") as file:
        np.savez(file, **{"master.column": np.array([1.0, np.nan])})  # type: ignore[arg-type]
    (tmp_path / "text.npz").write_text("no archive", encoding="utf-8")
    with pytest.raises(PlanError, match=says):
        reality.from_reality({"learned": [row]}, short(), tmp_path)


def test_a_reality_fits_a_plan_with_another_motion_or_compensator_but_not_with_other_models() -> None:
    plan = short()
    assert models_of(plan) == models_of(short(duration=3.0, scale=0.7))
    assert models_of(plan) == models_of(replace(plan, compensator=CompensatorTable("none", {})))
    assert models_of(plan) != models_of(replace(plan, table=replace(plan.table, frequency=9.0)))


def test_a_reality_contains_only_the_keys_that_differ_from_the_plan() -> None:
    planned = {"a": {"x": 1.0, "in": {"y": 2.0, "z": 3.0}}, "b": {"x": 1.0}}
    real = {"a": {"x": 1.0, "in": {"y": 2.5, "z": 3.0}}, "b": {"x": 1.0}}
    assert changed(planned, real, ("a", "b")) == {"a": {"in": {"y": 2.5}}}
