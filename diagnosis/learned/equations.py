"""The difference of a machine from its model as a series over its own motion: a force or a displacement.

Each series comes from the recorded signals at the machine itself, so that errors of other machines do not enter.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from common.plan.kinds import COLUMN, TABLE
from diagnosis.fits import hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals.mask import Mask
from diagnosis.signals.systematic import systematic
from laboratories.table import motor
from loop import replay
from models import friction, stops
from models.registry import Array
from models.saturation import saturated
from models.system import DamperEffects, System, TableEffects

STILL = 1e-3  # m/s, below which the sign of a measured rate is noise: 2 µm of stroke noise over one interval of 2 ms


@dataclass(frozen=True)
class Equation:
    """What a model leaves of a reading at a machine, over the machine's motion."""

    site: str
    machine: str  # the site within its laboratory, whose effects have the field `learned`
    motion: Array  # (ticks,) m, as far as possible without noise
    rate: Array  # (ticks,) m/s
    left: Array  # (ticks,) in `unit`
    there: Mask
    over: Literal[
        "piston displacement", "deformation", "table displacement", "velocity"
    ]  # abscissa of its curve
    quantity: str  # a text on the quantity in `left`
    unit: str


def equations(fit: Fit) -> list[Equation]:
    """The equations of the machines in a fit's part; their models have the effects of the fit."""
    part, system = fit.data.part, hypothesis.lay(fit.data, fit.z, fit.values)
    if isinstance(part, ColumnAlone):
        site = part.lab.site("column")
        return [of_specimen(site, system, part.inputs, part.measured[:, 0], part.present[:, 0])]
    if isinstance(part, LaboratoryPart) and part.lab.kind.name in LABORATORIES:
        return LABORATORIES[part.lab.kind.name](fit, part, system)
    return []


def of_column(fit: Fit, part: LaboratoryPart, system: System) -> list[Equation]:
    """The piston's displacement over the one that its model predicts, and the specimen's force over its deformation."""
    predicted = part.predict(system)
    place, force = part.measured.T
    placed, felt = part.present.T
    result = []
    motion = predicted[:, 0]
    if placed.any():
        left = np.where(placed, place - motion, 0.0)
        rate = rate_of(motion, system)
        result.append(
            Equation(
                part.lab.site("actuator"),
                "actuator",
                motion,
                rate,
                left,
                placed,
                "piston displacement",
                "displacement",
                "m",
            )
        )
        motion = motion + systematic(left, float(fit.data.white[0]), system.plan.test.interval)
    if felt.any():
        result.append(of_specimen(part.lab.site("column"), system, motion, force, felt))
    return result


def of_table(fit: Fit, part: LaboratoryPart, system: System) -> list[Equation]:
    """What brakes the table beyond its model, and the damper's force over its stroke."""
    return [*of_platform(fit, part, system), *of_damper(fit, part, system)]


def of_platform(fit: Fit, part: LaboratoryPart, system: System) -> list[Equation]:
    """The acceleration that the table lacks beside its servo loop's, over its place."""
    places = [
        part.lab.kind.channels.names.index(name) for name in ("table_displacement", "table_acceleration")
    ]
    (place, felt), (seen, there) = part.measured.T[places], part.present.T[places]
    if not (seen.any() and there.any()) or not servo_alone(system):
        return []
    interval = system.plan.test.interval
    predicted = part.predict(system)[:, places[0]]
    white = float(fit.data.white[places[0]])
    motion = predicted + systematic(np.where(seen, place - predicted, 0.0), white, interval)
    rate = np.gradient(motion, interval)
    command = next(iter(part.inputs.values()))
    left = np.where(there, platform_acceleration(system, command, motion, rate) - felt, 0.0)
    site = part.lab.site("table")
    return [Equation(site, "table", motion, rate, left, there, "table displacement", "acceleration", "m/s²")]


def servo_alone(system: System) -> bool:
    """Whether a table is a servo loop of second order alone, so that its acceleration follows from its motion."""
    effects = system.effects.table
    rigid = math.isinf(effects.oil_frequency) and math.isinf(effects.second_frequency)
    plain = effects.compliance == effects.backlash == effects.feed_velocity == 0.0
    return rigid and plain and math.isfinite(system.plan.table.frequency)


def platform_acceleration(system: System, command: Array, motion: Array, rate: Array) -> Array:
    """Acceleration (ticks,) m/s² by which a servo loop moves a table at a place (m) and rate (m/s)."""
    table, effects = system.plan.table, system.effects.table
    omega = 2.0 * math.pi * table.frequency
    ticks = np.arange(command.size)
    reached = ticks - 1.0 - table.delay / system.plan.test.interval  # a command is reached one interval later
    late = np.interp(reached, ticks, command, left=0.0)
    servo: Array = omega**2 * (effects.gain * late - motion) - 2.0 * table.damping_ratio * omega * rate
    return servo - friction_of(effects, rate)


def friction_of(effects: TableEffects | DamperEffects, rate: Array) -> Array:
    """The friction (ticks,) of a machine at a rate (m/s), by the model of its effects."""
    sides = 1.0 + effects.friction_asymmetry * np.sign(rate)
    speeds = 1.0 - effects.friction_drop * (1.0 - np.exp(-np.abs(rate) / effects.friction_speed))
    smooth = np.tanh(rate / max(effects.friction_velocity, STILL))
    result: Array = effects.friction * smooth * sides * speeds
    return result


def bristles_of(effects: DamperEffects, stroke: Array) -> Array:
    """The force (ticks,) N of a rail with presliding over its stroke (m), from rest."""
    result, force = np.zeros(stroke.size), 0.0
    least, most = (
        side * effects.friction * (1.0 + side * effects.friction_asymmetry) for side in (-1.0, 1.0)
    )
    for tick, moved in enumerate(np.diff(stroke).tolist(), 1):
        force = friction.dahl(force, moved, least, most, effects.presliding)
        result[tick] = force
    return result


def of_damper(fit: Fit, part: LaboratoryPart, system: System) -> list[Equation]:
    """The damper's force over its stroke."""
    places = [part.lab.kind.channels.names.index(name) for name in ("damper_stroke", "damper_force")]
    (stroke, force), (seen, felt) = part.measured.T[places], part.present.T[places]
    predicted = part.predict(system)[:, places[0]]
    if not (seen.any() and felt.any()):
        return []
    interval = system.plan.test.interval
    white = float(fit.data.white[places[0]])
    motion = predicted + systematic(np.where(seen, stroke - predicted, 0.0), white, interval)
    rate = np.gradient(motion, interval)
    command = list(part.inputs.values())[1] if len(part.inputs) > 1 else np.zeros(motion.size)
    left = np.where(felt, force - damper_force(system, motion, rate, command), 0.0)
    site = part.lab.site("damper")
    return [Equation(site, "damper", motion, rate, left, felt, "velocity", "force", "N")]


def damper_force(system: System, stroke: Array, rate: Array, command: Array) -> Array:
    """Force (ticks,) N of a damper on its table at a stroke (m) with its rate (m/s), its motor under a command (N)."""
    damper, effects = system.plan.damper, system.effects.damper
    level = (effects.force_limit, effects.force_limit_sharpness)
    wanted = np.vectorize(saturated, otypes=[float])(effects.gain * command, *level)
    interval, lag = system.plan.test.interval, damper.motor_time_constant
    pushed = motor.states(wanted, interval, lag, effects.motor_damping)[motor.FORCE]
    shape = (effects.stop_stroke, effects.stop_stiffness, effects.stop_exponent, effects.stop_damping)
    stopped = np.vectorize(stops.force, otypes=[float])(stroke, rate, *shape)
    rubbing = bristles_of(effects, stroke) if effects.presliding else friction_of(effects, rate)
    beside: Array = stopped + rubbing - effects.offset
    return damper.stiffness * stroke + damper.damping * rate + beside - pushed


def of_specimen(site: str, system: System, motion: Array, force: Array, there: Mask) -> Equation:
    """The force that a specimen's model leaves at a deformation (ticks,) m."""
    left = np.where(there, force - replay.column(system, motion), 0.0)
    return Equation(site, "column", motion, rate_of(motion, system), left, there, "deformation", "force", "N")


def rate_of(motion: Array, system: System) -> Array:
    """Rate (ticks,) of a motion (ticks,), m/s, over the interval that ends at each tick, as in a simulation."""
    return np.diff(motion, prepend=motion[:1]) / system.plan.test.interval


LABORATORIES: dict[str, Callable[[Fit, LaboratoryPart, System], list[Equation]]] = {
    COLUMN: of_column,
    TABLE: of_table,
}
