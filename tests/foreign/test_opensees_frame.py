"""The frame of OpenSees that ships as the building of a test, beside OpenSees alone with the specimen inside."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError
from common.foreign import ForeignModel
from common.opensees.process import INTERPRETER
from common.plan.plan import Plan
from common.plan.read import load, parse
from common.reality.reality import as_planned
from common.recording.reader import read
from loop import foreign, substructure
from simulation import virtual
from tests.helpers import ROOT
from tests.opensees import lacking

EXAMPLE = ROOT / "examples" / "opensees" / "frame.toml"
ALONE = Path(__file__).with_name("alone.py")
STIFFNESS = 6.25e6  # N/m of the specimen against the drift of its storey
IDEAL = """
[actuator]
delay = 0.0
time_constant = 0.0
[compensator]
kind = "none"
[sensors]
column_displacement = 0.0
column_force = 0.0
[slave]
kind = "none"
"""
# three columns of the default storey as a rod between ground and floor
ROD = """
def build(ops, stiffness=1.875e7, floors=1):
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(1, 0.0)
    ops.node(2, 1.0)
    ops.fix(1, 1)
    ops.mass(2, 160e3)
    ops.uniaxialMaterial("Elastic", 1, stiffness)
    ops.element("Truss", 1, 1, 2, 1.0, 1)
    return [2] * floors, 1
"""
PLAN = """
[test]
name = "rod"
duration = 1.0
[structure]
model = "opensees:rod.py"
mass = 160e3
stiffness = 25e6
[slave]
kind = "none"
"""
pytestmark = pytest.mark.skipif(bool(lacking()), reason=lacking())


def alone(plan: Plan, specimen: list[list[Any]], method: str = "AlphaOS") -> Any:
    """Displacements (ticks, floors) m of OpenSees without this program."""
    ground = substructure.ground_rows(plan, substructure.motion(plan))[0][:-1]
    task = {"specimen": specimen, "interval": plan.test.interval, "ground": ground.tolist()}
    words = [
        os.environ.get(INTERPRETER) or sys.executable,
        str(ALONE),
        str(EXAMPLE.with_name("frame.py")),
        method,
    ]
    done = subprocess.run(words, input=json.dumps(task), capture_output=True, text=True, check=True)
    return np.array(json.loads(next(line for line in done.stdout.splitlines() if line.startswith("[["))))


def hybrid(plan: Plan, path: Path) -> Any:
    """Displacements (ticks, floors) m of the closed loop."""
    assert virtual.run(virtual.assemble(plan, as_planned(plan), path), str) is None
    return read(path).columns["master"]["displacement"]


def apart(found: Any, expected: Any) -> float:
    """Largest difference of the storeys' drifts over the largest drift of that storey."""
    one, other = (np.diff(values, axis=1, prepend=0.0) for values in (found, expected))
    return float(np.max(np.max(np.abs(one - other), axis=0) / np.max(np.abs(other), axis=0)))


def drift(displacement: Any) -> Any:
    """The largest drift of every storey (m)."""
    return np.max(np.abs(np.diff(displacement, axis=1, prepend=0.0)), axis=0)


def plan_of(more: str = "", ticks: int = 700) -> Plan:
    return parse(EXAMPLE.read_text().split("[damper]", maxsplit=1)[0] + more, EXAMPLE.parent).with_ticks(
        ticks
    )


def test_the_hybrid_frame_equals_the_frame_with_the_specimen_inside_opensees(tmp_path: Path) -> None:
    """With an ideal transfer system to rounding; with default actuator, compensator and noise within 1 % of the drift.

    So is it of OpenSees with Newton's iterations in every step.
    """
    plan = plan_of(IDEAL)
    expected = alone(plan, [["Elastic", STIFFNESS]])
    assert 5e-3 < np.max(np.abs(expected)) < 30e-3
    assert apart(hybrid(plan, tmp_path / "ideal.mcap"), expected) < 1e-6
    found = drift(hybrid(plan_of('[slave]\nkind = "none"\n'), tmp_path / "real.mcap"))
    assert found == pytest.approx(drift(expected), rel=0.01)
    assert found == pytest.approx(drift(alone(plan, [["Elastic", STIFFNESS]], "Newton")), rel=0.01)


def test_a_yielding_specimen_in_the_loop_equals_one_inside_opensees(tmp_path: Path) -> None:
    yields = '[column]\nmodel = "bilinear"\nyield_displacement = 1e-3\nhardening = 0.1\n'
    plan = plan_of(IDEAL + yields)
    expected = alone(plan, [["Steel01", 12.5e3, STIFFNESS, 0.1]])
    assert apart(hybrid(plan, tmp_path / "yields.mcap"), expected) < 0.01


def test_the_example_runs_with_the_laboratories_of_the_default_test(tmp_path: Path) -> None:
    plan = load(EXAMPLE).with_ticks(500)
    path = tmp_path / "frame.mcap"
    assert virtual.run(virtual.assemble(plan, as_planned(plan), path), str) is None
    run = read(path)
    assert run.columns["master"]["displacement"].shape == (500, 2)
    assert np.max(np.abs(run.columns["slave"]["damper_force"])) > 50.0
    # what the storeys carry, by the masses of the plan, is what the model's own columns resist with their damping
    forces, moved = (run.columns["master"][name] for name in ("numerical_force", "displacement"))
    stiff = np.polyfit(moved[:, 0], forces[:, 0], 1)[0]
    assert 15e6 < stiff < 25e6


def rod(folder: Path, text: str = ROD) -> Plan:
    (folder / "rod.py").write_text(text)
    return parse(PLAN, folder)


def started(plan: Plan, **options: Any) -> ForeignModel:
    task = {"options": options, "interval": 0.01, "ground": [0.0] * 50, "stiffness": [6.25e6]}
    return ForeignModel(plan.structure.model, plan.base, plan.storeys, task)


def moved(models: list[ForeignModel]) -> list[list[float]]:
    """Displacements (m) of each model over 40 steps under 100 kN, the models in turn."""
    found: list[list[float]] = [[] for _ in models]
    try:
        for _ in range(40):
            for model, places in zip(models, found, strict=True):
                model.advance([1e5])
                motion = model.motion(10.0)
                assert motion
                places.append(motion.displacement[0])
    finally:
        for model in models:
            model.close()
    return found


def test_two_models_at_once_run_in_separate_processes(tmp_path: Path) -> None:
    plan = rod(tmp_path)
    soft, stiff = moved([started(plan), started(plan, stiffness=4e7)])
    assert [soft] == moved([started(plan)])
    assert [stiff] == moved([started(plan, stiffness=4e7)])
    assert max(soft) == pytest.approx(2e5 / 1.875e7, rel=0.02)  # twice that of the resting load
    assert max(stiff) == pytest.approx(2e5 / 4e7, rel=0.02)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "def build(ops):\n    raise RuntimeError('no such bar')\n",
            "cannot be the building (line 2: no such bar).",
        ),
        ("def build(ops:\n", "cannot be the building (line 1: SyntaxError: '(' was never closed)."),
        ("def build(ops):\n    return {}['bar'], 1\n", "cannot be the building (line 2: KeyError: 'bar')."),
        (
            "raise SystemExit(7)\n",
            "cannot be the building (its process said nothing and ended with exit code 7).",
        ),
        ("def build(ops):\n    ops.fix(1, 1)\n", "cannot be the building (line 2: "),
        ("def build(ops):\n    return 3\n", "must return nodes and a direction"),
        ("x = 1\n", "cannot be the building (it has no function build(ops, **options))."),
        (ROD.replace("ops.element", "0 and ops.element"), "cannot be the building (build makes no element)."),
        (ROD.replace("[2] *", "[3] *"), "(build returns node 3, which is not in the model)."),
        (
            ROD.replace("* floors, 1", "* floors, 2"),
            "(build returns direction 2, but must return one from 1 to 1).",
        ),
        (ROD.replace("floors=1", "floors=2"), "has 2 floors, but [structure] gives 1 masses"),
    ],
)
def test_a_model_that_cannot_be_the_building_is_refused_with_the_reason(
    text: str, says: str, tmp_path: Path
) -> None:
    plan = rod(tmp_path, text)
    with pytest.raises(InputError) as told:
        foreign.checked(plan)
    assert says in str(told.value)
    assert str(told.value).startswith("'rod.py' ")


def test_after_a_models_process_dies_the_laboratories_are_safe_and_the_recording_is_complete(
    tmp_path: Path,
) -> None:
    plan = rod(tmp_path)
    bench = virtual.assemble(plan, as_planned(plan), tmp_path / "a.mcap")
    virtual.play(bench, pause=lambda: bench.master.ticks >= 100)
    building: Any = bench.master._building
    os.kill(building._model._program._process.pid, signal.SIGKILL)
    error = virtual.run(bench, str)
    assert str(error) == "The building 'rod.py' has ended: its process was ended by signal 9, Killed."
    assert error is not None
    assert error.exit_code == 3
    run = read(tmp_path / "a.mcap")
    assert run.columns["master"]["seq"].tolist() == list(range(100))
    assert run.ramps["master"]["mode"][-1] == "safe"
    assert int(run.ramps["master"]["seq"][0]) == 100  # in the tick itself


def test_a_model_that_finds_no_equilibrium_ends_the_test_with_the_time(tmp_path: Path) -> None:
    text = ROD.replace("    return", "    ops.analyze = lambda steps, h: -3\n    return")
    plan = rod(tmp_path, text)
    error = virtual.run(virtual.assemble(plan, as_planned(plan), tmp_path / "a.mcap"), str)
    assert str(error) == "The building 'rod.py' has ended: OpenSees finds no equilibrium at 0.002 s."


def test_check_measures_the_step_times_and_lists_the_model_file(
    tmp_path: Path, call: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    rod(tmp_path)
    (tmp_path / "plan.toml").write_text(PLAN.replace("duration = 1.0", "duration = 1.0\ninterval = 0.01"))
    assert call("check", tmp_path / "plan.toml", "--classes") == 0
    said = capsys.readouterr().out
    assert f"[structure] runs the model 'opensees:rod.py' from {tmp_path}/rod.py, with your rights" in said
    call("check", tmp_path / "plan.toml", "--json")
    found = json.loads(capsys.readouterr().out)["structure"]["model"]
    assert found.startswith("A step of the building 'rod.py' takes ")


def test_a_diagnosis_judges_the_laboratories_and_states_that_the_building_is_not_judged(
    tmp_path: Path, call: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    rod(tmp_path)
    plan, real, out = tmp_path / "plan.toml", tmp_path / "real.toml", tmp_path / "a.mcap"
    plan.write_text(PLAN.replace("duration = 1.0", "duration = 6.0"))
    real.write_text('[[effect]]\nname = "column.friction"\nforce = 2500.0\n')
    assert call("run", plan, "--virtual", "--reality", real, "-o", out) == 0
    capsys.readouterr()
    assert call("diagnose", out, "--json", tmp_path / "a.json") == 0
    found = json.loads((tmp_path / "a.json").read_text())
    assert found["which"][0]["effects"] == ["column.friction"]
    assert any(text.startswith("'opensees:rod.py' computed the building") for text in found["warnings"])
