"""An FMU that is built here is the master's building and is compared with the master's own linear building."""

from __future__ import annotations

import gc
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError
from common.plan.read import parse
from common.reality.reality import as_planned
from common.recording.reader import read
from common.recording.run import Run
from common.signals import Signal
from loop import foreign
from rths.fmi import build
from simulation import virtual

REASON = "FMPy is not installed: make fmi"
pytestmark = [
    pytest.mark.skipif(find_spec("fmpy") is None or find_spec("lxml") is None, reason=REASON),
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler on this machine"),
]
INTERVAL = 0.002
# three columns of the default storey by the explicit Newmark method; beyond 20 kN it fails, and writes more than that
STOREY = """
import os, struct, sys
out = os.dup(1)
source = sys.stdin.buffer
h, m, c, k = 0.002, 160e3, 2e5, 18.75e6
x = v = a = half = 0.0
while order := source.read(1):
    if order == b"S":
        source.read(8)
    else:
        force, ground = struct.unpack("<2d", source.read(16))
        if abs(force) > 2e4:
            sys.stderr.write("Traceback (most recent call last):\\nOSError: the pipe of an inner process\\n")
            sys.stderr.flush()
            os.write(out, b"\\1" + struct.pack("<H", 10) + b"it is torn")
        a = (force - m * ground - k * x - c * half) / (m + 0.5 * h * c)
        half += h * a
        x, v = x + h * half, half + 0.5 * h * a
    os.write(out, b"\\0" + struct.pack("<3d", x, v, a))
"""
PLAN = """
[test]
name = "storey"
duration = 1.0
[structure]
MODELmass = 160e3
stiffness = 25e6
[actuator]
delay = 0.0
time_constant = 0.0
[compensator]
kind = "none"
[slave]
kind = "none"
"""
FOREIGN = PLAN.replace("MODEL", 'model = "storey.fmu"\n')


def signal(name: str, unit: str) -> Signal:
    return Signal(name, unit, name)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the FMU of a storey."""
    path = tmp_path_factory.mktemp("storey")
    wanted = build.AskedFor(
        "storey",
        "a storey",
        [signal("force_1", "N"), signal("ground_acceleration", "m/s²")],
        [signal("displacement_1", "m"), signal("velocity_1", "m/s"), signal("acceleration_1", "m/s²")],
        INTERVAL,
        1,
        1.0,
        (sys.executable, "-c", f"exec({STOREY!r})"),
        {},
    )
    build.build(wanted, path / "storey.fmu")
    return path


def played(text: str, folder: Path, path: Path) -> Run:
    plan = parse(text, folder)
    assert virtual.run(virtual.assemble(plan, as_planned(plan), path), str) is None
    return read(path)


def test_the_loop_with_an_fmu_equals_the_loop_with_the_masters_own_building(
    folder: Path, tmp_path: Path
) -> None:
    own = played(PLAN.replace("MODEL", ""), folder, tmp_path / "own.mcap").columns["master"]
    found = played(FOREIGN, folder, tmp_path / "found.mcap").columns["master"]
    for name in ("displacement", "column_target", "column_force"):
        assert np.max(np.abs(found[name] - own[name])) <= 1e-9 * np.max(np.abs(own[name])), name
    # the FMU gives the velocity at the end of a step, and the acceleration at its beginning: one step later
    assert found["velocity"] == pytest.approx(own["velocity"], abs=1e-5)
    assert found["acceleration"][1:] == pytest.approx(own["acceleration"][:-1], abs=1e-9)


def test_the_process_of_a_building_leaves_no_unpacked_fmu(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (place := tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(place))
    played(FOREIGN, folder, tmp_path / "found.mcap")
    gc.collect()
    assert list(place.iterdir()) == []


def test_an_fmu_without_velocities_gets_them_from_differences(folder: Path, tmp_path: Path) -> None:
    options = 'options = { outputs = ["displacement_1"] }\nmass'
    own = played(FOREIGN, folder, tmp_path / "own.mcap").columns["master"]
    found = played(FOREIGN.replace("mass", options), folder, tmp_path / "a.mcap").columns["master"]
    assert np.array_equal(found["displacement"], own["displacement"])
    assert np.max(np.abs(found["velocity"] - own["velocity"])) < 0.1 * np.max(np.abs(own["velocity"]))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"outputs": ["displacement_2"]}, "has no variable 'displacement_2': it has"),
        ({"inputs": ["force_1"]}, "must be 1 forces and the ground acceleration"),
        ({"bars": 3}, "options in [structure] has 'bars', but an FMU takes inputs, outputs, start."),
    ],
)
def test_options_that_do_not_fit_are_refused(options: dict[str, Any], says: str, folder: Path) -> None:
    plan = parse(FOREIGN, folder)
    object.__setattr__(plan.structure, "options", options)
    with pytest.raises(InputError) as told:
        foreign.checked(plan)
    assert says in str(told.value)


def test_an_fmu_that_fails_ends_the_test_with_its_own_message(folder: Path, tmp_path: Path) -> None:
    plan = parse(FOREIGN + "[ground_motion]\nscale = 2.0\n", folder)
    error = virtual.run(virtual.assemble(plan, as_planned(plan), tmp_path / "a.mcap"), str)
    assert error is not None
    assert error.exit_code == 3
    assert str(error) == "The building 'storey.fmu' has ended: the FMU storey.fmu failed: it is torn."
