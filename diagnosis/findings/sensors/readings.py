"""Noise, rounding and repeated samples of readings, seen in the samples themselves without a model of the part."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from common.recording.imported import ImportedChannel
from diagnosis.fits.residuals import STEPPING, Data
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.parts import FINE_ERROR
from diagnosis.recorded.record import Record
from diagnosis.signals.noise.rounding import quantum, quantum_between
from models.registry import Array

# A sensor counts as too noisy from LOUDER times the noise that the plan and the other sensors make expected, and from
# LEAST times the plan's own: a plan rarely knows a sensor's noise better than within a factor of two.
LOUDER, LEAST = 2.5, 2.0
# Noise over a reading's peak that a logger's converter makes: 12 bits of a range five times the peak, whose steps are
# hidden once the reading is interpolated.
CONVERTER = 7e-4
# Least expected noise as a share of the planned one, so that a quiet set of sensors gives no alarm.
QUIETEST = 0.4
# Relative error, 95 % of the noise levels found in white noise: 2.3 % in 40 s at 2 ms, 3.5 % in 10 s.
NOISE_ERROR = 0.03
# Relative error of a step: more than the rounding of floats or of a text, far less than anything of interest.
STEP_ERROR = 1e-7
# Least common noise of all sensors as a share of the planned one: below it they count as free of noise.
LEAST_SCALE = 1e-3
# Share of repeated samples from which on a sensor misses samples (two equal samples of normal noise are impossible in
# double precision), and from which on the signal stood still instead.
REPEATED, STOOD = 1e-3, 0.5
# Step over the range of a channel, times that of the other channels, from which on it rounds by itself. Decimal digits
# differ between channels by up to a factor of ten, ranges of converters by two to four.
UNLIKE = 5.0
# Times its noise, from which on a reading's step counts as coarse: converters are chosen with steps of about their
# sensors' noise, and one of twice the noise makes it a sixth louder.
COARSER = 2.0
SAME = 1.01  # factor within which two steps are the same one
DIGITS = 7  # significant digits up to which values count as printed text


class SensorFinding(NamedTuple):
    """What was found on one sensor."""

    effect: str
    parameter: str
    value: float
    interval: tuple[float, float]
    ratio: float  # of the sensor's whole noise to its usual one, of a step's error to the usual noise

    @property
    def usual(self) -> float:
        """Rms noise that a sensor which is too noisy has otherwise."""
        return self.value / math.sqrt(self.ratio**2 - 1.0)


def read_by(record: Record) -> list[str]:
    """The measured signals of all laboratories."""
    return [name for lab in record.labs for name in lab.measured]


def effect_on(record: Record, name: str, fault: str) -> str:
    """The effect of a fault on the reading of that name."""
    lab = next(lab for lab in record.labs if name in lab.measured)
    return f"{lab.sensor(name)}.{fault}"


def steps(record: Record) -> dict[str, float]:
    """Rounding step of every reading that has one, by signal."""
    found = {}
    for name in read_by(record):
        if record.has(name):
            there = record.signals[name][record.present[name]]
            if np.ptp(there) > 0.0 and (step := quantum(there)) > 0.0:
                found[name] = step
    return found


def stated_steps(record: Record) -> dict[str, float]:
    """The resolution stated for channels in an import map, by signal."""
    return {name: one.resolution for name, one in imports(record).items() if one.resolution > 0.0}


def printed_steps(record: Record) -> dict[str, float]:
    """The step of the last decimal of channels that were imported from a text with as many in each row, by signal."""
    return {name: one.printed for name, one in imports(record).items() if one.printed > 0.0}


def imports(record: Record) -> dict[str, ImportedChannel]:
    """What an import states about the channels of readings, by signal; none of a test recorded by rths itself."""
    stated = record.stated
    return {
        given: stated.channel(lab.role, name)
        for lab in record.labs
        for name, given in zip(lab.kind.channels.names, lab.measured, strict=True)
        if stated is not None
    }


def resolutions(record: Record, rounded: Mapping[str, float]) -> dict[str, float]:
    """Rounding steps by signal: `rounded`, or that from before an interpolation, or the one stated for a channel.

    The second is a logger's, and so no error of a sensor.
    """
    found = stated_steps(record)
    for name in read_by(record):
        if name not in rounded and record.has(name):
            step = quantum_between(record.signals[name][record.present[name]])
            found |= {name: step} if step > 0.0 else {}
    return {**found, **rounded}


def held(record: Record, steps: Mapping[str, float]) -> dict[str, float]:
    """Share of samples exactly equal to the one before, by sensor; only of sensors whose noise rules that out.

    Sensors with `steps` may well repeat a sample. So may a channel that was interpolated onto the ticks, whose steps
    may not be known.
    """
    found, between = {}, interpolated(record)
    for name in read_by(record):
        if name in steps or name in between:
            continue
        if record.has(name) and np.ptp(record.signals[name]) > 0.0:
            there = record.signals[name][record.present[name]]
            share = float(np.mean(there[1:] == there[:-1]))
            if REPEATED < share < STOOD and not printed(there):
                found[name] = share
    return found


def interpolated(record: Record) -> set[str]:
    """The readings whose rows were not on the ticks when they were imported."""
    return {name for name, one in imports(record).items() if one.interpolated}


def printed(values: Array) -> bool:
    """Whether values went through a text of a few digits, in which neighbours may well be equal; 200 samples tell."""
    some = values[:: max(1, values.size // 200)]
    return all(float(f"{value:.{DIGITS}g}") == value for value in some.tolist())


def levels(datas: list[Data], noises: list[Array] | None = None) -> dict[str, float]:
    """Rms noise of every reading; `noises` holds that of each part (signals,), its data's where none are given."""
    return {
        name: float(noise)
        for data, own in zip(datas, noises or [data.white for data in datas], strict=True)
        if not data.part.exact and not isinstance(data.part, Building)
        for name, noise, there in zip(data.part.signals, own, data.part.present.T, strict=True)
        if there.any()
    }


def floors(
    noise: Mapping[str, float], steps: Mapping[str, float], named: Sequence[SensorFinding], record: Record
) -> dict[str, float]:
    """Rms noise of every reading, no less than what rounding makes.

    Steps of effects `named` are simulated instead, and what they make is taken from noise that holds it.
    """
    own = {item.effect for item in named}
    result = dict(noise)
    for name in noise.keys() & steps.keys():
        rounding = steps[name] / math.sqrt(12.0)
        if effect_on(record, name, "quantization") not in own:
            result[name] = max(noise[name], rounding)
        elif noise[name] > rounding:
            result[name] = math.sqrt(noise[name] ** 2 - rounding**2)
    return result


def beside_rounding(white: float, step: float) -> float:
    """Rms noise of a reading without that of its rounding to a step; 0 where the step may hide it."""
    return math.sqrt(white**2 - step**2 / 12.0) if STEPPING * white > step else 0.0


def coarsest(record: Record, rounded: Mapping[str, float]) -> dict[str, float]:
    """Largest step that the logger's own rounding explains, by signal; empty unless most readings are rounded.

    A converter or a text rounds all channels to about as many digits, or all of a unit to one decimal, while a sensor
    with coarse steps stands alone.
    """
    read = [name for name in read_by(record) if record.has(name) and np.ptp(record.signals[name]) > 0.0]
    if len(rounded) < 2 or len(rounded) <= len(read) / 2:
        return {}
    shares = {name: step / float(np.ptp(record.signals[name])) for name, step in rounded.items()}
    usual = float(np.median(list(shares.values())))
    result = {}
    for name in rounded:
        alike = [
            step
            for other, step in rounded.items()
            if other != name and record.unit(other) == record.unit(name)
        ]
        result[name] = max([UNLIKE * usual * float(np.ptp(record.signals[name])), *alike])
    return result


def findings(
    record: Record,
    white: dict[str, float],
    rounded: dict[str, float],
    steps: Mapping[str, float],
    *,
    logged: bool = False,
) -> list[SensorFinding]:
    """Sensors that round coarsely, and sensors that are far noisier than planned and than the other ones.

    `rounded` are the steps of `steps` that a sensor may have made; `white` is the rms noise. Where a logger recorded
    (`logged`), noise as small as that of its converter is the logger's. Steps that err by less than two very good
    solutions of a model differ are those of a text.
    """
    noise_of = record.planned_noise
    # A value that is only stated has no noise.
    read = {name for name in white if np.ptp(record.signals[name]) > 0.0}
    noise = {name: beside_rounding(level, steps.get(name, 0.0)) for name, level in white.items()}
    ratios = {
        name: noise[name] / noise_of[name] for name in noise if name in read & noise_of.keys() and noise[name]
    }
    usual = max(float(np.median(list(ratios.values()))) if ratios else 1.0, LEAST_SCALE)
    result = []
    stated = stated_steps(record)
    # a text's digits may be finer than the steps of the converter before it, which the map states
    whole = {name: max(stated.get(name, 0.0), rounded.get(name, 0.0)) for name in (*stated, *rounded)}
    coarse = coarsest(record, whole) | stated
    text = printed_steps(record)
    for name, step in rounded.items():
        expected = noise_of.get(name, 0.0) * usual
        seen = FINE_ERROR * float(np.std(record.signals[name])) * math.sqrt(12.0)
        least = max(COARSER * expected, SAME * coarse.get(name, 0.0), SAME * text.get(name, 0.0), seen)
        if step > least:
            size = step / np.sqrt(12.0) / expected if expected > 0.0 else 0.0
            bounds = ((1.0 - STEP_ERROR) * step, (1.0 + STEP_ERROR) * step)
            result.append(SensorFinding(effect_on(record, name, "quantization"), "step", step, bounds, size))
    if not record.has("displacement"):  # the plan's sensors may be another laboratory's
        return result
    for name, ratio in ratios.items():
        others = [value for key, value in ratios.items() if key != name]
        expected = float(np.median(others)) if others else 1.0
        if logged and noise[name] < CONVERTER * float(np.max(np.abs(record.signals[name]))):
            continue
        if ratio > LOUDER * max(expected, QUIETEST) and ratio > LEAST:
            value = float(np.sqrt(max(noise[name] ** 2 - (expected * noise_of[name]) ** 2, 0.0)))
            bounds = ((1.0 - NOISE_ERROR) * value, (1.0 + NOISE_ERROR) * value)
            result.append(
                SensorFinding(effect_on(record, name, "noise"), "rms", value, bounds, ratio / expected)
            )
    return result
