"""Checks whether a class of a user's is a complete kind of laboratory, and compiles its kernel.

Before a plan may use it, the kernel is run with its nominal parameters on arrays between guard numbers: compiled code
that writes beyond its arrays would otherwise crash the process or change other data without any error.
"""

from __future__ import annotations

import inspect
import linecache
import math
import re
from collections.abc import Callable, Iterable
from typing import Any

import numba
import numpy as np
from numba import types

from common import blame
from common.errors import InputError
from common.protocol.messages import MOST_CHANNELS
from common.signals import BUILDING, MODE, NUMERICAL, Channels
from laboratories.device import Device
from models.compiled import jit_apart
from models.registry import Array

VECTOR = types.float64[::1]
KERNEL = types.void(VECTOR, VECTOR, VECTOR, types.float64, types.float64)
"""Signature of a device's `step`: parameters, state, truth, command (m), effort (N)."""

WORD = re.compile(r"[a-z][a-z0-9_]*")
# names of other signals in the topics that record a laboratory's channels
TAKEN = frozenset(signal.name for signal in (*BUILDING, NUMERICAL, MODE)) | {"command_seq"}
BESIDE = 64  # guard numbers on each side of an array: a wrong index is found up to this many places beyond it
# the trial: one period of a sine of 1 mm
INTERVAL = 2e-3  # s, the default control interval
TICKS = 250  # one period of 0.5 s, that of the default building
REACH = 1e-3  # m: small, so that a correct device does not reach its stops


def complete(kind: Device, where: str) -> None:
    """Compile the kernel of a user's kind; raises InputError where the class is not a complete kind."""
    if wrong := complaint(kind):
        raise InputError(f"{called(kind)} named in {where} {wrong}.")
    kind.move_by(compiled(kind, where))


def complaint(kind: Device) -> str:
    """What is wrong with the attributes of a user's kind, as the end of a sentence; empty where nothing is."""
    lacking = [name for name in ("name", "says", "channels", "step") if not hasattr(kind, name)]
    if lacking:
        return f"lacks {', '.join(lacking)}"
    if not isinstance(kind.channels, Channels):
        return f"has channels of the class {type(kind.channels).__name__}, but must have laboratories.device.Channels"
    if not isinstance(kind.states, int) or kind.states < 0:
        return f"has states = {kind.states!r}, but must have the number of its states"
    return of_names(kind) or of_channels(kind) or of_tables(kind)


def of_names(kind: Device) -> str:
    """Complaint about the names of signals, parameters and faults."""
    channels = kind.channels
    signals = [channels.target.name, *channels.drives, *channels.names]
    for name in (kind.name, *signals, *kind.nominal, *kind.faults):
        if not isinstance(name, str) or not WORD.fullmatch(name):
            return f"has the name {name!r}, but a name begins with a letter and has small letters, digits and _ only"
    for place, name in enumerate(signals):
        if name in TAKEN or name in signals[:place] or name in channels.rates:
            return f"has a signal '{name}', which is the name of another signal of the recording: rename it"
    both = sorted(kind.nominal.keys() & kind.faults.keys())
    return f"has '{both[0]}' in nominal and in faults: rename one of them" if both else ""


def of_channels(kind: Device) -> str:
    """Complaint about the number of measured channels, or about the names of the position and the force."""
    names = kind.channels.names
    if not 1 <= len(names) <= MOST_CHANNELS:
        return f"measures {len(names)} channels, but must measure 1 to {MOST_CHANNELS}"
    for role in ("position", "force"):
        given = getattr(kind.channels, role)
        if given not in names:
            return f"has '{given}' for its {role}, but must name a measured channel: {', '.join(names)}"
    return ""


def of_tables(kind: Device) -> str:
    """Complaint about nominal parameters, noise, limits and faults, or about names in them that are unknown."""
    channels = kind.channels
    limits = (*(name for name in (*kind.limited,) if name), channels.target.name, *channels.drives)
    for table, known in (("rms", channels.names), ("most", (*channels.names, *limits))):
        if strange := [name for name in getattr(kind, table) if name not in known]:
            return f"has '{strange[0]}' in {table}, but may have there only {', '.join(known)}"
    for attribute in ("stiffness", "damping"):
        if (given := getattr(kind, attribute)) and given not in kind.nominal:
            return f"has {attribute} = '{given}', which is no parameter in nominal: {', '.join(kind.nominal)}"
    for name, fault in kind.faults.items():
        if not fault.least <= fault.null <= fault.most or not all(
            fault.least <= size <= fault.most and size != fault.null for size in fault.sizes
        ):
            return f"has a fault '{name}' whose null or sizes are outside least and most, or a size equal to its null"
        if not fault.sizes:
            return f"has a fault '{name}' without sizes, from which a search starts"
    return ""


def compiled(kind: Device, where: str) -> Any:
    """The kernel of a kind, compiled and tested; raises InputError where it cannot be used."""
    step = type(kind).step
    try:
        kernel = numba.cfunc(KERNEL, error_model="numpy")(step)
    except Exception as error:  # Numba lets exceptions of all its parts through
        raise InputError(
            f"step of {type(kind).__name__} named in {where} cannot be compiled ({place(step, error)}): "
            f"{reason(error)}."
        ) from None
    if wrong := misbehaviour(kind, kernel):
        raise InputError(f"step of {called(kind)} named in {where} {wrong}.")
    return kernel


def called(kind: Device) -> str:
    """A kind's class and its file, for errors."""
    return f"{type(kind).__name__} ({blame.source_of(type(kind)) or 'no file'})"


def place(step: Callable[..., Any], error: Exception) -> str:
    """File, line and text of the code that cannot be compiled: as Numba reports it, or the kernel's beginning."""
    location = getattr(error, "loc", None)
    code = inspect.unwrap(step).__code__
    file, line = (location.filename, location.line) if location else (code.co_filename, code.co_firstlineno)
    text = linecache.getline(file, line).strip()
    return f"{file}, line {line}: {text}" if text else f"{file}, line {line}"


def reason(error: Exception) -> str:
    """The first line of Numba's message that describes the user's code."""
    words = ("Failed in ", "During: ")
    lines = [line.strip() for line in str(error).splitlines() if line.strip() and not line.startswith(words)]
    return lines[0].rstrip(".:") if lines else type(error).__name__


def misbehaviour(kind: Device, kernel: Any) -> str:
    """What a kernel does wrong along a sine from rest, as the end of a sentence; empty where nothing is."""
    row = (
        INTERVAL,
        *(one.value for one in kind.nominal.values()),
        *(one.null for one in kind.faults.values()),
    )
    arrays = [padded(row), padded([0.0] * kind.states), padded([math.nan] * len(kind.channels.names))]
    inner = [array[BESIDE : array.size - BESIDE] for array in arrays]
    before = [array.copy() for array in arrays]
    parameters, state, truth = inner
    driven(kernel, parameters, state, truth, REACH, TICKS)
    for name, array, old in zip(("parameters", "state", "truth"), arrays, before, strict=True):
        changed = np.flatnonzero(array.view(np.int64) != old.view(np.int64)) - BESIDE
        size = array.size - 2 * BESIDE
        if np.any((changed < 0) | (changed >= size)):
            return f"writes beyond the {size} numbers of {name}"
        if name == "parameters" and changed.size:
            return f"changes parameters[{changed[0]}], which it may only read"
    return of_truth(kind, truth)


@jit_apart
def driven(step: Any, parameters: Array, state: Array, truth: Array, reach: float, ticks: int) -> None:
    """Run a kernel along one period of a sine of `reach` m."""
    for tick in range(ticks):
        step(parameters, state, truth, reach * math.sin(2.0 * math.pi * (tick + 1) / ticks), 0.0)


def of_truth(kind: Device, truth: Array) -> str:
    """Complaint about a channel to which the trial has written no finite number."""
    for place_, name in enumerate(kind.channels.names):
        if not math.isfinite(truth[place_]):
            return f"sets {name} (truth[{place_}]) to no finite number along a sine of 1 mm with the nominal parameters"
    return ""


def padded(values: Iterable[float]) -> Array:
    """The values between guards of NaN, so that a kernel that reads beyond its arrays gives NaN."""
    beside = [math.nan] * BESIDE
    return np.array([*beside, *values, *beside])
