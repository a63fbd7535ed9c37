"""What all cases of a trial have in common: the plan, the effects that they may hide, and the tests."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from common.errors import InputError
from common.plan import read as plans
from common.plan.kinds import TABLE
from common.plan.plan import Plan
from common.roles import SLAVE
from common.terminal import cli
from models.ground_motion.motions import MOTIONS
from models.registry import Array
from validation.blind import library as libraries
from validation.blind import lots
from validation.blind.library import Library
from validation.blind.lots import Lot

# m, of the default test's linear building; of other plans in proportion to their own test. The smallest still is
# hundreds of times the noise of a displacement sensor (5 µm); the largest keeps the actuator well within its limit of
# 30 mm.
PEAK_DRIFT = (3e-3, 10e-3)
# Share of the cases whose damper is active, where the plan has one: most, because effects of the motor show only then.
WITH_DAMPER = 0.75


@dataclass(frozen=True)
class TrialBasis:
    """The plan of a trial, the length of its tests (s), and the effects that its cases may hide."""

    plan: Plan
    duration: float
    library: Library
    _drifts: dict[tuple[str, bool], float] = field(default_factory=dict, compare=False)

    def drift(self, record: str, *, damper: bool) -> float:
        """Peak drift (m) of the plan's linear building under an unscaled record of the package."""
        if (record, damper) not in self._drifts:
            self._drifts[record, damper] = peak_drift(self.plan, record, damper=damper)
        return self._drifts[record, damper]

    @cached_property
    def usual(self) -> float:
        """Peak drift of the plan's own test over that of the default test, both of the linear building."""
        return own_drift(self.plan) / own_drift(default())


def default() -> Plan:
    """The default test."""
    return plans.load(cli.plan_path("default"))


def basis(plan: Plan | None = None, duration: float = 30.0, library: Library | None = None) -> TrialBasis:
    """What the cases of a trial of a plan have in common; without a plan, of the default test.

    Raises:
        InputError: the plan names rigs, or a kind that cannot be loaded.
    """
    plan = anywhere(plan or default())
    if not plan.emulated:
        raise InputError(
            "The plan names a rig: remove `rig` from [master] and [slave], because the trial emulates all laboratories."
        )
    return TrialBasis(plan, duration, library or libraries.of_plan(plan, lambda: reached(plan)))


def anywhere(plan: Plan) -> Plan:
    """The plan with full paths of the files of users' kinds: a case is recorded and diagnosed in other folders."""

    def full(kind: str) -> str:
        file, _, name = kind.rpartition(":")
        return f"{(plan.base / file).resolve()}:{name}" if file.endswith(".py") else kind

    slaves = {name: replace(lab, kind=full(lab.kind)) for name, lab in plan.slaves.items()}
    master, slave = (replace(lab, kind=full(lab.kind)) for lab in (plan.master, plan.slave))
    return replace(plan, master=master, slave=slave, slaves=slaves)


def reached(plan: Plan) -> dict[str, dict[str, float]]:
    """Peaks of the signals in a plan's own test by its nominal models, by role and name.

    Raises:
        InputError: the test cannot be simulated, or diverges.
    """
    from loop.nominal import preflight

    columns, finite = preflight.simulated(plan)
    if not finite:
        raise InputError(
            "The plan's own test diverges with its nominal models: run rths check, and mend the plan."
        )
    return {
        role: {name: float(np.max(np.abs(values))) for name, values in signals.items()}
        for role, signals in columns.items()
    }


def draw_plan(lot: Lot, trial: TrialBasis) -> Plan:
    """The trial's test with another motion, scaled to a drawn drift, with the damper or without."""
    generator = lots.generator(*lot, "plan")
    record = lots.chosen(MOTIONS, *lot, "motion")
    damper = bool(generator.random() < WITH_DAMPER)
    peak = trial.usual * log_uniform(generator, *PEAK_DRIFT)
    tables = trial.plan.tables()
    tables["test"] |= {"name": "blind", "duration": trial.duration, "seed": int(generator.integers(2**31))}
    for control in controls(tables):
        control["amd"] = damper
    tables["limits"]["error_energy"] = math.inf  # an effect that disturbs the loop must not end the test
    scale = round(peak / trial.drift(record, damper=damper), 4)
    tables["ground_motion"] = {"record": record, "scale": scale}
    return plans.from_tables(tables, trial.plan.base)


def another_motion(lot: Lot, plan: Plan, trial: TrialBasis) -> Plan:
    """A case's plan with a second motion, scaled to a drift of its own."""
    first, damper = plan.ground_motion.record, plan.control.amd
    record = lots.chosen((name for name in MOTIONS if name != first), *lot, "other motion")
    peak = trial.usual * log_uniform(lots.generator(*lot, "other peak"), *PEAK_DRIFT)
    tables = plan.tables()
    tables["ground_motion"] = {
        "record": record,
        "scale": round(peak / trial.drift(record, damper=damper), 4),
    }
    return plans.from_tables(tables, plan.base)


def controls(tables: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The tables [control] of a plan's tables, its own and every slave's."""
    own = [
        lab["control"] for lab in tables.get(SLAVE, {}).values() if isinstance(lab, dict) and "control" in lab
    ]
    return [tables["control"], *own]


def own_drift(plan: Plan) -> float:
    """Peak drift (m) of a plan's linear building in its own test."""
    scale = plan.ground_motion.scale
    return scale * peak_drift(plan, plan.ground_motion.record, damper=plan.control.amd)


def peak_drift(plan: Plan, record: str, *, damper: bool) -> float:
    """Peak drift (m) of any storey of the linear building under an unscaled record; dampers on tables as dashpots."""
    from scipy.signal import lsim

    from loop import substructure

    tables = plan.tables()
    tables["ground_motion"] = {"record": record, "scale": 1.0}
    alone = plans.from_tables(tables, plan.base)
    ground = substructure.ground_rows(alone, substructure.motion(alone))[0]
    t = np.arange(ground.size) * plan.test.interval
    _, drifts, _ = lsim(linear(plan, damper=damper), ground, t)
    return float(np.max(np.abs(drifts)))


def linear(plan: Plan, *, damper: bool) -> tuple[Array, Array, Array, Array]:
    """The building in state space, from the ground's acceleration (m/s²) to the drifts (m) of its storeys.

    The states are the velocities and displacements of its floors against the ground.
    """
    from loop.nominal.partition import matrices

    n, (M, C, K) = plan.storeys, matrices(plan)
    mass, C = np.diag(M)[:, None], C.copy()
    for role, kind in plan.kinds.items() if damper else ():
        if kind == TABLE:
            seen = plan.of(role)
            C[seen.damper.floor - 1, seen.damper.floor - 1] += seen.control.gain
    A = np.block([[-C / mass, -K / mass], [np.eye(n), np.zeros((n, n))]])
    B = np.concatenate([np.ones((n, 1)), np.zeros((n, 1))])  # the sign is reversed: only peaks are used
    drifts = np.eye(n) - np.eye(n, k=-1)
    return A, B, np.hstack([np.zeros((n, n)), -drifts]), np.zeros((n, 1))


def log_uniform(generator: np.random.Generator, one: float, other: float) -> float:
    """A log-uniform draw between two positive values."""
    return float(np.exp(generator.uniform(*sorted((np.log(one), np.log(other))))))
