"""Frequency, damping ratio and dead time of the shaking table, and its frequency response."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.laboratory_tables import Damper, ShakingTable
from laboratories.identification import checks, estimate
from laboratories.identification.estimate import Identified
from laboratories.table import model as table_lab
from laboratories.table.record import TableLab
from models.compiled import jit
from models.registry import Array

LEAST = 50  # samples: more than ten for each parameter of the fit
NAMES = ("frequency", "damping_ratio", "delay", "gain")
UNITS = ("Hz", "", "s", "")
# Bounds of the fit, beyond any shaking table in use: slower ones cannot follow a building, faster ones look ideal at 2
# ms.
LOW = (0.2, 0.02, 0.0, 0.2)
HIGH = (200.0, 5.0, 0.5, 5.0)
HOPELESS = 0.8  # nrmse above which the fit is rejected: a constant has the nrmse 1
COHERENT = 0.8  # least coherence of a frequency that is used: a fifth of the power there is noise


class FrequencyResponse(NamedTuple):
    """Measured over commanded motion; all (m,)."""

    frequency: Array  # Hz
    response: np.ndarray[tuple[int], np.dtype[np.complex128]]
    coherence: Array


class Bandwidth(NamedTuple):
    """The frequencies up to which a table follows; nan where the record does not reach that far."""

    half_power: float  # Hz, −3 dB
    quarter_turn: float  # Hz, −90°
    delay: float  # s, at low frequency: L + 2ζ/ω


@jit
def respond(lab: TableLab, command: Array, result: Array) -> None:
    """Table displacement at each tick from rest; the command written at tick k acts from there on."""
    result[0] = 0.0
    for k in range(command.size - 1):
        result[k + 1] = table_lab.advance(lab, command[k], 0.0)[0]


def response(command: Array, interval: float, table: ShakingTable) -> Array:
    """Exact displacement (n,) of the table model to a ramped command that was zero before."""
    lab = table_lab.build(interval, table, Damper())
    result = np.empty(command.size)
    respond(lab, command, result)
    return result


def least_squares(command: Array, displacement: Array, interval: float) -> Identified:
    """`frequency` (Hz), `damping_ratio`, dead time `delay` (s) and `gain` of the table from a record of any motion.

    `command` (m) and `displacement` (m) have one value per tick of `interval` (s): the command written at
    tick k is ramped and reached at tick k + 1. The record begins at rest; the sensor's level is fitted too. The gain is
    that of loop and sensor together: without it an error of the calibration would be taken for a slower loop. The
    prediction uses the exact kernel of the emulated table; the intervals follow from Jacobian and residual, corrected
    for autocorrelation (`estimate.of_fit`). Motion well below the natural frequency determines L + 2ζ/ω only, and the
    intervals are then wide.

    Raises:
        InputError: too short, unequal lengths, not finite, constant, or a displacement that does not follow.

    Source: Ljung, System Identification (1999), section 7.
    """
    from scipy import optimize

    checks.positive("interval", interval)
    command, displacement = checks.signals(LEAST, command=command, displacement=displacement)
    checks.moves("command", command)
    checks.moves("displacement", displacement)
    moved = np.ascontiguousarray(command - command[0])
    spread = float(np.std(displacement))

    def model(x: Array) -> Array:
        table = ShakingTable(
            frequency=float(np.exp(x[0])), damping_ratio=float(np.exp(x[1])), delay=float(x[2])
        )
        return x[3] * response(moved, interval, table) + x[4] * spread

    def residual(x: Array) -> Array:
        return (model(x) - displacement) / spread

    level = float(displacement[0]) / spread
    guesses = [
        np.array([np.log(frequency), np.log(ratio), dead_time, 1.0, level])
        for frequency in (3.0, 8.0, 15.0, 30.0, 80.0)
        for ratio in (0.3, 0.8)
        for dead_time in (0.0, 0.005, 0.02, 0.06)
    ]
    best = min(guesses, key=lambda x: float(np.sum(residual(x) ** 2)))
    result = optimize.least_squares(
        residual,
        best,
        bounds=(
            [np.log(LOW[0]), np.log(LOW[1]), *LOW[2:], -np.inf],
            [np.log(HIGH[0]), np.log(HIGH[1]), *HIGH[2:], np.inf],
        ),
        x_scale="jac",
        diff_step=1e-6,
    )
    fitted = model(result.x)
    slopes = np.array([np.exp(result.x[0]), np.exp(result.x[1]), 1.0, 1.0])  # logarithms back to units
    result.jac = result.jac / np.append(slopes, 1.0)
    result.x = np.append([np.exp(result.x[0]), np.exp(result.x[1])], result.x[2:])
    misfit = estimate.nrmse(displacement, fitted)
    if misfit > HOPELESS:
        raise InputError("The table's displacement does not follow the command: check sensor and cabling.")
    return Identified(estimate.of_fit(result, NAMES, UNITS, np.ones(len(NAMES))), misfit)


def reached(command: Array) -> Array:
    """The command that the rig's ramp has reached at each tick, which is that of the tick before."""
    return np.concatenate([command[:1], command[:-1]])


def frequency_response(command: Array, measured: Array, interval: float) -> FrequencyResponse:
    """Frequency response from the ramped command to the measurement, with coherence; frequencies in Hz.

    Arrays have one value per tick of `interval` (s), the command written at tick k being reached at tick
    k + 1. Averaged over Hann windows of a quarter of the record, at most 2048 ticks, that overlap by half;
    the spectrum of the ramp's straight pieces (sinc²) is divided out.

    Raises:
        InputError: too short, unequal lengths, not finite, constant.

    Source: Welch (1967); Bendat and Piersol, Random Data, section 6.
    """
    from scipy import signal

    checks.positive("interval", interval)
    command, measured = checks.signals(4 * LEAST, command=command, measured=measured)
    checks.moves("command", command)
    checks.moves("measured", measured)
    given = reached(command)
    options = {"fs": 1.0 / interval, "nperseg": min(command.size // 4, 2048)}
    frequency, own = signal.welch(given, **options)
    _, cross = signal.csd(given, measured, **options)
    _, other = signal.welch(measured, **options)
    tiny = np.finfo(np.float64).tiny
    coherence = np.abs(cross) ** 2 / np.maximum(own * other, tiny)
    result = cross / np.maximum(own, tiny) / np.sinc(frequency * interval) ** 2
    return FrequencyResponse(frequency[1:], result[1:], coherence[1:])


def bandwidth(response: FrequencyResponse) -> Bandwidth:
    """Frequencies (Hz) of −3 dB and of −90°, and the delay (s) at low frequency.

    Only the frequencies below the first gap in coherence are used; −3 dB is relative to the response at the two lowest
    of them. The delay is τ of a phase `−2πτ·f + c·f³`, fitted up to half the frequency of −90°.

    Raises:
        InputError: fewer than four frequencies are coherent from the lowest on.
    """
    good = response.coherence >= COHERENT
    first = int(np.argmax(good))
    gap = np.flatnonzero(~good[first:])
    last = first + int(gap[0]) if gap.size else good.size
    if not good.any() or last - first < 4:
        raise InputError("The measurement is not coherent with the command: excite over a broad band.")
    frequency = response.frequency[first:last]
    size = np.abs(response.response[first:last])
    phase = np.unwrap(np.angle(response.response[first:last]))
    half_power = crossing(frequency, size / size[:2].mean(), np.sqrt(0.5))
    quarter = crossing(frequency, phase, -np.pi / 2.0)
    low = frequency <= (quarter / 2.0 if np.isfinite(quarter) else frequency[-1])
    low[:3] = True
    base = np.column_stack([frequency[low], frequency[low] ** 3])
    weights = np.linalg.lstsq(base, phase[low], rcond=None)[0]
    return Bandwidth(half_power, quarter, float(-weights[0] / (2.0 * np.pi)))


def crossing(frequency: Array, value: Array, level: float) -> float:
    """Frequency at which the value first falls through the level, nan if it does not."""
    under = np.flatnonzero(value < level)
    if not under.size or under[0] == 0:
        return float("nan")
    k = int(under[0])
    share = (value[k - 1] - level) / (value[k - 1] - value[k])
    return float(frequency[k - 1] + share * (frequency[k] - frequency[k - 1]))
