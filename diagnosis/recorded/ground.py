"""The ground motion: the recorded one against that of the plan."""

from __future__ import annotations

import math

import numpy as np

from common.recording.imported import ImportedData
from common.roles import MASTER
from diagnosis.recorded.nuisances import Nuisance
from diagnosis.recorded.parts import Measured, of_sites
from diagnosis.recorded.record import Record
from loop import substructure
from models.registry import Array
from models.system import System


class Ground(Measured):
    """The recorded ground acceleration, predicted from the ground motion of the plan."""

    name = "ground"
    role = MASTER
    exact = True
    signals: tuple[str, ...] = ("ground_acceleration",)

    def __init__(self, record: Record, believed: Array) -> None:
        self._interval = record.plan.test.interval
        stated = record.stated or ImportedData("")
        rows = stated.channel(MASTER, self.signals[0])
        self._believed = rows.through(believed[0], self._interval)  # beyond the test's end as well
        self._scale = record.plan.ground_motion.scale
        self.measured = record.signals["ground_acceleration"][:, None]
        self.present = record.present["ground_acceleration"][:, None]
        self.nuisances: tuple[Nuisance, ...] = ()
        self.candidates = of_sites(record, ("ground",), record.plan)
        self.blur = self.interpolated(rows.rate) if rows.interpolated and rows.rate > 0.0 else 0.0
        if record.start is not None:
            self.blur = max(self.blur, record.start.blur)

    def interpolated(self, rate: float) -> float:
        """Rms error (m/s²) of the plan's motion once it is sampled at `rate` (Hz) and interpolated onto the ticks."""
        ticks = np.arange(self._believed.size) * self._interval
        rows = np.arange(math.ceil(ticks[-1] * rate) + 1) / rate
        again = np.interp(ticks, rows, np.interp(rows, ticks, self._believed))
        return float(np.sqrt(np.mean(np.square(again - self._believed))))

    def predict(self, system: System) -> Array:
        """Ground acceleration."""
        factor = system.plan.ground_motion.scale / self._scale if self._scale else 1.0
        shift = system.effects.time_shift / self._interval
        return factor * substructure.shifted(self._believed[None], shift).T[: len(self.measured)]

    def first(self, ticks: int) -> Ground:
        """The whole of it, because it is computed and cheap."""
        return self

    def shift(self) -> float:
        """Delay (s) of the recorded motion against the plan's, by cross-correlation."""
        size = 2 * self.measured.size
        came = np.fft.rfft(self.measured[:, 0], size)
        product = np.fft.irfft(came * np.conj(np.fft.rfft(self._believed, size)), size)
        place = int(np.argmax(np.abs(product)))
        return (place if place < size // 2 else place - size) * self._interval
