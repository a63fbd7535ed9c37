"""An imported shaking table of whose motion a share passes through its oil column, logged by sensors that are off."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from rths.examine.diagnose import diagnose_file
from rths.examine.import_ import add_arguments, run

Array = NDArray[np.float64]
INTERVAL, SUBSTEPS, SECONDS = 0.002, 10, 16.0
OMEGA, RATIO, DELAY, FRICTION = 2.0 * np.pi * 15.0, 0.7, 0.004, 0.08
OIL, OIL_RATIO, SHARE, OFF, LEANING = 2.0 * np.pi * 17.0, 0.05, 0.06, 1.2e-4, 0.04


def wanted(t: Array) -> Array:
    """An earthquake's displacement, m, by waves of 0.4 to 11 Hz."""
    draw = np.random.default_rng(8)
    waves = ((f, draw.uniform(0.0, 6.0)) for f in np.geomspace(0.4, 11.0, 24))
    shape = np.sum([np.sin(2.0 * np.pi * f * t + phase) / f**1.7 for f, phase in waves], axis=0)
    return np.asarray(0.01 * np.minimum(t / 3.0, 1.0) * np.exp(-np.maximum(t - 6.0, 0.0) / 5.0) * shape)


def shaken() -> tuple[Array, Array, Array]:
    """Command m, displacement m and acceleration m/s²; the loop by small explicit steps, the oil column exactly."""
    h = INTERVAL / SUBSTEPS
    t = np.asarray(np.arange(round(SECONDS / INTERVAL) * SUBSTEPS) * h, dtype=np.float64)
    late, moved, gained = (
        wanted(np.asarray(np.maximum(t - DELAY - INTERVAL, 0.0), dtype=np.float64)),
        np.zeros(t.size),
        np.zeros(t.size),
    )
    x = v = 0.0
    for k in range(t.size):
        push = OMEGA**2 * (late[k] - x) - 2.0 * RATIO * OMEGA * v
        sticking = abs(v) < 1e-9 and abs(push) < FRICTION
        gain = 0.0 if sticking else push - FRICTION * np.sign(v if abs(v) >= 1e-9 else push)
        moved[k], gained[k] = x, gain
        after = v + h * gain
        v = 0.0 if v * after < 0.0 else after
        x += h * v
    oil = signal.StateSpace(*signal.tf2ss([OIL**2], [1.0, 2.0 * OIL_RATIO * OIL, OIL**2]))
    motion, rate = ((1.0 - SHARE) * one + SHARE * signal.lsim(oil, one, t)[1] for one in (moved, gained))
    return wanted(t)[::SUBSTEPS], motion[::SUBSTEPS], rate[::SUBSTEPS]


@pytest.mark.slow
def test_a_share_of_an_oil_column_and_friction_are_found_behind_zeros_that_are_off(tmp_path: Path) -> None:
    command, motion, rate = shaken()
    noise = np.random.default_rng(3).standard_normal((2, command.size))
    rows = np.column_stack(
        [1e3 * command, 1e3 * (motion + OFF + 5e-6 * noise[0]), rate + LEANING + 0.01 * noise[1]]
    )
    np.savetxt(tmp_path / "table.txt", rows, header="cmd  lvdt  acc", comments="", fmt="%9.5f")
    (tmp_path / "table.toml").write_text(
        f'[test]\nname = "table"\ninterval = {INTERVAL}\n[table]\nfrequency = 15.0\ndamping_ratio = 0.7\n'
        f"delay = {DELAY}\n[sensors]\ntable_displacement = 5e-6\ntable_acceleration = 0.01\n"
    )
    (tmp_path / "map.toml").write_text(
        f'plan = "table.toml"\nrate = {1.0 / INTERVAL}\n[signals]\n'
        'table_command = { column = "cmd", unit = "mm" }\ntable_displacement = { column = "lvdt", unit = "mm" }\n'
        'table_acceleration = { column = "acc" }\n'
    )
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    words = ["table.txt", "--map", "map.toml", "-o", "table.mcap"]
    paths = [word if word.startswith("-") else str(tmp_path / word) for word in words]
    assert run(parser.parse_args(paths)) == 0
    first = diagnose_file(tmp_path / "table.mcap").plain()["which"][0]
    readings = {"sensor.table_displacement.bias", "sensor.table_acceleration.bias"}
    assert set(first["effects"]) == {*readings, "table.friction", "table.oil_column"}
    found = first["parameters"]
    assert found["table.friction"]["acceleration"]["value"] == pytest.approx(FRICTION, rel=0.1)
    assert found["table.oil_column"]["frequency"]["value"] == pytest.approx(17.0, rel=0.02)
    assert found["table.oil_column"]["share"]["value"] == pytest.approx(SHARE, rel=0.2)
