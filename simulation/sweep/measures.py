"""The figures of one test of a sweep, which are the columns of its table."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from common.plan.plan import Plan
from common.roles import MASTER
from laboratories.kinds import kinds_of
from loop.closed_loop import Rollout
from loop.nominal import limited
from loop.signals import by_role
from models.registry import Array

COMPLETED, DIVERGED = "completed", "diverged"
SHARE, NEAREST = "limit_share", "limit"


def units(plan: Plan) -> dict[str, str]:
    """The units of the figures by their names: peaks in those of the signals, errors as shares."""
    found = dict.fromkeys(drifts(plan), "m")
    found |= {
        name: limited.unit_of(plan, name) for name in limited.most(plan) if name not in limited.ENERGIES
    }
    found |= dict.fromkeys(errors(plan), "")
    return found | {SHARE: ""}


def drifts(plan: Plan) -> dict[str, Array]:
    """The names of the storeys' peak drifts, and each drift's direction (floors,)."""
    first = np.eye(plan.storeys)
    if plan.storeys == 1:
        return {"peak_drift": first[0]}
    below = np.vstack([np.zeros(plan.storeys), first[:-1]])
    return {f"peak_drift_{storey}": row for storey, row in enumerate(first - below, 1)}


def errors(plan: Plan) -> dict[str, str]:
    """The roles of the laboratories by the names of their tracking errors."""
    return {"tracking_error" if role == MASTER else f"{role}.tracking_error": role for role in kinds_of(plan)}


def measured(plan: Plan, rollout: Rollout) -> dict[str, float | str]:
    """Peak of every drift (m) and limited quantity, tracking errors, and the limit that comes nearest.

    A tracking error is the root mean square of measured position minus target over that of the target. Of a test that
    diverges all figures are infinite.
    """
    most = limited.most(plan)
    if not rollout.finite:
        name = next(iter(most), "")
        return {"outcome": DIVERGED} | dict.fromkeys(units(plan), math.inf) | {NEAREST: name}
    signals = by_role(plan, rollout)
    floors = rollout.master["displacement"].reshape(rollout.ticks, plan.storeys)
    peaks = {name: limited.peak(floors @ direction) for name, direction in drifts(plan).items()}
    tops = limited.peaks(plan, signals)
    missed = {name: tracking_error(plan, role, signals[role]) for name, role in errors(plan).items()}
    shares = {name: top / most[name] for name, top in tops.items() if most[name] > 0.0}
    nearest = max(shares, key=lambda name: shares[name], default="")
    return (
        {"outcome": COMPLETED} | peaks | tops | missed | {SHARE: shares.get(nearest, 0.0), NEAREST: nearest}
    )


def tracking_error(plan: Plan, role: str, columns: Mapping[str, Array]) -> float:
    """How far a transfer system is from its target, over the target's root mean square; 0 where it has none.

    The target in the master's own laboratory is that of the tick, a slave's that of the interval's end.
    """
    channels = kinds_of(plan)[role].channels
    target = columns[channels.target.name]
    wanted = target if role == MASTER else limited.before(target)
    error = columns[channels.position] - wanted
    power = float(wanted @ wanted)
    return math.sqrt(float(error @ error) / power) if power > 0.0 else 0.0
