"""Noise of a reading that follows the motion of its part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from diagnosis.diagnose import diagnose, machines_first, with_own_error
from diagnosis.findings.certainty.trust import share_likeliest
from diagnosis.findings.sensors import jumps, outliers, swaying, uneven_noise
from diagnosis.findings.sensors.readings import SensorFinding
from diagnosis.findings.verdict import OwnError, PartVerdict, judge
from diagnosis.fits import fitting, residuals
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search, search
from diagnosis.fits.unexplained import remaining
from diagnosis.fits.worth import SEEN
from diagnosis.recorded.record import Record
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_b

TICKS = 6000
SIZE = 0.6  # rms of an error over that of the noise: less than what is seen in averages

NOISY = SensorFinding("sensor.damper_force.noise", "rms", 1.6, (1.5, 1.7), 8.0)


def white(seed: int, count: int = TICKS) -> Array:
    """Normal numbers of unit variance."""
    return np.asarray(np.random.default_rng(seed).normal(size=count))


def erring(whole: Record, name: str) -> Record:
    """The record with a reading whose samples are taken early and late, by `SIZE` times its noise."""
    read = whole.signals[name]
    made = np.gradient(read) * white(11, read.size)
    made *= SIZE * whole.planned_noise[name] / np.sqrt(np.mean(made**2))
    return replace(whole, signals=whole.signals | {name: read + made})


@pytest.mark.long
@pytest.mark.parametrize("name", ["damper_stroke", "column_displacement", "damper_force"])
def test_noise_that_follows_the_motion_is_an_effect_of_its_reading(name: str, cases: Cases) -> None:
    whole = erring(cases.record(duration=8.0), name)
    found = diagnose({"slave": whole}, {})["slave"].report
    assert (found.status, [place.site for place in found.where]) == ("unknown_effect", [f"sensor.{name}"])
    assert found.which[0].effects == ()
    assert any(one.startswith(f"The noise of {name} follows the motion") for one in found.warnings)
    assert (found.where[0].residual_to_noise or 0.0) > SEEN
    assert not found.details.learned


@pytest.mark.long
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_clock_that_is_early_by_chance_is_no_delay_and_no_effect_of_the_table(
    share: float, cases: Cases
) -> None:
    whole = cases.record(duration=12.0)
    read = whole.signals["table_displacement"]
    early = share * np.random.default_rng(5).random(read.size)
    made = read - early * np.diff(read, prepend=read[0])
    jittering = replace(whole, signals=whole.signals | {"table_displacement": made})
    found = diagnose({"slave": jittering}, {})["slave"].report
    assert found.status in ("unknown_effect", "partly_explained")
    assert found.where[0].site == "sensor.table_displacement"
    assert not found.which[0].effects or (found.which[0].probability or 0.0) < 0.5
    assert any(one.startswith("The noise of table_displacement follows") for one in found.warnings)


def test_a_doubt_of_a_delay_says_nothing_for_the_alternatives_to_it(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = cases.record(duration=8.0)
    part = lab_b(whole)
    data = residuals.prepare(part, whole)
    late, lagging, bare = (
        fitting.at(data, values, np.zeros(len(part.nuisances)))
        for values in (
            {"sensor.damper_stroke.delay": {"delay": 1e-3}},
            {"sensor.damper_stroke.lag": {"lag": 1e-3}},
            {},
        )
    )
    verdict = PartVerdict(Search(data, bare, late, (lagging,)), "explained", 0.9, ((lagging, 0.06),), ())
    own = OwnError("damper_stroke", 1.0, ("sensor.damper_stroke",))
    monkeypatch.setattr(uneven_noise, "own_error", lambda *_: own)
    found = uneven_noise.doubting(verdict, part, ())
    assert found.outcome == "partly"
    assert found.probability == pytest.approx(0.45)
    assert share_likeliest(found) == pytest.approx(share_likeliest(verdict))


@pytest.mark.parametrize(
    ("share", "fine", "told"), [(2.0, True, True), (0.5, True, False), (2.0, False, False)]
)
def test_an_error_of_one_reading_is_told_in_place_of_a_smaller_gap_of_the_smallest_kind(
    share: float, fine: bool, told: bool, cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = cases.record(duration=8.0)
    data = residuals.prepare(lab_b(whole), whole)
    data = data.fine if fine else data
    bare = fitting.at(data, {}, np.zeros(len(data.part.nuisances)))
    verdict = PartVerdict(Search(data, bare, bare, ()), "unknown", 0.9, (), ())
    own = OwnError("damper_stroke", share * remaining(bare), ("sensor.damper_stroke",))
    for kind in (outliers, jumps, swaying):
        monkeypatch.setattr(kind, "own_error", lambda *_: None)
    monkeypatch.setattr(uneven_noise, "own_error", lambda *_: own)
    assert with_own_error(verdict, ()).own == (own if told else None)


@pytest.mark.long
def test_readings_of_which_something_is_known_are_left_aside(cases: Cases) -> None:
    whole = erring(cases.record(duration=8.0), "damper_stroke")
    part = lab_b(whole)
    verdict = judge(search(residuals.prepare(part, whole), Scales(whole)))
    assert with_own_error(verdict, ()).outcome == "unknown"
    assert uneven_noise.own_error(verdict, part) is not None
    assert uneven_noise.own_error(verdict, part, {"damper_stroke"}) is None


def motion() -> Array:
    """An input (ticks, 1) that grows and falls again."""
    t = np.arange(TICKS) * 2e-3
    return np.asarray(np.sin(2.0 * np.pi * t / 12.0) ** 4 * np.sin(2.0 * np.pi * 2.0 * t))[:, None]


def judged(noise: Array, erring: Array) -> uneven_noise.Uneven:
    """How much of a noise follows that input."""
    rows = [uneven_noise.amplitudes(motion(), size) for size in uneven_noise.SCALES]
    return uneven_noise.over_scales(noise, rows, erring)


@pytest.mark.parametrize("seed", range(8))
def test_steady_noise_of_any_colour_follows_no_motion(seed: int) -> None:
    normal = white(seed)
    tails = np.random.default_rng(seed).standard_t(3.0, TICKS)
    slow = np.convolve(normal, np.exp(-np.arange(400) / 60.0), "same") + 0.1 * white(seed + 100)
    for noise in (normal, tails, slow):
        assert judged(noise, np.zeros(TICKS)).significance < uneven_noise.SURE


def test_a_gain_that_sways_shows_over_longer_means() -> None:
    swaying = motion()[:, 0] * np.convolve(white(5), np.ones(20), "same")
    found = judged(white(6) + 0.5 * swaying / swaying.std(), np.zeros(TICKS))
    assert found.significance > uneven_noise.SURE
    assert found.scale > uneven_noise.SCALES[0]


def test_what_a_model_errs_by_does_not_count() -> None:
    noise = white(3) * (1.0 + np.abs(motion()[:, 0]))
    seen, none = (judged(noise, erring) for erring in (np.zeros(TICKS), 3.0 * white(4)))
    assert min(seen.significance, none.significance) > uneven_noise.SURE
    assert seen.ratio > 0.5
    assert none.ratio == 0.0


@pytest.mark.long
@pytest.mark.parametrize("follows", [True, False])
def test_loud_noise_beside_an_effect_is_its_sensors_only_where_it_is_steady(
    follows: bool, cases: Cases
) -> None:
    whole = cases.record({"damper.friction": {"force": 3.0}}, duration=12.0)
    read = whole.signals["damper_force"]
    made = white(7, read.size) * (np.abs(np.gradient(read)) if follows else 1.0)
    made *= 8.0 * whole.planned_noise["damper_force"] / np.sqrt(np.mean(made**2))
    loud = replace(whole, signals=whole.signals | {"damper_force": read + made})
    verdict = judge(search(residuals.prepare(lab_b(loud), loud), Scales(loud)))
    assert verdict.effects == ("damper.friction",)
    explained = replace(verdict, outcome="explained")
    told, left = uneven_noise.beside_effects(explained, {"damper_force"})
    assert (told.outcome, left) == (("partly", {"damper_force"}) if follows else ("explained", set()))
    assert machines_first(loud, [explained], [NOISY])[1] == ([] if follows else [NOISY])
    assert uneven_noise.beside_effects(explained, {"table_displacement"}) == (explained, set())


@pytest.mark.parametrize("skewness", [0.2, 0.6, 1.5])
def test_few_loud_samples_are_as_rare_as_a_skewed_sum_makes_them(skewness: float) -> None:
    """SciPy's gamma distribution of that skewness, in standard deviations of the normal one."""
    shape = 4.0 / skewness**2
    for deviations in (1.0, 3.0, 6.0):
        tail = stats.gamma.sf(shape + deviations * np.sqrt(shape), shape)
        expected = float(stats.norm.isf(tail))
        assert uneven_noise.unskewed(deviations, skewness) == pytest.approx(expected, abs=0.05)
    assert uneven_noise.unskewed(5.0, 0.0) == 5.0


def test_a_pulse_over_few_samples_makes_loud_ones_follow_it_less() -> None:
    energy, motion = np.square(white(3)), np.zeros((TICKS, 1))
    motion[100:104], energy[100:104] = 1.0, 8.0
    long = np.zeros((TICKS, 1))
    long[100:1700], steady = 1.0, energy.copy()
    steady[100:1700] *= 1.5
    assert uneven_noise.follows(energy, motion)[0] < uneven_noise.SURE
    assert uneven_noise.follows(steady, long)[0] > uneven_noise.SURE


@pytest.mark.parametrize(("louder", "together"), [(1.0, True), (1.5, False)])
def test_two_scales_of_slow_noise_are_not_two_witnesses(
    louder: float, together: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def at_scale(_noise: Array, _rows: Array, _erring: Array, size: int) -> uneven_noise.Uneven:
        return uneven_noise.Uneven(1.0, 5.0, size, louder ** np.log2(size))

    monkeypatch.setattr(uneven_noise, "at_scale", at_scale)
    found = uneven_noise.over_scales(white(1), [white(2)] * len(uneven_noise.SCALES), white(3))
    assert found.significance == pytest.approx(5.0 * np.sqrt(2.0) if together else 5.0)


@pytest.mark.parametrize("logged", [False, True])
def test_bends_are_left_out_where_readings_hold_what_they_do_between_ticks(
    logged: bool, cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = cases.record(duration=8.0)
    part = lab_b(whole).logged(whole.late) if logged else lab_b(whole)
    data = residuals.prepare(part, whole)
    usual, asked = uneven_noise.amplitudes, list[float]()

    def amplitudes(moving: Array, size: int, *, bends: bool) -> Array:
        found = usual(moving, size, bends=bends)
        asked.append(found.shape[1] / moving.shape[1])
        return found

    monkeypatch.setattr(uneven_noise, "amplitudes", amplitudes)
    uneven_noise.uneven(fitting.at(data, {}, np.zeros(len(data.part.nuisances))))
    assert set(asked) == {2.0 if logged else 3.0}
