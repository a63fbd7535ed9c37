"""Time per tick over the number of storeys, the tick rate and the number of slaves, compiled and of the loop objects.

In virtual time nothing waits, so that a time is that of all laboratories, with emulated rigs, on one processor.
Each curve is a row of `CURVES`: its parameter, the values of the parameter, and the plan for a value.
"""

from __future__ import annotations

import gc
import math
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.result import BenchmarkFigure
from common.plan.laboratory_tables import SlaveLaboratory
from common.plan.plan import Plan, ideal
from common.plan.tables import RecordingTable
from common.reality import reality
from loop import substructure
from loop.closed_loop import simulate
from loop.nominal import partition
from models.registry import Array
from models.structures import shear_building
from simulation import virtual

STOREYS = (1, 2, 5, 10, 20, 50, 100)
LABORATORIES = (1, 2, 4, 8)
RATES_HZ = (500, 1_000, 2_000, 4_000, 8_000)
PERIOD = 0.1  # s per storey: the usual estimate of the first period of a frame
DAMPING_RATIO = 0.05  # of the first mode: the usual value of the design codes
SCALE = 0.02  # of the ground motion: small enough that no limit is reached on any curve
FREE = 8_000  # ticks of free vibration for the first frequency: 16 s, longer than the period of 10 s of 100 storeys
# Largest relative error of that frequency; measured 5e-5, which is the period error of CR at ω·h = 0.025,
# (ω·h)²/12.
SAME = 1e-4


class Effort(NamedTuple):
    """The amount of work for a point, and the number of values of a curve."""

    repeats: int
    ticks: int  # of a test with the loop objects
    compiled_ticks: int  # of a compiled simulation
    values: int | None  # None for all


# 4,000 ticks take about 0.2 s; of 10,000 compiled ticks (2 ms) the allocation of the arrays is a small part
FULL = Effort(5, 4_000, 10_000, None)
QUICK = Effort(1, 20, 20, 2)


class Point(NamedTuple):
    """The time of one tick, compiled and of the loop objects: best and median of the repeats, µs."""

    value: float  # of the curve's parameter
    interval: float  # s
    compiled: float
    compiled_median: float
    objects: float
    objects_median: float
    finite: bool  # whether all values of the compiled simulation are finite

    @property
    def real_time(self) -> float:
        """How many times faster than real time the loop objects are, median."""
        return self.interval * 1e6 / self.objects_median

    def plain(self, name: str) -> dict[str, float]:
        """The point for JSON and the table of points, with the value under `name`; times in µs."""
        return {
            name: self.value,
            "interval": self.interval * 1e6,
            "compiled": self.compiled,
            "compiled_median": self.compiled_median,
            "compiled_real_time_factor": self.interval * 1e6 / self.compiled_median,
            "loops": self.objects,
            "loops_median": self.objects_median,
            "real_time_factor": self.real_time,
            "share_of_interval": 1.0 / self.real_time,
        }


class ScaleCurve(NamedTuple):
    """The name, unit and values of a parameter, and the plan for a value."""

    name: str
    unit: str
    values: tuple[int, ...]
    plan: Callable[[int], Plan]


# -- plans ------------------------------------------------------------------------------------------


def uniform(storeys: int) -> Plan:
    """A uniform shear building whose first period is 0.1 s per storey, but at least that of the default building.

    The specimen is one of the four columns of the lowest storey. The integrator is CR, which is stable for every
    frequency.
    """
    plan = Plan()
    (mass,), (stiffness,) = plan.structure.mass, plan.structure.stiffness
    omega = min(2.0 * math.pi / (PERIOD * storeys), math.sqrt(stiffness / mass))
    each = mass * (omega / first_frequency(storeys)) ** 2
    structure = replace(
        plan.structure,
        mass=(mass,) * storeys,
        stiffness=(each,) * storeys,
        damping=(2.0 * DAMPING_RATIO / omega * each,) * storeys,
        integrator="cr",
    )
    column = replace(plan.column, stiffness=plan.column.stiffness * each / stiffness)
    motion = replace(plan.ground_motion, scale=SCALE)
    return light(replace(plan, structure=structure, column=column, ground_motion=motion))


def at_rate(hertz: int) -> Plan:
    """The default test at another tick rate."""
    plan = Plan()
    motion = replace(plan.ground_motion, scale=SCALE)
    return light(replace(plan, test=replace(plan.test, interval=1.0 / hertz), ground_motion=motion))


def laboratories(count: int) -> Plan:
    """The default test with its damper split among `count` laboratories, each with an equal part of the force."""
    plan = Plan()
    share = 1.0 / count
    damper = replace(plan.damper, force_scale=share * plan.damper.force_scale)
    control = replace(plan.control, gain=share * plan.control.gain)
    slave = SlaveLaboratory(plan.table, damper, control, plan.slave.rig)
    slaves = {f"part_{place}": slave for place in range(count)} if count > 1 else {}
    return light(replace(plan, slaves=slaves))


def light(plan: Plan) -> Plan:
    """The plan without a recorder."""
    return replace(plan, recording=RecordingTable(required=False))


def first_frequency(storeys: int) -> float:
    """First circular frequency of a uniform shear building over √(k/m) of a storey: 2·sin(π/(4n + 2))."""
    return 2.0 * math.sin(math.pi / (4 * storeys + 2))


CURVES = (
    ScaleCurve("storeys", "storeys", STOREYS, uniform),
    ScaleCurve("tick_rate", "Hz", RATES_HZ, at_rate),
    ScaleCurve("laboratories", "slaves", LABORATORIES, laboratories),
)


# -- times ------------------------------------------------------------------------------------------


def costs(work: Callable[[], float], repeats: int) -> list[float]:
    """The times that `work` returns in each repeat, without garbage collection; a first call is not counted."""
    work()
    found = []
    for _ in range(repeats):
        gc.collect()
        gc.disable()
        found.append(work())
        gc.enable()
    return found


def compiled(plan: Plan, ground: Array) -> float:
    """Time per tick of the compiled simulation, µs, including the allocation of its arrays."""
    began = time.perf_counter()
    ticks = simulate(plan, ground).ticks
    return (time.perf_counter() - began) * 1e6 / max(ticks, 1)


def objects(plan: Plan) -> float:
    """Time per tick of the loop objects over the link in memory, µs, without building and warming up."""
    bench = virtual.assemble(plan, reality.as_planned(plan), None)
    began = time.perf_counter()
    error = virtual.run(bench, str)
    spent = time.perf_counter() - began
    if error is not None:
        raise error
    return spent * 1e6 / bench.master.ticks


def point(value: int, plan: Plan, effort: Effort) -> Point:
    """The times per tick of one plan."""
    shorter, longer = plan.with_ticks(effort.ticks), plan.with_ticks(effort.compiled_ticks)
    ground = substructure.ground_rows(longer, substructure.motion(plan))
    fast = costs(lambda: compiled(longer, ground), effort.repeats)
    slow = costs(lambda: objects(shorter), effort.repeats)
    return Point(
        value,
        plan.test.interval,
        min(fast),
        statistics.median(fast),
        min(slow),
        statistics.median(slow),
        simulate(longer, ground).finite,
    )


# -- check of the simulated building ----------------------------------------------------------------


def free_vibration(plan: Plan) -> float:
    """First circular frequency (rad/s) of the ideal undamped test, from its free vibration after an impulse.

    The modal coordinate of the first mode obeys `q_{k+1} = 2·cos(ω·h)·q_k − q_{k−1}`.
    """
    n = plan.storeys
    still = replace(plan.structure, damping=(0.0,) * n)
    control = replace(plan.control, amd=False)
    quiet = replace(ideal(plan), structure=still, control=control).with_ticks(FREE)
    ground = np.zeros((2, FREE + 1))
    ground[0, 1] = 1.0
    x = simulate(quiet, ground).master["displacement"].reshape(FREE, n)[10:]
    shape = np.sin((np.arange(n) + 1) * math.pi / (2 * n + 1))
    q = x @ shape
    cosine = q[1:-1] @ (q[2:] + q[:-2]) / (2.0 * q[1:-1] @ q[1:-1])
    return float(math.acos(cosine) / quiet.test.interval)


def frequency_error(storeys: int) -> float:
    """The larger relative error of the first frequency, of the matrices and of the simulation, from the closed form."""
    plan = uniform(storeys)
    exact = first_frequency(storeys) * math.sqrt(plan.structure.stiffness[0] / plan.structure.mass[0])
    modes = shear_building.modes(*partition.matrices(plan))
    found = (2.0 * math.pi / modes.periods[0], free_vibration(plan))
    return float(max(abs(omega / exact - 1.0) for omega in found))


# -- figures ----------------------------------------------------------------------------------------


def figures(curve: ScaleCurve, points: list[Point]) -> list[BenchmarkFigure]:
    """The last point of the curve as two figures; that of the loop objects holds the points of the whole curve."""
    last = points[-1]
    name = f"{last.value:,.0f} {curve.unit}"
    limit = last.interval * 1e6
    return [
        BenchmarkFigure(
            f"loop objects, {name}",
            "µs/tick",
            last.objects,
            last.objects_median,
            f"≤ {limit:,.0f}",
            all(each.finite and each.real_time >= 1.0 for each in points),
            "real time",
            last.real_time,
            [each.plain(curve.name) for each in points],
        ),
        BenchmarkFigure(
            f"compiled loop, {name}",
            "µs/tick",
            last.compiled,
            last.compiled_median,
            peer="real time",
            ratio=limit / last.compiled_median,
        ),
    ]


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """Measure all curves, and compare the first frequency of the buildings with the closed form."""
    found, effort = [], QUICK if quick else FULL
    for curve in CURVES:
        values = curve.values[: effort.values]
        found += figures(curve, [point(value, curve.plan(value), effort) for value in values])
    error = max(frequency_error(storeys) for storeys in STOREYS[: effort.values])
    name = "first frequency of uniform buildings, off the closed form"
    return [*found, BenchmarkFigure(name, "relative", error, error, f"≤ {SAME:g}", error <= SAME)]
