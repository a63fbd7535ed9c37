"""Coloured noise: its model, its spectral lines and spikes, and the effect of the model on a gap."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.unexplained import gap
from diagnosis.signals.noise import colour, pickup
from diagnosis.signals.noise.model import NoiseModel
from diagnosis.signals.noise.spikes import spikes
from diagnosis.signals.predictors.ceiling import Crosswise
from diagnosis.signals.predictors.features import features
from models.registry import Array
from tests.diagnosis.cases import white

INTERVAL, GROUP, TICKS = 0.002, 4, 12_000
RATE = 1.0 / INTERVAL


def low_passed(cutoff: float) -> Array:
    """White noise behind a filter of fourth order."""
    sections = signal.butter(4, cutoff, fs=RATE, output="sos")
    return np.asarray(signal.sosfilt(sections, white(1, TICKS)))


def pink() -> Array:
    """Noise whose density falls with the frequency."""
    lines = np.fft.rfft(white(2, TICKS))
    return np.asarray(
        np.fft.irfft(lines / np.sqrt(np.maximum(np.fft.rfftfreq(TICKS, INTERVAL), 0.05)), TICKS)
    )


COLOURS: dict[str, Array] = {
    "white": white(3, TICKS),
    "50 Hz": low_passed(50.0),
    "100 Hz": low_passed(100.0),
    "200 Hz": low_passed(200.0),
    "AR(1)": np.asarray(signal.lfilter([1.0], [1.0, -0.9], white(4, TICKS))),
    "pink": pink(),
    "heavy tails": np.random.default_rng(5).standard_t(3, TICKS),
    "12 bit": np.round(white(6, TICKS) / 0.5) * 0.5,
}


def averaged(x: Array) -> Array:
    """Sums over groups of ticks that keep the rms of white noise."""
    return np.asarray(x[: x.size // GROUP * GROUP].reshape(-1, GROUP).sum(axis=1) / np.sqrt(GROUP))


@pytest.mark.parametrize("place", [0, 1, 3998, 3999])
def test_a_sample_far_off_at_an_end_of_a_recording_is_a_spike(place: int) -> None:
    noise = np.random.default_rng(6).standard_normal(4000)
    noise[place] += 40.0
    assert np.flatnonzero(spikes(noise)).tolist() == [place]


def without_spikes(x: Array) -> Array:
    """Noise with straight lines in place of its spikes."""
    there = ~spikes(x)
    return np.asarray(np.interp(np.arange(x.size), np.flatnonzero(there), x[there]))


def whitened(noise: Array, known: list[Array]) -> tuple[Array, NoiseModel]:
    """Noise whitened with the model of some stretches of it, and that model."""
    density, order = colour.density(known)
    count = sum(piece.size for piece in known)
    model = NoiseModel(1.0, "ar", order, density=density, samples=count)
    return colour.whitened(noise[:, None], colour.gains(density, noise.size)[:, None])[:, 0], model


@pytest.mark.parametrize("name", COLOURS)
def test_noise_of_any_colour_does_not_count_as_a_gap(name: str) -> None:
    noise = averaged(without_spikes(COLOURS[name]))
    flat, model = whitened(noise, [noise[:500], noise[1500:2000]])
    assert gap(flat, GROUP, model).significance < 5.0
    assert np.var(flat) == pytest.approx(1.0, abs=0.15)
    assert np.abs(np.corrcoef(flat[1:], flat[:-1])[0, 1]) < 0.1


def test_noise_is_whitened_alike_by_more_lines_that_are_fast() -> None:
    """4007 is a prime number; of 4050 lines the last 43 samples are those before, turned back."""
    noise = np.asarray(signal.lfilter([1.0], [1.0, -0.9], np.random.default_rng(2).standard_normal(4007)))
    density, _ = colour.density([noise])
    assert colour.fast(noise.size) == 4050
    assert colour.fast(4050) == 4050
    few, more = (
        colour.whitened(noise[:, None], colour.gains(density, count)[:, None])[:, 0] for count in (4007, 4050)
    )
    assert few.shape == more.shape
    assert np.std(more) == pytest.approx(1.0, abs=0.03)
    assert np.max(np.abs(more - few)[:-10]) < 0.05


def test_the_ends_of_whitened_noise_are_as_loud_as_the_rest() -> None:
    smooth = signal.butter(8, 20.0, fs=RATE, output="sos")
    noise = averaged(np.asarray(signal.sosfilt(smooth, white(14, TICKS))[4000:]))
    flat, _ = whitened(noise, [noise])
    assert np.max(np.abs(flat)) < 5.0
    assert colour.heaviness(flat) < 1.2


def test_slow_noise_is_alike_in_two_stretches_and_a_motion_in_one_of_them_is_not() -> None:
    quiet = np.arange(1500) % 187 < 70
    band = signal.butter(2, (0.05, 0.2), "band")
    for seed in range(15, 20):
        noise = averaged(white(seed, 6000)) + np.cumsum(white(seed + 10, 1500)) / 5.0
        motion = np.where(quiet, 0.1, 1.0) * np.asarray(signal.lfilter(*band, white(seed + 20, 1500)))
        assert sensor_noise.alike(noise, quiet)
        assert not sensor_noise.alike(noise + 5.0 * motion, quiet)


@pytest.mark.parametrize("name", ["50 Hz", "AR(1)", "pink"])
def test_a_motion_is_significant_in_coloured_noise(name: str) -> None:
    noise = averaged(COLOURS[name])
    t = np.arange(noise.size) * INTERVAL * GROUP
    moving = np.where(t > 10.0, 2.5 * np.std(noise), 0.0) * np.sin(2.0 * np.pi * 3.0 * t)
    found, model = whitened(noise + moving, [noise[:1000]])
    assert gap(found, GROUP, model).significance > 10.0


def test_the_noise_model_recovers_the_filter_that_made_the_noise() -> None:
    made = np.array([1.0, -1.2, 0.6])
    model = colour.autoregression([np.asarray(signal.lfilter([1.0], made, white(7, 4000)))], careful=True)
    assert model.weights == pytest.approx(made, abs=0.05)
    assert model.variance == pytest.approx(1.0, abs=0.06)
    assert colour.autoregression([white(8, 4000)], careful=True).order == 0


def test_spectral_lines_of_constant_amplitude_count_as_pickup_and_those_of_a_motion_do_not() -> None:
    t = np.arange(TICKS) * INTERVAL
    hum = 0.5 * np.sin(2.0 * np.pi * 50.01 * t) + 0.2 * np.sin(2.0 * np.pi * 150.0 * t)
    found = pickup.pickups(white(9, TICKS) + hum, INTERVAL)
    assert pickup.named(found) == (50.0, 150.0)
    assert found[0].amplitude == pytest.approx(0.5, rel=0.1)
    left = white(9, TICKS) + hum - pickup.waves(white(9, TICKS) + hum, found, INTERVAL)
    assert np.std(left) == pytest.approx(1.0, rel=0.02)
    burst = np.exp(-(((t - 12.0) / 2.0) ** 2)) * np.sin(2.0 * np.pi * 20.0 * t)
    assert pickup.pickups(white(9, TICKS) + 3.0 * burst, INTERVAL) == []


@pytest.mark.parametrize(
    ("frequency", "wanders", "times", "left"),
    [
        (49.983, 0.0, 500.0, 1.02),
        (33.2147, 0.0, 500.0, 1.02),
        (50.01, 0.01, 20.0, 1.1),
        (60.0, 0.005, 50.0, 1.1),
    ],
)
def test_loud_hum_is_taken_away_to_the_noise_though_no_line_of_a_spectrum_lies_on_it(
    frequency: float, wanders: float, times: float, left: float
) -> None:
    t = np.arange(15_000) * INTERVAL
    wandering = wanders * np.sin(2.0 * np.pi * t / 40.0)  # Hz
    phase = 2.0 * np.pi * np.cumsum(frequency + wandering) * INTERVAL
    reading = white(9, t.size) + times * np.sin(phase)
    (found,) = pickup.pickups(reading, INTERVAL)
    assert found.frequency == pytest.approx(frequency + wandering.mean(), abs=5e-3)
    assert found.amplitude == pytest.approx(times, rel=0.02)
    assert np.std(reading - pickup.waves(reading, [found], INTERVAL)) == pytest.approx(1.0, abs=left - 1.0)


@pytest.mark.parametrize(("times", "left"), [(0.5, 0.02), (1.0, 0.03), (5.0, 0.5)])
def test_mains_whose_frequency_wanders_at_random_are_followed(times: float, left: float) -> None:
    for seed in range(4):
        rng = np.random.default_rng(seed)
        wandering = 0.03 * np.sqrt(INTERVAL) * np.cumsum(rng.standard_normal(13_000))  # Hz
        reading = rng.standard_normal(13_000)
        reading += times * math.sqrt(2.0) * np.sin(2.0 * np.pi * np.cumsum(50.0 + wandering) * INTERVAL)
        found = pickup.pickups(reading, INTERVAL)
        assert 50.0 in pickup.named(found)
        assert np.std(reading - pickup.waves(reading, found, INTERVAL)) == pytest.approx(1.0, abs=left)


def test_lines_in_several_readings_count_as_motion_except_those_at_mains_frequency() -> None:
    t = np.arange(TICKS) * INTERVAL
    line, hum = np.sin(2.0 * np.pi * 12.4 * t), np.sin(2.0 * np.pi * 50.0 * t)
    both = np.column_stack([white(31, TICKS) + line + hum, white(32, TICKS) + 0.4 * line + hum])
    alone = np.column_stack([white(31, TICKS) + line, white(32, TICKS)])
    for readings, expected in ((both, [12.4]), (alone, [])):
        found = [pickup.pickups(one, INTERVAL) for one in readings.T]
        moving = pickup.moving(found, readings, INTERVAL)[0]
        assert [round(item.frequency, 1) for item in moving] == expected


def test_single_samples_count_as_spikes_and_a_motion_does_not() -> None:
    noise = white(10, 3000)
    struck = noise.copy()
    struck[[500, 900, 1400]] += 30.0
    assert np.flatnonzero(spikes(struck)).tolist() == [500, 900, 1400]
    kick = noise + np.where(np.arange(3000) // 10 == 150, 30.0, 0.0)
    assert not spikes(kick).any()
    assert not spikes(low_passed(50.0)).any()


def test_the_part_that_follows_from_the_inputs_is_predicted_and_noise_is_not() -> None:
    drive = np.asarray(signal.lfilter([1.0], [1.0, -1.95, 0.96], white(11, 2500)))
    x = features(drive[:, None], 0.008, np.ones(2500, dtype=bool), timeless=True)
    rubbing = 2.0 * np.std(drive) * np.sign(np.gradient(drive))
    noise = np.asarray(signal.lfilter([1.0], [1.0, -0.9], white(12, 2500)))
    said = Crosswise(x).predict(np.column_stack([rubbing + noise, noise]))
    assert np.corrcoef(said[:, 0], rubbing)[0, 1] > 0.8
    assert np.std(said[:, 1]) < 0.2 * np.std(noise)
