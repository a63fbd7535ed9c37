"""Likely slips of units: values that are possible, but that no building or laboratory has."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from common.plan.kinds import COLUMN
from common.plan.patience import strict
from common.plan.plan import Plan
from common.roles import MASTER
from loop.nominal.partition import felt, matrices, taken_over
from loop.nominal.preflight import LIMITS, Findings
from models.ground_motion import MOTIONS, STANDARD_GRAVITY, GroundMotion
from models.structures import shear_building

SHORTEST, LONGEST = (
    0.05,
    12.0,
)  # s, of a first period: a stiff test frame has 20 Hz, the tallest towers 8 to 10 s
USUAL = (
    0.1,
    5.0,
)  # s, periods by which a slip is recognised: from low stiff houses to tall or isolated buildings
LARGEST_DAMPING = 0.5  # a building with many dampers has 0.3
LEAST_DAMPING = 1e-4  # bare welded steel has 2e-3; a dashpot in kN·s/m is a thousandth
OFF = 10.0  # specimen over the stiffness that it represents: cracking gives 3, the smallest mistake of units 1000
LARGEST_STROKE = 2.0  # m; the largest shaking tables and dynamic actuators have 1 m
TICKS_PER_PERIOD = 20.0  # least, with which a second-order integration keeps a period to half a percent
WEAKEST = 1.0  # m/s², peak of an unscaled record: records for tests have a tenth of g and more
STRONGEST = 25.0  # m/s², peak of a record: only a few records of all earthquakes are stronger
LEAST_PEAK = 0.01  # m/s², peak after scaling: a thousandth of g, about the threshold of perception
LARGEST_DRIFT = 0.5  # m: a sixth of a storey's height, at which every building collapses
SLOWEST = 0.5  # s, dead time and lag of a transfer system: ten times that of slow ones
FORCE_OFF = 100.0  # peak over limit: a limit in kN is a thousandth of the right one
NOISE_SHARE = 0.1  # rms of a sensor's noise over its limit: good ones have a thousandth of their range
MASS, STIFFNESS = "mass in [structure]", "stiffness in [structure]"
FACTORS = (  # of the period where a value is by that much too small, and what was written instead
    (math.sqrt(1e3), MASS, "t in place of kg"),
    (1.0 / math.sqrt(1e3), STIFFNESS, "kN/m in place of N/m"),
    (1.0 / math.sqrt(1e6), STIFFNESS, "kN/mm in place of N/m"),
)


class PlanSlip(NamedTuple):
    """One value that is probably in another unit."""

    where: str  # key and table
    text: str  # a sentence


def slips(plan: Plan, motion: GroundMotion, found: Findings) -> list[PlanSlip]:
    """Everything that looks like a slip of units, in the order of the plan."""
    modes = shear_building.modes(*matrices(plan))
    period = float(modes.periods[0])
    return [
        *interval_slip(plan, period),
        *motion_slips(plan, motion),
        *period_slips(period),
        *damping_slips(float(modes.damping_ratios[0])),
        *specimen_slip(plan),
        *transfer_slips(plan),
        *sensor_slips(strict(plan)),
        *limit_slips(strict(plan), {} if found.unstable or found.peaks is None else found.peaks.every),
    ]


def of_machine(plan: Plan) -> list[PlanSlip]:
    """What looks like a slip of units of a machine by itself: no motion of a test says how far it goes."""
    return [*transfer_slips(plan), *sensor_slips(strict(plan)), *limit_slips(strict(plan), {})]


def interval_slip(plan: Plan, period: float) -> list[PlanSlip]:
    """An interval that does not resolve the building's motion."""
    interval = plan.test.interval
    if period / interval >= TICKS_PER_PERIOD or period < SHORTEST:
        return []
    text = (
        f"The interval of {interval:g} s is {period / interval:.1f} to the first period of {period:.3g} s, where at "
        f"least {TICKS_PER_PERIOD:g} are needed: it must be in seconds, 0.002 for 2 ms."
    )
    return [PlanSlip("interval in [test]", text)]


def motion_slips(plan: Plan, motion: GroundMotion) -> list[PlanSlip]:
    """A record whose numbers are not in m/s², and a scale that makes the motion far too weak or too strong."""
    chosen, where, peak = plan.ground_motion, "record in [ground_motion]", motion.peak
    share = f"{peak:.3g} m/s² ({peak / STANDARD_GRAVITY:.3g} g)"
    if chosen.record not in MOTIONS and peak < WEAKEST:
        text = (
            f"The record peaks at {share}, which is weak: where its numbers are in g, say so in its header or by "
            'unit = "g".'
        )
        return [PlanSlip(where, text)]
    if peak > STRONGEST:
        text = (
            f"The record peaks at {share}, more than was ever recorded: where its numbers are in gal, give "
            'unit = "gal".'
        )
        return [PlanSlip(where, text)]
    scaled = abs(chosen.scale) * peak
    if scaled > STRONGEST or 0.0 < scaled < LEAST_PEAK:
        text = (
            f"scale {chosen.scale:g} makes a peak of {scaled:.3g} m/s² of the record's {share}: it is a factor, "
            "0.1 for 10 %."
        )
        return [PlanSlip("scale in [ground_motion]", text)]
    return []


def period_slips(period: float) -> list[PlanSlip]:
    """A first period that no building has, and which unit would explain it."""
    if SHORTEST <= period <= LONGEST:
        return []
    causes = [
        f"{name} ({slip}), with which it would be {period * factor:.3g} s"
        for factor, name, slip in FACTORS
        if USUAL[0] <= period * factor <= USUAL[1]
    ]
    where = "; or ".join(causes) or f"{MASS} (kg) and {STIFFNESS} (N/m)"
    text = (
        f"The first period is {period:.3g} s, while buildings and frames have {SHORTEST:g} to {LONGEST:g} s: check "
        f"{where}."
    )
    return [PlanSlip("[structure]", text)]


def damping_slips(ratio: float) -> list[PlanSlip]:
    """A damping ratio that no building has."""
    if LEAST_DAMPING <= ratio <= LARGEST_DAMPING or ratio == 0.0 or math.isnan(ratio):
        return []
    text = (
        f"The first mode's damping ratio is {ratio * 100.0:.3g} %, while buildings have 0.5 to 20 %: damping must be "
        "in N·s/m (200e3 for 200 kN·s/m), damping_ratio a share (0.05 for 5 %)."
    )
    return [PlanSlip("damping in [structure]", text)]


def specimen_slip(plan: Plan) -> list[PlanSlip]:
    """A specimen whose stiffness differs greatly from the one that it represents."""
    if plan.kinds.get(MASTER) != COLUMN:
        return []
    given, wanted = felt(plan).stiffness, taken_over(plan).stiffness
    if given <= 0.0 or wanted <= 0.0 or 1.0 / OFF <= given / wanted <= OFF:
        return []
    text = (
        f"The specimen is felt as {given:.3g} N/m, and the building leaves {wanted:.3g} N/m to it, "
        f"{wanted / given:.3g} times as much: stiffness must be in N/m (12.5e6 for 12.5 kN/mm) in [column] "
        "and in [structure]."
    )
    return [PlanSlip("stiffness in [column]", text)]


def transfer_slips(plan: Plan) -> list[PlanSlip]:
    """Delays of transfer systems that are not in seconds."""
    times = [
        ("time_constant in [actuator]", plan.actuator.time_constant),
        ("delay in [actuator]", plan.actuator.delay),
    ]
    times += [("lead in [compensator]", plan.compensator.parameters.get("lead", 0.0))]
    for role in plan.roles:
        times.append(
            (f"delay in [{role}.table]" if plan.slaves else "delay in [table]", plan.of(role).table.delay)
        )
    return [
        PlanSlip(
            where,
            f"{where} is {value:g} s, slower than any transfer system: it must be in s, 0.014 for 14 ms.",
        )
        for where, value in times
        if value > SLOWEST
    ]


def sensor_slips(plan: Plan) -> list[PlanSlip]:
    """Noise that is large beside the limit of its signal."""
    result = []
    for name, rms in vars(plan.sensors).items():
        limit, unit = getattr(plan.limits, name), LIMITS[name].unit
        if rms > NOISE_SHARE * limit:
            text = f"The noise of {name} is {rms:g} {unit} rms, and its limit {limit:g} {unit}: it must be in {unit}."
            result.append(PlanSlip(f"{name} in [sensors]", text))
    return result


def limit_slips(plan: Plan, peaks: Mapping[str, float]) -> list[PlanSlip]:
    """Limits in mm, limits in kN beside the `peaks` expected, and a drift that no storey has."""
    result = []
    for name, limit in vars(plan.limits).items():
        unit = LIMITS[name].unit
        if unit == "m" and LARGEST_STROKE < limit < math.inf:
            text = (
                f"The limit of {name} is {limit:g} m, more than any laboratory moves: it must be in m, 0.15 for "
                "150 mm."
            )
            result.append(PlanSlip(f"{name} in [limits]", text))
        if unit == "N" and peaks.get(name, 0.0) > FORCE_OFF * limit:
            text = (
                f"The limit of {name} is {limit:g} N, and {peaks[name]:.3g} N are expected: it must be in N, "
                "400e3 for 400 kN."
            )
            result.append(PlanSlip(f"{name} in [limits]", text))
    if peaks.get("displacement", 0.0) > LARGEST_DRIFT:
        text = (
            f"A storey moves by {peaks['displacement']:.3g} m: check the units of mass, stiffness and record."
        )
        result.append(PlanSlip("[structure]", text))
    return result
