"""A kind of laboratory of the user's own: a class in a file, from which all else follows.

The class names its channels, its nominal parameters and what moves the device on. A plan chooses it by
`kind = "file.py:Class"`, and its table `[device]` says where the device stands in the building.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numba
import numpy as np
from numba import types

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.schema import as_type, nearest
from common.plan.tables import ForceCorrection
from common.safety.ramp import MotionRamp, Ramp
from laboratories.kind import Chosen, Coupling, Follows, Kind
from models.registry import Array
from models.system import System

if TYPE_CHECKING:
    from laboratories.effects.effect import Effect

VECTOR = types.float64[::1]
KERNEL = types.void(VECTOR, VECTOR, VECTOR, types.float64, types.float64)
"""Signature of a device's `step`: parameters, state, truth, command (m), effort (N)."""

UNCORRECTED = ForceCorrection()


class Nominal(NamedTuple):
    """A nominal parameter of a device."""

    value: float
    unit: str
    says: str
    tolerance: float = 0.02  # how well it is known, relative


class DeviceRecord(NamedTuple):
    """A device at work, which its own kernel moves on."""

    step: Any  # compiled, as an address
    parameters: Array  # interval s, the nominal parameters, then what effects set, in the order of the class
    state: Array


def advance_device(lab: DeviceRecord, truth: Array, command: float, effort: float) -> None:
    """One interval of any device, by its own kernel."""
    lab.step(lab.parameters, lab.state, truth, command, effort)


class HoldRamp:
    """The command comes to a hold, and where the plan says so goes on to where the device carries no force."""

    def __init__(
        self, plan: Plan, last: tuple[float, ...], before: tuple[float, ...], force: int, *, effort: bool
    ) -> None:
        safety, interval = plan.safety, plan.test.interval
        velocity = (last[0] - before[0]) / interval
        self._motion = MotionRamp(safety, interval, last[0], velocity, unload=safety.unload)
        self._force = force
        self._rest = (0.0,) if effort else ()

    def step(self, measured: tuple[float, ...] | None) -> tuple[float, ...]:
        """The command for the coming interval, a motor's force at zero."""
        return (self._motion.step(measured[self._force] if measured else None), *self._rest)

    @property
    def done(self) -> bool:
        """Whether the command is at rest."""
        return self._motion.done

    @property
    def travel(self) -> float:
        """How far apart the commands have been, m."""
        return self._motion.travel

    @property
    def left(self) -> float:
        """How long it takes at most from here on, s."""
        return self._motion.left

    def doing(self, measured: tuple[float, ...] | None) -> str:
        """What it does, in words, with the force that the device still carries."""
        force = "unknown force" if measured is None else f"{abs(measured[self._force]) * 1e-3:.1f} kN"
        if self._motion.unloading:
            return f"unloading the device: {force} left"
        return f"bringing the device to a halt: {force} on it"


class Device(Kind):
    """Base of kinds of users' own; a subclass sets what stands here and writes `step`.

    `step(parameters, state, truth, command, effort)` moves the device on by one interval and is compiled: `parameters`
    holds the interval (s), the values of `nominal` and then those of `faults`, each in the order of the class; `state`
    has `states` numbers, all zero at rest; `command` (m) is reached at the interval's end, `effort` (N) is the motor's;
    what sensors without error would read then goes into `truth`, in the order of the measured channels.
    """

    follows: ClassVar[Follows] = Follows.DRIFT
    nominal: ClassVar[Mapping[str, Nominal]] = {}
    faults: ClassVar[
        Mapping[str, float]
    ] = {}  # what effects set, by name, with the value at which there is none
    states: ClassVar[int] = 0
    rms: ClassVar[Mapping[str, float]] = {}  # nominal noise by channel
    most: ClassVar[Mapping[str, float]] = {}  # limits by signal, and of those that `limited` names
    effects: ClassVar[tuple[Effect, ...]] = ()
    stiffness: ClassVar[str] = ""  # the nominal parameter that is the device's stiffness, N/m; empty for none
    damping: ClassVar[str] = ""  # likewise its dashpot, N·s/m
    sites = ("device",)
    record = DeviceRecord
    advance = staticmethod(advance_device)
    step: Callable[[Array, Array, Array, float, float], None]

    def check(self, where: str) -> None:
        """Raise InputError where the class is no complete kind; compile its kernel."""
        lacking = [name for name in ("name", "says", "channels", "step") if not hasattr(self, name)]
        if lacking:
            raise InputError(f"{type(self).__name__} named in {where} lacks {', '.join(lacking)}.")
        try:
            self._kernel = numba.cfunc(KERNEL)(type(self).step)
        except numba.core.errors.NumbaError as error:
            reason = str(error).strip().splitlines()[-1]
            raise InputError(
                f"step of {type(self).__name__} named in {where} cannot be compiled: {reason}"
            ) from None

    def values(self, plan: Plan) -> dict[str, float]:
        """The nominal parameters by name: the class's, or the plan's where it gives them.

        Raises:
            InputError: the plan gives one that the class does not have, or no number.
        """
        given = self._given(
            plan.device.parameters,
            self.nominal,
            "device.parameters",
            {name: one.unit for name, one in self.nominal.items()},
        )
        return {name: one.value for name, one in self.nominal.items()} | given

    def build(self, system: System) -> DeviceRecord:
        """The device of a system at rest."""
        values = self.values(system.plan)
        faults = dict(self.faults) | system.effects.device
        row = [system.plan.test.interval, *values.values(), *(faults[name] for name in self.faults)]
        return DeviceRecord(self._kernel, np.array(row), np.zeros(self.states))

    def coupling(self, plan: Plan) -> Coupling:
        """The device's storey or floor as `[device]` says it."""
        device, values = plan.device, self.values(plan)
        felt = device.ratio * device.scale
        return Coupling(
            follows=self.follows,
            place=device.place,
            ratio=device.ratio,
            scale=device.scale,
            effort=0.0,
            correction=UNCORRECTED,
            stiffness=felt * values.get(self.stiffness, 0.0),
            damping=felt * values.get(self.damping, 0.0),
            mass=0.0,
            share=0.0,
        )

    def compensator(self, plan: Plan) -> Chosen:
        """That of `[device.compensator]`."""
        chosen = plan.device.compensator
        return Chosen(chosen.kind, chosen.parameters, "device.compensator")

    def noise(self, plan: Plan) -> Array:
        """The class's, or the plan's where it gives it."""
        units = {signal.name: signal.unit for signal in self.channels.measured}
        rms = dict(self.rms) | self._given(plan.device.noise, units, "device.noise", units)
        return np.array([rms.get(name, 0.0) for name in self.channels.names])

    def limits(self, plan: Plan) -> Mapping[str, float]:
        """The class's, or the plan's where it gives them."""
        return dict(self.most) | self._given(plan.device.limits, self.most, "device.limits", {})

    def ramp(self, plan: Plan, last: tuple[float, ...], before: tuple[float, ...]) -> Ramp:
        """The command comes to a hold, then the device is unloaded."""
        force = self.channels.names.index(self.channels.force)
        return HoldRamp(plan, last, before, force, effort=self.channels.effort is not None)

    def _given(
        self, table: Mapping[str, Any], known: Mapping[str, Any], where: str, units: Mapping[str, str]
    ) -> dict[str, float]:
        for name in table:
            if name not in known:
                raise InputError(f"Unknown key '{name}' in [{where}]: {nearest(name, known)}")
        return {
            name: as_type("float", value, f"{name} in [{where}]", units.get(name))
            for name, value in table.items()
        }
