"""Fits: parameters known beforehand come back, and the fibre column's curves are followed."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from common.errors import InputError
from models.registry import Array
from models.specimens import SPECIMENS
from models.specimens.fit import FREE, fit, forces, thinned

CURVES = Path(__file__).parents[2] / "data" / "fiber_column"
NAMES = ("4-D22", "4-D22_bondslip", "8-D22", "8-D22_bondslip")
K, DY = 12.5e6, 0.008  # N/m, m
TRUE: dict[str, dict[str, float]] = {
    "linear": {"stiffness": K},
    "bilinear": {"stiffness": K, "yield_displacement": DY, "hardening": 0.1},
    "bouc_wen": {
        "stiffness": K,
        "yield_displacement": DY,
        "hardening": 0.05,
        "n": 1.6,
        "beta": 0.7,
        "gamma": 0.3,
    },
    "clough": {
        "stiffness": K,
        "yield_displacement": DY,
        "hardening": 0.06,
        "unloading": 0.4,
        "crack_displacement": 0.3 * DY,
        "closing": 0.2,
    },
}
DEGRADING = {
    "stiffness": K,
    "yield_displacement": DY,
    "hardening": 0.05,
    "n": 1.5,
    "beta": 0.8,
    "gamma": 0.2,
    "delta_nu": 0.05,
    "delta_eta": 0.08,
    "zeta_s": 0.7,
    "q": 0.1,
    "p": 0.4,
    "psi": 0.4,
    "delta_psi": 0.02,
    "lambda_": 0.6,
}
# found by `fit` with up to 80 steps to a minimum
FOUND: dict[str, dict[str, float]] = {
    "4-D22": {
        "stiffness": 62590000.0,
        "yield_displacement": 0.0023,
        "hardening": 0.067,
        "n": 1.304,
        "beta": 1.336,
        "delta_nu": 0.05663,
        "delta_eta": 0.01712,
        "zeta_s": 0.7208,
        "q": -0.6845,
        "p": 42.97,
        "psi": 0.105,
        "delta_psi": 0.07219,
        "lambda_": 5.0,
        "gamma": -0.3357,
    },
    "4-D22_bondslip": {
        "stiffness": 39190000.0,
        "yield_displacement": 0.003522,
        "hardening": 0.03035,
        "n": 1.204,
        "beta": 0.7891,
        "delta_nu": 0.1999,
        "delta_eta": 0.103,
        "zeta_s": 0.7643,
        "q": -0.9823,
        "p": 18.64,
        "psi": 0.1956,
        "delta_psi": 0.0105,
        "lambda_": 4.993,
        "gamma": 0.2109,
    },
    "8-D22": {
        "stiffness": 68780000.0,
        "yield_displacement": 0.002545,
        "hardening": 0.1303,
        "n": 1.226,
        "beta": 0.8226,
        "delta_nu": 0.1366,
        "delta_eta": 0.003453,
        "zeta_s": 0.6399,
        "q": -0.6636,
        "p": 21.23,
        "psi": 0.1288,
        "delta_psi": 0.0901,
        "lambda_": 4.999,
        "gamma": 0.1774,
    },
    "8-D22_bondslip": {
        "stiffness": 49600000.0,
        "yield_displacement": 0.003448,
        "hardening": 0.1139,
        "n": 1.208,
        "beta": 1.65,
        "delta_nu": 0.3581,
        "delta_eta": 0.09137,
        "zeta_s": 0.8547,
        "q": -0.8265,
        "p": 38.31,
        "psi": 0.2203,
        "delta_psi": 0.0001216,
        "lambda_": 4.915,
        "gamma": -0.6504,
    },
}


def protocol(steps: int = 40) -> Array:
    """Two cycles at each amplitude from half to five times the yield displacement (m)."""
    corners = [0.0] + [sign * DY * size for size in (0.5, 1.0, 2.0, 3.0, 5.0) for sign in (1, -1) * 2] + [0.0]
    parts = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(corners)]
    return np.concatenate([[0.0], *parts])


def curve(name: str) -> tuple[Array, Array]:
    """Deformation (m) and force (N) of a fibre column, without the end of 8-D22 that ORIGIN.md describes."""
    rows = np.loadtxt(CURVES / f"column_{name}.csv", delimiter=",", skiprows=1)
    if name == "8-D22":
        rows = rows[: np.flatnonzero(rows[:, 0] == rows[:, 0].min())[-1] + 1]
    return rows[:, 0] * 1e-3, rows[:, 1] * 1e3


def misfit(found: Array, force: Array) -> float:
    return float(np.sqrt(np.mean((found - force) ** 2) / np.mean(force**2)))


def test_every_model_can_be_fitted() -> None:
    assert FREE.keys() == SPECIMENS.keys()
    for name, ranges in FREE.items():
        assert set(ranges) <= set(SPECIMENS[name].params._fields)


@pytest.mark.parametrize("model", TRUE)
def test_known_parameters_come_back(model: str) -> None:
    path = protocol()
    force = forces(model, TRUE[model], path)
    found = fit(model, path, force)
    assert found.model == model
    assert found.nrmse < 1e-4
    assert found.parameters.keys() == found.intervals.keys() == TRUE[model].keys()
    for name, value in TRUE[model].items():
        assert found.parameters[name] == pytest.approx(value, rel=2e-3, abs=1e-5), name


@pytest.mark.parametrize("model", TRUE)
def test_intervals_hold_the_truth_under_noise(model: str) -> None:
    path = protocol()
    clean = forces(model, TRUE[model], path)
    noise = 0.02 * np.abs(clean).max() * np.random.default_rng(3).standard_normal(path.size)
    found = fit(model, path, clean + noise)
    assert found.nrmse == pytest.approx(misfit(clean, clean + noise), rel=0.02)
    for name, value in TRUE[model].items():
        low, high = found.intervals[name]
        assert low < found.parameters[name] < high
        # twice the width: one interval of twenty misses
        middle, width = 0.5 * (low + high), high - low
        assert abs(value - middle) <= width, name


def test_the_degrading_column_comes_back_from_a_start_nearby() -> None:
    path = protocol(20)
    force = forces("bwbn", DEGRADING, path)
    start = {name: value * 1.1 for name, value in DEGRADING.items() if name not in ("beta", "gamma")}
    found = fit("bwbn", path, force, start | {"beta": 0.7, "gamma": 0.3})
    assert found.nrmse < 0.01
    assert found.parameters["stiffness"] == pytest.approx(K, rel=0.05)
    assert found.intervals.keys() == DEGRADING.keys()


def test_a_start_with_another_sum_of_beta_and_gamma_is_the_same_loop() -> None:
    path, one = protocol(), TRUE["bouc_wen"]
    scaled = one | {"beta": 1.4, "gamma": 0.6, "yield_displacement": DY * 2.0 ** (1.0 / 1.6)}
    np.testing.assert_allclose(
        forces("bouc_wen", scaled, path), forces("bouc_wen", one, path), atol=1e-6 * K * DY
    )
    found = fit("bouc_wen", path, forces("bouc_wen", one, path), scaled)
    assert found.parameters["yield_displacement"] == pytest.approx(DY, rel=1e-3)


def test_a_long_record_is_thinned_but_keeps_its_peaks() -> None:
    path = protocol(500)
    kept = thinned(path, 1000)
    assert kept.size <= 1002
    assert (kept[0], kept[-1]) == (0, path.size - 1)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(path)))) + 1
    assert set(turns) <= set(kept.tolist())
    found = fit("clough", path, forces("clough", TRUE["clough"], path))
    assert found.nrmse < 1e-3


@pytest.mark.parametrize("name", NAMES)
def test_clough_follows_the_fibre_column_and_bilinear_does_not(name: str) -> None:
    path, force = curve(name)
    found = fit("clough", path, force)
    assert found.nrmse <= 0.10
    assert misfit(forces("clough", found.parameters, path), force) == pytest.approx(found.nrmse)
    assert fit("bilinear", path, force).nrmse > 0.15


@pytest.mark.parametrize("name", NAMES)
def test_bwbn_follows_the_fibre_column(name: str) -> None:
    path, force = curve(name)
    assert misfit(forces("bwbn", FOUND[name], path), force) <= 0.07


def test_the_end_of_8_d22_is_beyond_any_column() -> None:
    # the same peak is left three times; ORIGIN.md says what the last is
    rows = np.loadtxt(CURVES / "column_8-D22.csv", delimiter=",", skiprows=1)
    falls = []
    for peak in np.flatnonzero(rows[:, 0] == rows[:, 0].min()):
        way = rows[peak : peak + 80]
        later = np.interp(rows[peak, 0] + 1.0, way[:, 0], way[:, 1])
        falls.append(float(later - rows[peak, 1]))
    assert falls == pytest.approx([36.7, 36.7, 4.4], abs=0.2)


def test_what_cannot_be_fitted_is_refused() -> None:
    path = protocol()
    force = K * path
    for model, x, f, start, says in [
        ("cloug", path, force, None, "did you mean clough"),
        ("clough", path, force[:-1], None, "one length"),
        ("clough", path[:5], force[:5], None, "too few"),
        ("clough", path, np.where(path > 0, np.nan, force), None, "finite"),
        ("clough", path, 0.0 * force, None, "zero in every row"),
        ("clough", path, force, {"stifness": 1.0}, "did you mean stiffness"),
    ]:
        with pytest.raises(InputError, match=says):
            fit(model, x, f, start)
