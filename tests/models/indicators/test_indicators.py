"""Indicators against published figures and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import InputError
from models import indicators
from models.indicators import tracking
from models.registry import Array
from models.structures import shear_building

DT = 0.002
M, C, K = 160e3, 200e3, 25e6
OMEGA = math.sqrt(K / M)


def chirp(delay: float = 0.0) -> Array:
    t = np.arange(0.0, 20.0, DT) - delay
    return np.sin(2.0 * np.pi * (0.5 + 0.1 * t) * t) * np.exp(-0.02 * t)


def drifting(seconds: float, delay: float) -> Array:
    """A vibration at 2 Hz on a drift over one minute, as of a floor above a moving ground."""
    t = np.arange(0.0, seconds, DT) - delay
    return np.asarray(0.05 * np.sin(2.0 * np.pi * t / 60.0) + 0.003 * np.sin(4.0 * np.pi * t))


class TestTracking:
    @pytest.mark.parametrize("delay", [-0.031, -0.0012, 0.0, 0.0005, 0.012, 0.044, 0.15])
    def test_a_known_delay_or_lead_is_found(self, delay: float) -> None:
        assert indicators.correlation_delay(chirp(), chirp(delay), DT) == pytest.approx(delay, abs=2e-5)
        if abs(delay) < 0.1:
            found = indicators.frequency_evaluation_index(chirp(), 1.1 * chirp(delay), DT)
            assert found.delay == pytest.approx(delay, rel=0.03, abs=1e-5)

    @given(amplitude=st.floats(0.2, 3.0), phase=st.floats(-2.5, 2.5), frequency=st.floats(0.5, 8.0))
    def test_the_frequency_index_of_a_sine_gives_its_amplitude_and_phase(
        self, amplitude: float, phase: float, frequency: float
    ) -> None:
        turn = 2.0 * np.pi * frequency * np.arange(0.0, 20.0, DT)
        found = indicators.frequency_evaluation_index(np.sin(turn), amplitude * np.sin(turn - phase), DT)
        assert found.amplitude == pytest.approx(amplitude, rel=1e-3)
        assert found.frequency == pytest.approx(frequency, rel=1e-3)
        assert found.delay == pytest.approx(phase / (2.0 * np.pi * frequency), rel=2e-3, abs=1e-6)

    def test_the_synchronization_area_is_that_of_the_ellipse_with_the_sign_of_the_lag(self) -> None:
        turn = np.linspace(0.0, 2.0 * np.pi, 5001)
        area = indicators.tracking_indicator(np.sin(turn), np.sin(turn - 0.3))
        assert area[-1] == pytest.approx(np.pi * math.sin(0.3), rel=1e-6)
        assert indicators.tracking_indicator(np.sin(turn), np.sin(turn + 0.3))[-1] == pytest.approx(-area[-1])

    @given(scale=st.floats(1e-6, 1e6), error=st.floats(-2.0, 2.0))
    def test_relative_errors_do_not_depend_on_the_scale(self, scale: float, error: float) -> None:
        reference = scale * chirp()
        values = (1.0 + error) * reference
        assert indicators.nrmse(reference, values) == pytest.approx(abs(error), abs=1e-12)
        assert indicators.peak_error(reference, values) == pytest.approx(abs(error), abs=1e-12)

    @pytest.mark.parametrize("frequency", [0.5, 2.0, 5.0, 8.0])
    @pytest.mark.parametrize("delay", [-0.03, 0.0, 0.0013, 0.044])
    def test_a_sine_is_not_taken_for_another_period(self, frequency: float, delay: float) -> None:
        t = np.arange(0.0, 10.0, DT)
        target, measured = (np.sin(2.0 * np.pi * frequency * (t - late)) for late in (0.0, delay))
        measured += 1e-3 * np.random.default_rng(2).standard_normal(t.size)
        assert indicators.correlation_delay(target, measured, DT) == pytest.approx(delay, abs=2e-4)

    @pytest.mark.parametrize("delay", [0.0, 0.004, 0.04, 0.098])
    def test_the_benchmarks_delay_is_the_whole_tick_of_largest_correlation(self, delay: float) -> None:
        assert indicators.correlation_lag(chirp(), chirp(delay), DT) == pytest.approx(delay, abs=1e-12)

    @pytest.mark.parametrize("seed", [1, 2, 3])
    def test_correlations_of_all_lags_are_the_coefficients_of_the_overlapping_samples(
        self, seed: int
    ) -> None:
        rng = np.random.default_rng(seed)
        target = rng.normal(size=300).cumsum() + 40.0
        measured = 3.0 * np.roll(target, 11) + rng.normal(size=300)
        found = tracking.correlations(target, measured, -60, 60)
        wanted = [
            np.corrcoef(target[max(-k, 0) : 300 - max(k, 0)], measured[max(k, 0) : 300 - max(-k, 0)])[0, 1]
            for k in range(-60, 61)
        ]
        assert found == pytest.approx(wanted, abs=1e-9)

    def test_a_constant_signal_has_zero_correlation(self) -> None:
        target = np.concatenate([np.full(100, 2.0), np.sin(np.arange(20.0))])
        measured = np.concatenate([np.cos(np.arange(20.0)), np.full(100, 1.0)])
        assert np.all(tracking.correlations(target, measured, 90, 110) == 0.0)

    def test_the_benchmarks_delay_is_never_a_lead_and_has_an_upper_bound(self) -> None:
        assert indicators.correlation_lag(chirp(), chirp(-0.01), DT) == 0.0
        assert indicators.correlation_lag(chirp(), chirp(0.03), DT, ticks=10) == pytest.approx(9 * DT)
        with pytest.raises(InputError, match="50 ticks are too few for 50 delays: give at least 51"):
            indicators.correlation_lag(chirp()[:50], chirp()[:50], DT)

    @pytest.mark.parametrize("seconds", [2.0, 5.0, 12.0, 40.0])
    @pytest.mark.parametrize("delay", [-0.012, 0.0189, 0.044])
    def test_the_delay_of_a_short_motion_on_a_slow_drift_is_found(self, seconds: float, delay: float) -> None:
        target, measured = (drifting(seconds, late) for late in (0.0, delay))
        found = indicators.aligned_evaluation(target, measured, DT)
        plain = indicators.frequency_evaluation_index(target, measured, DT)
        assert found.delay == pytest.approx(delay, abs=1e-5)
        assert found.amplitude == pytest.approx(1.0, abs=1e-4)
        assert abs(plain.delay - delay) > 0.1 * abs(delay)  # why it has to be aligned
        correlation = indicators.correlation_delay(target, measured, DT)
        assert indicators.tracking_delay(found.delay, correlation, DT) == found.delay

    def test_two_different_estimates_give_no_delay(self) -> None:
        assert indicators.tracking_delay(0.0164, 0.0189, DT) is None
        assert indicators.tracking_delay(0.0188, 0.0189, DT) == 0.0188

    def test_a_delay_beyond_the_search_range_is_reported(self) -> None:
        with pytest.raises(InputError, match="not within ±0.02 s"):
            indicators.correlation_delay(chirp(), chirp(0.15), DT, most=0.02)


class TestDamping:
    @pytest.mark.parametrize(
        ("delay", "percent"),
        [
            (0.001, 4.84),
            (0.004, 4.37),
            (0.008, 3.75),
            (0.012, 3.13),
            (0.016, 2.51),
            (0.030, 0.42),
            (0.044, -1.5),
        ],
    )
    def test_apparent_damping_agrees_with_the_published_value(self, delay: float, percent: float) -> None:
        found = 100.0 * indicators.apparent_damping(M, C, K, K / 4.0, 1.0, delay)
        assert found == pytest.approx(percent, abs=0.06 if percent < 0.0 else 0.02)

    def test_the_equivalent_damping_agrees_for_small_delays(self) -> None:
        lost, softer = indicators.damping_equivalent(K / 4.0, 1.0, 0.001, OMEGA)
        points = indicators.damping_points(lost, M, K)
        assert 100.0 * points == pytest.approx(0.156, abs=0.001)
        assert softer == pytest.approx(K / 4.0 * (OMEGA * 0.001) ** 2 / 2.0, rel=1e-3)
        root = indicators.apparent_damping(M, C, K, K / 4.0, 1.0, 0.001)
        assert 0.05 - root == pytest.approx(points, rel=0.02)

    @given(ratio=st.floats(-0.03, 0.2), frequency=st.floats(0.7, 6.0), phase=st.floats(0.0, 6.0))
    def test_the_damping_of_a_free_vibration_is_estimated(
        self, ratio: float, frequency: float, phase: float
    ) -> None:
        t = np.arange(0.0, 5.0, DT)
        natural = 2.0 * np.pi * frequency
        signal = np.exp(-ratio * natural * t) * np.cos(natural * math.sqrt(1 - ratio**2) * t + phase)
        signal += 1e-3 * np.random.default_rng(1).standard_normal(t.size) * np.max(np.abs(signal))
        found = indicators.free_vibration_damping(3e-3 * signal, DT)
        assert found[0] == pytest.approx(frequency, rel=2e-3)
        assert found[1] == pytest.approx(ratio, abs=1e-3)


class TestEnergy:
    def test_the_error_energy_of_a_delayed_spring_is_the_area_of_its_loop(self) -> None:
        turn = np.linspace(0.0, 20.0 * np.pi, 50_001)
        target, measured = np.sin(turn), np.sin(turn - 0.1)
        force = 2.0 * measured
        found = indicators.hybrid_simulation_error_energy(target, measured, force, np.zeros(turn.size), 1.0)
        assert found[-1] == pytest.approx(10.0 * 2.0 * np.pi * math.sin(0.1), rel=1e-4)

    def test_perfect_tracking_has_no_error_energy(self) -> None:
        x = chirp()
        assert np.all(indicators.hybrid_simulation_error_energy(x, x, x, np.ones(x.size), 1.0) == 0.0)


def one(value: float) -> Array:
    return np.array([[value]])


BENCHMARK = 1e6 * np.array(
    [[26.0549, -23.1339, 5.9370], [-23.1339, 32.5608, -14.4200], [5.9370, -14.4200, 9.2673]]
)


class TestStability:
    @pytest.mark.parametrize(("share", "ms"), [(0.25, 32.9), (0.5, 16.1), (0.75, 10.7), (1.0, 8.0)])
    def test_the_critical_delay_of_the_papers_building_agrees_with_the_published_one(
        self, share: float, ms: float
    ) -> None:
        found = indicators.critical_delay(one(M), one(C), one((1 - share) * K), np.ones(1), share * K)
        assert 1e3 * found == pytest.approx(ms, abs=0.06)

    @pytest.mark.parametrize(
        ("mass", "ratio", "ms"),
        [(1000.0, 0.05, 14.65), (1100.0, 0.04, 12.23), (1300.0, 0.03, 9.92), (1000.0, 0.03, 8.73)],
    )
    def test_the_force_delays_of_the_2020_benchmark_problem_agree_with_the_published_ones(
        self, mass: float, ratio: float, ms: float
    ) -> None:
        """Force delay of cases C1 to C4: Silva, Gomez, Maghareh, Dyke and Spencer, MSSP (2020)."""
        whole = mass * np.eye(3)
        values, vectors = np.linalg.eigh(BENCHMARK / mass)
        damping = mass * vectors @ np.diag(2.0 * ratio * np.sqrt(values)) @ vectors.T
        direction = np.array([1.0, 0.0, 0.0])
        outer = np.outer(direction, direction)
        specimen = (1.19e6, 114.6, 29.13)
        numerical = [
            matrix - value * outer
            for matrix, value in zip((whole, damping, BENCHMARK), reversed(specimen), strict=True)
        ]
        found = indicators.critical_delay(numerical[0], numerical[1], numerical[2], direction, *specimen)
        assert 1e3 * found == pytest.approx(ms, abs=0.1)

    @given(share=st.floats(0.15, 1.0), ratio=st.floats(0.01, 0.05))
    def test_the_loop_vibrates_undamped_at_its_critical_delay(self, share: float, ratio: float) -> None:
        damping = 2.0 * ratio * math.sqrt(K * M)
        critical = indicators.critical_delay(
            one(M), one(damping), one((1 - share) * K), np.ones(1), share * K
        )
        roots = [
            indicators.apparent_damping(M, damping, K, share * K, 1.0, factor * critical)
            for factor in (0.9, 1.0, 1.1)
        ]
        assert roots[0] > 0.0
        assert abs(roots[1]) < 1e-9
        assert roots[2] < 0.0

    @pytest.mark.parametrize("n", [2, 5, 12, 20, 30])
    def test_the_critical_delay_of_many_storeys_agrees_with_a_scan_over_frequency(self, n: int) -> None:
        ones = np.ones(n)
        mass, _, whole = shear_building.matrices(1e5 * ones, 1e8 * ones, ones)
        direction = np.eye(n)[n // 2] - np.eye(n)[n // 2 - 1]
        numerical = whole - 4e7 * np.outer(direction, direction)
        omega = np.linspace(0.5, 80.0, 100_001)
        values, vectors = np.linalg.eigh(numerical / 1e5)
        shares = (vectors.T @ direction) ** 2 / 1e5
        modal = values[:, None] - omega**2 + 1j * omega * (0.3 + 5e-4 * values[:, None])
        gain = 4e7 * np.sum(shares[:, None] / modal, axis=0)
        at = np.flatnonzero(np.diff(np.sign(np.abs(gain) - 1.0)) != 0)
        scanned = np.min((np.angle(-gain[at]) % (2.0 * np.pi)) / omega[at])
        damping = 0.3 * mass + 5e-4 * numerical
        found = indicators.critical_delay(mass, damping, numerical, direction, 4e7)
        assert found == pytest.approx(scanned, rel=2e-3)

    def test_a_specimen_heavier_than_the_numerical_part_tolerates_no_delay(self) -> None:
        heavy = indicators.critical_delay(one(M), one(C), one(K), np.ones(1), K, 0.0, 2.0 * M)
        assert heavy == 0.0
        assert indicators.predictive_stability_indicator(heavy) == -math.inf

    def test_an_unstable_or_misshapen_loop_is_refused(self) -> None:
        with pytest.raises(InputError, match="unstable without any delay"):
            indicators.critical_delay(one(M), one(-C), one(K), np.ones(1), 1.0)
        with pytest.raises(InputError, match="must be 1 by 1 finite"):
            indicators.critical_delay(one(M), np.ones((2, 2)), one(K), np.ones(1), K)
        with pytest.raises(InputError, match="singular"):
            indicators.critical_delay(one(0.0), one(C), one(K), np.ones(1), K)

    def test_a_specimen_with_a_small_share_tolerates_any_delay(self) -> None:
        assert indicators.critical_delay(one(M), one(C), one(0.95 * K), np.ones(1), 0.05 * K) == math.inf

    def test_the_stability_indicator_has_its_value_and_its_class(self) -> None:
        assert indicators.predictive_stability_indicator(0.01) == pytest.approx(1.0)
        assert [indicators.sensitivity(x) for x in (1.5, 0.3, -0.1)] == [
            "slightly",
            "moderately",
            "extremely",
        ]


@pytest.mark.parametrize(
    ("signals", "sentence"),
    [
        ((np.zeros(0), np.zeros(0)), "give one value per tick"),
        ((np.ones(9), np.ones(8)), "differ in length"),
        ((np.array([1.0, np.nan]), np.ones(2)), "not finite"),
        ((np.zeros(900), chirp()[:900]), "zero throughout|constant"),
    ],
)
def test_signals_without_motion_are_refused(signals: tuple[Array, Array], sentence: str) -> None:
    for call in (
        lambda: indicators.nrmse(*signals),
        lambda: indicators.peak_error(*signals),
        lambda: indicators.correlation_delay(*signals, DT),
        lambda: indicators.frequency_evaluation_index(*signals, DT),
    ):
        with pytest.raises(InputError, match=sentence):
            call()
