"""Fits of a laboratory's parameters and noise, their derivatives, and the choice of the beginning of a test."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.plan import read as plans
from common.plan.plan import Plan
from common.recording.reader import read
from diagnosis.fits import fitting, hypothesis, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import secant
from diagnosis.fits.residuals import Data
from diagnosis.recorded import record
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.nuisances import of_building
from diagnosis.recorded.parts import MODEL_ERROR, LaboratoryPart, Part
from diagnosis.recorded.record import Record
from diagnosis.signals.noise import level
from laboratories.effects import CATALOGUE
from models.registry import Array
from models.system import System
from tests.diagnosis import cases as made
from tests.diagnosis.cases import Cases, jitter, lab_a, lab_b, short, white

PARTS: dict[str, Callable[[Record], Part]] = {"a": lab_a, "b": lab_b, "building": Building}


def data_of(cases: Cases, kind: str, **options: float) -> Data:
    """A part of a clean laboratory with jittered parameters."""
    found = cases.record(**options)  # type: ignore[arg-type]
    return residuals.prepare(PARTS[kind](found), found)


def at_nominal(data: Data) -> Fit:
    """The nominal models, nothing fitted."""
    return fitting.at(data, {}, np.zeros(len(data.part.nuisances)))


def found_z(fit: Fit) -> dict[str, float]:
    """Fitted parameters by name."""
    return {item.name: float(z) for item, z in zip(fit.data.part.nuisances, fit.z, strict=True)}


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    ("kind", "sharp"),
    [
        ("a", {"column.stiffness": 0.1, "actuator.delay": 0.3, "actuator.time_constant": 0.3}),
        (
            "b",
            {
                "table.frequency": 0.3,
                "table.damping_ratio": 0.3,
                "damper.stiffness": 0.1,
                "damper.mass": 0.1,
                "damper.damping": 0.1,
            },
        ),
    ],
)
def test_commissioning_finds_the_parameters_of_the_laboratories(
    cases: Cases, kind: str, sharp: Mapping[str, float], seed: int
) -> None:
    fit = fitting.fit(data_of(cases, kind, seed=seed), {})
    wrong, found = jitter(seed), found_z(fit)
    for name, near in sharp.items():
        assert found[name] == pytest.approx(wrong[name], abs=near), name
    assert 0.5 < fit.chi / fit.reduced.size < 1.15  # nothing is left but noise, of which σ holds more


def test_commissioning_finds_the_parameters_of_the_building(tmp_path: Path) -> None:
    off = {"structure.mass": 1.0, "structure.stiffness": -0.8, "structure.damping": 0.5}
    base = short(6.0)
    made.play(base, made.tables(base, {}, off, 1), tmp_path / "a.mcap")
    whole = record.build(read(tmp_path / "a.mcap"))
    fit = fitting.fit(residuals.prepare(Building(whole), whole), {})
    assert found_z(fit) == pytest.approx(off, abs=0.3)
    assert found_z(fit)["structure.stiffness"] - found_z(fit)["structure.mass"] == pytest.approx(
        -1.8, abs=0.2
    )


def test_a_laboratory_as_planned_is_fitted_with_the_planned_parameters(cases: Cases) -> None:
    for kind in ("a", "b"):
        fit = fitting.fit(data_of(cases, kind, seed=0), {})
        assert np.max(np.abs(fit.z)) < 0.3


@pytest.mark.parametrize("kind", ["a", "b"])
def test_the_noise_levels_are_estimated(cases: Cases, kind: str, default_plan: Plan) -> None:
    data = data_of(cases, kind)
    planned = [getattr(default_plan.sensors, name) for name in data.part.signals]
    assert data.white == pytest.approx(planned, rel=0.08)
    assert np.all(data.sigma > data.white)
    level = np.sqrt(np.mean(data.part.measured**2, axis=0))
    assert np.all(data.sigma <= data.white + 1.01 * MODEL_ERROR * level)


def test_the_noise_estimate_ignores_a_smooth_signal() -> None:
    t = np.arange(5000) * 0.002
    smooth = np.stack([1e3 * np.sin(2 * np.pi * 3 * t), 50 * t**2], axis=1)
    assert level.white_rms(smooth + 0.1 * white(0, 5000, 2)) == pytest.approx([0.1, 0.1], rel=0.05)
    assert np.all(level.white_rms(smooth) < 1e-3)


def test_residuals_of_white_noise_have_unit_variance(cases: Cases) -> None:
    data = data_of(cases, "b")
    part = data.part
    assert isinstance(part, LaboratoryPart)
    noisy = part.predict(data.system) + data.sigma * white(3, *part.measured.shape)
    again = dataclasses.replace(data, part=part.replaced(measured=noisy))
    reduced = again.reduced(data.system)
    assert np.mean(reduced**2, axis=0) == pytest.approx(np.ones(4), abs=0.15)


def test_missing_samples_do_not_count_in_the_residual(cases: Cases) -> None:
    data = data_of(cases, "a")
    part = data.part
    assert isinstance(part, LaboratoryPart)
    present = part.present.copy()
    present[1000:2000, 1] = False
    spoilt = part.measured.copy()
    spoilt[1000:2000, 1] = 1e9
    less = dataclasses.replace(data, part=part.replaced(measured=spoilt, present=present))
    residual = less.residual(data.system)
    assert not residual[1000:2000, 1].any()
    assert np.array_equal(residual[:1000], data.residual(data.system)[:1000])


def differences(fit: Fit, place: int, step: float) -> Array:
    """A column of the jacobian by central differences."""
    problem = hypothesis.Problem(fit.data, fit.values)
    p = problem.place(fit.values, fit.z)
    up, down = p.copy(), p.copy()
    up[place] += step
    down[place] -= step
    return (problem.reduced(up) - problem.reduced(down)).ravel() / (2.0 * step)


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("a", {}),
        ("a", {"actuator.delay": {"delay": 0.004}}),
        ("b", {"damper.viscous": {"factor": 1.5}}),
        ("building", {"structure.damping": {"factor": 1.2}}),
    ],
)
def test_derivatives_agree_with_those_of_finer_differences(
    cases: Cases, kind: str, values: hypothesis.Values
) -> None:
    data = data_of(cases, kind, duration=4.0)
    fit = fitting.at(data, values, np.zeros(len(data.part.nuisances)))
    assert fit.jacobian.shape == (fit.reduced.size, fit.z.size + len(values))
    for place in range(fit.jacobian.shape[1]):
        fine = differences(fit, place, 1e-3)
        off = np.linalg.norm(fit.jacobian[:, place] - fine) / np.linalg.norm(fine)
        assert off < 0.12, place


def test_a_fit_uses_the_beginning_of_a_test_that_holds_most_of_the_residual(cases: Cases) -> None:
    data = data_of(cases, "a", duration=12.0)
    fit = at_nominal(data)
    early = np.zeros_like(fit.reduced)
    early[: early.shape[0] // 3] = 1.0
    part = fitting.beginning(data, dataclasses.replace(fit, reduced=early), 0.7)
    assert part.groups * part.group * 0.002 == pytest.approx(fitting.SHORTEST)
    assert part.train.size == part.groups
    assert np.array_equal(part.part.measured, data.part.measured[: part.groups * part.group])
    assert np.array_equal(part.part.predict(data.system), data.part.predict(data.system)[:3000])
    late = fit.reduced * 0.0
    late[-10:] = 1.0
    assert fitting.beginning(data, dataclasses.replace(fit, reduced=late), 0.7) is data
    short_ = data_of(cases, "a", duration=4.0)
    assert fitting.beginning(short_, at_nominal(short_), 0.1) is short_


def test_a_building_is_always_judged_over_the_whole_test(cases: Cases) -> None:
    data = data_of(cases, "building", duration=12.0)
    assert fitting.beginning(data, at_nominal(data), 0.01) is data


def test_a_model_that_the_plan_cannot_have_gets_a_large_residual(cases: Cases) -> None:
    data = data_of(cases, "a", duration=4.0)
    wrong = System(dataclasses.replace(data.system.plan, column=None))  # type: ignore[arg-type]
    with pytest.raises(AttributeError):
        data.reduced(wrong)  # a mistake of ours is not taken for a bad hypothesis
    diverging = data.system.moved("column", stiffness=math.inf)
    assert np.max(np.abs(data.reduced(diverging))) == residuals.FAR


@given(st.sampled_from(sorted(CATALOGUE)), st.floats(0.01, 0.99))
def test_the_transformation_of_fitted_parameters_is_inverted_exactly(name: str, share: float) -> None:
    effect = CATALOGUE[name]
    values = {item.name: item.sizes[0] if item.sizes else item.least for item in effect.parameters}
    for item in hypothesis.free(effect, values):
        low, high = item.bounds
        assert low < high
        place = item.inward(values[item.parameter.name])
        assert item.outward(place) == pytest.approx(values[item.parameter.name], rel=1e-9, abs=1e-15)
        if math.isfinite(low) and math.isfinite(high):
            inside = low + share * (high - low)
            assert item.inward(item.outward(inside)) == pytest.approx(inside, rel=1e-6, abs=1e-6)


def test_withheld_time_consists_of_blocks_of_one_second(cases: Cases) -> None:
    data = data_of(cases, "a")
    seconds = data.train[: 10 * 125].reshape(10, 125)
    assert all(block.all() or not block.any() for block in seconds)
    assert [bool(block[0]) for block in seconds] == [True, True, False, True, False] * 2


def test_each_storeys_parameters_are_fitted_separately() -> None:
    text = "[structure]\nmass = [1e5, 2e5]\nstiffness = [3e7, 2e7]\ndamping_ratio = 0.05\n"
    plan = plans.parse(text, Path())
    found = {item.name: item for item in of_building(plan)}
    assert list(found) == [
        *(f"structure.{key} of storey {storey}" for key in ("mass", "stiffness") for storey in (1, 2)),
        "structure.damping_ratio",
    ]
    moved = found["structure.stiffness of storey 2"].moved(System(plan), 0.5).plan.structure
    assert moved.stiffness == pytest.approx((3e7, 2e7 * 1.01))
    assert moved.mass == plan.structure.mass
    assert [item.name for item in of_building(Plan())] == [
        "structure.mass",
        "structure.stiffness",
        "structure.damping",
    ]


@pytest.mark.parametrize("effects", [{}, {"damper.friction": {"force": 150.0}}])
def test_sensors_read_a_motion_that_is_kept_as_they_read_one_that_is_played(
    cases: Cases, effects: dict[str, dict[str, float]]
) -> None:
    data = data_of(cases, "b")
    drift = {"sensor.damper_stroke.drift": {"rate": 1e-5}, "sensor.table_acceleration.lag": {"time": 3e-3}}
    z = np.zeros(len(data.part.nuisances))
    fitting.at(data, effects, z)  # from here on the motion is kept
    kept = fitting.at(data, effects | drift, z)
    played = fitting.at(data_of(cases, "b"), effects | drift, z)
    assert np.array_equal(kept.reduced, played.reduced)
    assert not np.array_equal(kept.reduced, fitting.at(data, effects, z).reduced)


@pytest.mark.parametrize(
    ("seen", "judging", "one"), [(4.0, 0.0, True), (0.0, 4.0, True), (4.0, 4.0, False), (-0.2, -0.1, False)]
)
def test_a_gap_on_one_side_of_what_a_fit_sees_is_told(
    cases: Cases, seen: float, judging: float, one: bool
) -> None:
    data = data_of(cases, "a")
    noise = np.sqrt(np.where(data.train, 1.0 + seen, 1.0 + judging))[:, None] * np.ones(data.sigma.size)
    fit = Fit(data, {}, np.zeros(len(data.part.nuisances)), noise)
    assert fitting.one_sided(fit) is one
    whole = dataclasses.replace(fit, data=data.whole)
    assert not fitting.one_sided(whole)
    assert whole.chi == pytest.approx(float(np.sum(noise**2)))
    assert fit.chi == pytest.approx((1.0 + judging) * noise.size)


def test_slopes_follow_the_residuals_of_a_step() -> None:
    random = np.random.default_rng(4)
    slopes, before = random.normal(size=(30, 3)), random.normal(size=3)
    p, old, new = before + np.array([0.5, 0.0, -0.2]), random.normal(size=30), random.normal(size=30)
    found = secant(before, old, p, new, slopes)
    assert found @ (p - before) == pytest.approx(new - old)
    assert np.array_equal(found[:, 1], slopes[:, 1])  # of a parameter that did not move
    assert secant(before, old, before, new, slopes) is slopes


def test_a_step_beyond_all_numbers_ends_at_the_range_of_a_parameter(cases: Cases) -> None:
    name = "sensor.column_force.saturation"
    start = {name: CATALOGUE[name].values({"limit": 5e4, "sharpness": 2.0})}
    problem = hypothesis.Problem(data_of(cases, "a", duration=2.0), start)
    far = np.full(problem.place(start, np.zeros(problem.count)).size, 1e5)
    limit, _ = CATALOGUE[name].parameters
    assert problem.values(far)[name]["limit"] == limit.most
