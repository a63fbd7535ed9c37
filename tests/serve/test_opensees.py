"""OpenSees in another process with laboratories as its elements, compared with its own springs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InterlockError
from common.opensees.process import INTERPRETER
from common.plan.plan import Plan
from common.plan.read import with_test
from common.reality.reality import as_planned
from common.recording.reader import read
from master.client.building import ClientBuilding
from master.client.pace import AsFastAsItGoes
from simulation import virtual
from tests.helpers import ROOT
from tests.opensees import lacking
from tests.processes import HANG_S
from tests.serve.client import PATIENCE_S, free_port
from tests.serve.serving import ALONE, plan_of

MODEL = ROOT / "benchmarks" / "opensees" / "model.py"
STEPS, REST = 400, 20
pytestmark = pytest.mark.skipif(bool(lacking()), reason=lacking())
EXPLICIT = ("NewmarkExplicit", "CentralDifference", "AlphaOS")
TWICE = '[slave.east]\nkind = "column"\n'
YIELDING = ALONE + '[column]\nmodel = "bilinear"\nyield_displacement = 2e-4\nhardening = 0.1\n'


def opensees(*words: object) -> subprocess.Popen[str]:
    """OpenSees on the model, in the interpreter that has it."""
    return subprocess.Popen(
        [os.environ.get(INTERPRETER) or sys.executable, str(MODEL), *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def answered(process: subprocess.Popen[str]) -> Any:
    """Displacements (steps, laboratories) m."""
    said, complaint = process.communicate(timeout=HANG_S)
    lines = [line for line in said.splitlines() if line.startswith("{")]
    assert lines, complaint
    return np.array(json.loads(lines[-1])["found"])


def served(
    folder: Path, plan: Plan, integrator: str, algorithm: str = "Linear", *, elements: int = 1, rest: int = 0
) -> tuple[Any, Any, Any]:
    """The error that ended the test, what OpenSees found, and the recording."""
    ports, laboratories = [free_port() for _ in range(elements)], len(plan.kinds)
    addresses = [f"127.0.0.1:{port}" for port in ports]
    building = ClientBuilding(plan, addresses, AsFastAsItGoes(PATIENCE_S, str))
    with opensees(integrator, algorithm, STEPS, rest, laboratories, *ports) as process:
        end = time.monotonic() + PATIENCE_S
        while building.awaited and process.poll() is None and time.monotonic() < end:
            building.look_after()
        assert not building.awaited
        bench = virtual.assemble(plan, as_planned(plan), folder / "test.mcap", building=building)
        error = virtual.run(bench, str)
        if error is not None:  # OpenSees waits for ever for an answer over a connection that is closed
            process.kill()
            return error, None, read(folder / "test.mcap")
        found = answered(process)
    return error, found, read(folder / "test.mcap")


def springs(integrator: str, laboratories: int = 1, algorithm: str = "Linear", rest: int = 0) -> Any:
    """The same model with springs of its own."""
    return answered(opensees(integrator, algorithm, STEPS, rest, laboratories))


def same(found: Any, expected: Any) -> None:
    """Equal to twelve digits of the largest displacement, at every step."""
    assert found.shape == expected.shape == (STEPS, found.shape[1])
    assert np.max(np.abs(found - expected)) <= 1e-12 * np.max(np.abs(expected))


@pytest.mark.parametrize("integrator", [*EXPLICIT, "Newmark"])
def test_a_served_laboratory_equals_the_spring_that_it_represents(integrator: str, tmp_path: Path) -> None:
    error, found, run = served(tmp_path, plan_of(), integrator)
    assert error is None
    same(found, springs(integrator))
    moved = run.columns["master"]["client_displacement"]
    assert integrator == "AlphaOS" or np.isin(moved, found).all()  # AlphaOS corrects what it imposes
    assert not run.columns["master"]["client_late"].any()


@pytest.mark.parametrize("elements", [1, 2])
@pytest.mark.parametrize("integrator", EXPLICIT)
def test_two_laboratories_are_served_as_one_element_or_as_two(
    integrator: str, elements: int, tmp_path: Path
) -> None:
    """Each step lasts two intervals, so that the slave's force belongs to its displacement."""
    plan = with_test(plan_of(TWICE), intervals=2)
    error, found, run = served(tmp_path, plan, integrator, elements=elements)
    assert error is None
    same(found, springs(integrator, 2))
    assert run.columns["master"]["client_displacement"].shape[1] == 2
    assert run.shared["client_force"] == ("master", "slave.east")


@pytest.mark.parametrize("integrator", [*EXPLICIT, "Newmark"])
def test_every_step_of_an_analysis_is_one_step_of_the_test_also_at_rest(
    integrator: str, tmp_path: Path
) -> None:
    """A static analysis that moves nothing, a motion that begins with zeros, then the motion."""
    error, found, run = served(tmp_path, plan_of(), integrator, rest=REST)
    assert error is None
    same(found, springs(integrator, rest=REST))
    of = run.columns["master"]
    assert of["client_step"].tolist() == list(range(1, REST + STEPS + 1))
    assert np.max(np.abs(of["client_displacement"][: 2 * REST])) < 1e-15  # rounding of the motion's times
    assert np.all(of["client_displacement"][2 * REST + 2 :] != 0.0)
    told = [event["text"].split(" ms ")[0] for event in run.events if "of its analysis" in event["text"]]
    assert told == ["A step of the client's is 50", "A step of the client's is 2"]


def test_steps_at_rest_are_counted_once_for_two_elements(tmp_path: Path) -> None:
    error, found, run = served(
        tmp_path, with_test(plan_of(TWICE), intervals=2), EXPLICIT[0], elements=2, rest=REST
    )
    assert error is None
    same(found, springs(EXPLICIT[0], 2, rest=REST))
    assert run.columns["master"]["client_step"][-1] == REST + STEPS


def test_newton_on_linear_laboratories_imposes_each_displacement_once(tmp_path: Path) -> None:
    error, found, _ = served(tmp_path, plan_of(), "Newmark", "Newton")
    assert error is None
    same(found, springs("Newmark", algorithm="Newton"))


def test_newton_on_a_yielding_specimen_is_refused_and_suitable_integrators_are_named(tmp_path: Path) -> None:
    error, _, run = served(tmp_path, plan_of(YIELDING), "Newmark", "Newton")
    assert isinstance(error, InterlockError)
    assert "NewmarkExplicit, CentralDifference or AlphaOS" in str(error)
    assert run.ramps["master"]["mode"][-1] == "safe"
