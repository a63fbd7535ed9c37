"""Force over motion of the devices in the laboratories: deformation of the column, stroke of the damper."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from common.recording.run import Run
from report.pictures.curves import Values, labs_of, moving
from report.pictures.figure import SMALL
from report.pictures.layout import panels
from report.text.formats import axis_scale, fixed, scale

if TYPE_CHECKING:
    from laboratories.kind import Hysteresis
    from report.facts.laboratories import LaboratoryFacts


LEAST = 10  # ticks from which on noise is estimated: with fewer its error would exceed a quarter


def draw(recording: Run, canvas: Any) -> bool:
    """Loops with the energy that they absorb, a specimen's beside its planned stiffness; False where there is none."""
    found = [
        (lab, loop, moving(recording, lab.topic, loop.motion), moving(recording, lab.topic, loop.force))
        for lab in labs_of(recording)
        for loop in lab.pictured.loops
    ]
    present = [
        (lab, loop, x.values, y.values)
        for lab, loop, x, y in found
        if x is not None and y is not None and x.values.shape == y.values.shape
    ]
    if not present:
        return False
    for axis, (lab, loop, x, y) in zip(panels(canvas, len(present), 2), present, strict=True):
        (along, length), (up, force) = (
            axis_scale(float(np.nanmax(np.abs(v))), u) for v, u in ((x, "m"), (y, "N"))
        )
        axis.plot(along * x, up * y, linewidth=0.5)
        name = loop.name + lab.letter
        axis.set(xlabel=f"{name} {loop.across}, {length}", ylabel=f"{name} force, {force}")
        planned = planned_stiffness(axis, stiffness_of(lab, loop), (along, up), x, y)
        axis.set_title(work(x, y) + planned, loc="left", fontsize=SMALL)
    return True


def work(deformation: Values, force: Values) -> str:
    """The energy that a loop absorbs, with the digits that noise allows, four at most."""
    energy, doubt = absorbed(deformation, force)
    factor, unit = scale(max(abs(energy), doubt), "J")
    energy, doubt = factor * energy, factor * doubt
    least = max(doubt, 1e-3 * abs(energy))
    places = max(0, -math.floor(math.log10(least))) if least > 0.0 else 0
    return f"∫ F dx = {fixed(energy, places)} ± {fixed(doubt, places)} {unit}".replace("-", "−")


def absorbed(deformation: Values, force: Values) -> tuple[float, float]:
    """Work (J) that a deformation (n,) m does against a force (n,) N, `∫ F dx`, and what noise can add to it.

    The sum over known ticks by trapezia, and two standard deviations for white noise in both: with noise a_k of the
    force and b_k of the deformation it has the terms ½·(a_{k−1}·b_k − a_k·b_{k−1}) and ½·(F_{k−1} − F_{k+1})·b_k, and
    likewise a_k.
    """
    known = np.isfinite(deformation) & np.isfinite(force)
    x, f = deformation[known], force[known]
    of_x, of_f = noise(x), noise(f)
    with_noise = sum((0.5 * own) ** 2 * slopes(other) for own, other in ((of_x, f), (of_f, x)))
    variance = with_noise - 0.5 * x.size * (of_x * of_f) ** 2  # noise by noise is in both sums
    return float(np.trapezoid(f, x)), 2.0 * math.sqrt(max(variance, 0.0))


def slopes(values: Values) -> float:
    """Sum of the squared differences of a signal (n,) over two ticks."""
    return float(np.sum((values[2:] - values[:-2]) ** 2))


def noise(values: Values) -> float:
    """Standard deviation of white noise over a smooth signal (n,), from its second differences."""
    return float(np.std(np.diff(values, 2))) / math.sqrt(6.0) if values.size > LEAST else 0.0


def stiffness_of(lab: LaboratoryFacts, loop: Hysteresis) -> float:
    """The planned elastic stiffness (N/m) of what makes a loop; 0 where it has none or none is known."""
    felt, whole = lab.coupling, (lab.channels.position, lab.channels.force) == (loop.motion, loop.force)
    return felt.stiffness / (felt.ratio * felt.scale) if felt is not None and felt.scale and whole else 0.0


def planned_stiffness(axis: Any, stiffness: float, factors: tuple[float, float], x: Values, y: Values) -> str:
    """The line of a planned stiffness (N/m) over the recorded forces, and its text in the title."""
    if not stiffness:
        return ""
    reach = float(np.nanmax(np.abs(y)))
    ends = np.clip(np.array([np.nanmin(x), np.nanmax(x)]), -reach / stiffness, reach / stiffness)
    axis.plot(
        factors[0] * ends, factors[1] * stiffness * ends, linestyle=(0, (4, 3)), color="black", linewidth=0.8
    )
    return f"\ndashed: planned {1e-6 * stiffness:.3g} kN/mm"
