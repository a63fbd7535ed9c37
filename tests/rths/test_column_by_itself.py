"""A column by itself that its measured motion drives: filters of its channels, and the digits it was printed with."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

from common.recording.imported import NOTHING_STATED, ImportedChannel
from common.recording.logger.low_pass import LoggerFilter
from common.recording.reader import read as read_recording
from diagnosis.recorded import record
from diagnosis.recorded.column_alone import ColumnAlone, apart
from diagnosis.recorded.divided import parts_of
from models.registry import Array
from models.specimens.fit import forces
from rths.examine.diagnose import diagnose_recording

RATE, CUTOFF = 500.0, 30.0  # Hz
LAW = {"stiffness": 9e6, "yield_displacement": 8e-3, "hardening": 0.04, "n": 2.0}  # in N and m
PLAN = f"""[test]
interval = {1.0 / RATE}
[slave]
kind = "none"
[column]
model = "{{model}}"
stiffness = {LAW["stiffness"]}
{{more}}
[sensors]
column_displacement = 4e-6
column_force = 45.0
"""
YIELDS = "yield_displacement = 8e-3\nhardening = 0.04\nn = 2.0"
FILTER = f', filter = {{ type = "butterworth", order = 4, cutoff = {CUTOFF} }}'
ROWS = (
    'column_displacement = { column = "d", unit = "mm"%s }\ncolumn_force = { column = "f", unit = "kN"%s }\n'
)


@pytest.fixture
def status(call: Any, tmp_path: Path) -> Any:
    """The status of a column whose displacement (mm) and force (kN) were printed, under a plan and a map."""

    def found(plan: str, columns: Array, digits: list[str], head: str, more: tuple[str, str]) -> Any:
        np.savetxt(tmp_path / "a.csv", columns, digits, ",", header="d,f", comments="")
        (tmp_path / "plan.toml").write_text(plan)
        (tmp_path / "map.toml").write_text(f'plan = "plan.toml"\n{head}[signals]\n{ROWS % more}')
        out = tmp_path / "a.mcap"
        assert call("import", tmp_path / "a.csv", "--map", tmp_path / "map.toml", "-o", out) == 0
        (report,) = diagnose_recording(out).values()
        return report.status

    return found


@pytest.mark.parametrize(("motion", "force"), [("", FILTER), (FILTER, FILTER), (FILTER, "")])
def test_the_stated_filters_of_both_channels_are_no_effect(motion: str, force: str, status: Any) -> None:
    t = np.arange(round(8.0 * RATE)) / RATE
    true = np.sum([2.0 * np.sin(2.0 * np.pi * f * t + f) for f in (0.6, 1.7, 3.1)], axis=0) * np.minimum(
        t, 1.0
    )
    low = signal.butter(4, 2.0 * np.pi * CUTOFF, analog=True)

    def logged(values: Array, stated: str) -> Array:
        return np.asarray(signal.lsim(low, values, t)[1]) if stated else values

    rng = np.random.default_rng(4)
    read = logged(true, motion) + 4e-3 * rng.standard_normal(t.size)
    felt = logged(9.0 * true, force) + 0.045 * rng.standard_normal(t.size)
    plan = PLAN.format(model="linear", more="")
    columns = np.column_stack([read, felt])
    assert status(plan, columns, ["%.6f", "%.6f"], f"rate = {RATE}\n", (motion, force)) in (
        "no_gap",
        "within_tolerances",
    )


@pytest.mark.parametrize("noisy", [True, False])
def test_the_digits_of_a_static_test_are_no_gap_of_its_specimen(noisy: bool, status: Any) -> None:
    turns = np.concatenate(
        [[0.0], np.repeat([2.0, 6.0, 12.0, 20.0, 30.0], 4) * np.tile([1.0, -1.0], 10), [0.0]]
    )
    true = np.concatenate([np.linspace(a, b, 60) for a, b in pairwise(turns)])
    rng = np.random.default_rng(6)
    read = true + noisy * 4e-3 * rng.standard_normal(true.size)
    force = 1e-3 * forces("bouc_wen", LAW, 1e-3 * true) + noisy * 0.045 * rng.standard_normal(true.size)
    stated = (', resolution = "0.01 mm"', ', resolution = "0.1 kN"')
    plan = PLAN.format(model="bouc_wen", more=YIELDS)
    columns = np.column_stack([read, force])
    assert status(plan, columns, ["%.2f", "%.1f"], "static = true\n", stated) in (
        "no_gap",
        "within_tolerances",
    )


def test_rows_that_drive_a_specimen_turn_where_it_did_and_err_by_noise_and_digits(
    status: Any, tmp_path: Path
) -> None:
    true = np.concatenate(
        [np.linspace(0.0, 8.0, 1000), np.linspace(8.0, -8.0, 2000), np.linspace(-8.0, 0.0, 1000)]
    )
    read = true + 4e-3 * np.random.default_rng(7).standard_normal(true.size)
    columns = np.column_stack([read, 1e-3 * forces("bouc_wen", LAW, 1e-3 * true)])
    status(PLAN.format(model="bouc_wen", more=YIELDS), columns, ["%.2f", "%.6f"], "static = true\n", ("", ""))
    (part,) = parts_of(record.build(read_recording(tmp_path / "a.mcap"), role="master"))
    assert isinstance(part, ColumnAlone)
    ways = np.sign(np.diff(part.inputs))
    assert np.count_nonzero(np.diff(ways[ways != 0.0])) == 2
    assert part.blurred == pytest.approx(LAW["stiffness"] * np.hypot(4e-6, 1e-5 / np.sqrt(12.0)), rel=1e-6)


def test_channels_that_are_alike_need_no_filter() -> None:
    one = ImportedChannel(LoggerFilter("bessel", 4, 50.0), 2e-3, resolution=1e-5)
    same = ImportedChannel(LoggerFilter("bessel", 4, 50.0), 2e-3, calibration=0.01)
    assert apart(one, same) == (NOTHING_STATED, NOTHING_STATED)
    motion, force = apart(one, NOTHING_STATED)
    assert (motion.filter, motion.delay) == (one.filter, one.delay)
    assert force == NOTHING_STATED


@pytest.mark.parametrize(("model", "more", "keeps"), [("bouc_wen", YIELDS, True), ("linear", "", False)])
def test_what_a_motion_does_at_its_turns_is_kept_by_a_memory_only(
    model: str, more: str, keeps: bool, call: Any, tmp_path: Path
) -> None:
    t = np.arange(2000) / RATE
    motion = 20.0 * np.sin(2.0 * np.pi * 1.3 * t)
    np.savetxt(
        tmp_path / "a.csv", np.column_stack([motion, 9.0 * motion]), "%.6f", ",", header="d,f", comments=""
    )
    (tmp_path / "plan.toml").write_text(PLAN.format(model=model, more=more))
    (tmp_path / "map.toml").write_text(f'plan = "plan.toml"\nrate = {RATE}\n[signals]\n{ROWS % ("", "")}')
    out = tmp_path / "a.mcap"
    assert call("import", tmp_path / "a.csv", "--map", tmp_path / "map.toml", "-o", out) == 0
    (part,) = parts_of(record.build(read_recording(out), role="master"))
    bend = 20e-3 * (2.0 * np.pi * 1.3 / RATE) ** 2
    expected = LAW["stiffness"] * 0.5 * bend / np.sqrt(80.0) if keeps else 0.0
    assert np.max(part.blurred) == pytest.approx(expected, rel=0.05)
