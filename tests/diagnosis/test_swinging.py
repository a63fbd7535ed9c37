"""What swings for many periods at a machine is found, though it looks like noise of a colour."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal

from diagnosis.findings.certainty.other_causes import swings
from diagnosis.findings.certainty.trust import trusted
from diagnosis.findings.verdict import judge
from diagnosis.findings.which import swinging
from diagnosis.fits import fitting, residuals, settling
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import search
from diagnosis.fits.unexplained import SIGNIFICANT, foresees, leaves, model_error, resonant
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.recorded.record import Record
from diagnosis.signals.predictors.ceiling import Crosswise
from diagnosis.signals.predictors.resonances import Resonances
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_a, lab_b, white

INTERVAL = 0.008  # s, of averaged samples
FREQUENCY, DAMPING, MASS = 5.3, 0.012, 40.0  # Hz, ratio and kg of a part that is bolted to the piston
SIGNS = {"clear": 6.0, "names": 0.0}  # of a verdict whose name stands out of what is left
LOUD = 300.0  # N rms, of a load cell
FORCE, PLACE = 1, 0  # places of the column's force and its displacement among the readings


def swung(acceleration: Array, interval: float, mass: float = MASS) -> Array:
    """Force (n,) N of a part that swings on something that moves by an acceleration (n,) m/s²."""
    omega = 2.0 * math.pi * FREQUENCY
    spring = [2.0 * DAMPING * omega, omega**2]
    pole = signal.cont2discrete((spring, [1.0, *spring]), interval)
    return np.asarray(mass * signal.lfilter(np.ravel(pole[0]), pole[1], acceleration))


def with_a_fixture(whole: Record, mass: float = MASS) -> LaboratoryPart:
    """The master's laboratory with a part that swings on the piston, whose force the load cell reads."""
    part, interval = lab_a(whole), whole.plan.test.interval
    place = part.predict(whole.systems[part.role])[:, PLACE]
    measured = part.measured.copy()
    measured[:, FORCE] += swung(np.gradient(np.gradient(place, interval), interval), interval, mass)
    return part.replaced(measured=measured)


def significance(y: Array, said: Array) -> float:
    """Standard deviations of a prediction (n, 1) of white noise y (n, 1) above chance."""
    return float(np.sum(y * said) / max(math.sqrt(float(np.sum(said**2))), 1e-300))


def shaken(seed: int) -> tuple[Array, Array]:
    """An input (n,) with most of its energy near 2 Hz, and white noise (n,) beside it."""
    rng = np.random.default_rng(seed)
    b, a = signal.butter(2, [1.0, 3.0], "band", fs=1.0 / INTERVAL)
    noise = rng.standard_normal((2, 1500))
    return np.asarray(signal.lfilter(b, a, noise[0]) + 0.05 * noise[0]), noise[1]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_oscillator_is_predicted_for_time_that_was_not_seen(seed: int) -> None:
    moving, noise = shaken(seed)
    force = swung(moving, INTERVAL)
    resonances = Resonances(np.column_stack([noise[::-1], moving]), INTERVAL)
    y = (6.0 * force / np.linalg.norm(force) * math.sqrt(3.0) + noise)[:, None]
    assert significance(y, resonances.predict(y)) > SIGNIFICANT
    columns = resonances.columns(y)
    power = np.abs(np.fft.rfft(columns[:, 0] * np.hanning(len(columns))))
    assert np.argmax(power) / (len(columns) * INTERVAL) == pytest.approx(FREQUENCY, abs=0.15)


def test_noise_is_not_predicted_however_many_oscillators_are_tried() -> None:
    for seed in range(12):
        moving, noise = shaken(seed)
        said = Resonances(moving[:, None], INTERVAL).predict(noise[:, None])
        assert significance(noise[:, None], said) < 0.7 * SIGNIFICANT


def test_a_few_columns_more_predict_what_features_leave() -> None:
    rng = np.random.default_rng(4)
    x, more, noise = (rng.standard_normal((600, k)) for k in (3, 1, 1))
    y = x[:, :1] + more + 0.1 * noise
    features = Crosswise(x)
    assert np.std(y - features.beside(more).predict(y)) < 0.12
    assert np.std(y - features.predict(y)) > 0.9


def test_a_part_that_swings_on_the_piston_is_no_noise_of_the_load_cell(cases: Cases) -> None:
    whole = cases.record({}, duration=12.0)
    data = residuals.prepare(with_a_fixture(whole), whole)
    bare = settling.settled(fitting.fit(data.fine, {}))
    erring = model_error(bare)
    assert not leaves(bare, erring)
    assert not foresees(bare, erring)  # what it leaves is taken for noise of a colour
    assert judge(search(data, Scales(whole))).outcome == "unknown"


def test_a_laboratory_in_which_nothing_swings_has_no_resonance(cases: Cases) -> None:
    whole = cases.record({}, duration=12.0)
    for part in (lab_a(whole), lab_b(whole)):
        fit = settling.settled(fitting.fit(residuals.prepare(part, whole).fine, {}))
        assert resonant(fit) is None


@pytest.mark.long
@pytest.mark.parametrize("frequency", [3.1, 0.8])  # of a frame, of liquid in a tank
def test_a_mass_that_swings_on_the_table_is_named_where_it_looked_like_noise(
    cases: Cases, frequency: float
) -> None:
    swings = {"table.second_mass": {"frequency": frequency, "share": 0.05, "damping": 0.02}}
    whole = cases.record(swings, duration=12.0)
    verdict = judge(search(residuals.prepare(lab_b(whole), whole), Scales(whole)))
    assert verdict.effects == ("table.second_mass",)


@pytest.mark.long
def test_what_swings_beside_a_name_leaves_that_partly_explained(cases: Cases) -> None:
    whole = cases.record({"column.inertia": {"mass": 5000.0}}, duration=12.0)
    part = with_a_fixture(whole, 300.0)
    part.measured[:, FORCE] += LOUD * white(5, len(part.measured))  # in which it looks like noise of a colour
    found = search(residuals.prepare(part, whole), Scales(whole))
    verdict = judge(found)
    assert verdict.effects == ("column.inertia",)
    assert swings(found)
    assert verdict.outcome == "partly"
    probability = trusted(SimpleNamespace(verdicts=[verdict]), [verdict], SIGNS, 1.0)  # type: ignore[arg-type]
    assert probability < 0.5
    assert "swings for many periods" in swinging(verdict)[0]


@pytest.mark.long
def test_a_mass_that_does_not_swing_is_explained(cases: Cases) -> None:
    whole = cases.record({"column.inertia": {"mass": 5000.0}}, duration=12.0)
    found = search(residuals.prepare(lab_a(whole), whole), Scales(whole))
    assert judge(found).outcome == "explained"
    assert not swings(found)
