"""The readings of a laboratory: `gain·value` past a high-pass, saturated, plus bias, drift and noise; held, rounded.

Noise is white, from `default_rng(seed)`; lost samples are drawn from another generator.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from models.registry import Array
from validation.blind.labs.laying import PLAIN, KnownEffect, Values
from validation.blind.labs.unlisted import readings

BLOCK = 512  # rows of noise drawn at once, because one call costs as much as a hundred draws
MOTIONS = (
    "column_displacement",
    "table_displacement",
    "damper_stroke",
)  # no sensor of these forgets where it stands
LAGS = {"butterworth": 2, "first_order": 1}


def true_values(names: Sequence[str], levels: Mapping[str, float]) -> Values:
    """Perfect sensors with the noise given."""
    values: Values = {}
    for name in names:
        perfect = {"noise": levels[name], "gain": 1.0, "bias": 0.0, "drift": 0.0, "step": 0.0}
        perfect |= {
            "saturation": 0.0,
            "sharpness": 1.0,
            "missing": 0.0,
            "lag": 0.0,
            "order": 0.0,
            "forgetting": 0.0,
            "crosstalk": 0.0,
        }
        values |= {f"{name}.{key}": value for key, value in perfect.items()}
    return values


def gain(values: Values, *, signal: str, factor: float) -> None:
    """Reading = factor·value."""
    values[f"{signal}.gain"] *= factor


def bias(values: Values, *, signal: str, offset: float) -> None:
    """Reading = value + offset."""
    values[f"{signal}.bias"] += offset


def drift(values: Values, *, signal: str, rate: float) -> None:
    """Reading = value + rate·t."""
    values[f"{signal}.drift"] += rate


def lag(values: Values, *, signal: str, time_constant: float) -> None:
    """Low-pass filter that delays slow signals by the time constant."""
    values[f"{signal}.lag"] = time_constant


def high_pass(values: Values, *, signal: str, time_constant: float) -> None:
    """High-pass filter of first order that forgets a constant value in the time constant."""
    values[f"{signal}.forgetting"] = 1.0 / time_constant


def quantization(values: Values, *, signal: str, step: float) -> None:
    """Reading = step·round(value/step)."""
    values[f"{signal}.step"] = step


def noise(values: Values, *, signal: str, rms: float) -> None:
    """White noise in addition to the sensor's own."""
    values[f"{signal}.noise"] = math.hypot(values[f"{signal}.noise"], rms)


def saturation(values: Values, *, signal: str, limit: float, sharpness: float = 1.0) -> None:
    """Reading = ±limit·tanh(|value/limit|ⁿ)^(1/n), n = sharpness."""
    values |= {f"{signal}.saturation": limit, f"{signal}.sharpness": sharpness}


def missing(values: Values, *, signal: str, probability: float) -> None:
    """A sample that is lost repeats the reading before it."""
    values[f"{signal}.missing"] = probability


def crosstalk(values: Values, *, signal: str, coefficient: float) -> None:
    """Reading = value + coefficient·(last signal of the laboratory)."""
    values[f"{signal}.crosstalk"] = coefficient


FALSIFIED: tuple[Callable[..., None], ...] = (gain, bias, drift, high_pass, quantization, noise)
OUTSIDE: tuple[Callable[..., None], ...] = (missing, crosstalk)


def known(names: Sequence[str]) -> dict[str, KnownEffect]:
    """The effects on a laboratory's readings."""
    result: dict[str, KnownEffect] = {}
    for name in names:
        for effect in FALSIFIED:
            if effect is high_pass and name in MOTIONS:
                continue
            result[f"sensor.{name}.{effect.__name__}"] = KnownEffect(partial(effect, signal=name), PLAIN)
        result[f"sensor.{name}.lag"] = KnownEffect(partial(lag, signal=name), LAGS, f"{name}.order")
        blunt = KnownEffect(partial(saturation, signal=name), {"tanh": 0})
        result[f"sensor.{name}.saturation"] = blunt
        for effect in OUTSIDE:
            result[f"x.sensor.{name}.{effect.__name__}"] = KnownEffect(partial(effect, signal=name), PLAIN)
    return result | readings.of_signals(names)


def blunted(value: float, limit: float, sharpness: float) -> float:
    """A value as a saturating sensor reads it."""
    share = math.tanh((abs(value) / limit) ** sharpness) ** (1.0 / sharpness)
    return math.copysign(limit * share, value)


@dataclass
class TrueSensor:
    """One sensor with effects."""

    values: Values
    generator: np.random.Generator
    interval: float  # s
    last: float = 0.0
    before: float = 0.0  # the value a tick ago, and what the high-pass made of it
    passed: float = 0.0

    def read(self, value: float, leak: float, error: float, t: float) -> float:
        """Reading of a true value at `t` s; `leak` is the signal that may leak into it."""
        v = self.values
        result = v["gain"] * self.past_high_pass(value + v["crosstalk"] * leak)
        if v["saturation"] > 0.0:
            result = blunted(result, v["saturation"], v["sharpness"])
        result += v["bias"] + v["drift"] * t + error
        if v["step"] > 0.0:
            result = v["step"] * math.floor(result / v["step"] + 0.5)
        if v["missing"] > 0.0 and self.generator.random() < v["missing"]:
            return self.last
        self.last = result
        return result

    def past_high_pass(self, value: float) -> float:
        """What a high-pass lets pass of a value, by the trapezoidal rule."""
        share = 0.5 * self.interval * self.values["forgetting"]
        change = value - self.before
        self.before, self.passed = value, ((1.0 - share) * self.passed + change) / (1.0 + share)
        return value if share == 0.0 else self.passed


class TrueSensors:
    """The sensors of a laboratory."""

    def __init__(self, names: Sequence[str], values: Values, interval: float, seed: int) -> None:
        own = [{key: values[f"{name}.{key}"] for key in keys(name, values)} for name in names]
        generators = [np.random.default_rng([seed, 1 + place]) for place in range(len(own))]
        self._sensors = [TrueSensor(v, generators[place], interval) for place, v in enumerate(own)]
        self._strange = readings.strange(names, values, interval, seed)
        self._changed = any(v != {**perfect(), "noise": v["noise"]} for v in own)
        self._levels = np.array([v["noise"] for v in own])
        self._noise = np.random.default_rng(seed)
        self._block: list[list[float]] = []
        self._interval, self._tick = interval, 0
        self._made_of = (tuple(names), dict(values), seed)
        self._quick: TrueSensors | None = None
        self.lags = {name: (values[f"{name}.order"], values[f"{name}.lag"]) for name in names}

    def between(self, rows: Array) -> Array:
        """Readings of true values (steps, signals) within an interval, by the same sensors that are read so often.

        It is asked for after every interval from the first one, which begins at rest, or never.
        """
        if self._quick is None:
            names, values, seed = self._made_of
            self._quick = TrueSensors(names, values, self._interval / len(rows), seed)
            self._quick.read([0.0] * len(names))
        return np.array([list(self._quick.read(row)) for row in rows.tolist()])

    def read(self, true: Sequence[float]) -> Iterable[float]:
        """Readings at the present tick."""
        if not self._block:
            rows = self._noise.standard_normal((BLOCK, self._levels.size)) * self._levels
            self._block = rows[::-1].tolist()
        errors = self._block.pop()
        t = self._tick * self._interval
        self._tick += 1
        if self._strange:
            true = [
                self._strange[place].read(true, t) if place in self._strange else value
                for place, value in enumerate(true)
            ]
        if not self._changed:
            return [value + error for value, error in zip(true, errors, strict=True)]
        pairs = zip(self._sensors, true, errors, strict=True)
        return [sensor.read(value, true[-1], error, t) for sensor, value, error in pairs]


def keys(name: str, values: Values) -> list[str]:
    """Names of the values of one sensor."""
    return [key.rpartition(".")[2] for key in values if key.startswith(f"{name}.")]


def perfect() -> dict[str, Any]:
    """A sensor without effects or noise."""
    return {key.rpartition(".")[2]: value for key, value in true_values(["x"], {"x": 0.0}).items()}
