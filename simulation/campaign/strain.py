"""What a test does to the specimens: the largest drift of a storey, and the energy that a specimen absorbs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from common.plan.plan import Plan
from common.recording.run import Run
from common.roles import MASTER
from laboratories.kinds import kinds_of
from loop.closed_loop import Rollout
from loop.nominal import partition
from loop.signals import by_role
from models.registry import Array


class Strain(NamedTuple):
    """What a test does to the specimens, the largest of several."""

    drift: float  # m, of any storey
    energy: float  # J, absorbed by a specimen


def of_rollout(plan: Plan, rollout: Rollout) -> Strain:
    """The strain in a simulated test."""
    return of_columns(plan, by_role(plan, rollout))


def of_run(plan: Plan, run: Run) -> Strain:
    """The strain in a recorded test; what was not recorded counts as none."""
    return of_columns(plan, {role: run.columns.get(role, {}) for role in (MASTER, *plan.roles)})


def of_columns(plan: Plan, columns: Mapping[str, Mapping[str, Array]]) -> Strain:
    """The strain of signals by role and name."""
    moved = columns[MASTER].get("displacement")
    drift = 0.0
    if moved is not None and moved.size:
        floors = np.asarray(moved, dtype=np.float64).reshape(len(moved), plan.storeys)
        storeys = np.diff(floors, axis=1, prepend=0.0)
        drift = float(np.max(np.abs(storeys)))
    return Strain(drift, max(energies(plan, columns), default=0.0))


def energies(plan: Plan, columns: Mapping[str, Mapping[str, Array]]) -> list[float]:
    """The energy that each specimen under a storey's drift has absorbed at the end, its elastic part included."""
    found = []
    for role in partition.drifts(plan):
        channels = kinds_of(plan)[role].channels
        read = [columns[role].get(name) for name in (channels.position, channels.force)]
        if read[0] is not None and read[1] is not None and read[0].size > 1:
            place, force = (np.asarray(one, dtype=np.float64) for one in read)
            found.append(max(0.0, float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(place)))))
    return found
