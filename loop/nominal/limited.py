"""The quantities that a plan limits, computed from the signals of a simulation or a recording."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from common.plan.plan import Plan
from common.plan.tables import Limits
from common.roles import MASTER
from common.signals import OF_STOREYS
from laboratories.checks import PATIENCE
from laboratories.kind import Kind
from laboratories.kinds import kinds_of
from laboratories.limits import quantities
from models.compiled import jit
from models.registry import Array

ENERGIES = ("numerical_drift", "error_energy")  # sums over a whole test, which only the running test checks
RULES = {name: field.metadata["rule"] for name, field in Limits.__dataclass_fields__.items()}


def most(plan: Plan) -> dict[str, float]:
    """The limits by the names of the quantities of the plan's test; the smallest where laboratories differ."""
    given = vars(plan.limits)
    found = {name: given[name] for name in OF_STOREYS if name in given}
    for role, kind in kinds_of(plan).items():
        limits = kind.limits(plan.of(role))
        for name in quantities(kind):
            if name in limits:
                found[name] = min(limits[name], found.get(name, limits[name]))
    order = {name: place for place, name in enumerate(given)}
    return dict(sorted(found.items(), key=lambda one: order.get(one[0], len(order))))


def unit_of(plan: Plan, name: str) -> str:
    """The unit of a limited quantity."""
    if name in RULES:
        return str(RULES[name].unit)
    return next(units[name] for units in map(quantities, kinds_of(plan).values()) if name in units)


def magnitudes(plan: Plan, columns: Mapping[str, Mapping[str, Array]]) -> dict[str, Array]:
    """Magnitude of every limited quantity, the largest of all laboratories and storeys, (ticks,) each.

    `columns` by role and name as `loop.signals.by_role` gives them. The two energies of [limits] are not among them.
    """
    found: dict[str, Array] = {}
    with np.errstate(over="ignore", invalid="ignore"):  # a loop that diverged
        of_building = {name: columns[MASTER][name] for name in OF_STOREYS if name in RULES}
        every = [of_building] + [
            {name: columns[role][name] for name in quantities(kind) if name in columns[role]}
            | derived(plan, kind, columns[role], own=role == MASTER)
            for role, kind in kinds_of(plan).items()
        ]
        for of_role in every:
            for name, values in of_role.items():
                top = largest(values)
                found[name] = np.maximum(found[name], top) if name in found else top
    return {name: found[name] for name in most(plan) if name in found}


def peaks(plan: Plan, columns: Mapping[str, Mapping[str, Array]]) -> dict[str, float]:
    """The largest value of each of the `magnitudes`, in a tenth of their time."""
    found: dict[str, float] = {}
    with_units = [{name: columns[MASTER][name] for name in OF_STOREYS if name in RULES}]
    for role, kind in kinds_of(plan).items():
        with_units.append({name: columns[role][name] for name in quantities(kind) if name in columns[role]})
        for name, value in derived_peaks(plan, kind, columns[role], own=role == MASTER).items():
            found[name] = max(found.get(name, 0.0), value)
    for every in with_units:
        for name, values in every.items():
            found[name] = max(found.get(name, 0.0), peak(values))
    return {name: found[name] for name in most(plan) if name in found}


def derived_peaks(plan: Plan, kind: Kind, columns: Mapping[str, Array], *, own: bool) -> dict[str, float]:
    """The largest magnitudes of what `derived` gives."""
    interval, limited, channels = plan.test.interval, kind.limited, kind.channels
    step, second = largest_steps(columns[channels.command.name])
    target = columns[channels.target.name]
    found = {
        limited.step: step,
        limited.velocity: step / interval,
        limited.acceleration: second / interval**2,
        limited.error: largest_lasting(columns[channels.position], target, 0 if own else 1),
    }
    if channels.effort:
        found[limited.effort_step] = largest_steps(columns[channels.effort.name])[0]
    return {name: value for name, value in found.items() if name}


def peak(values: Array) -> float:
    """The largest magnitude of a signal (ticks,) or of several (ticks, n)."""
    if values.ndim == 1:
        return float(largest_of(values))
    return max((float(largest_of(values[:, place])) for place in range(values.shape[1])), default=0.0)


@jit
def largest_of(values: Array) -> float:
    """The largest magnitude of values (n,), 0 of none."""
    found = 0.0
    for tick in range(values.size):
        found = max(found, abs(values[tick]))
    return found


@jit
def largest_steps(values: Array) -> tuple[float, float]:
    """The largest magnitudes of first and second differences of values (n,), from rest."""
    first, second, last, step = 0.0, 0.0, 0.0, 0.0
    for tick in range(values.size):
        now = values[tick] - last
        first = max(first, abs(now))
        second = max(second, abs(now - step))
        last, step = values[tick], now
    return first, second


@jit
def largest_lasting(position: Array, target: Array, late: int) -> float:
    """The largest error (n,) that lasts `PATIENCE` intervals; the target is that of `late` intervals before."""
    found = 0.0
    for tick in range(PATIENCE - 1, position.size):
        least = np.inf
        for before in range(tick - PATIENCE + 1, tick + 1):
            wanted = target[before - late] if before >= late else 0.0
            least = min(least, abs(position[before] - wanted))
        found = max(found, least)
    return found


def derived(plan: Plan, kind: Kind, columns: Mapping[str, Array], *, own: bool) -> dict[str, Array]:
    """The limited quantities of a laboratory that are not signals: rates, steps and lasting errors, (ticks,) each.

    The recorded target of the master's `own` laboratory is that of the tick, a slave's that of the interval's end.
    """
    interval, limited, channels = plan.test.interval, kind.limited, kind.channels
    command, target = steps(columns[channels.command.name]), columns[channels.target.name]
    found = {
        limited.step: command,
        limited.velocity: command / interval,
        limited.acceleration: steps(command) / interval**2,
        limited.error: lasting(columns[channels.position] - (target if own else before(target))),
    }
    if channels.effort:
        found[limited.effort_step] = steps(columns[channels.effort.name])
    return {name: values for name, values in found.items() if name}


def largest(values: Array) -> Array:
    """Largest magnitude at every tick, over storeys and slaves where there are several."""
    return np.abs(values).reshape(values.shape[0], -1).max(axis=1, initial=0.0)


def before(values: Array) -> Array:
    """The values of the tick before, at rest before the first."""
    return np.concatenate([np.zeros_like(values[:1]), values[:-1]])


def steps(values: Array) -> Array:
    """Change since the tick before, from rest."""
    return values - before(values)


def lasting(errors: Array) -> Array:
    """The smallest magnitude of an error within the last `PATIENCE` intervals, at every tick."""
    now = largest(errors)
    for _ in range(PATIENCE - 1):
        now = np.minimum(now, before(now))
    return now
