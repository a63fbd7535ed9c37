"""Laws that are learned from residuals which no effect explains: their forms and the estimate of their errors."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from common.plan.plan import Plan
from diagnosis.findings import rest
from diagnosis.findings.found import Diagnosis
from diagnosis.learned import regression
from diagnosis.learned.equations import damper_force, platform_acceleration
from diagnosis.learned.learn import LearnedLaw
from diagnosis.learned.regression import AGEING, STEADY, Regression, regress
from laboratories.effects import lay
from laboratories.kinds import KINDS
from loop import replay
from models import preisach
from models.registry import Array
from models.system import System
from tests.diagnosis.cases import Cases

INTERVAL, TICKS = 0.002, 8000
K, LIMIT = 12.5e6, 0.83e-3  # N/m, m


def motion(seed: int, size: float) -> Array:
    """A narrow-banded motion that swells and fades, at most `size` m."""
    draws = np.random.default_rng(seed)
    t = np.arange(TICKS) * INTERVAL
    phases = draws.uniform(0.0, 2.0 * np.pi, 12)
    waves = np.cos(2.0 * np.pi * np.linspace(1.5, 2.6, 12)[:, None] * t + phases[:, None]).sum(axis=0)
    swelling = waves * np.minimum(t / 1.0, 1.0)
    return np.asarray(size * swelling / np.max(np.abs(swelling)))


def rate(x: Array) -> Array:
    return np.diff(x, prepend=x[:1]) / INTERVAL


def bilinear(x: Array) -> Array:
    """A slider's force: what an elastic, perfectly plastic column lacks beside an elastic one."""
    held, result = 0.0, np.empty(x.size)
    for i, step in enumerate(np.diff(x, prepend=0.0)):
        held = min(max(held + step, -LIMIT), LIMIT)
        result[i] = K * held
    return np.asarray(result - K * x)


def flag(x: Array) -> Array:
    """A flag: a slider that works only while a joint is open, so that unloading ends on the elastic line."""
    opened = x - np.clip(x, -LIMIT, LIMIT)
    slid, result = 0.0, np.empty(x.size)
    for i, gap in enumerate(opened):
        slid = min(max(slid, gap - 0.2e-3), gap + 0.2e-3) if gap * slid >= 0.0 else 0.0
        result[i] = -0.9 * K * slid
    return result


def clearance(x: Array) -> Array:
    return np.asarray(-K * np.clip(x, -0.3e-3, 0.3e-3))


def damping(x: Array) -> Array:
    return np.asarray(100e3 * rate(x) * np.abs(x) / 2e-3)


LAWS = {"bilinear": bilinear, "flag": flag, "clearance": clearance, "damping": damping}


def learned(law: str, seed: int = 1, noise: float = 100.0) -> tuple[Regression | None, Array]:
    x = motion(seed, 2e-3)
    y = LAWS[law](x) + noise * np.random.default_rng(9).standard_normal(TICKS)
    return regress(x, rate(x), y, np.ones(TICKS, dtype=bool), INTERVAL), x


def left(found: Regression, law: str, seed: int, size: float) -> float:
    """The rms error of a learned law on a motion, relative to the law's rms."""
    x = motion(seed, size)
    true = LAWS[law](x)
    missed = true - preisach.play(found.law, x, rate(x))
    return float(np.sqrt(np.mean(missed**2) / np.mean(true**2)))


@pytest.mark.parametrize("law", LAWS)
def test_a_law_outside_the_catalogue_is_learned_and_holds_for_another_and_a_larger_motion(law: str) -> None:
    found, _ = learned(law)
    assert found is not None
    assert found.share > 0.95
    assert left(found, law, seed=2, size=1.8e-3) < 0.15
    assert left(found, law, seed=3, size=2.6e-3) < 0.25


def test_no_law_is_learned_from_noise_of_any_colour() -> None:
    x = motion(1, 2e-3)
    there = np.ones(TICKS, dtype=bool)
    white = np.random.default_rng(4).standard_normal(TICKS)
    slow = np.convolve(white, np.ones(50), "same")
    for series in (white, slow, np.cumsum(white)):
        assert regress(x, rate(x), series, there, INTERVAL) is None


def test_no_law_is_learned_without_motion_or_with_most_samples_missing() -> None:
    x = motion(1, 2e-3)
    y = bilinear(x)
    assert regress(0.0 * x, 0.0 * x, y, np.ones(TICKS, dtype=bool), INTERVAL) is None
    assert regress(x, rate(x), y, np.zeros(TICKS, dtype=bool), INTERVAL) is None


def test_the_band_of_a_learned_law_covers_another_motion_and_widens_beyond_the_learned_range() -> None:
    found, x = learned("flag")
    assert found is not None
    other = motion(5, 2e-3)
    missed = np.abs(flag(other) - preisach.play(found.law, other, rate(other)))
    assert np.mean(missed <= found.band(other, rate(other))) > 0.9
    far = 2.0 * x
    assert np.max(found.band(far, rate(far))) > 1.5 * np.max(found.band(x, rate(x)))


def test_the_strongest_part_of_a_test_is_predicted_by_a_law_learned_from_the_rest() -> None:
    found, x = learned("bilinear", noise=0.0)
    assert found is not None
    first, last = found.strongest
    assert first <= int(np.argmax(np.abs(x))) < last
    assert last - first == round(regression.STRONGEST * TICKS)
    missed = bilinear(x) - preisach.play(found.weaker, x, rate(x))
    assert np.std(missed[first:last]) < 0.1 * np.std(bilinear(x)[first:last])


def test_stepping_a_law_in_time_gives_the_values_of_the_regression() -> None:
    x = motion(1, 2e-3)
    for grid in (STEADY, AGEING):
        bare = preisach.pack(grid, 2e-3, 0.03)
        weights = np.random.default_rng(3).standard_normal(preisach.count(bare))
        law = np.concatenate([bare, weights])
        state = preisach.memory(law)
        marched = [preisach.step(law, state, *pair) for pair in zip(x[:500], rate(x)[:500], strict=True)]
        np.testing.assert_allclose(marched, preisach.play(law, x[:500], rate(x)[:500]), rtol=1e-12)
        assert preisach.features(bare, x, rate(x)).shape == (TICKS, weights.size)


def test_the_dampers_force_agrees_with_the_simulated_laboratory() -> None:
    system = lay(System(Plan()), [("damper.friction", {"force": 3.0}), ("damper.offset", {"force": 1.0})])
    t = np.arange(3000) * INTERVAL
    command = np.stack([0.01 * np.sin(9.0 * t), 20.0 * np.sin(13.0 * t)], axis=1)
    read = replay.laboratory(KINDS["table"], system, command)
    stroke, force = read[:, 2], read[:, 3]
    found = damper_force(system, stroke, np.gradient(stroke, INTERVAL), command[:, 1])
    assert np.std(found - force) < 0.03 * np.std(force)
    without = damper_force(System(Plan()), stroke, np.gradient(stroke, INTERVAL), command[:, 1])
    assert np.std(without - force) > 2.5


def test_the_tables_acceleration_follows_from_its_motion() -> None:
    rubbing = {"acceleration": 0.3, "law": 1.0, "asymmetry": 0.3}
    system = lay(System(Plan()), [("table.friction", rubbing), ("table.gain", {"factor": 1.05})])
    t = np.arange(3000) * INTERVAL
    command = np.stack([0.01 * np.sin(9.0 * t), np.zeros(t.size)], axis=1)
    place, felt = replay.laboratory(KINDS["table"], system, command)[:, :2].T
    found = platform_acceleration(system, command[:, 0], place, np.gradient(place, INTERVAL))
    assert np.std((found - felt)[100:]) < 0.06 * np.std(felt)
    without = platform_acceleration(System(Plan()), command[:, 0], place, np.gradient(place, INTERVAL))
    assert np.std((without - felt)[100:]) > 0.2 * np.std(felt)


def test_a_force_that_acts_against_a_table_is_learned_and_stepped_in_time() -> None:
    """A spring that stiffens beside the servo loop, which no effect of the table is."""
    base, drive = System(Plan()), np.stack([motion(1, 20e-3), np.zeros(TICKS)], axis=1)
    x = motion(7, 20e-3)
    stiffening = regress(x, rate(x), 2e6 * x**3, np.ones(TICKS, dtype=bool), INTERVAL)
    assert stiffening is not None
    true = base.laid("table", learned=tuple(stiffening.law.tolist()))
    place, felt = replay.laboratory(KINDS["table"], true, drive)[:, :2].T
    speed = np.gradient(place, INTERVAL)
    left = platform_acceleration(base, drive[:, 0], place, speed) - felt
    found = regress(place, speed, left, np.ones(TICKS, dtype=bool), INTERVAL)
    assert found is not None
    other = np.stack([motion(2, 20e-3), np.zeros(TICKS)], axis=1)
    bare, real, corrected = (
        replay.laboratory(KINDS["table"], system, other)[:, :2]
        for system in (base, true, base.laid("table", learned=tuple(found.law.tolist())))
    )
    left, gap = np.std(corrected - real, axis=0), np.std(bare - real, axis=0)
    assert left[0] < 0.1 * gap[0]
    assert left[1] < 0.5 * gap[1]  # the bends of the law's lines are steps of its slope


@pytest.mark.parametrize(
    ("kind", "machine", "law", "channel"),
    [("column", "column", clearance, 1), ("column", "actuator", flag, 0), ("table", "damper", damping, 3)],
)
def test_a_laboratory_is_simulated_with_a_learned_law(
    kind: str, machine: str, law: Callable[[Array], Array], channel: int
) -> None:
    drive = np.stack([motion(1, 2e-3), np.zeros(TICKS)], axis=1)
    base = System(Plan())
    bare = replay.laboratory(KINDS[kind], base, drive)
    x = bare[:, 2 if machine == "damper" else 0]
    y = law(x) * (1.0 if channel else 1e-9)
    found = regress(x, rate(x), y, np.ones(TICKS, dtype=bool), INTERVAL)
    assert found is not None
    more = replay.laboratory(KINDS[kind], base.laid(machine, learned=tuple(found.law.tolist())), drive)
    change = more[:, channel] - bare[:, channel]
    if machine == "damper":  # whose own motion changes with the force
        assert np.std(change) > 0.0
        return
    assert np.std(change - y) < 0.1 * np.std(y)


def test_a_law_with_which_the_simulation_diverges_is_left_out(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    law = cast(LearnedLaw, SimpleNamespace(site="table"))
    monkeypatch.setattr(rest, "on_itself", lambda _: rest.Gaps(0.1, 0.1, float("nan"), 0.01, rest.STRONGEST))
    found, gap, warnings = rest.with_laws_that_hold(Diagnosis(cases.record(), learned=[law]), [])
    assert (list(found.learned), gap) == ([], None)
    assert "table does not hold" in warnings[0]
