"""Specimens of OpenSees under the emulated actuator: equal bits, materials, a user's model, and failures."""

from __future__ import annotations

import os
import signal
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError, RigError
from common.opensees.process import INTERPRETER, SpecimenProcess
from common.plan.read import load, parse
from common.reality.reality import as_planned, from_reality
from common.recording.reader import read
from common.recording.run import Run
from common.rig import ColumnCommand
from loop import substructure
from loop.closed_loop import simulate
from loop.signals import by_role
from rths.opensees import Specimen
from simulation import virtual
from tests import opensees
from tests.helpers import ROOT

EXAMPLES = ROOT / "examples" / "opensees"
CURVES = ROOT / "tests" / "data" / "fiber_column"
with_opensees = pytest.mark.skipif(bool(opensees.lacking()), reason=opensees.lacking())
ELASTIC: dict[str, Any] = {"materials": [["Elastic", 1, 12.5e6]]}


def played(text: str, path: Path, **tables: Any) -> Run:
    plan = parse(text, path.parent)
    reality = from_reality(tables, plan, path.parent) if tables else as_planned(plan)
    assert virtual.run(virtual.assemble(plan, reality, path), str) is None
    return read(path)


ROD = """
def build(ops):
    ops.model('basic', '-ndm', 1, '-ndf', 1)
    ops.node(1, 0.0)
    ops.node(2, 1.0)
    ops.fix(1, 1)
    ops.uniaxialMaterial('Elastic', 1, 1e6)
    ops.element('Truss', 1, 1, 2, 1.0, 1)
    return 2, 1
"""


@with_opensees
def test_an_elastic_material_gives_the_bits_of_the_emulated_column(tmp_path: Path) -> None:
    text = "[test]\nduration = 1.0\n[ground_motion]\nscale = 0.2\n"
    emulated = played(text, tmp_path / "a.mcap")
    rig = {"class": "rths.opensees:Specimen", "options": ELASTIC}
    found = played(text, tmp_path / "b.mcap", master={"rig": rig})
    for name, values in emulated.columns["master"].items():
        assert np.array_equal(values, found.columns["master"][name]), name


@with_opensees
@pytest.mark.parametrize("name", ["steel02", "pinching4", "fiber_column"])
def test_a_plan_with_a_specimen_of_opensees_runs(name: str, tmp_path: Path) -> None:
    plan = load(EXAMPLES / f"{name}.toml").with_ticks(900)
    assert virtual.run(virtual.assemble(plan, as_planned(plan), tmp_path / "a.mcap"), str) is None
    found = read(tmp_path / "a.mcap").columns["master"]
    assert np.abs(found["column_force"]).max() > 3e3


@with_opensees
def test_the_loop_with_steel02_is_near_the_loop_with_this_programs_own_law(tmp_path: Path) -> None:
    plan = load(EXAMPLES / "steel02.toml").with_ticks(1500)
    assert virtual.run(virtual.assemble(plan, as_planned(plan), tmp_path / "a.mcap"), str) is None
    found = read(tmp_path / "a.mcap").columns["master"]["displacement"]
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    own = by_role(plan, simulate(plan, ground, seed=plan.test.seed))["master"]["displacement"]
    assert np.sqrt(np.mean((found - own) ** 2) / np.mean(own**2)) < 0.02


@with_opensees
def test_the_rigs_force_equals_that_of_opensees_along_the_same_path() -> None:
    rows = [["Steel02", 1, 25e3, 12.5e6, 0.05, 18.0, 0.925, 0.15]]
    silent = {"column_displacement": 0.0, "column_force": 0.0}
    rig = Specimen(0.002, 3, materials=rows, sensors=silent, substeps=3)
    other = SpecimenProcess("the same", {"materials": rows})
    try:
        rig.arm()
        reached = 0.0
        for command in 4e-3 * np.sin(np.linspace(0.0, 9.0, 500)):
            rig.write(ColumnCommand(float(command)))
            measured = rig.read()
            way = np.linspace(reached, measured.column_displacement, 4)[1:]
            assert measured.column_force == other.force(way)
            reached = measured.column_displacement
    finally:
        rig.disarm()
        other.close()


@with_opensees
@pytest.mark.parametrize(("name", "bars", "slip"), [("8-D22", 8, False), ("4-D22_bondslip", 4, True)])
def test_the_shipped_curves_are_those_of_the_model(name: str, bars: int, slip: bool) -> None:
    rows = np.loadtxt(CURVES / f"column_{name}.csv", delimiter=",", skiprows=1)[:120]
    options = {"bars": bars, "slip": slip}
    column = SpecimenProcess("the column", {"model": str(EXAMPLES / "fiber_column.py"), "options": options})
    try:
        for (before, _), (place, force) in pairwise(rows):
            way = np.linspace(before, place, 4)[1:] * 1e-3
            assert column.force(way) == pytest.approx(1e3 * force, abs=1.0)  # N: the file has so many digits
    finally:
        column.close()


@with_opensees
def test_a_model_without_equilibrium_ends_the_test_with_one_sentence(tmp_path: Path) -> None:
    limited = "    analyze = ops.analyze\n"
    limited += (
        "    ops.analyze = lambda steps: analyze(steps) if ops.nodeDisp(2, 1) < 1e-3 else -3\n    return"
    )
    (tmp_path / "rod.py").write_text(ROD.replace("    return", limited))
    column = SpecimenProcess("'rod.py'", {"model": str(tmp_path / "rod.py"), "options": {}})
    try:
        assert column.force([5e-4]) == pytest.approx(500.0)
        assert column.force([2e-3]) == pytest.approx(2000.0)
        with pytest.raises(RigError, match="finds no equilibrium of 'rod.py' at 3 mm"):
            column.force([3e-3])
    finally:
        column.close()


@with_opensees
def test_a_dead_opensees_process_ends_the_test_with_one_sentence() -> None:
    rig = Specimen(0.002, 3, **ELASTIC)
    os.kill(rig._process._program._process.pid, signal.SIGKILL)
    with pytest.raises(RigError, match="OpenSees has ended as the specimen 'Elastic'"):
        rig.write(ColumnCommand(1e-3))
    rig.disarm()


@with_opensees
@pytest.mark.parametrize(
    ("options", "text"),
    [
        (
            {"materials": [["Stele02", 1, 1.0]]},
            "specimen 'Stele02' \\(WARNING material type Stele02 is unknown\\)",
        ),
        (
            {"materials": [["Steel02", 1, 25e3]]},
            "specimen 'Steel02' \\(Invalid #args, want: uniaxialMaterial Steel02",
        ),
        (
            {"file": str(EXAMPLES / "steel02.toml")},
            "OpenSees cannot be the specimen .* \\(line 17: SyntaxError",
        ),
    ],
)
def test_a_material_that_opensees_refuses_is_reported(options: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        Specimen(0.002, 1, **options)


@with_opensees
@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x = 1\n", "it has no function build(ops, **options)"),
        ("def build(ops):\n    return 3\n", "build returns 3, but must return a node and a direction"),
        (ROD.replace("    ops.element", "    0 and ops.element"), "build makes no element"),
        (ROD.replace("return 2, 1", "return 3, 1"), "build returns node 3, which is not in the model"),
        (
            ROD.replace("return 2, 1", "return 2, 2"),
            "build returns direction 2, but must return one from 1 to 1",
        ),
    ],
)
def test_a_file_that_makes_no_specimen_is_refused_with_the_reason(
    text: str, says: str, tmp_path: Path
) -> None:
    (tmp_path / "rod.py").write_text(text)
    with pytest.raises(InputError) as told:
        Specimen(0.002, 1, file=str(tmp_path / "rod.py"))
    assert str(told.value) == f"OpenSees cannot be the specimen '{tmp_path}/rod.py' ({says})."


@with_opensees
@pytest.mark.parametrize(("text", "code"), [(ROD, 0), (ROD.replace("return 2, 1", "return 3, 1"), 2)])
def test_check_builds_the_specimen_and_lists_its_file(
    text: str, code: int, tmp_path: Path, call: Any, capsys: Any
) -> None:
    (tmp_path / "rod.py").write_text(text)
    plan = tmp_path / "p.toml"
    plan.write_text(
        '[test]\nduration = 0.5\n[master.rig]\nclass = "rths.opensees:Specimen"\noptions = { file = "rod.py" }\n'
    )
    assert call("check", plan, "--classes") == 0
    out = capsys.readouterr().out
    assert f"the class 'rths.opensees:Specimen' from {ROOT / 'rths' / 'opensees.py'}" in out
    assert f"the model 'rod.py' from {tmp_path / 'rod.py'}" in out
    assert call("check", plan) == code
    assert ("build returns node 3, which is not in the model" in capsys.readouterr().err) == (code == 2)


@with_opensees
def test_a_material_without_a_force_is_reported() -> None:
    rig = Specimen(0.002, 1, materials=[["Elastic", 1, float("nan")]])
    with pytest.raises(RigError) as told:
        rig.arm()
    assert str(told.value) == "OpenSees finds no force of 'Elastic' at 0 mm: correct its row in materials."
    rig.disarm()


def test_an_interpreter_without_openseespy_gives_one_sentence_with_the_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\necho \"ModuleNotFoundError: No module named 'openseespy'\" >&2\nexit 1\n")
    python.chmod(0o755)
    monkeypatch.setenv(INTERPRETER, str(python))
    with pytest.raises(InputError) as told:
        Specimen(0.002, 1, **ELASTIC)
    assert str(told.value) == (
        "OpenSees cannot be the specimen 'Elastic' (No module named 'openseespy'): `make opensees` installs "
        "OpenSeesPy, or RTHS_OPENSEES_PYTHON names an interpreter that has it."
    )
    monkeypatch.setenv(INTERPRETER, str(tmp_path / "nowhere"))
    with pytest.raises(InputError, match="nowhere in RTHS_OPENSEES_PYTHON cannot be started: No such file"):
        Specimen(0.002, 1, **ELASTIC)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({}, "needs either materials or a file"),
        (ELASTIC | {"file": "a.py"}, "needs either materials or a file"),
        ({"file": "nowhere.py"}, "There is no OpenSees model nowhere.py"),
        ({"materials": [["Elastic"]]}, "has the row"),
        ({"materials": ["Elastic"]}, "has the row"),
        (ELASTIC | {"substeps": 0}, "substeps in .* is 0"),
        (ELASTIC | {"actuator": {"model": "servo_hydraulic"}}, "must be 'fopdt'"),
        (ELASTIC | {"actuator": {"dealy": 0.0}}, "did you mean delay"),
    ],
)
def test_options_that_do_not_fit_are_refused(options: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        Specimen(0.002, 1, **options)


def test_a_file_among_the_options_is_looked_for_beside_the_plan(tmp_path: Path) -> None:
    text = '[master.rig]\nclass = "rths.opensees:Specimen"\noptions = { file = "column.py" }\n'
    plan = parse(text, tmp_path)
    assert as_planned(plan).master.options["file"] == f"{tmp_path.resolve()}/column.py"
    other = tmp_path / "other"
    reality = from_reality({"slave": {"rig": {"class": "a:B", "options": {"file": "x.py"}}}}, plan, other)
    assert reality.master.options["file"] == f"{tmp_path.resolve()}/column.py"
    assert reality.slave.options["file"] == f"{other.resolve()}/x.py"
