"""Control steps per second of the compiled closed loop, beside the same building in plain Python."""

from __future__ import annotations

import statistics
from dataclasses import replace

import numpy as np

from benchmarks.result import Figure, rate_figure, rates
from common.plan import Control, Plan, ideal
from models import substructure
from models.closed_loop import signals, simulate
from models.registry import Array

TARGET = 5e6


def plain_python(plan: Plan, ground: Array) -> list[float]:
    """Displacements of the bare nominal building by the central difference method, step by step in Python."""
    (mass,), (stiffness,), (damping,) = plan.structure.mass, plan.structure.stiffness, plan.structure.damping
    dt, before, now = plan.test.interval, 0.0, 0.0
    left = mass / dt**2 + damping / (2.0 * dt)
    right = mass / dt**2 - damping / (2.0 * dt)
    found = []
    for acceleration in ground[0, :-1].tolist():
        found.append(now)
        load = -mass * acceleration - stiffness * now + 2.0 * mass / dt**2 * now - right * before
        before, now = now, load / left
    return found


def run() -> list[Figure]:
    """The default test without and with noise; the ideal test beside plain Python, with their difference."""
    plan = Plan()
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    peer = statistics.median(rates(lambda: len(plain_python(plan, ground))))
    bare = replace(ideal(plan), control=Control(amd=False))
    x = signals(bare, simulate(bare, ground))["displacement"]
    difference = float(np.max(np.abs(x - plain_python(plan, ground))) / np.max(np.abs(x)))
    words = "central difference of the building alone in plain Python"
    return [
        rate_figure(
            "compiled closed loop",
            "steps/s",
            rates(lambda: simulate(plan, ground).ticks),
            least=TARGET,
            peer=words,
            beside=peer,
        ),
        rate_figure(
            "compiled closed loop with noise", "steps/s", rates(lambda: simulate(plan, ground, seed=1).ticks)
        ),
        Figure(
            "difference from that peer, ideal test",
            "of the peak",
            difference,
            difference,
            "≤ 0.001",
            difference <= 1e-3,
        ),
    ]
