"""The quantities that a plan limits, as a simulation or a recording has them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from common.plan.plan import Plan
from models.registry import Array

PATIENCE = 3  # intervals for which an error must be beyond its limit
ENERGIES = ("numerical_drift", "error_energy")  # sums over a whole test, which a running test watches


def magnitudes(plan: Plan, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Magnitude of every limited quantity, its tables' and dampers' the largest of all slaves, (ticks,) each.

    `columns` by name as `closed_loop.signals` gives them, further axes for storeys and slaves. The two energies of
    [limits] are not among them.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # a loop that diverged
        every = {name: largest(values) for name, values in columns.items()} | derived(plan, columns)
    return {name: every[name] for name in vars(plan.limits) if name not in ENERGIES}


def derived(plan: Plan, columns: Mapping[str, Array]) -> dict[str, Array]:
    """The limited quantities that are no signals: rates, steps and lasting errors."""
    interval = plan.test.interval
    actuator, table = (steps(columns[f"{part}_command"]) for part in ("actuator", "table"))
    return {
        "actuator_step": largest(actuator),
        "actuator_velocity": largest(actuator) / interval,
        "actuator_acceleration": largest(steps(actuator)) / interval**2,
        "column_error": lasting(columns["column_displacement"] - columns["column_target"]),
        "table_step": largest(table),
        "table_velocity": largest(table) / interval,
        "table_error": lasting(columns["table_displacement"] - before(columns["table_target"])),
        "damper_step": largest(steps(columns["damper_command"])),
    }


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
    """Magnitude that an error has kept for three intervals, at every tick."""
    now = largest(errors)
    for _ in range(PATIENCE - 1):
        now = np.minimum(now, before(now))
    return now
