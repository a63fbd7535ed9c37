"""The statements of an imported recording about its channels: written, read, and applied to a prediction."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from common.errors import InputError
from common.recording.imported import (
    IMPORT,
    NOTHING_STATED,
    ImportedChannel,
    ImportedData,
    exchange_known,
    imported,
)
from common.recording.logger.low_pass import LoggerFilter
from common.recording.logger.passing import later
from common.recording.run import Run

LOW_PASS = LoggerFilter("butterworth", 4, 100.0)
FORCE = ImportedChannel(LOW_PASS, 0.004, 1.0, 0.01, interpolated=True, rate=1024.0)


def run_with_metadata(metadata: dict[str, dict[str, str]]) -> Run:
    return Run(Path("a.mcap"), metadata=metadata)


def test_written_data_are_read_back_unchanged() -> None:
    stated = ImportedData("a.csv", True, {"master": {"column_force": FORCE}})
    found = imported(run_with_metadata({IMPORT: stated.metadata()}))
    assert found == stated
    assert found.channel("master", "column_force") == FORCE
    assert found.channel("slave", "damper_force") == NOTHING_STATED


def test_a_recording_of_rths_is_no_import_and_an_older_import_states_no_channels() -> None:
    assert imported(run_with_metadata({})) is None
    older = imported(run_with_metadata({IMPORT: {"data": "b.csv"}}))
    assert older == ImportedData("b.csv")
    with pytest.raises(InputError, match="its metadata 'import' cannot be read"):
        imported(run_with_metadata({IMPORT: {"channels": '{"master": {"x": {"colour": 1}}}'}}))


@pytest.mark.parametrize("kind", ["butterworth", "bessel"])
def test_a_filter_attenuates_3_db_at_its_cutoff_and_delays_slow_motion(kind: str) -> None:
    low_pass = LoggerFilter(kind, 4, 50.0)
    assert abs(low_pass.response(np.array([50.0]))[0]) == pytest.approx(math.sqrt(0.5), rel=1e-6)
    t = np.arange(2000) * 0.001
    slow = np.sin(2.0 * math.pi * 2.0 * t)
    late = -np.angle(low_pass.response(np.array([2.0])))[0] / (2.0 * math.pi * 2.0)
    expected = np.sin(2.0 * math.pi * 2.0 * (t - late))
    assert np.max(np.abs(low_pass.filtered(slow, 0.001) - expected)[500:]) < 1e-3


RIPPLING = [LoggerFilter("chebyshev", 5, 80.0, 0.5), LoggerFilter("elliptic", 4, 80.0, 0.2, 50.0)]


@pytest.mark.parametrize("low_pass", RIPPLING, ids=["chebyshev", "elliptic"])
def test_a_filter_with_a_ripple_loses_it_at_its_cutoff_and_nothing_at_rest(low_pass: LoggerFilter) -> None:
    frequencies = np.linspace(0.0, 80.0, 400)
    gain = np.abs(low_pass.response(frequencies))
    assert gain[0] == pytest.approx(1.0)
    assert 20.0 * math.log10(gain.max() / gain.min()) == pytest.approx(low_pass.ripple, rel=1e-3)
    assert gain[-1] == pytest.approx(gain.min())
    beyond = np.abs(low_pass.response(np.linspace(400.0, 4000.0, 400)))
    assert beyond.max() < (10.0 ** (-low_pass.attenuation / 20.0) * 1.03 if low_pass.attenuation else 1e-3)


@pytest.mark.parametrize("low_pass", RIPPLING, ids=["chebyshev", "elliptic"])
def test_a_signal_behind_a_filter_with_a_ripple_is_what_its_response_says(low_pass: LoggerFilter) -> None:
    interval = 1e-3
    t = np.arange(4000) * interval
    for frequency in (2.0, 30.0):
        seen = low_pass.filtered(np.sin(2.0 * math.pi * frequency * t), interval)[1000:-1]
        turned = low_pass.response(np.array([frequency]))[0] * np.exp(2j * math.pi * frequency * t[1000:-1])
        assert np.max(np.abs(seen - turned.imag)) < 2e-2 * (2.0 * math.pi * frequency * interval) ** 2


@pytest.mark.parametrize("order", [1, 4, 12])
@pytest.mark.parametrize("kind", ["butterworth", "bessel"])
def test_a_filter_far_below_the_rate_keeps_its_digits(kind: str, order: int) -> None:
    low_pass, interval = LoggerFilter(kind, order, 5.0), 1.0 / 4096.0
    t = np.arange(12_000) * interval
    seen = low_pass.filtered(np.sin(2.0 * math.pi * 2.0 * t), interval)[10_000:]
    turned = low_pass.response(np.array([2.0]))[0] * np.exp(4j * math.pi * t[10_000:])
    assert seen == pytest.approx(turned.imag, abs=1e-4)
    assert low_pass.filtered(np.r_[0.0, np.ones(12_000)], interval)[-1] == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("kind", ["butterworth", "bessel"])
def test_a_filter_takes_nothing_more_away_than_an_analogue_one(kind: str) -> None:
    low_pass, t = LoggerFilter(kind, 4, 100.0), np.arange(1000) * 0.002
    for frequency in (2.0, 6.0):
        omega = 2.0 * math.pi * frequency
        seen = low_pass.filtered(np.sin(omega * t), 0.002)[250:-1]
        turned = (low_pass.response(np.array([frequency]))[0] * np.exp(1j * omega * t[250:-1])).imag
        assert np.max(np.abs(seen - turned)) < 1e-2 * (0.002 * omega) ** 2 / 12.0


@pytest.mark.parametrize("ticks", [0.5, 3.0, 7.3, -0.4])
def test_a_signal_that_comes_later_keeps_its_amplitude_and_is_constant_at_its_ends(ticks: float) -> None:
    t = np.arange(400) * 0.002
    wave = np.sin(2.0 * math.pi * 4.0 * t)
    expected = np.sin(2.0 * math.pi * 4.0 * (t - 0.002 * ticks))
    seen = later(wave, ticks)
    assert np.max(np.abs(seen - expected)[20:-20]) < 3e-7  # a straight line is off by up to 3e-4
    assert later(wave + 2.0, 30.5)[:28] == pytest.approx(2.0)


def test_a_channel_responds_as_its_filter_and_its_delay() -> None:
    response = FORCE.response(np.array([3.0]))[0]
    assert response == pytest.approx(LOW_PASS.response(np.array([3.0]))[0] * np.exp(-0.024j * math.pi))
    assert ImportedChannel().response(np.array([3.0])) == pytest.approx([1.0])


def test_a_prediction_passes_through_the_stated_filter_and_delay() -> None:
    t = np.arange(1000) * 0.002
    ramp = np.asarray(3.0 * t, dtype=np.float64)
    seen = FORCE.through(ramp, 0.002)
    late = 0.004 + 2.6131 / (2.0 * math.pi * 100.0)  # the delay, and the filter's at low frequency
    assert np.allclose(seen[100:], 3.0 * (t - late)[100:], atol=1e-6)
    assert NOTHING_STATED.through(ramp, 0.002) is ramp


def test_a_stated_high_pass_halves_the_power_at_its_corner_and_forgets_where_a_signal_stood() -> None:
    channel, interval = ImportedChannel(high_pass=0.5), 1e-3
    t = interval * np.arange(20_000)
    seen = channel.through(3.0 + np.sin(math.pi * t), interval)[10_000:]
    turned = channel.response(np.array([0.5]))[0]
    assert turned == pytest.approx(0.5 + 0.5j)
    assert seen == pytest.approx((turned * np.exp(1j * math.pi * t[10_000:])).imag, abs=1e-5)


def test_a_channels_lateness_is_its_delay_plus_its_filters_delay_of_slow_motion() -> None:
    passed = LoggerFilter("butterworth", 2, 50.0)
    assert ImportedChannel(delay=0.002).late == pytest.approx(0.002)
    assert ImportedChannel(passed, 0.002).late == pytest.approx(
        0.002 + math.sqrt(2.0) / (2.0 * math.pi * 50.0)
    )


def test_an_import_states_the_exchange_by_sequence_numbers_or_time_stamps() -> None:
    numbers = Run(Path("a.mcap"), columns={"master": {"damper_force_seq": np.zeros(3)}})
    stamps = Run(Path("a.mcap"), columns={"latency": {"command_one_way": np.zeros(3)}})
    neither = Run(Path("a.mcap"), columns={"slave": {"seq": np.zeros(3), "damper_force": np.zeros(3)}})
    assert [exchange_known(run) for run in (numbers, stamps, neither)] == [True, True, False]
