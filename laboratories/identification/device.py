"""Nominal parameters of a device of a user's kind from any motion, by least squares on its own kernel's response."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from laboratories.device import Device, DeviceRecord
from laboratories.identification import checks, estimate
from laboratories.identification.estimate import Estimate
from models.compiled import jit_apart
from models.registry import Array
from models.system import System

LEAST = 20  # samples: several for each parameter of the fit
HOPELESS = 0.9  # nrmse above which the fit is rejected: a constant has the nrmse 1
STEP = (
    1e-4  # relative step of the derivatives: above the rounding of a long simulation, within the linear range
)
MOST = 40  # steps of the fit; a device that follows its command needs about ten


@dataclass(frozen=True)
class DeviceFit:
    """The result of a fit: the parameters by name, and the misfit of each measured channel."""

    parameters: dict[str, Estimate]
    nrmse: dict[str, float]


@jit_apart
def follow(lab: DeviceRecord, commands: Array, efforts: Array, truth: Array, result: Array) -> None:
    """Fill the readings of sensors without error at each tick, (ticks, channels); the first row is zero, at rest."""
    result[0, :] = 0.0
    for k in range(commands.size - 1):
        lab.step(lab.parameters, lab.state, truth, commands[k], efforts[k])
        for place in range(truth.size):
            result[k + 1, place] = truth[place]


def response(lab: DeviceRecord, commands: Array, efforts: Array, channels: int) -> Array:
    """Readings (ticks, channels) of a device, at first at rest, for commands (m) and a motor's forces (N) per tick."""
    result = np.empty((commands.size, channels))
    follow(lab, commands, efforts, np.zeros(channels), result)
    return result


def least_squares(kind: Device, plan: Plan, commands: Array, efforts: Array, measured: Array) -> DeviceFit:
    """The nominal parameters of a kind, from a record that begins at rest; the plan's are the first guess.

    Args:
        kind: the kind of laboratory.
        plan: of the role that hosts it.
        commands: (ticks,) m, written at each tick.
        efforts: (ticks,) N, the motor's force; zero for a kind without one.
        measured: (ticks, channels), in the order of the kind's channels.

    Raises:
        InputError: too short, not finite, no motion, no parameter, or a reading that does not follow the command.

    Each channel is weighted by its standard deviation. A parameter without influence on this motion has an infinite
    interval. The method is that of `actuator.least_squares`.
    """
    from scipy import optimize

    values = {name: value for name, value in kind.values(plan).items() if value != 0.0}
    if not values:
        raise InputError(
            f"{type(kind).__name__} has no nominal parameter other than 0 that could be identified."
        )
    names = kind.channels.names
    checks.signals(LEAST, command=commands, **dict(zip(names, measured.T, strict=True)))
    checks.moves("command", commands)
    spread = np.std(measured, axis=0)
    if dead := [name for name, size in zip(names, spread, strict=True) if size == 0.0]:
        raise InputError(f"The {checks.spoken(dead[0])} is constant: nothing can be identified from it.")
    scales = np.array(list(values.values()))

    def misfits(x: Array) -> Array:
        lab = built(kind, plan, dict(zip(values, (x * scales).tolist(), strict=True)))
        return ((response(lab, commands, efforts, len(names)) - measured) / spread).T.ravel()

    bounds = [
        (one.least, np.inf if one.most is None else one.most) for one in map(kind.nominal.__getitem__, values)
    ]
    ends = np.array(bounds).T / scales
    result = optimize.least_squares(
        misfits,
        np.ones(scales.size),
        bounds=(np.min(ends, axis=0), np.max(ends, axis=0)),
        diff_step=STEP,
        x_scale="jac",
        max_nfev=MOST,
    )
    parts = np.asarray(result.fun).reshape(len(names), -1)
    nrmse = {name: float(np.sqrt(np.mean(part**2))) for name, part in zip(names, parts, strict=True)}
    if max(nrmse.values()) > HOPELESS:
        raise InputError("The measurements do not follow the command: check sensors and cabling.")
    units = [kind.nominal[name].unit for name in values]
    blocks = [commands.size] * len(names)
    return DeviceFit(estimate.of_fit(result, list(values), units, scales, blocks), nrmse)


def built(kind: Device, plan: Plan, values: dict[str, float]) -> DeviceRecord:
    """The device at rest, with these nominal parameters in place of the plan's."""
    lab = kind.build(System(plan))
    places = {name: 1 + place for place, name in enumerate(kind.nominal)}
    for name, value in values.items():
        lab.parameters[places[name]] = value
    return lab
