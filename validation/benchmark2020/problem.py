"""The benchmark as plans of this system: four cases, the available motions, the compared settings, drawn plants."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from common.plan.laboratory_tables import CompensatorTable
from common.plan.plan import Plan
from common.plan.read import load
from loop import substructure

PLAN = Path(__file__).resolve().parents[2] / "rths" / "plans" / "benchmark2020.toml"
REST = 10.0  # s of still ground after the record, in which the floors come to rest
FORCE = 8900.0  # N, limit of the transfer system as published
DELAY = 0.0251  # s, of the transfer system at low frequency: a1/a0 below
# Coefficients (–, s, s², s³) of the inverse of the published transfer system at low frequency, and the lag with dead
# time whose first three coefficients are the same.
INVERSE = {"a0": 0.99254, "a1": 0.024889, "a2": 1.0662e-4, "a3": 3.8564e-7}
LAG = {"delay": 0.00472, "time_constant": 0.02017, "gain": 1.0 / 0.99254, "order": 3.0}


@dataclass(frozen=True)
class PartitionCase:
    """A published partition: floors and damping of the reference building; the specimen is the same in all."""

    number: int
    mass: float  # kg, of each floor
    damping_ratio: float  # of every mode

    @property
    def name(self) -> str:
        """The name in tables."""
        return f"case {self.number}"


CASES = (
    PartitionCase(1, 1000.0, 0.05),
    PartitionCase(2, 1100.0, 0.04),
    PartitionCase(3, 1300.0, 0.03),
    PartitionCase(4, 1000.0, 0.03),
)


@dataclass(frozen=True)
class Motion:
    """A ground motion at the intensity of the comparison."""

    title: str
    record: str
    scale: float


EL_CENTRO = Motion("El Centro", "el_centro_1940_ns", 0.4)
MOTIONS = (
    EL_CENTRO,
    Motion("Loma Prieta", "loma_prieta_1989_corralitos_000", 0.2),
    Motion("San Fernando", "san_fernando_1971_pacoima_dam_164", 0.2),
)

SETTINGS = {
    "none": CompensatorTable("none", {}),
    "sample": CompensatorTable("pi_lead", {}),
    "pid": CompensatorTable("pid", {"proportional": 1.93, "integral": 0.047, "derivative": 0.0}),
    "pid_taylor": CompensatorTable(
        "pid_taylor", {"proportional": 1.93, "integral": 0.047, "derivative": 0.0, "lead": DELAY}
    ),
    "taylor1": CompensatorTable("taylor", {"lead": DELAY, "order": 1.0}),
    "taylor2": CompensatorTable("taylor", {"lead": DELAY, "order": 2.0}),
    "taylor3": CompensatorTable("taylor", {"lead": DELAY, "order": 3.0}),
    "horiuchi1": CompensatorTable("horiuchi", {"delay": DELAY, "order": 1.0}),
    "horiuchi2": CompensatorTable("horiuchi", {"delay": DELAY, "order": 2.0}),
    "horiuchi3": CompensatorTable("horiuchi", {"delay": DELAY, "order": 3.0}),
    "inverse": CompensatorTable("inverse", LAG),
    "pid_inverse": CompensatorTable(
        "pid_inverse", {"proportional": 1.0, "integral": 0.0, "derivative": 0.0} | LAG
    ),
    "series": CompensatorTable("series", INVERSE),
    "ats": CompensatorTable(
        "ats", {"lead": LAG["delay"], "time_constant": LAG["time_constant"], "trigger": 1e-4}
    ),
    "amb": CompensatorTable("amb", INVERSE),
}


def planned(case: PartitionCase, motion: Motion) -> Plan:
    """The plan of one test with the sample controller: the record, then `REST` of still ground."""
    base = load(PLAN)
    plan = replace(
        base,
        test=replace(base.test, name=f"benchmark2020_case{case.number}"),
        ground_motion=replace(base.ground_motion, record=motion.record, scale=motion.scale),
        structure=replace(base.structure, mass=(case.mass,) * base.storeys, damping_ratio=case.damping_ratio),
    )
    ticks = round((substructure.motion(plan).duration + REST) / plan.test.interval)
    return plan.with_ticks(ticks)


def with_compensator(plan: Plan, chosen: CompensatorTable) -> Plan:
    """The plan with another compensator of the actuator; the compensation of the measured force stays."""
    compensator = replace(plan.compensator, kind=chosen.kind, parameters=dict(chosen.parameters))
    return replace(plan, compensator=compensator)


class DrawnSystem(NamedTuple):
    """A transfer system and specimen drawn about the nominal ones."""

    leakage: float
    valve_damping: float
    valve_stiffness: float
    stiffness: float  # N/m, of the specimen


SPREAD = DrawnSystem(1.3, 3.3, 3.3e3, 5e4)  # standard deviations as published


def draw(plan: Plan, count: int, seed: int) -> list[DrawnSystem]:
    """`count` plants, normally distributed about the plan's; draws with a value that is not positive are repeated."""
    servo = plan.actuator.servo
    middle = np.array([servo.leakage, servo.valve_damping, servo.valve_stiffness, plan.column.stiffness])
    generator = np.random.default_rng(seed)
    found: list[DrawnSystem] = []
    while len(found) < count:
        values = generator.normal(middle, SPREAD)
        if np.all(values > 0.0):
            found.append(DrawnSystem(*values.tolist()))
    return found


def with_plant(plan: Plan, plant: DrawnSystem) -> Plan:
    """The plan on another plant; the whole building stays, so the numerical part is without the drawn specimen."""
    servo = replace(
        plan.actuator.servo,
        leakage=plant.leakage,
        valve_damping=plant.valve_damping,
        valve_stiffness=plant.valve_stiffness,
    )
    own = plan.structure.experimental
    if own is None:
        raise ValueError(
            "The plan has no [structure.experimental], the specimen's share of the building: add it."
        )
    experimental = replace(own, stiffness=plant.stiffness)
    return replace(
        plan,
        actuator=replace(plan.actuator, servo=servo),
        column=replace(plan.column, stiffness=plant.stiffness),
        structure=replace(plan.structure, experimental=experimental),
    )
