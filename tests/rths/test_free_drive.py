"""An imported drive without a spring: friction and a constant force are found although its replay would drift.

In such a drive friction with a constant force is the same as friction that is larger in one direction. The pair has
fewer free parameters than that law of friction, so it is named, and the report says that the law explains as much.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from common.errors import InputError
from rths.examine.diagnose import diagnose_file
from rths.examine.import_ import add_arguments, run

Array = NDArray[np.float64]
MASS, DASHPOT, FRICTION, OFFSET = 95.0, 200.0, 20.0, 3.0
INTERVAL, SUBSTEPS, SECONDS, PERIOD = 0.002, 20, 12.0, 5.0


def wanted(t: float) -> float:
    """A motion of 0.1 m between two points, with pauses."""
    place = (t % PERIOD) / PERIOD
    share = min(max((place if place < 0.5 else place - 0.5) / 0.4, 0.0), 1.0)
    smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return 0.1 * (smooth if place < 0.5 else 1.0 - smooth)


def drive(teeth: float = 0.0) -> tuple[Array, Array]:
    """Motor force N and position m in closed position control, by small explicit steps with sticking.

    `teeth` is the amplitude (N) of a force that the motor's magnets add every 24 mm.
    """
    count = round(SECONDS / INTERVAL)
    force, position = np.empty(count), np.empty(count)
    x, v, h = 0.0, 0.0, INTERVAL / SUBSTEPS
    for k in range(count):
        position[k] = x
        force[k] = 38880.0 * (wanted(k * INTERVAL) - x) - 1944.0 * v
        for _ in range(SUBSTEPS):
            push = force[k] - DASHPOT * v + OFFSET + teeth * np.sin(2.0 * np.pi * x / 0.024)
            if abs(v) < 1e-9 and abs(push) < FRICTION:
                v = 0.0
                continue
            against = np.sign(v) if abs(v) >= 1e-9 else np.sign(push)
            after = v + h * (push - FRICTION * against) / MASS
            v = 0.0 if v * after < 0.0 else float(after)
            x += h * v
    return force, position + 1e-6 * np.random.default_rng(3).standard_normal(count)


def diagnosed(tmp_path: Path, force: Array, position: Array) -> dict[str, Any]:
    """The report on an imported drive."""
    return diagnose_file(imported(tmp_path, force, position)).plain()


def imported(tmp_path: Path, force: Array, position: Array) -> Path:
    """The recording of a drive."""
    import argparse

    np.savetxt(
        tmp_path / "drive.csv", np.column_stack([force, position]), delimiter=",", header="F,q", comments=""
    )
    (tmp_path / "drive.toml").write_text(
        f'[test]\nname = "drive"\ninterval = {INTERVAL}\n'
        f"[damper]\nmass = {MASS}\nstiffness = 0.0\ndamping = {DASHPOT}\nmotor_time_constant = 0.0\n"
        "[sensors]\ndamper_stroke = 1e-6\n"
    )
    (tmp_path / "map.toml").write_text(
        f'plan = "drive.toml"\nrate = {1.0 / INTERVAL}\n[signals]\n'
        'damper_command = { column = "F" }\ndamper_stroke = { column = "q" }\ntable_acceleration = { value = 0.0 }\n'
    )
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    words = [
        str(tmp_path / "drive.csv"),
        "--map",
        str(tmp_path / "map.toml"),
        "-o",
        str(tmp_path / "drive.mcap"),
    ]
    assert run(parser.parse_args(words)) == 0
    return tmp_path / "drive.mcap"


@pytest.mark.slow
def test_the_friction_of_a_drive_without_a_spring_is_found(tmp_path: Path) -> None:
    report = diagnosed(tmp_path, *drive())
    first = report["which"][0]
    assert set(first["effects"]) == {"damper.friction", "damper.offset"}
    assert first["parameters"]["damper.friction"]["force"]["value"] == pytest.approx(FRICTION, rel=0.02)
    assert first["parameters"]["damper.offset"]["force"]["value"] == pytest.approx(OFFSET, rel=0.05)
    alike = "damper.friction with damper.offset from damper.friction (law by direction and speed)"
    assert any(f"cannot separate {alike}" in warning for warning in report["warnings"])
    assert report["where"][0]["site"] == "damper"


@pytest.mark.slow
def test_friction_is_not_the_explanation_of_a_motor_with_teeth(tmp_path: Path) -> None:
    """Their force of a twentieth of the friction moves the drive by 5 µm, of a stroke of 50 mm."""
    report = diagnosed(tmp_path, *drive(teeth=1.0))
    assert report["status"] == "partly_explained"
    assert "damper.friction" in report["which"][0]["effects"]


@pytest.mark.parametrize(
    ("push", "length", "message"),
    [
        (-1.0, 1.0, "'damper_stroke' has the opposite sign of what the plan predicts from damper_command"),
        (1.0, 1e3, "is 490 times what the plan predicts from damper_command: check the units of its column"),
    ],
    ids=["sign of the force", "millimetres"],
)
def test_a_slip_is_seen_by_what_forces_did_to_a_motion_without_a_spring(
    push: float, length: float, message: str, tmp_path: Path
) -> None:
    force, position = drive()
    with pytest.raises(InputError, match=re.escape(message)):
        imported(tmp_path, push * force, length * position)


def test_volts_taken_for_newtons_are_told_and_imported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    force, position = drive()
    imported(tmp_path, force / 35.0, position)
    assert (
        "check: 'damper_stroke' is 17.1 times what the plan predicts from damper_command"
        in capsys.readouterr().out
    )
