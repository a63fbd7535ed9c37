"""The noise of static data, whose rows have no times: what changes slowly from row to row is the error of a law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from common.plan.plan import Plan
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.residuals import Data
from loop import replay
from models.registry import Array
from models.system import System
from tests.diagnosis.cases import white
from tests.diagnosis.specimens import INTERVAL, NOISE, TICKS, MadeSpecimen, data_of

SLOW = 5.0 * NOISE
RESTS = 3000  # rows in which the column stands still


class Erring(MadeSpecimen):
    """A column that its plan describes but for an error that changes slowly from row to row."""

    def __init__(self, rests: int, hum: float = 0.0) -> None:
        super().__init__()
        self.motion[:rests] = 0.0
        slow = signal.lfilter([1.0], [1.0, -0.95], white(11, TICKS))
        wave = hum * np.sin(2.0 * np.pi * 25.0 * INTERVAL * np.arange(TICKS))
        error = SLOW / slow.std() * slow + wave + NOISE * white(12, TICKS)
        self.measured = replay.column(System(Plan()), self.motion)[:, None] + error[:, None]


def found(rests: int, *, static: bool, hum: float = 0.0) -> tuple[Data, Array]:
    """The data of such a column with their noise, and what its sensor is said to pick up."""
    data = replace(data_of(Erring(rests, hum)), static=static)
    data = sensor_noise.modelled(data, data.system)
    return data, np.zeros(1) if data.lines is None else data.lines


def test_what_changes_slowly_from_row_to_row_is_no_noise_of_static_data() -> None:
    timed, _ = found(0, static=False)
    static, _ = found(0, static=True)
    assert timed.noise[0].density is not None
    assert timed.white[0] > 0.9 * SLOW
    assert static.noise[0].density is None
    assert static.white[0] < 0.5 * SLOW


def test_rows_at_rest_tell_that_noise_of_static_data_changes_slowly() -> None:
    static, _ = found(RESTS, static=True)
    assert static.noise[0].density is not None
    assert static.white[0] == pytest.approx(SLOW, rel=0.2)


def test_rows_have_no_frequency_that_a_sensor_could_pick_up() -> None:
    assert np.ptp(found(0, static=False, hum=20.0 * NOISE)[1]) > 0.0
    assert not np.any(found(0, static=True, hum=20.0 * NOISE)[1])
