"""The readings of a shaking table as spectra, which its linear models predict from the spectrum of its command.

It stands in for the table's part where a fit has a long way to go: a spectrum takes a tenth of the time of a replay,
and all that is linear in a loop acts on each of its lines by itself.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from diagnosis.recorded.parts import LaboratoryPart, Measured
from diagnosis.signals.mask import Mask
from laboratories.table import transfer
from models.registry import Array
from models.system import SensorEffects, System

Spectrum = npt.NDArray[np.complex128]

# Hz, of the lines that count: zeros of sensors and their drift stand below, mostly noise above. AT_TICKS is the share
# of the sampling rate above which straight lines between samples carry little of a motion.
LOWEST, HIGHEST, AT_TICKS = 0.15, 40.0, 0.35
THERE = 0.95  # of its samples that a reading must have
READ = ("table_displacement", "table_acceleration")


def places_read(part: LaboratoryPart) -> list[int]:
    """The places of the readings of a table that were recorded."""
    shown = part.present.mean(axis=0) > THERE
    return [place for place, name in enumerate(part.lab.kind.channels.names) if name in READ and shown[place]]


class LoopResponse(Measured):
    """The spectra of a table's readings, (2·lines, readings): real parts, and below them imaginary parts."""

    name = "response"
    exact = False

    def __init__(self, part: LaboratoryPart, interval: float) -> None:
        names = part.lab.kind.channels.names
        places = places_read(part)
        self.role, self.nuisances, self.candidates = part.role, part.nuisances, part.candidates
        self.signals = tuple(part.signals[place] for place in places)
        self._names, self._step = [names[place] for place in places], interval / max(part.steps, 1)
        # a reading is taken before the command of its tick acts, but where a logger sampled both
        self._ahead = 0.0 if part.steps else interval
        ticks = len(part.measured)
        frequencies: Array = np.asarray(np.fft.rfftfreq(ticks, interval), dtype=np.float64)
        self._lines = (frequencies > LOWEST) & (frequencies < min(HIGHEST, AT_TICKS / interval))
        self._s = np.asarray(2j * np.pi * frequencies[self._lines], dtype=np.complex128)
        command = self.spectrum(part.inputs[next(iter(part.inputs))])
        passed = [part.channels[place].response(frequencies[self._lines]) for place in places]
        self._commands = [np.asarray(command * one) for one in passed]
        self.measured = np.stack([apart(self.spectrum(part.measured[:, place])) for place in places], axis=1)
        self.present: Mask = np.ones(self.measured.shape, dtype=bool)

    def spectrum(self, values: Array) -> Spectrum:
        """The lines of a series (ticks,), scaled so that the parts of white noise keep its rms."""
        return np.asarray(np.fft.rfft(values - values[0])[self._lines] * np.sqrt(2.0 / values.size))

    def predict(self, system: System) -> Array:
        """Spectra of the readings."""
        moved = np.exp(-self._s * self._ahead) * transfer.displacement(
            self._s, self._step, system.plan.table, system.effects.table
        )
        columns = []
        for name, command in zip(self._names, self._commands, strict=True):
            motion = moved if name == READ[0] else self._s**2 * moved
            columns.append(apart(motion * command * self.sensed(system.effects.sensors.get(name))))
        return np.stack(columns, axis=1)

    def sensed(self, effects: SensorEffects | None) -> Spectrum | float:
        """A reading over what its sensor sees."""
        if effects is None:
            return 1.0
        late = effects.delay + effects.logger_delay
        lag = 1.0 + effects.lag * self._s + (effects.lag * self._s / (2.0 * effects.lag_damping)) ** 2
        return np.asarray(effects.gain * np.exp(-late * self._s) / lag)

    def first(self, ticks: int) -> LoopResponse:
        """The whole of it, because a spectrum has no beginning."""
        return self


def apart(values: Spectrum) -> Array:
    """Real parts (n,) of a spectrum, and below them its imaginary parts, (2·n,)."""
    return np.concatenate([values.real, values.imag])
