"""How large an effect might be in this recording: the catalogue's sizes, carried over from the default test.

A width, a force or a velocity that is large in one laboratory is nothing in another, so sizes follow what
the recording's signals reach.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from diagnosis.recorded.record import Record
from laboratories.effects.effect import Effect, Parameter

USUAL = {  # what the default test reaches
    ("a", "m"): 2.4e-3,
    ("a", "N"): 30e3,
    ("a", "m/s"): 0.035,
    ("b", "m"): 20e-3,
    ("b", "m/s²"): 1.0,
    ("damper", "m"): 49e-3,
    ("damper", "N"): 76.0,
}
SIGNAL = {
    ("a", "m"): "column_displacement",
    ("a", "N"): "column_force",
    ("b", "m"): "table_displacement",
    ("b", "m/s²"): "table_acceleration",
    ("damper", "m"): "damper_stroke",
    ("damper", "N"): "damper_force",
}
GROUP = {"actuator": "a", "column": "a", "table": "b", "damper": "damper"}
SENSORS = {
    "column_displacement": "a",
    "column_force": "a",
    "table_displacement": "b",
    "table_acceleration": "b",
    "damper_stroke": "damper",
    "damper_force": "damper",
}
HARD = (0.5, 5.0, 50.0)  # times the largest force over the largest stroke: an end stop from soft to hard
FARTHEST = 4.0  # times a usual size where a search still begins
LIMITS = (0.25, 0.4, 0.55, 0.7, 0.85, 0.95)  # of what is reached: where a limit is looked for


class Scales:
    """Sizes of effects for one recording."""

    def __init__(self, record: Record, shift: float = 0.0) -> None:
        self._shift = shift
        self._record = record
        self._reached: dict[tuple[str, str], float] = {}
        for key, name in SIGNAL.items():
            if record.has(name):
                self._reached[key] = self.peak(name)
        if record.has("column_displacement"):
            rate = np.diff(record.signals["column_displacement"][::8]) / (8 * record.plan.test.interval)
            self._reached["a", "m/s"] = float(np.max(np.abs(rate), initial=0.0))
        self._velocities: dict[str, float] = {}
        for group, name in (
            ("a", "column_displacement"),
            ("b", "table_displacement"),
            ("damper", "damper_stroke"),
        ):
            if record.has(name):
                steps = np.diff(record.signals[name][::8]) / (8 * record.plan.test.interval)
                self._velocities[group] = float(np.max(np.abs(steps), initial=0.0)) or 0.05

    def peak(self, signal: str) -> float:
        """Largest magnitude of a recorded signal, 0 where it was not recorded."""
        record = self._record
        return float(np.max(np.abs(record.signals[signal]))) if record.has(signal) else 0.0

    def group(self, effect: Effect) -> str:
        """Which of the signals' scales an effect lives on."""
        return SENSORS[effect.signal] if effect.signal else GROUP.get(effect.site, "")

    def starts(self, effect: Effect) -> Iterator[tuple[tuple[float, ...], dict[str, float]]]:
        """Parameters from which a search starts, from weak to strong, and the form that each belongs to."""
        strength = [item for item in effect.parameters if not item.shape]
        if len(strength) != 1:
            return
        (parameter,) = strength
        for size in self.sizes(effect, parameter):
            for form, shape in self.forms(effect):
                yield form, {**shape, parameter.name: size}

    def forms(self, effect: Effect) -> list[tuple[tuple[float, ...], dict[str, float]]]:
        """What an effect may look like, each form by itself: a law at rest is also tried as one that is smooth.

        An end stop is soft or hard against the force at hand; of these the best is one form with the others.
        """
        shapes = {item.name: item.default for item in effect.parameters if item.default is not None}
        if (found := effect.contact) and (force := self.peak(found.force)):
            (item,) = (item for item in effect.parameters if item.name == found.stiffness)
            soft = force / self.peak(found.motion)
            return [((), {item.name: min(max(share * soft, item.least), item.most)}) for share in HARD]
        smooth = {
            item.name: item.smoothing * self.velocity(effect) for item in effect.parameters if item.smoothing
        }
        if not smooth:
            return [((), shapes)]
        return [(tuple(form.values()), form) for form in (shapes, shapes | smooth)]

    def velocity(self, effect: Effect) -> float:
        """Velocity that a part reaches, m/s."""
        return self._velocities.get(self.group(effect), 0.05)

    def sizes(self, effect: Effect, parameter: Parameter) -> list[float]:
        """Sizes of the parameter that counts."""
        if effect.shifts_time and self._shift != 0.0:
            return [self._shift]
        if starts := effect.starts(self._record.plan):
            return list(starts)
        key = (self.group(effect), parameter.unit)
        reached = self._reached.get(key)
        if parameter.follows:
            reached = self.peak(parameter.follows) or None
        if np.isinf(parameter.null) and reached:
            sizes = [share * reached for share in LIMITS]
        elif reached and key in USUAL:
            sizes = [size * reached / USUAL[key] for size in parameter.sizes]
        else:
            sizes = list(parameter.sizes)
        if np.isfinite(parameter.null) and len(sizes) > 2:
            sizes = sizes[1:-1:2] if len(sizes) > 4 else [sizes[1], sizes[-1]]
        return [min(max(size, parameter.least), parameter.most) for size in sizes]

    def stretch(self, effect: Effect) -> tuple[float, float]:
        """How far a start may be stretched along a straight line from the null value, and mirrored."""
        strength = [item for item in effect.parameters if not item.shape]
        if any(np.isinf(item.null) for item in strength):
            return 0.5, 1.5
        return (-FARTHEST if all(item.least < item.null for item in strength) else 0.0), FARTHEST

    def stretched(self, effect: Effect, values: dict[str, float], share: float) -> dict[str, float]:
        """The start moved to where a straight line from the null value promises most."""
        result = dict(values)
        for item in effect.parameters:
            if not item.shape and np.isfinite(item.null) and share != 0.0:
                moved = item.null + share * (values[item.name] - item.null)
                result[item.name] = min(max(moved, item.least), item.most)
        return result
