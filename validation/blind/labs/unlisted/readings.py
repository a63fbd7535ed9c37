"""Effects of no catalogue on the readings of the trial's laboratories."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from validation.blind.labs.laying import KnownEffect, Values
from validation.blind.labs.unlisted.effect import SIZES, Unlisted, known

(JUMPS, INTERPOLATION, HYSTERESIS, HEAT, CHARGE, CLOCK, TILT, RECTIFIED) = range(1, 9)
(ADDRESS, COSINE, FIXTURE, CONNECTOR) = range(9, 13)

KEEPING = (JUMPS, HYSTERESIS, HEAT, CHARGE, CLOCK)  # effects with memory
TABLE, TABLE_ACCELERATION, STROKE = range(3)  # places of laboratory B's signals
GRAVITY = 9.81  # m/s²
ROUND = 1.7  # s, after which a multiplexer errs again

EFFECTS = {
    "x.sensor.column_displacement.jumps": Unlisted(
        JUMPS, "counts are lost now and then: the zero jumps", {"jump": (5e-6, 2e-4), "rate": (0.3, 2.0)}
    ),
    "x.sensor.column_displacement.interpolation": Unlisted(
        INTERPOLATION,
        "an encoder's interpolation: an error periodic in place",
        {"amplitude": (2e-6, 6e-5), "period": (2e-4, 2e-3)},
    ),
    "x.sensor.column_force.hysteresis": Unlisted(
        HYSTERESIS, "a load cell's hysteresis (magnetostriction), as a play", {"width": (100.0, 4000.0)}
    ),
    "x.sensor.column_force.heat": Unlisted(
        HEAT,
        "a load cell's zero moves with the work that warms it",
        {"rate": (0.03, 0.8)},
        ("sensor.column_force.drift",),
    ),
    "x.sensor.column_force.charge": Unlisted(
        CHARGE,
        "a piezoelectric cell's charge leaks: a high-pass of first order",
        {"rate": (0.02, 1.0)},
        ("sensor.column_force.high_pass",),
    ),
    "x.sensor.table_displacement.clock": Unlisted(
        CLOCK,
        "a converter's clock jitters: samples are up to so much of an interval early",
        {"share": (0.2, 1.0)},
    ),
    "x.sensor.table_acceleration.tilt": Unlisted(
        TILT, "the table tilts under the moving mass: gravity leaks in", {"tilt": (0.01, 0.4)}
    ),
    "x.sensor.table_acceleration.rectified": Unlisted(
        RECTIFIED, "an accelerometer rectifies vibration (IEEE Std 1293)", {"share": (4e-3, 0.4)}
    ),
    "x.sensor.damper_stroke.address": Unlisted(
        ADDRESS, "a multiplexer gives the table's place in the stroke's for some time", {"time": (4e-3, 0.12)}
    ),
    "x.sensor.damper_stroke.cosine": Unlisted(
        COSINE, "a wire sensor's wire is not along the stroke: s + c·s²", {"curvature": (0.01, 1.0)}
    ),
    "x.sensor.damper_force.fixture": Unlisted(
        FIXTURE, "the table shakes a mass that hangs on the load cell", {"mass": (0.05, 1.5)}
    ),
    "x.sensor.damper_force.connector": Unlisted(
        CONNECTOR,
        "a bad connector: the gain sways in time",
        {"share": (5e-3, 0.15), "frequency": (0.3, 4.0)},
    ),
}


def of_signals(names: Sequence[str]) -> dict[str, KnownEffect]:
    """The effects on a laboratory's readings; each has its code and parameters behind its signal's name."""
    found: dict[str, KnownEffect] = {}
    for name in names:
        here = {key: one for key, one in EFFECTS.items() if key.startswith(f"x.sensor.{name}.")}
        found |= known(here, f"unlisted.{name}")
    return found


def strange(names: Sequence[str], values: Values, interval: float, seed: int) -> dict[int, StrangeReading]:
    """The readings with such an effect among a laboratory's values, by place."""
    found = {}
    for place, name in enumerate(names):
        key = f"unlisted.{name}"
        if values.get(key):
            sizes = [values.get(f"{key}.{size}", 0.0) for size in SIZES]
            found[place] = StrangeReading(values[key], (sizes[0], sizes[1]), place, interval, seed)
    return found


class StrangeReading:
    """A reading with an effect of no catalogue, which keeps what it must from tick to tick."""

    def __init__(
        self, code: float, sizes: tuple[float, float], place: int, interval: float, seed: int
    ) -> None:
        self._code, self._sizes, self._place, self._interval = code, sizes, place, interval
        self._generator = np.random.default_rng([seed, 100 + place])
        self._kept = 0.0
        self._before: Sequence[float] = ()

    def read(self, true: Sequence[float], t: float) -> float:
        """What is read at `t` s, before gain and noise, where the laboratory's signals are truly these."""
        found = self._remembering(true) if self._code in KEEPING else self._at_once(true, t)
        self._before = tuple(true)
        return found

    def _at_once(self, true: Sequence[float], t: float) -> float:
        """What is read by an effect without memory."""
        (a, b), value = self._sizes, true[self._place]
        if self._code == INTERPOLATION:
            return value + a * math.sin(2.0 * math.pi * value / b)
        if self._code == TILT:
            return value + GRAVITY * a * true[STROKE]
        if self._code in (RECTIFIED, COSINE):
            return value + a * value * value
        if self._code == ADDRESS:
            return true[TABLE] if t % ROUND > ROUND - a else value
        if self._code == FIXTURE:
            return value + a * true[TABLE_ACCELERATION]
        return value * (1.0 + a * math.sin(2.0 * math.pi * b * t))  # CONNECTOR

    def _remembering(self, true: Sequence[float]) -> float:
        """What is read by an effect with memory."""
        (a, b), value = self._sizes, true[self._place]
        before = self._before or (0.0,) * len(true)
        if self._code == JUMPS:
            if self._generator.random() < b * self._interval:
                self._kept += a if self._generator.random() < 0.5 else -a
            return value + self._kept
        if self._code == HYSTERESIS:
            self._kept = min(max(self._kept, value - 0.5 * a), value + 0.5 * a)
            return self._kept
        if self._code == HEAT:
            self._kept += a * abs(value * (true[0] - before[0]))
            return value + self._kept
        if self._code == CHARGE:
            self._kept += a * self._interval * (value - self._kept)
            return value - self._kept
        early = a * float(self._generator.random())  # CLOCK
        return value - early * (value - before[self._place])
