"""Two dampers on a building, compared with a continuous state-space model that shares no code with the loops."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import StateSpace, lsim

from common.plan.plan import Plan, ideal
from common.plan.read import from_tables
from loop import substructure
from loop.closed_loop import simulate

Array = NDArray[np.float64]

MASS, STIFFNESS, DASHPOT = 1.6e5, 126e6, 1.0e6
SCALE = 100.0
ROOF = {"mass": 16.0, "stiffness": 56.8, "damping": 6.0, "gain": 2.4e5}
MIDDLE = {"mass": 8.0, "stiffness": 50.5, "damping": 4.0, "gain": 1.2e5}
LAG = 0.003


def tall(interval: float) -> Plan:
    """Three storeys with a damper on the roof and one on the second floor, everything in the laboratories ideal."""
    slaves = {
        name: {
            "damper": {"floor": floor, **{key: own[key] for key in ("mass", "stiffness", "damping")}},
            "control": {"gain": own["gain"]},
        }
        for name, floor, own in (("roof", 3, ROOF), ("middle", 2, MIDDLE))
    }
    tables = {
        "test": {"duration": 4.0, "interval": interval},
        "structure": {"mass": [MASS] * 3, "stiffness": [STIFFNESS] * 3, "damping": [DASHPOT] * 3},
        "column": {"stiffness": STIFFNESS / 2},
        "slave": slaves,
    }
    return ideal(from_tables(tables, Path()))


def chain(value: float) -> Array:
    """Matrix of three equal springs or dashpots from the ground up."""
    return value * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])


def exact(ground: Array, interval: float) -> tuple[Array, Array]:
    """Floor displacements (ticks, 3) and strokes (ticks, 2), m; states: x, ẋ, and s, ṡ, u of each damper.

    m·(s̈ + ẍ + d̈) = −k·s − c·ṡ + u, T·u̇ + u = G/λ·ẋ, and λ·(k·s + c·ṡ − u) on the floor. Inputs: acceleration
    that the building feels, and that of the ground displacement d on the tables, which is free of the record's drift.
    """
    a, b = np.zeros((12, 12)), np.zeros((12, 2))
    a[:3, 3:6] = np.eye(3)
    a[3:6, :3], a[3:6, 3:6] = -chain(STIFFNESS) / MASS, -chain(DASHPOT) / MASS
    b[3:6, 0] = -1.0
    for place, (floor, own) in enumerate(((2, ROOF), (1, MIDDLE))):
        s, v, u = 6 + 3 * place, 7 + 3 * place, 8 + 3 * place
        force = np.zeros(12)
        force[[s, v, u]] = own["stiffness"], own["damping"], -1.0
        a[3 + floor] += SCALE * force / MASS
        a[s, v] = 1.0
        a[u, 3 + floor], a[u, u] = own["gain"] / SCALE / LAG, -1.0 / LAG
        a[v] = -force / own["mass"]  # the floor's own acceleration follows below
    for v, floor in ((7, 2), (10, 1)):
        a[v] -= a[3 + floor]
        b[v] = 1.0, -1.0
    out = np.eye(12)[[0, 1, 2, 6, 9]]
    inputs = np.stack([ground[0], np.gradient(np.gradient(ground[1], interval), interval)], axis=1)
    t = np.arange(len(inputs)) * interval
    _, found, _ = lsim(StateSpace(a, b, out, np.zeros((5, 2))), inputs, t)
    return found[:, :3], found[:, 3:]


def errors(interval: float) -> tuple[float, float]:
    """NRMSE of the floors' displacements and of the strokes."""
    plan = tall(interval)
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    found = simulate(plan, ground)
    strokes_found = np.stack([of["damper_stroke"] for of in found.slaves.values()], axis=1)
    floors, strokes = exact(ground[:, :-1], interval)
    pairs = ((found.master["displacement"], floors), (strokes_found, strokes))
    return tuple(  # type: ignore[return-value]
        float(np.sqrt(np.mean((x - y) ** 2)) / np.sqrt(np.mean(y**2))) for x, y in pairs
    )


@pytest.mark.slow
def test_building_and_dampers_converge_to_the_continuous_model_with_the_interval() -> None:
    coarse, fine = errors(0.002), errors(0.0005)
    assert fine == pytest.approx((0.0, 0.0), abs=0.01)
    for rough, smooth in zip(coarse, fine, strict=True):
        assert rough / smooth == pytest.approx(4.0, rel=0.15)  # one interval of delay: first order
