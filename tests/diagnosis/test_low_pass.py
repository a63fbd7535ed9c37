"""Parameters that leave the least of readings behind a filter, by sums over a few lines of their spectra."""

from __future__ import annotations

import numpy as np
import pytest

from common.recording.imported import ImportedChannel
from common.recording.logger.low_pass import LoggerFilter
from diagnosis.signals import low_pass
from models.registry import Array
from tests.diagnosis.cases import white

INTERVAL, TICKS = 2e-3, 8000
BESSEL = LoggerFilter("bessel", 4, 40.0)


def motion() -> tuple[Array, Array]:
    """Two readings (ticks, 2), and their slopes over three parameters (ticks, 2, 3)."""
    t = INTERVAL * np.arange(TICKS)
    true = np.stack(
        [np.sin(9.0 * t) + 0.3 * np.sin(70.0 * t), np.cos(11.0 * t) + 0.2 * np.sin(120.0 * t)], axis=1
    )
    true += 0.01 * np.stack([white(1, TICKS), white(2, TICKS)], axis=1)
    rates = np.gradient(true, INTERVAL, axis=0)
    return true, np.stack([0.01 * true, 5e-5 * rates, 0.01 * np.roll(true, 3, axis=0)], axis=2)


def spectra(narrow: int, monkeypatch: pytest.MonkeyPatch) -> low_pass.ReadSpectra:
    """Spectra of readings of other parameters behind a filter, with noise."""
    monkeypatch.setattr(low_pass, "NARROW", narrow)
    true, slopes = motion()
    moved = true + slopes @ np.array([1.5, -0.7, 0.4])
    read = np.stack([BESSEL.filtered(one, INTERVAL) for one in moved.T], axis=1)
    read += 1e-3 * np.stack([white(3, TICKS), white(4, TICKS)], axis=1)
    return low_pass.spectra(read, true, slopes, INTERVAL, 200.0, 20)


def test_single_lines_give_the_least_squares(monkeypatch: pytest.MonkeyPatch) -> None:
    of = spectra(1, monkeypatch)
    passed = ImportedChannel(BESSEL).response(of.frequency)[:, None]
    left, level = of.read - passed * of.true, np.full((of.starts.size, 2), 2.0)
    known = np.array([True, True, False])
    found = low_pass.fitted(of, passed, left, level, known)
    slopes = (of.slopes[0] + 1j * of.slopes[1]).reshape(*left.shape, 3)
    weight = np.sqrt(2.0 * low_pass.OWN / 2.0)
    lines = weight * (passed[:, :, None] * slopes).reshape(-1, 3)
    prior = np.diag([1.0, 1.0, np.sqrt(low_pass.FREE)])
    rows = np.concatenate([lines.real, lines.imag, prior])
    wanted = np.concatenate([weight * left.real.ravel(), weight * left.imag.ravel(), np.zeros(3)])
    assert found == pytest.approx(np.linalg.lstsq(rows, wanted)[0], rel=1e-6)


@pytest.mark.parametrize("cutoff", [20.0, 40.0, 80.0])
def test_a_few_lines_together_say_the_same(cutoff: float, monkeypatch: pytest.MonkeyPatch) -> None:
    channel = ImportedChannel(LoggerFilter("butterworth", 3, cutoff))
    exact, near = (low_pass.surprise(spectra(narrow, monkeypatch), channel) for narrow in (1, 4))
    assert near == pytest.approx(exact, abs=1.0)
    other = low_pass.surprise(spectra(4, monkeypatch), ImportedChannel(BESSEL))
    assert abs(other - near) > 100.0  # what filters differ by
