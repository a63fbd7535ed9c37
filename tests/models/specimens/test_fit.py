"""Fits of specimen models: known parameters are recovered, and the fibre column's curves are followed."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from common.errors import InputError
from models.registry import Array
from models.specimens import SPECIMENS
from models.specimens import fit as fitting
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
    "menegotto_pinto": {
        "stiffness": K,
        "yield_displacement": DY,
        "hardening": 0.05,
        "sharpness": 12.0,
        "loss": 0.8,
    },
    "pinched": {
        "stiffness": K,
        "yield_displacement": DY,
        "hardening": 0.05,
        "first_bend": 0.5,
        "second_stiffness": 0.4,
        "pinch_force": 0.3,
        "pinch_displacement": 0.6,
        "unloading": 0.3,
        "damage": 0.02,
        "asymmetry": -0.2,
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
        "stiffness": 67580000.0,
        "yield_displacement": 0.002145,
        "hardening": 2.55e-13,
        "n": 1.487,
        "beta": 1.859,
        "delta_nu": 0.01085,
        "delta_eta": 1e-05,
        "zeta_s": 0.7945,
        "q": -0.7857,
        "p": 29.27,
        "psi": 0.1391,
        "delta_psi": 0.04964,
        "lambda_": 5.0,
        "gamma": -0.8594,
    },
    "4-D22_bondslip": {
        "stiffness": 42680000.0,
        "yield_displacement": 0.003536,
        "hardening": 0.03074,
        "n": 1.0,
        "beta": 0.5057,
        "delta_nu": 0.1872,
        "delta_eta": 0.1794,
        "zeta_s": 0.6173,
        "q": -0.5528,
        "p": 5.567,
        "psi": 0.1214,
        "delta_psi": 1e-06,
        "lambda_": 5.0,
        "gamma": 0.4943,
    },
    "8-D22": {
        "stiffness": 64810000.0,
        "yield_displacement": 0.002774,
        "hardening": 0.1647,
        "n": 2.137,
        "beta": 0.9263,
        "delta_nu": 0.6318,
        "delta_eta": 1e-05,
        "zeta_s": 0.6309,
        "q": -1.0,
        "p": 11.49,
        "psi": 0.2373,
        "delta_psi": 0.08278,
        "lambda_": 5.0,
        "gamma": 0.07374,
    },
    "8-D22_bondslip": {
        "stiffness": 47920000.0,
        "yield_displacement": 0.003507,
        "hardening": 0.09933,
        "n": 1.447,
        "beta": 1.315,
        "delta_nu": 0.3184,
        "delta_eta": 0.0534,
        "zeta_s": 0.8134,
        "q": -1.0,
        "p": 18.32,
        "psi": 0.2441,
        "delta_psi": 0.01524,
        "lambda_": 5.0,
        "gamma": -0.3151,
    },
}


def protocol(steps: int = 40) -> Array:
    """Two cycles at each amplitude from half to five times the yield displacement (m)."""
    corners = [0.0] + [sign * DY * size for size in (0.5, 1.0, 2.0, 3.0, 5.0) for sign in (1, -1) * 2] + [0.0]
    parts = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(corners)]
    return np.concatenate([[0.0], *parts])


def curve(name: str) -> tuple[Array, Array]:
    """Deformation (m) and force (N) of a fibre column."""
    rows = np.loadtxt(CURVES / f"column_{name}.csv", delimiter=",", skiprows=1)
    return rows[:, 0] * 1e-3, rows[:, 1] * 1e3


def misfit(found: Array, force: Array) -> float:
    return float(np.sqrt(np.mean((found - force) ** 2) / np.mean(force**2)))


def test_every_model_can_be_fitted() -> None:
    assert FREE.keys() == SPECIMENS.keys()
    for name, ranges in FREE.items():
        assert set(ranges) <= set(SPECIMENS[name].params._fields)


@pytest.mark.parametrize("model", TRUE)
def test_known_parameters_are_recovered(model: str) -> None:
    path = protocol()
    force = forces(model, TRUE[model], path)
    found = fit(model, path, force)
    assert found.model == model
    assert found.nrmse < 1e-4
    assert found.parameters.keys() == found.intervals.keys() == TRUE[model].keys()
    for name, value in TRUE[model].items():
        assert found.parameters[name] == pytest.approx(value, rel=2e-3, abs=1e-5), name


@pytest.mark.parametrize("model", TRUE)
def test_intervals_cover_the_true_parameters_under_noise(model: str) -> None:
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


def test_the_degrading_columns_parameters_are_recovered_from_a_near_start() -> None:
    path = protocol(20)
    force = forces("bwbn", DEGRADING, path)
    start = {name: value * 1.1 for name, value in DEGRADING.items() if name not in ("beta", "gamma")}
    found = fit("bwbn", path, force, start | {"beta": 0.7, "gamma": 0.3})
    assert found.nrmse < 0.01
    assert found.parameters["stiffness"] == pytest.approx(K, rel=0.05)
    assert found.intervals.keys() == DEGRADING.keys()


def test_a_start_with_another_sum_of_beta_and_gamma_gives_the_same_loop() -> None:
    path, one = protocol(), TRUE["bouc_wen"]
    scaled = one | {"beta": 1.4, "gamma": 0.6, "yield_displacement": DY * 2.0 ** (1.0 / 1.6)}
    np.testing.assert_allclose(
        forces("bouc_wen", scaled, path), forces("bouc_wen", one, path), atol=1e-6 * K * DY
    )
    found = fit("bouc_wen", path, forces("bouc_wen", one, path), scaled)
    assert found.parameters["yield_displacement"] == pytest.approx(DY, rel=1e-3)


def test_of_few_starts_one_is_followed_to_its_minimum(monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[int] = []

    def counted(*args: Any, max_nfev: int, **options: Any) -> Any:
        steps.append(max_nfev)
        return least_squares(*args, max_nfev=max_nfev, **options)

    monkeypatch.setattr(fitting, "least_squares", counted)
    starts = [np.array([start]) for start in (-2.0, 0.0, 2.0)]
    best = fitting.followed(
        lambda x: np.array([x[0] ** 2 - 1.0, 0.1 * (x[0] - 1.0)]), starts, np.array([-9.0]), np.array([9.0])
    )
    assert best.x == pytest.approx([1.0])
    assert steps.count(fitting.EVALUATIONS) == 1


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
    assert misfit(forces("bwbn", FOUND[name], path), force) <= 0.08


@pytest.mark.parametrize("name", NAMES)
def test_a_fibre_column_unloads_from_the_same_peak_equally_each_time(name: str) -> None:
    path, force = curve(name)
    falls = []
    for peak in np.flatnonzero(path == path.min()):
        way = slice(peak, peak + 80)
        falls.append(float(np.interp(path[peak] + 1e-3, path[way], force[way]) - force[peak]))
    assert len(falls) == 3
    assert falls == pytest.approx(falls[:1] * 3, rel=0.01)


def test_records_that_cannot_be_fitted_are_refused() -> None:
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
