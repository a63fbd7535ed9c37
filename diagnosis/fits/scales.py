"""How large an effect might be in this recording: the catalogue's sizes, carried over from the default test.

A width, a force or a velocity that is large in one laboratory is nothing in another, so sizes follow what
the recording's signals reach.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from common.plan.plan import Plan
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.record import Record
from laboratories.effects import readings_of
from laboratories.effects.effect import Effect, Parameter

HARD = (0.5, 5.0, 50.0)  # times the largest force over the largest stroke: an end stop from soft to hard
USUAL_RATE = 0.05  # m/s, of a part whose motion was not recorded or is none
LARGEST_START = 4.0  # times a usual size where a search still begins
LIMITS = (0.25, 0.4, 0.55, 0.7, 0.85, 0.95)  # of what is reached: where a limit is looked for
SWALLOWED = (0.3, 1.0)  # of what is reached: a play that takes a large part of a small motion
INSIDE = 0.5  # of the largest play: one inside which a part may rest, and which a fit may still move


class Scales:
    """Sizes of effects for one recording."""

    def __init__(self, record: Record, shift: float = 0.0) -> None:
        self._shift = shift
        self._record = record
        # what signals, or their rates, usually reach, by unit; for readings of users' kinds their typical size
        self._usual: dict[tuple[str, str], float] = {}
        self._typical: dict[tuple[str, str], float] = {}
        self._of_site: dict[str, tuple[str, ...]] = {}  # signals that tell how large a site's effects may be
        self._curves: dict[
            str, tuple[str, ...]
        ] = {}  # by site: what a machine is given, and what it makes of it
        for lab in record.labs:
            self._usual |= {(lab.signal(name), unit): size for (name, unit), size in lab.kind.reaches.items()}
            readings = readings_of(lab.kind, lab.plan).items()
            self._typical |= {(lab.signal(name), one.unit): one.typical for name, one in readings}
            self._of_site |= sized(lab)
            for machine in lab.kind.machines(lab.plan):
                self._curves[lab.site(machine.site)] = tuple(map(lab.signal, machine.curve))

    def peak(self, signal: str) -> float:
        """Largest magnitude of a recorded signal, 0 where it was not recorded."""
        record = self._record
        return float(np.max(np.abs(record.signals[signal]))) if record.has(signal) else 0.0

    def signal(self, effect: Effect, unit: str) -> str:
        """The signal, or with a unit of velocity the motion, whose size a parameter follows; empty for none."""
        wanted = "m" if unit == "m/s" else unit
        names = self._of_site.get(effect.site, ())
        return next((name for name in names if self._record.unit(name) == wanted), "")

    def reached(self, name: str, unit: str) -> float | None:
        """What a signal reaches, its rate with a unit of velocity; None where it was not recorded."""
        if not name or not self._record.has(name):
            return None
        return self.rate(name) if unit == "m/s" and self._record.unit(name) == "m" else self.peak(name)

    def rate(self, name: str) -> float:
        """Largest rate of a recorded motion, m/s."""
        steps = np.diff(self._record.signals[name][::8]) / (8 * self._record.plan.test.interval)
        return float(np.max(np.abs(steps), initial=0.0))

    def starts(self, effect: Effect) -> Iterator[tuple[tuple[float, ...], dict[str, float]]]:
        """Parameters from which a search starts, from weak to strong, and the form that each belongs to."""
        strength = [item for item in effect.parameters if not item.shape]
        if len(strength) != 1:
            return
        (parameter,) = strength
        for size in (*self.sizes(effect, parameter), *self.swallowing(effect, parameter)):
            for form, shape in self.forms(effect):
                yield form, {**shape, parameter.name: size}

    def forms(self, effect: Effect) -> list[tuple[tuple[float, ...], dict[str, float]]]:
        """What an effect may look like, each form by itself: a law at rest is also tried as one that is smooth.

        An end stop is soft or hard against the force at hand; of these the best is one form with the others. Where
        either of force and motion was not recorded, it has its usual stiffness.
        """
        shapes = {item.name: item.default for item in effect.parameters if item.default is not None}
        found = effect.contact
        if found and (force := self.peak(found.force)) and (motion := self.peak(found.motion)):
            (item,) = (item for item in effect.parameters if item.name == found.stiffness)
            soft = force / motion
            return [((), {item.name: min(max(share * soft, item.least), item.most)}) for share in HARD]
        smooth = {
            item.name: item.smoothing * self.velocity(effect) for item in effect.parameters if item.smoothing
        }
        if not smooth:
            return [((), shapes)]
        return [(tuple(form.values()), form) for form in (shapes, shapes | smooth)]

    def velocity(self, effect: Effect) -> float:
        """Velocity that a part reaches, m/s."""
        motion = self.signal(effect, "m")
        return (self.rate(motion) if motion and self._record.has(motion) else 0.0) or USUAL_RATE

    def sizes(self, effect: Effect, parameter: Parameter) -> list[float]:
        """Usual sizes of the parameter that counts."""
        if effect.shifts_time and self._shift != 0.0:
            return [self._shift]
        if starts := effect.starts(self._plan(effect)):
            return list(starts)
        key = (self.signal(effect, parameter.unit), parameter.unit)
        known = key in self._usual or parameter.unit != "m/s"
        reached = self.reached(*key) if known else None
        usual = self._usual.get(key) or (self._typical.get(key) if effect.signal else None)
        if parameter.follows:
            reached = self.peak(parameter.follows) or None
        if np.isinf(parameter.null) and reached:
            # a level that bends what comes near it is felt below it too
            above = [size / usual for size in parameter.sizes if size > usual] if usual else []
            sizes = [share * reached for share in (*LIMITS, *above)]
        elif reached and usual:
            sizes = [size * reached / usual for size in parameter.sizes]
        else:
            sizes = list(parameter.sizes)
        if np.isfinite(parameter.null) and len(sizes) > 2:
            sizes = sizes[1:-1:2] if len(sizes) > 4 else [sizes[1], sizes[-1]]
        return [min(max(size, parameter.least), parameter.most) for size in sizes]

    def swallowing(self, effect: Effect, parameter: Parameter) -> list[float]:
        """Widths of a play that take a large part of the motion, none where the parameter is no such width.

        One is the width that takes all that a motion lacks of its command.
        """
        reached = self.reached(self.signal(effect, parameter.unit), parameter.unit)
        if not parameter.swallows or not reached:
            return []
        found = [share * reached for share in SWALLOWED]
        given, made = self._curves[effect.site]
        if self._record.has(given) and self._record.unit(given) == self._record.unit(made):
            found.append(max(2.0 * (self.peak(given) - self.peak(made)), found[-1]))
        return [min(size, parameter.most) for size in sorted(set(found))]

    def resting(self, effect: Effect) -> Iterator[dict[str, float]]:
        """Parameters of a play inside which a part rests, under laws whose shape says what moves it there."""
        for parameter in effect.parameters:
            reached = self.reached(self.signal(effect, parameter.unit), parameter.unit)
            if not parameter.swallows or not reached:
                continue
            width = min(reached, INSIDE * parameter.most)
            for place, law in enumerate(effect.laws):
                for shape in effect.further if place and not law.model else ():
                    if shape.name in law.shapes:
                        under = effect.under(place, {parameter.name: width})
                        yield from (under | {shape.name: size} for size in shape.sizes)

    def _plan(self, effect: Effect) -> Plan:
        """The plan as the role sees it whose laboratory has an effect's site."""
        owners = (lab.plan for lab in self._record.labs if effect.site in sized(lab))
        return next(owners, self._record.plan)

    def stretch(self, effect: Effect) -> tuple[float, float]:
        """How far a start may be stretched along a straight line from the null value, and mirrored."""
        strength = [item for item in effect.parameters if not item.shape]
        if any(np.isinf(item.null) for item in strength):
            return 0.5, 1.5
        return (-LARGEST_START if all(item.least < item.null for item in strength) else 0.0), LARGEST_START

    def stretched(self, effect: Effect, values: dict[str, float], share: float) -> dict[str, float]:
        """The start moved to where a straight line from the null value promises most."""
        result = dict(values)
        for item in effect.parameters:
            if not item.shape and np.isfinite(item.null) and share != 0.0:
                moved = item.null + share * (values[item.name] - item.null)
                result[item.name] = min(max(moved, item.least), item.most)
        return result


def sized(lab: RecordedLaboratory) -> dict[str, tuple[str, ...]]:
    """The signals that tell how large effects may be, by site: a machine's, and of a reading those of its machine."""
    machines = lab.kind.machines(lab.plan)
    result = {lab.site(item.site): tuple(map(lab.signal, item.sized)) for item in machines}
    for name in lab.kind.channels.names:
        names = next((item.sized for item in machines if name in item.sized), (name,))
        result[lab.site(f"sensor.{name}")] = tuple(map(lab.signal, names))
    return result
