"""The catalogue of unmodelled effects: one file each, listed here.

An effect is added by its file and its line in `FILES`. Effects on readings exist once per signal.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from common.errors import InputError
from common.plan.schema import Rule, nearest
from models.effects import (
    actuator_backlash,
    actuator_compliance,
    actuator_deadband,
    actuator_delay,
    actuator_gain,
    actuator_time_constant,
    actuator_velocity_limit,
    column_degradation,
    column_friction,
    column_inertia,
    column_pinching,
    column_slip,
    column_stiffness,
    column_viscous,
    column_yielding,
    damper_force_limit,
    damper_friction,
    damper_gain,
    damper_mass,
    damper_motor_lag,
    damper_offset,
    damper_stiffness,
    damper_stroke_stop,
    damper_viscous,
    ground_scale,
    ground_time_shift,
    link_delay,
    link_jitter,
    link_loss,
    sensor_bias,
    sensor_delay,
    sensor_drift,
    sensor_gain,
    sensor_lag,
    sensor_noise,
    sensor_quantization,
    structure_damping,
    structure_mass,
    structure_p_delta,
    structure_stiffness,
    table_backlash,
    table_bandwidth,
    table_delay,
    table_friction,
    table_gain,
    table_oil_column,
    table_payload,
)
from models.effects.effect import Effect, Parameter
from models.effects.readings import SIGNALS
from models.system import System

Entry = tuple[str, Mapping[str, float]]  # name of an effect, its parameters

FILES = (
    ground_scale.EFFECT,
    ground_time_shift.EFFECT,
    structure_mass.EFFECT,
    structure_stiffness.EFFECT,
    structure_damping.EFFECT,
    structure_p_delta.EFFECT,
    actuator_delay.EFFECT,
    actuator_time_constant.EFFECT,
    actuator_gain.EFFECT,
    actuator_velocity_limit.EFFECT,
    actuator_backlash.EFFECT,
    actuator_compliance.EFFECT,
    actuator_deadband.EFFECT,
    column_stiffness.EFFECT,
    column_yielding.EFFECT,
    column_degradation.EFFECT,
    column_pinching.EFFECT,
    column_friction.EFFECT,
    column_viscous.EFFECT,
    column_inertia.EFFECT,
    column_slip.EFFECT,
    link_delay.EFFECT,
    link_jitter.EFFECT,
    link_loss.EFFECT,
    table_delay.EFFECT,
    table_gain.EFFECT,
    table_bandwidth.EFFECT,
    table_oil_column.EFFECT,
    table_payload.EFFECT,
    table_backlash.EFFECT,
    table_friction.EFFECT,
    damper_friction.EFFECT,
    damper_viscous.EFFECT,
    damper_stiffness.EFFECT,
    damper_mass.EFFECT,
    damper_motor_lag.EFFECT,
    damper_gain.EFFECT,
    damper_force_limit.EFFECT,
    damper_stroke_stop.EFFECT,
    damper_offset.EFFECT,
)

READINGS = (
    sensor_gain.effect,
    sensor_bias.effect,
    sensor_drift.effect,
    sensor_lag.effect,
    sensor_delay.effect,
    sensor_quantization.effect,
    sensor_noise.effect,
)

CATALOGUE: dict[str, Effect] = {
    item.name: item
    for item in (
        *FILES,
        *(effect(name, signal.unit) for name, signal in SIGNALS.items() for effect in READINGS),
    )
}


def lay(system: System, entries: Sequence[Entry]) -> System:
    """The system with effects of the catalogue laid over it, in the order given.

    Parameters of the plan are multiplied or added to, so that such effects given twice add up; of effects
    with fields of their own the last one given holds.

    Raises:
        InputError: an effect or a parameter is unknown, a parameter is missing or out of its bounds, or the plan's
            actuator is of a model that cannot have the effect.
    """
    for name, given in entries:
        if name not in CATALOGUE:
            raise InputError(f"Unknown effect '{name}': {nearest(name, CATALOGUE)}")
        effect = CATALOGUE[name]
        if not effect.fits(system.plan):
            raise InputError(
                f"The effect '{name}' is one of the actuator '{' or '.join(effect.actuators)}', but the plan's is "
                f"'{system.plan.actuator.model}', which has none such: leave it out."
            )
        system = effect.apply(system, **checked(effect, given))
    return system


def checked(effect: Effect, given: Mapping[str, float]) -> dict[str, float]:
    """All parameters of an effect by name, those not given at their default.

    Raises:
        InputError: a parameter is unknown, missing, no number or out of its bounds.
    """
    known = {item.name: item for item in effect.parameters}
    for name, value in given.items():
        if name not in known:
            raise InputError(f"Unknown parameter '{name}' of effect '{effect.name}': {nearest(name, known)}")
        if not admits(known[name], value):
            raise InputError(
                f"{name} of effect '{effect.name}' is {value!r}, but must be {allowed(known[name])}."
            )
    values = effect.values(given)
    for name, parameter in known.items():
        if name not in values:
            raise InputError(
                f"{name} of effect '{effect.name}' is missing: give a number that is {allowed(parameter)}."
            )
    return {name: float(value) for name, value in values.items()}


def admits(parameter: Parameter, value: object) -> bool:
    """Whether a value is a number within a parameter's bounds, or its null value."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return value == parameter.null or parameter.least <= value <= parameter.most


def allowed(parameter: Parameter) -> str:
    """The allowed range of a parameter in words."""
    words = Rule(parameter.says, parameter.unit, least=parameter.least, most=parameter.most).allowed()
    return words + (", or inf for no effect" if math.isinf(parameter.null) else "")


def null_parameters(effect: Effect) -> dict[str, float]:
    """The parameters with which an effect is not there; what only shapes it is at its default."""
    return {
        item.name: item.default if item.shape and item.default is not None else item.null
        for item in effect.parameters
    }


def of_site(site: str) -> list[Effect]:
    """The effects at one site, in the catalogue's order; none at an unknown site."""
    return [effect for effect in CATALOGUE.values() if effect.site == site]
