"""Narrow lines of constant amplitude in a residual: mains and other machines that a sensor picks up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.signal import fftconvolve

from models.registry import Array

LOWEST = 8.0  # Hz, below which a line may well be the motion's own
SLOWEST = 2.0  # Hz, below which a drift may look like one
AROUND = 1.5  # Hz to each side over which the density beside a line is taken
CHANCE = 1e-4  # of a line in noise without one
MOST_LINES = 12
PARTS = 6  # of the record, in which a line's amplitude and phase are compared
TURNED = 3  # times that a frequency is found by its phase
WANDERS = 3  # degree of the polynomial that the phase of the mains follows
STEADY = 0.35  # by which its amplitude may vary from the mean, relative; noise adds to that
ALSO = 1e-3  # chance of a line in another reading, at the one frequency where it is looked for
MAINS = (50.0, 60.0)  # Hz
NEAR = 0.2  # Hz, within which a frequency is that of the mains or a harmonic
# s, over which phase and amplitude of the mains are followed beside a polynomial: their frequency wanders at random, by
# up to a tenth of a hertz within half a minute. As much of a reading's noise goes with them as lies within 0.5 Hz.
FOLLOWED = 0.4
WIDTHS = 4.0  # standard deviations of the normal weights, beyond which they are none
MORE = 2.0  # times the power beside a line of the mains, from which on what is left of it is followed


class Pickup(NamedTuple):
    """A narrow line in a reading."""

    frequency: float  # Hz
    amplitude: float  # in the reading's unit
    # Polynomial over time (s), highest power first, of the phase (rad) by which it wanders from such a frequency.
    wander: tuple[float, ...] = ()

    def phase(self, t: Array) -> Array:
        """Its phase (n,) at times (n,) s, up to a constant, rad."""
        turned = 2.0 * np.pi * self.frequency * t
        return np.asarray(turned + np.polyval(self.wander, t) if self.wander else turned)


class Spectrum(NamedTuple):
    """Power of a residual by frequency, and what it is around each."""

    power: Array  # (lines,)
    around: Array  # (lines,) mean power of the noise
    line: float  # Hz between two


def spectrum(residual: Array, interval: float) -> Spectrum:
    """The spectrum of a residual (n,) behind a Hann window."""
    power = np.abs(np.fft.rfft(residual * np.hanning(residual.size))) ** 2
    line = 1.0 / (residual.size * interval)
    size = 2 * max(8, round(AROUND / line)) + 1
    return Spectrum(power, ndimage.median_filter(power, size, mode="reflect") / math.log(2.0), line)


def pickups(residual: Array, interval: float, lowest: float = LOWEST) -> list[Pickup]:
    """Lines of a residual (n,) that stand out of the density around them and keep amplitude and phase."""
    power, around, line = spectrum(residual, interval)
    places = np.arange(power.size)
    above = power > math.log(residual.size / CHANCE) * around
    peak = (power == ndimage.maximum_filter1d(power, 7)) & above & (places * line > lowest)
    found = []
    for place in sorted(np.flatnonzero(peak & (places < power.size - 2)), key=lambda k: -power[k])[
        :MOST_LINES
    ]:
        one = followed(residual, Pickup(refined(power, int(place)) * line, 0.0), interval)
        amplitude = steady(residual, one, interval)
        if amplitude > 0.0:
            found.append(one._replace(amplitude=amplitude))
    return found


def shows(residual: Array, frequency: float, interval: float) -> bool:
    """Whether a residual (n,) has a line at a frequency (Hz) that is known from elsewhere."""
    power, around, line = spectrum(residual, interval)
    place = min(round(frequency / line), power.size - 1)
    return bool(power[place] > -math.log(ALSO) * around[place])


def moving(found: Sequence[Sequence[Pickup]], residuals: Array, interval: float) -> list[list[Pickup]]:
    """The lines of residuals (n, signals), by signal, that something moving makes: no mains, and several show them.

    A machine's motion is seen by every sensor near it, a disturbance of a cable by one alone, and the mains by all.
    """
    result: list[list[Pickup]] = []
    for place, lines in enumerate(found):
        others = [k for k in range(residuals.shape[1]) if k != place]
        result.append(
            [
                one
                for one in lines
                if not of_mains(one.frequency)
                and any(shows(residuals[:, k], one.frequency, interval) for k in others)
            ]
        )
    return result


def refined(power: Array, place: int) -> float:
    """Place of a peak between the lines of a spectrum, by a parabola through the logarithms."""
    a, b, c = (math.log(max(float(value), 1e-300)) for value in power[place - 1 : place + 2])
    bend = a - 2.0 * b + c
    return place + (0.5 * (a - c) / bend if bend < 0.0 else 0.0)


def followed(residual: Array, near: Pickup, interval: float) -> Pickup:
    """A line of a residual (n,), by how its phase turns against one whose frequency is `near`.

    A peak of a spectrum tells a frequency to a hundredth of the distance between two, by which the phase is off at the
    ends of a record: of a line that is 500 times the noise, that is more than the noise. The frequency of the mains
    wanders by some thousandths of a hertz within a record, that of a machine's controller does not.
    """
    middles = np.array([piece.mean() for piece in np.array_split(interval * np.arange(residual.size), PARTS)])
    line = near
    for _ in range(TURNED):
        faster = float(turned(residual, line, interval, middles, 1)[0]) / (2.0 * math.pi)
        line = line._replace(frequency=line.frequency + faster)
    if of_mains(line.frequency):
        for _ in range(TURNED):
            further = turned(residual, line, interval, middles, WANDERS)
            line = line._replace(wander=tuple(np.polyadd(line.wander or (0.0,), further).tolist()))
    return line


def turned(residual: Array, line: Pickup, interval: float, middles: Array, degree: int) -> Array:
    """Polynomial (degree + 1,) over time (s), highest power first, of the phase (rad) of a residual (n,) over a line's.

    `middles` (parts,) are the middles of the parts of the record, s.
    """
    parts = demodulated(residual, line, interval)
    over = np.unwrap(np.angle(parts * np.conj(parts.sum())))
    return np.asarray(np.polyfit(middles, over, degree, w=np.abs(parts)), dtype=np.float64)


def demodulated(residual: Array, line: Pickup, interval: float) -> NDArray[np.complex128]:
    """Amplitude and phase (parts,) of a residual (n,) over a line's phase, in the parts of the record."""
    t = np.asarray(interval * np.arange(residual.size), dtype=np.float64)
    wave = np.exp(-1j * line.phase(t))
    return np.array([2.0 * np.mean(piece) for piece in np.array_split(residual * wave, PARTS)])


def steady(residual: Array, line: Pickup, interval: float) -> float:
    """Amplitude of a line that is the same throughout a residual (n,), 0 where it comes and goes.

    Each part's amplitude and phase are held against those of the whole, with what noise makes them differ by; of the
    mains, whose phase wanders, the amplitude alone.
    """
    beside = [line._replace(frequency=line.frequency + shift) for shift in (-AROUND, AROUND)]
    if of_mains(line.frequency):
        sizes = rms_of_parts(residual, line, interval)
        noise = float(np.median([rms_of_parts(residual, one, interval) for one in beside]))
        sizes = np.sqrt(np.maximum(sizes**2 - noise**2, 0.0))
        mean = float(np.mean(sizes))
        return mean if np.all(np.abs(sizes - mean) < STEADY * mean + 2.5 * noise) else 0.0
    parts = demodulated(residual, line, interval)
    whole = complex(np.mean(parts))
    # rms of a complex normal number over the median of its size
    noise = 1.2 * float(np.median([np.abs(demodulated(residual, one, interval)) for one in beside]))
    apart = np.abs(parts - whole)
    return abs(whole) if np.all(apart < STEADY * abs(whole) + 2.5 * noise) else 0.0


def rms_of_parts(residual: Array, line: Pickup, interval: float) -> Array:
    """Rms amplitude (parts,) of what follows a line in a residual (n,), in the parts of the record."""
    pieces = np.array_split(np.square(np.abs(envelope(residual, line, interval))), PARTS)
    return np.sqrt(np.array([piece.mean() for piece in pieces]))


def envelope(residual: Array, line: Pickup, interval: float) -> NDArray[np.complex128]:
    """Amplitude and phase (n,) of a residual (n,) over a line's phase, followed over `FOLLOWED` seconds."""
    t = np.asarray(interval * np.arange(residual.size), dtype=np.float64)
    turned = 2.0 * residual * np.exp(-1j * line.phase(t))
    reach = round(WIDTHS * FOLLOWED / interval)
    weights = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) * interval / FOLLOWED))
    # by spectra, as a direct sum over so many weights takes fifteen times as long
    return np.asarray(fftconvolve(np.pad(turned, reach, mode="edge"), weights / weights.sum(), mode="valid"))


def waves(residual: Array, lines: Sequence[Pickup], interval: float) -> Array:
    """The lines' part (n,) of a residual (n,), by least squares over all lines at once, with the mains followed."""
    if not lines:
        return np.zeros_like(residual)
    t = np.asarray(interval * np.arange(residual.size), dtype=np.float64)
    columns = [shape(item.phase(t)) for item in lines for shape in (np.cos, np.sin)]
    x = np.column_stack(columns)
    found: Array = np.asarray(x @ np.linalg.lstsq(x, residual, rcond=None)[0])
    for one in lines:
        if of_mains(one.frequency) and wanders(residual - found, one, interval):
            left = envelope(residual - found, one, interval)
            found = found + np.real(left * np.exp(1j * one.phase(t)))
    return found


def wanders(left: Array, line: Pickup, interval: float) -> bool:
    """Whether more is left (n,) near a line that was taken away than beside it: its phase goes other ways."""
    beside = [line._replace(frequency=line.frequency + shift) for shift in (-AROUND, AROUND)]
    near, *others = (float(np.mean(np.abs(envelope(left, one, interval)) ** 2)) for one in (line, *beside))
    return near > MORE * max(others)


def named(lines: Sequence[Pickup]) -> tuple[float, ...]:
    """Frequencies of lines, ascending; those of mains and harmonics by their nominal value."""
    return tuple(sorted({nominal(item.frequency) for item in lines}))


def nominal(frequency: float) -> float:
    """A frequency, that of the mains or a harmonic where it is near one."""
    return next((multiple for multiple in harmonics(frequency)), round(frequency, 2))


def of_mains(frequency: float) -> bool:
    """Whether a frequency is that of the mains or of a harmonic."""
    return bool(harmonics(frequency))


def harmonics(frequency: float) -> list[float]:
    """The frequencies of the mains and their harmonics that a frequency is near to."""
    multiples = [max(1, round(frequency / mains)) * mains for mains in MAINS]
    pairs = zip(multiples, MAINS, strict=True)
    return [multiple for multiple, mains in pairs if abs(frequency - multiple) < NEAR * multiple / mains]
