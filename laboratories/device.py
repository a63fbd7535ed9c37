"""The base class of a user's own kind of laboratory.

The class gives its channels, its nominal parameters, its possible faults and its kernel. A plan chooses it by
`kind = "file.py:Class"`, and its table `[device]` states where the device stands in the building.
"""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeVar, cast

import numba
import numpy as np

from common.errors import InputError
from common.plan.laboratory_tables import ForceCorrection
from common.plan.plan import Plan
from common.plan.schema import Rule, as_type, in_range, nearest
from common.safety.ramp import Ramp
from common.signals import Channels, Signal
from laboratories.descent import HoldRamp
from laboratories.kind import (
    Chosen,
    Coasting,
    Coupling,
    Follows,
    Kind,
    Limited,
    Machine,
    Moving,
    Sensed,
    usual,
)
from models.compiled import bound, jit
from models.registry import Array
from models.system import System

if TYPE_CHECKING:
    from laboratories.effects.effect import Effect

# a kernel is passed by its address, which Numba calls experimental; tests show that it works in every loop
warnings.filterwarnings("ignore", category=numba.NumbaExperimentalFeatureWarning)

__all__ = [
    "Channels",
    "Coasting",
    "Device",
    "Fault",
    "Follows",
    "Limited",
    "Moving",
    "Nominal",
    "Signal",
    "kernel",
]

Function = TypeVar("Function", bound=Callable[..., object])

UNCORRECTED = ForceCorrection()
SITE = "device"  # the site of the faults of any device


def kernel(function: Function) -> Function:
    """Compile a function that a device's `step` calls.

    It is compiled in each process and not cached, because a user's file may import others that change.
    """
    return cast(Function, numba.njit(error_model="numpy", nogil=True)(function))


class Nominal(NamedTuple):
    """A nominal parameter of a device."""

    value: float
    unit: str
    says: str
    tolerance: float = 0.02  # relative; the default is that of a plan's parameters
    least: float = 0.0  # least value that a plan may give
    most: float | None = None  # largest value that a plan may give; None for any


class Fault(NamedTuple):
    """A fault that a device may have and no plan describes: an effect of the catalogue with one parameter.

    The fault `leak` is the effect `device.leak`, which a reality can hide and a diagnosis can name.
    """

    says: str  # its short description
    parameter: str  # name of its magnitude
    unit: str
    null: float  # the magnitude without the fault
    least: float
    most: float
    sizes: tuple[float, ...]  # magnitudes from barely visible to strong, from which a search starts
    reference: str = "the user's own kind"

    def effect(self, name: str) -> Effect:
        """The effect of the catalogue that gives a device this fault."""
        # imported here, because the catalogue imports the shipped kinds, which import this package
        from laboratories.effects.effect import Effect, Parameter

        parameter = Parameter(self.parameter, self.unit, self.null, self.least, self.most, self.sizes)
        laid = partial(_laid, name=name, parameter=self.parameter)
        return Effect(f"{SITE}.{name}", SITE, "physics", self.says, (parameter,), self.reference, laid)


def _laid(system: System, *, name: str, parameter: str, **given: float) -> System:
    """The system whose device has the fault `name` with the magnitude that its one parameter gives."""
    device = system.effects.device | {name: given[parameter]}
    return dataclasses.replace(system, effects=dataclasses.replace(system.effects, device=device))


class DeviceRecord(NamedTuple):
    """A device with its state, which its own kernel updates."""

    step: Any  # address of the compiled kernel
    parameters: Array  # interval s, the nominal parameters, then the faults, in the order of the class
    state: Array


def advance_device(lab: DeviceRecord, truth: Array, command: float, effort: float) -> None:
    """One interval of any device, by its own kernel."""
    lab.step(lab.parameters, lab.state, truth, command, effort)


@jit
def enter_device(lab: tuple[Any, ...], truth: Array, command: float, effort: float) -> None:
    """`advance_device` for a caller outside compiled code, which holds the device as `compiled.plain` gives it."""
    lab[0](lab[1], lab[2], truth, command, effort)


class Device(Kind):
    """Base of users' own kinds, which set `name`, `says`, `channels` and further attributes, and define `step`.

    `step(parameters, state, truth, command, effort)` is a static method that updates the device by one interval; it is
    compiled. `parameters` holds the interval (s), the values of `nominal` and then those of `faults`, each in the order
    of the class. `state` has `states` numbers, all zero at rest. `command` (m) is reached at the interval's end, and
    `effort` (N) is the motor's force. The readings of sensors without error at the interval's end must be written into
    `truth`, in the order of the measured channels.
    """

    follows: ClassVar[Follows] = Follows.DRIFT
    nominal: ClassVar[Mapping[str, Nominal]] = {}
    faults: ClassVar[Mapping[str, Fault]] = {}
    states: ClassVar[int] = 0
    rms: ClassVar[Mapping[str, float]] = {}  # nominal noise by measured channel
    most: ClassVar[Mapping[str, float]] = {}  # limits by signal, and by the names in `limited`
    stiffness: ClassVar[str] = (
        ""  # name of the nominal parameter for the device's stiffness, N/m; empty for none
    )
    damping: ClassVar[str] = ""  # name of that for its dashpot, N·s/m
    sites = (SITE,)
    record = DeviceRecord
    advance = staticmethod(advance_device)
    step: Callable[[Array, Array, Array, float, float], None]

    def __init_subclass__(cls) -> None:
        """Set defaults: channels with noise are checked for frozen sensors, and pictures show force over position."""
        if not isinstance(getattr(cls, "channels", None), Channels):
            return
        if "pictured" not in vars(cls):
            cls.pictured = usual(cls.channels)
        if "sensed" not in vars(cls):
            noisy = tuple(name for name in cls.channels.names if cls.rms.get(name, 0.0) > 0.0)
            cls.sensed = (Sensed(noisy, cls.channels.position),) if noisy else ()

    def move_by(self, kernel: Any) -> None:
        """Set the compiled `step`, which every laboratory of this kind uses from then on."""
        self._kernel = kernel

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Its faults as effects of the catalogue, in the order of the class."""
        return tuple(fault.effect(name) for name, fault in self.faults.items())

    def machines(self, plan: Plan) -> tuple[Machine, ...]:
        """The device with its nominal parameters."""
        first, *rest = super().machines(plan)
        return (first._replace(parameters=tuple(f"{SITE}.{name}" for name in self.nominal)), *rest)

    def planned(self, plan: Plan, name: str) -> float:
        """A nominal parameter as the plan or the class gives it."""
        return self.values(plan)[name.partition(".")[2]]

    def tolerance(self, plan: Plan, name: str) -> float:
        """The tolerance that the class gives to a nominal parameter."""
        return self.nominal[name.partition(".")[2]].tolerance

    def scaled(self, system: System, name: str, factor: float) -> System:
        """The system with a nominal parameter multiplied, within the bounds of the class."""
        key = name.partition(".")[2]
        one, value = self.nominal[key], factor * self.planned(system.plan, name)
        value = min(max(value, one.least), math.inf if one.most is None else one.most)
        return system.moved("device", parameters=dict(system.plan.device.parameters) | {key: value})

    def noisy(self, system: System, rms: Mapping[str, float]) -> System:
        """The system with the noise of measured channels replaced."""
        return system.moved("device", noise=dict(system.plan.device.noise) | dict(rms))

    def values(self, plan: Plan) -> dict[str, float]:
        """The nominal parameters by name: the class's, or the plan's where it gives them.

        Raises:
            InputError: the plan gives an unknown parameter, a value that is not a number, or one out of bounds.
        """
        where = "device.parameters"
        units = {name: one.unit for name, one in self.nominal.items()}
        given = self._given(plan.device.parameters, units, where)
        for name, value in given.items():
            one = self.nominal[name]
            rule = Rule(one.says, one.unit, least=one.least, most=one.most)
            in_range(value, rule, f"{name} in [{where}]")
        return {name: one.value for name, one in self.nominal.items()} | given

    def build(self, system: System) -> DeviceRecord:
        """The device of a system at rest."""
        values, faults = self.values(system.plan), system.effects.device
        laid = [faults.get(name, fault.null) for name, fault in self.faults.items()]
        row = [system.plan.test.interval, *values.values(), *laid]
        return DeviceRecord(self._kernel, np.array(row), np.zeros(self.states))

    def mover(self, lab: DeviceRecord) -> Callable[..., tuple[float, ...]]:
        """The readings of sensors without error one interval later, for a caller outside compiled code."""
        truth = np.empty(len(self.channels.names))
        move = bound(enter_device, lab, truth, 0.0, 0.0)

        def moved(command: float, effort: float = 0.0) -> tuple[float, ...]:
            move(truth, command, effort)
            return tuple(truth.tolist())

        return moved

    def coupling(self, plan: Plan) -> Coupling:
        """The coupling to the storey or floor that `[device]` gives."""
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
        """The compensator of `[device.compensator]`."""
        chosen = plan.device.compensator
        return Chosen(chosen.kind, chosen.parameters, "device.compensator")

    def noise(self, plan: Plan) -> Array:
        """The class's noise, or the plan's where it gives it."""
        units = {signal.name: signal.unit for signal in self.channels.measured}
        rms = dict(self.rms) | self._given(plan.device.noise, units, "device.noise")
        return np.array([rms.get(name, 0.0) for name in self.channels.names])

    def limits(self, plan: Plan) -> Mapping[str, float]:
        """The class's limits, or the plan's where it gives them.

        Where all laboratories are emulated, the class's limits on the rates of a command are infinite: after a pause of
        the machine the newest command is ahead by the motion of that pause.
        """
        channels, limited = self.channels, self.limited
        signals = (channels.target, channels.command, channels.effort, *channels.measured)
        units = {signal.name: signal.unit for signal in signals if signal}
        rates = (limited.step, limited.velocity, limited.acceleration, limited.effort_step, limited.error)
        units |= {
            name: unit for name, unit in zip(rates, ("m", "m/s", "m/s²", "N", "m"), strict=True) if name
        }
        free = dict.fromkeys(filter(None, rates), math.inf) if plan.eased else {}
        return dict(self.most) | free | self._given(plan.device.limits, units, "device.limits")

    def ramp(self, plan: Plan, last: tuple[float, ...], before: tuple[float, ...]) -> Ramp:
        """The ramp on which the command comes to a hold and then the device is unloaded."""
        force = self.channels.names.index(self.channels.force)
        rest = (0.0,) if self.channels.effort else ()
        return HoldRamp(plan, last, before, force, "device", "device", rest)

    def _given(self, table: Mapping[str, Any], units: Mapping[str, str], where: str) -> dict[str, float]:
        """The numbers of a table of the plan, whose names must be among `units`; raises InputError."""
        for name in table:
            if name not in units:
                raise InputError(f"Unknown key '{name}' in [{where}]: {nearest(name, units)}")
        return {
            name: as_type("float", value, f"{name} in [{where}]", units[name])
            for name, value in table.items()
        }
