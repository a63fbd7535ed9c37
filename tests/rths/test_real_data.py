"""Published measurements, imported and diagnosed as `docs/explanation/real_data.md` describes."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.recording.reader import read
from report.text import tabular
from rths.examine import import_
from rths.examine.diagnose import diagnose_file
from rths.examine.importing.import_map import load_map
from rths.examine.importing.onto_ticks import on_ticks
from tests.helpers import ROOT

EXAMPLES = ROOT / "examples" / "real_data"
COLUMNS = ROOT / "tests" / "data" / "fiber_column"
RATE = 128.982  # of the force rig, samples per second
NOMINAL_LAG = 0.010  # s, of its plan


def imported(data: Path, mapping: str, folder: Path) -> Path:
    """A recording made of a data file."""
    chosen = load_map(EXAMPLES / f"{mapping}_map.toml")
    path = folder / f"{mapping}.mcap"
    import_.write(path, chosen, on_ticks(chosen, tabular.read_table(data), data), data.name)
    return path


def some(data: Path, folder: Path, rows: slice) -> Path:
    """A copy of a table with its header and some of its rows."""
    header, *values = data.read_text(encoding="utf-8").splitlines()
    copy = folder / data.name
    copy.write_text("\n".join([header, *values[rows]]) + "\n", encoding="utf-8")
    return copy


def lag_by_correlation(command: Any, response: Any, interval: float, finer: int = 8) -> float:
    """Shift at which the response resembles the command most, s."""
    places = np.arange((command.size - 1) * finer) / finer
    u, y = (np.interp(places, np.arange(command.size), values) for values in (command, response))
    products = [float(np.mean(u[: u.size - k] * y[k:])) for k in range(10 * finer)]
    return int(np.argmax(products)) * interval / finer


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The recording of the force rig's first half and the report on it."""
    folder = tmp_path_factory.mktemp("rig")
    half = some(EXAMPLES / "force_rig.csv", folder, slice(10_000))
    path = imported(half, "force_rig", folder)
    return path, diagnose_file(path).plain()


@pytest.mark.slow
def test_the_force_rigs_extra_delay_agrees_with_the_cross_correlation(
    rig: tuple[Path, dict[str, Any]],
) -> None:
    path, report = rig
    signals = read(path).columns["master"]
    interval = 1.0 / RATE
    seen = lag_by_correlation(signals["actuator_command"], signals["column_displacement"], interval)
    assert seen == pytest.approx(0.030, abs=1e-3)  # of the first half; of the whole test 33 ms
    verdict = report["which"][0]
    assert verdict["effects"] == ["actuator.time_constant"]
    factor = verdict["parameters"]["actuator.time_constant"]["factor"]["value"]
    lag = factor * report["tolerances"]["actuator.time_constant"]["factor"] * NOMINAL_LAG
    assert lag == pytest.approx(seen, abs=3e-3)


@pytest.mark.slow
def test_the_unexplained_part_of_the_force_rigs_gap_is_reported(rig: tuple[Path, dict[str, Any]]) -> None:
    _, report = rig
    far = report["how_far"]
    assert report["status"] in ("partly_explained", "unknown_effect")
    assert far["judged_on"] == "interleaved (interpolation)"
    assert 5.0 * far["noise_floor"] < far["after"] < 0.025
    assert report["where"][0]["site"] == "actuator"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "rows"),
    [("8-D22_bondslip", 4), *((name, 1) for name in ("4-D22", "8-D22", "4-D22_bondslip", "8-D22_bondslip"))],
)
def test_a_fibre_column_is_found_to_yield_and_to_soften_with_its_largest_drift(
    name: str, rows: int, tmp_path: Path
) -> None:
    data = some(COLUMNS / f"column_{name}.csv", tmp_path, slice(None, None, rows))
    report = diagnose_file(imported(data, f"column_{name}", tmp_path)).plain()
    first = report["which"][0]
    assert first["effects"] == ["column.yielding"]
    law = first["parameters"]["column.yielding"]["law"]["value"]
    assert (
        5 <= law <= 11
    )  # reloading softens with the largest drift seen: towards the peak, or as its layers crack
    assert report["status"] == "partly_explained"
    assert report["how_far"]["after"] < 0.1 * report["how_far"]["before"]


@pytest.mark.slow  # compiles the kind; the page of the documents runs the same commands
def test_a_friction_damper_fitted_to_three_sines_predicts_the_others(
    capsys: pytest.CaptureFixture[str],
) -> None:
    runpy.run_path(str(EXAMPLES / "friction_damper_fits.py"), run_name="__main__")
    rows = [line.split() for line in capsys.readouterr().out.splitlines() if "mm" in line]
    missed = {(float(row[0]), float(row[2])): float(row[5]) for row in rows if row[4] == "predicted"}
    assert len(missed) == 10
    assert max(value for (frequency, _), value in missed.items() if frequency <= 1.0) < 20.0
    assert 30.0 < missed[2.0, 19.0] < 45.0  # it chatters, which no law from displacement to force can hold


@pytest.mark.slow  # 20 s: three sines of a damper of which the plan says nothing right
def test_a_friction_damper_planned_as_an_elastic_column_is_friction_behind_play(tmp_path: Path) -> None:
    path = imported(EXAMPLES / "friction_damper.npz", "friction_damper_column", tmp_path)
    report = diagnose_file(path).plain()
    assert set(report["which"][0]["effects"]) == {"column.friction", "column.slip"}
    assert report["which"][0]["parameters"]["column.friction"]["asymmetry"]["value"] < -0.1
    assert report["how_far"]["after"] < 0.15
