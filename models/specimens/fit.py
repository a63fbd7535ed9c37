"""Parameters of a specimen model from a measured path of deformation and force.

The sum of squares of the force's misfit is minimised by a trust-region method (Branch, Coleman and Li, SIAM J.
Sci. Comput. 21 (1999), 1-23) from a few fixed starting points, because it has more than one minimum. Long
records are thinned to the extremes of equal blocks, which keeps every turning point; the misfit that is
reported is that of all rows. Two parameters are tied, because a path does not determine them
separately: β + γ = 1 (any other sum is equivalent to another yield displacement), and the hardening of `clough` is
sought as a share of the stiffness that its open cracks leave.

The intervals hold for independent errors of equal variance. The errors of a model that does not fit are neither, so
the intervals then describe how sharp the minimum is, not how much another column may differ.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares
from scipy.stats import t as student

from common.errors import InputError
from common.plan.schema import nearest
from models import specimens
from models.compiled import jit
from models.registry import Array
from models.specimens import SPECIMENS

MOST_ROWS = 1200  # of a thinned record: 600 blocks keep every turning point of some hundred cycles
# Number of starting points that are followed to their minimum, times the number of parameters squared, because a step
# costs about that; at least two points are followed.
FOLLOWED = 600
EVALUATIONS = (
    50  # largest number of steps to a minimum: a start that has not come near it by then is given up
)
# After how many steps starts are held against each other, and how many are followed on: most lead to the same few
# minima. Of 50 fits of paths of laboratories A two then ended in one that leaves 1 to 2.6 % more, none in a better one.
RACES = ((8, 6), (20, 3))
# Of so few starts, which a model with many parameters has, one is followed on after so many steps: of fits of the
# layers to eight columns one then left 0.02 % of the force more, the others as little or less.
FEW, LEADS = 3, ((15, 1),)
CONFIDENCE = 0.95
WEAKEST = (
    1e-13  # least eigenvalue of the normal matrix over its largest: smaller ones are rounding of a double
)
WIDEST = 50.0  # largest logarithm of interval over estimate: e^50 says that the parameter is not determined
STEP = 1e-6  # of the central differences of the parameters: their error of second order is below 1e-11


@dataclass(frozen=True)
class SearchRange:
    """The range in which a parameter is searched and its starting values, as multiples of `unit`: see `scales`."""

    low: float
    high: float
    starts: tuple[float, ...]
    unit: str = ""
    log: bool = True


@dataclass(frozen=True)
class SpecimenFit:
    """A fitted model: parameters, misfit `rms(f − f̂)/rms(f)`, and their 95 % intervals."""

    model: str
    parameters: dict[str, float]
    nrmse: float
    intervals: dict[str, tuple[float, float]]


# The ranges are wide bounds around what columns of reinforced concrete and steel have; the secant stiffness is a lower
# estimate of the elastic one, and a specimen that yields beyond five times the largest deformation looks elastic.
STIFFNESS = SearchRange(0.2, 100.0, (1.2, 3.0), "secant")
YIELDING = SearchRange(0.002, 5.0, (0.25, 0.6), "reach")
HARDENING = SearchRange(0.0, 0.95, (0.05, 0.3), log=False)
SHARPNESS = SearchRange(1.0, 20.0, (1.5,))
SHARE = SearchRange(0.005, 3.0, (0.1, 0.5))
ROUND = {
    "stiffness": STIFFNESS,
    "yield_displacement": YIELDING,
    "hardening": HARDENING,
    "n": SHARPNESS,
    "beta": SHARE,
}
SKELETON = {
    "stiffness": SearchRange(0.2, 100.0, (1.5,), "secant"),
    "yield_displacement": SearchRange(0.002, 5.0, (0.2, 0.5), "reach"),
    "hardening": SearchRange(-0.2, 0.95, (0.05, 0.3), log=False),
    "first_bend": SearchRange(0.02, 1.0, (0.4, 0.8), log=False),
    "second_stiffness": SearchRange(0.0, 1.0, (0.5,), log=False),
}
PINCHED = SKELETON | {
    "pinch_force": SearchRange(0.0, 1.0, (0.2, 0.8), log=False),
    "pinch_displacement": SearchRange(0.0, 1.0, (0.5,), log=False),
    "unloading": SearchRange(0.0, 1.0, (0.2,), log=False),
    "damage": SearchRange(0.0, 1.0, (0.01,), log=False),
    "asymmetry": SearchRange(-0.95, 0.95, (0.0,), log=False),
}
FREE: dict[str, dict[str, SearchRange]] = {
    "linear": {"stiffness": STIFFNESS},
    "bilinear": {"stiffness": STIFFNESS, "yield_displacement": YIELDING, "hardening": HARDENING},
    "bouc_wen": ROUND,
    "clough": {
        "stiffness": STIFFNESS,
        "yield_displacement": YIELDING,
        "hardening": HARDENING,
        "unloading": SearchRange(0.0, 1.0, (0.2, 0.6), log=False),
        "crack_displacement": SearchRange(0.002, 1.0, (0.1, 0.2), "reach"),
        "closing": SearchRange(0.0, 0.95, (0.05, 0.3), log=False),
    },
    "bwbn": ROUND
    | {
        "delta_nu": SearchRange(1e-5, 10.0, (0.003, 0.1)),
        "delta_eta": SearchRange(1e-5, 10.0, (0.003, 0.1)),
        "zeta_s": SearchRange(0.0, 0.99, (0.3,), log=False),
        "q": SearchRange(-1.0, 1.0, (0.1,), log=False),
        "p": SearchRange(1e-4, 50.0, (0.1,)),
        "psi": SearchRange(0.02, 5.0, (0.3,)),
        "delta_psi": SearchRange(1e-6, 5.0, (0.005,)),
        "lambda_": SearchRange(0.01, 5.0, (0.5,)),
    },
    "menegotto_pinto": {
        "stiffness": STIFFNESS,
        "yield_displacement": YIELDING,
        "hardening": HARDENING,
        "sharpness": SearchRange(1.0, 50.0, (5.0, 18.0)),
        "loss": SearchRange(0.0, 0.98, (0.9,), log=False),
    },
    "trilinear": SKELETON,
    "pinched": PINCHED,
    "pinched_by_peak": PINCHED,
    "pinched_by_rest": PINCHED,
    "layered": {
        "stiffness": SearchRange(0.2, 100.0, (3.0,), "secant"),
        "yield_displacement": SearchRange(0.02, 2.0, (0.12, 0.2, 0.35), "reach"),
        "hardening": SearchRange(-0.1, 0.2, (0.0,), log=False),
        "concrete": SearchRange(1.0, 30.0, (5.0,)),
        "axial": SearchRange(0.03, 4.0, (0.3, 1.0)),
        "strength": SearchRange(0.1, 3.0, (0.6,)),
        "spalling": SearchRange(0.0, 0.5, (0.15,), log=False),
        "sharpness": SearchRange(3.0, 20.0, (16.0,)),
        "shaft": SearchRange(0.2, 0.9, (0.4, 0.75), log=False),
        "focus": SearchRange(0.3, 30.0, (2.0,)),
        "core": SearchRange(0.0, 1.0, (0.5,), log=False),
        "friction": SearchRange(0.0, 0.08, (0.02,), log=False),
        "eccentricity": SearchRange(-0.3, 0.3, (0.0,), log=False),
    },
    "self_centring": {
        "stiffness": STIFFNESS,
        "yield_displacement": YIELDING,
        "hardening": HARDENING,
        "loop": SearchRange(0.0, 1.0, (0.3, 0.8), log=False),
    },
    "slider": {
        "stiffness": SearchRange(1.0, 1000.0, (3.0, 15.0), "secant"),
        "push": SearchRange(0.02, 3.0, (0.8,), "strength"),
        "pull": SearchRange(0.02, 3.0, (0.8,), "strength"),
        "play": SearchRange(1e-4, 1.9, (0.01, 0.1, 0.5), "reach"),
        "corner": SearchRange(1e-4, 0.2, (0.01,), "reach"),
    },
}


@jit
def rollout(kind: int, p: Array, s: Array, path: Array, force: Array) -> None:
    """Write the force (N) of a model along a path (m) into `force`; the state `s` is updated."""
    for i in range(path.size):
        force[i] = specimens.step(kind, p, s, path[i])


def forces(model: str, parameters: Mapping[str, float], path: Array) -> Array:
    """Force (N) of a model along a path (m) that starts at rest."""
    kind, p, s = specimens.pack(model, **parameters)
    force = np.empty(path.size)
    rollout(kind, p, s, path, force)
    return force


def fit(
    model: str,
    deformation: Array,
    force: Array,
    start: Mapping[str, float] | None = None,
    used: NDArray[np.bool_] | None = None,
) -> SpecimenFit:
    """Parameters of `model` with which it follows a path of deformation (m) and force (N) from rest.

    `start` holds parameters by name, from which the fit starts instead of the fixed points; a parameter that it lacks
    has the value of the first fixed point. Where rows (n,) are `used`, only the forces of these are fitted, along the
    whole path: a law remembers where it has been, so that rows cannot be cut out of it.

    Raises:
        InputError: the model or a parameter is unknown, or the record cannot be fitted.
    """
    path, measured = record(model, deformation, force)
    fields = SPECIMENS[model].params._fields
    for name in start or {}:
        if name not in fields:
            raise InputError(f"Unknown parameter '{name}' of model '{model}': {nearest(name, fields)}")
    ranges = FREE[model]
    there = np.ones(path.size, dtype=bool) if used is None else used
    scale = scales(path[there], measured[there])
    units = np.array([scale[item.unit] for item in ranges.values()])
    low, high = bounds(ranges)
    kept = thinned(path, MOST_ROWS)
    if not there.all():
        kept = np.union1d(kept, np.flatnonzero(there)[thinned(path[there], MOST_ROWS)])
    rms = math.sqrt(float(np.mean(measured[there] ** 2)))

    def misfit(x: Array) -> Array:
        found = (forces(model, parameters(model, x, units), path[kept]) - measured[kept]) / rms
        return np.asarray(found[there[kept]])

    trials = [np.clip(x, low, high) for x in starting_points(model, units, start)]
    ranked = sorted(trials, key=lambda x: float(np.sum(misfit(x) ** 2)))
    chosen = ranked[: max(2, FOLLOWED // len(ranges) ** 2)]
    best = followed(misfit, chosen, low, high)
    values = parameters(model, best.x, units)
    gap = (forces(model, values, path) - measured)[there]
    return SpecimenFit(
        model,
        values,
        math.sqrt(float(np.mean(gap**2))) / rms,
        intervals(model, np.asarray(best.x), units, np.asarray(best.jac), 2.0 * float(best.cost)),
    )


def followed(
    misfit: Callable[[Array], Array], starts: list[Array], low: Array, high: Array
) -> OptimizeResult:
    """The least minimum that starts lead to, the hopeless ones given up on the way."""

    def after(steps: int) -> list[OptimizeResult]:
        found = [least_squares(misfit, x, bounds=(low, high), x_scale="jac", max_nfev=steps) for x in starts]
        return sorted(found, key=lambda solution: float(solution.cost))

    for steps, kept in RACES if len(starts) > FEW else LEADS:
        if len(starts) > kept:
            starts = [solution.x for solution in after(steps)[:kept]]
    return after(EVALUATIONS)[0]


def record(model: str, deformation: Array, force: Array) -> tuple[Array, Array]:
    """Path (m) and force (N) after a check.

    Raises:
        InputError: the model is unknown or the record cannot be fitted.
    """
    if model not in FREE:
        raise InputError(f"No fit for specimen model '{model}': {nearest(model, FREE)}")
    path = np.ascontiguousarray(deformation, dtype=np.float64)
    measured = np.ascontiguousarray(force, dtype=np.float64)
    if path.ndim != 1 or path.shape != measured.shape:
        raise InputError(
            f"Deformation and force have the shapes {path.shape} and {measured.shape}: give one length."
        )
    if path.size <= len(FREE[model]):
        raise InputError(f"{path.size} rows are too few to fit {len(FREE[model])} parameters of '{model}'.")
    if not (np.isfinite(path).all() and np.isfinite(measured).all()):
        raise InputError("Deformation and force must be finite in every row.")
    if not (np.any(path) and np.any(measured)):
        raise InputError("Deformation or force is zero in every row, so there is nothing to fit.")
    return path, measured


def scales(path: Array, force: Array) -> dict[str, float]:
    """The units of the ranges: the largest deformation (m) and force (N), the secant stiffness (N/m), and one."""
    reach, strength = float(np.abs(path).max()), float(np.abs(force).max())
    return {"reach": reach, "strength": strength, "secant": strength / reach, "": 1.0}


def thinned(path: Array, most: int) -> NDArray[np.intp]:
    """Rows to keep of a path: the lowest and the highest of each of `most`/2 blocks, first and last."""
    if path.size <= most:
        return np.arange(path.size)
    edges = np.linspace(0, path.size, most // 2 + 1).astype(np.intp)
    pairs = [(a + path[a:b].argmin(), a + path[a:b].argmax()) for a, b in pairwise(edges)]
    return np.unique([0, path.size - 1, *np.ravel(pairs)]).astype(np.intp)


def bounds(ranges: Mapping[str, SearchRange]) -> tuple[Array, Array]:
    """Lower and upper bounds of the searched values."""
    low = [math.log(item.low) if item.log else item.low for item in ranges.values()]
    high = [math.log(item.high) if item.log else item.high for item in ranges.values()]
    return np.array(low), np.array(high)


def parameters(model: str, x: Array, units: Array) -> dict[str, float]:
    """The model's parameters from the searched values, which are logarithms, multiples and shares."""
    ranges = FREE[model]
    values = {
        name: float(unit * (math.exp(value) if item.log else value))
        for (name, item), value, unit in zip(ranges.items(), x.tolist(), units.tolist(), strict=True)
    }
    if "beta" in values:
        values["gamma"] = 1.0 - values["beta"]
    if "closing" in values:
        values["hardening"] *= 1.0 - values["closing"]
    if (
        "second_stiffness" in values
    ):  # a skeleton that stiffens would be told by a few peaks, and holds nowhere else
        values["second_stiffness"] = max(values["second_stiffness"], values["hardening"])
    return values


def sought(model: str, values: Mapping[str, float], units: Array) -> Array:
    """The searched values from the model's parameters; the inverse of `parameters`."""
    given = dict(values)
    if "beta" in given:
        # another sum of both gives the same loop with another yield displacement
        total = given["beta"] + given.pop("gamma", 1.0 - given["beta"])
        if total > 0.0:
            given["beta"] /= total
            given["yield_displacement"] *= total ** (-1.0 / given["n"])
    if "closing" in given:
        given["hardening"] /= max(1.0 - given["closing"], 1e-9)
    x = []
    for (name, item), unit in zip(FREE[model].items(), units.tolist(), strict=True):
        value = given[name] / unit
        x.append(math.log(max(value, item.low)) if item.log else value)
    return np.array(x)


def starting_points(model: str, units: Array, start: Mapping[str, float] | None) -> list[Array]:
    """The caller's point, or else every combination of the ranges' starting values."""
    ranges = FREE[model]
    points = [
        np.array(
            [math.log(value) if item.log else value for item, value in zip(ranges.values(), row, strict=True)]
        )
        for row in product(*(item.starts for item in ranges.values()))
    ]
    if start:
        return [sought(model, parameters(model, points[0], units) | dict(start), units)]
    return points


def intervals(
    model: str, x: Array, units: Array, jacobian: Array, squares: float
) -> dict[str, tuple[float, float]]:
    """95 % interval of every parameter, from the Jacobian of the misfit at the minimum."""
    rows, count = jacobian.shape
    weights, vectors = np.linalg.eigh(jacobian.T @ jacobian)
    # bounded from below, so that a direction without influence has a large variance
    weights = np.maximum(weights, WEAKEST * max(float(weights[-1]), 1e-300))
    covariance = (vectors / weights) @ vectors.T * (squares / (rows - count))
    factor = float(student.ppf(0.5 + 0.5 * CONFIDENCE, rows - count))
    values = parameters(model, x, units)
    found = {}
    for name, value in values.items():
        ranged = FREE[model].get(name)
        log = ranged is not None and ranged.log
        gradient = np.array(
            [
                (parameters(model, x + h, units)[name] - parameters(model, x - h, units)[name]) / (2.0 * STEP)
                for h in STEP * np.eye(count)
            ]
        )
        half = factor * math.sqrt(float(gradient @ covariance @ gradient))
        if log:
            spread = math.exp(min(half / value, WIDEST))
            found[name] = (value / spread, value * spread)
        else:
            found[name] = (value - half, value + half)
    return found
