"""The catalogue of unmodelled effects: one file each, in the folder of its site.

An effect consists of a file in the folder of its site, which the catalogue finds. The file defines `EFFECT`, or `FAULT`
for an effect that exists once per reading of any laboratory. The effects of a user's kind stand in its class.
"""

from __future__ import annotations

import math
import pkgutil
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from typing import Any

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.schema import Rule, nearest
from common.roles import MASTER
from laboratories.effects import reading, sites
from laboratories.effects.effect import Effect, Parameter
from laboratories.effects.reading import SIGNALS, ReadingFault
from laboratories.effects.sites import OF_TEST, SITES
from laboratories.kind import Kind
from laboratories.kinds import kind_of
from models.system import System

Entry = tuple[str, Mapping[str, float]]  # name of an effect, its parameters


def modules() -> Iterator[dict[str, Any]]:
    """The files in the folders of sites: of the whole test, then of each kind of laboratory."""
    for package in (__name__, "laboratories.column.effects", "laboratories.table.effects"):
        for folder in pkgutil.iter_modules(import_module(package).__path__, f"{package}."):
            if not folder.ispkg:
                continue
            for item in pkgutil.iter_modules(import_module(folder.name).__path__, f"{folder.name}."):
                yield vars(import_module(item.name))


FILES = tuple(modules())
FAULTS: tuple[ReadingFault, ...] = tuple(file["FAULT"] for file in FILES if "FAULT" in file)
"""The effects that any reading can have."""


def shipped() -> Iterator[Effect]:
    """The effects of all files, those on readings for the kinds that ship."""
    for file in FILES:
        if "FAULT" in file:
            fault: ReadingFault = file["FAULT"]
            yield from (fault.on(name, signal) for name, signal in SIGNALS.items() if fault.can_be_on(signal))
        else:
            yield file["EFFECT"]


CATALOGUE: dict[str, Effect] = {
    item.name: item for item in sorted(shipped(), key=lambda item: SITES.index(item.site))
}
"""Every effect that ships by its name, in the order of sites, within a site by the names of the files."""


def of_test() -> dict[str, Effect]:
    """The effects on the building and on the link, by name."""
    return {name: effect for name, effect in CATALOGUE.items() if effect.site in OF_TEST}


def of_kind(kind: Kind, plan: Plan) -> dict[str, Effect]:
    """The effects that a laboratory of a kind can have, by name; `plan` as the role that hosts it sees it."""
    places = sites.of_kind(kind)
    found = {name: effect for name, effect in CATALOGUE.items() if effect.site in places}
    found |= {effect.name: effect for effect in kind.effects}
    for name, size in readings_of(kind, plan).items():
        here = (fault.on(name, size) for fault in FAULTS if fault.can_be_on(size))
        found |= {effect.name: effect for effect in here if effect.name not in found}
    return dict(sorted(found.items(), key=lambda item: places.index(item[1].site)))


def readings_of(kind: Kind, plan: Plan) -> dict[str, reading.SensorSignal]:
    """The typical magnitudes of the measured channels of a kind, by name; `plan` as the role that hosts it sees it."""
    limits = kind.limits(plan)
    return {
        signal.name: reading.channel(signal.name, signal.unit, limits.get(signal.name, 0.0), float(noise))
        for signal, noise in zip(kind.channels.measured, kind.noise(plan), strict=True)
    }


def of_role(plan: Plan, role: str) -> dict[str, Effect]:
    """The effects that apply to the laboratory of a role, and before them those of the whole test, by name.

    Raises:
        InputError: the kind that the plan names cannot be loaded.
    """
    own = plan.kinds.get(role)
    return of_test() | (of_kind(kind_of(plan, role), plan.of(role)) if own else {})


def of_plan(plan: Plan) -> dict[str, Effect]:
    """The effects that the test of a plan can have, by name, in the order of its sites; raises InputError likewise."""
    order = sites.of_plan(plan)
    found: dict[str, Effect] = {}
    for role in (MASTER, *plan.roles):
        found = of_role(plan, role) | found
    kept = {name: effect for name, effect in found.items() if effect.site in order}
    places = {name: place for place, name in enumerate(CATALOGUE)}
    return dict(
        sorted(kept.items(), key=lambda item: (order.index(item[1].site), places.get(item[0], len(places))))
    )


def lay(system: System, entries: Sequence[Entry], known: Mapping[str, Effect] | None = None) -> System:
    """The system with effects applied in the order given; `known` are the possible effects, by default those that ship.

    Factors multiply and additions add, so that two of them accumulate; of effects that set a field the last one holds.

    Raises:
        InputError: an effect or a parameter is unknown, a parameter is missing or out of its bounds, or the plan's
            actuator is of a model that cannot have the effect.
    """
    catalogue = CATALOGUE if known is None else known
    for name, given in entries:
        if name not in catalogue:
            raise InputError(f"Unknown effect '{name}': {nearest(name, catalogue)}")
        effect = catalogue[name]
        if not effect.fits(system.plan):
            raise InputError(
                f"The effect '{name}' needs the actuator model '{' or '.join(effect.actuators)}', but the plan has "
                f"'{system.plan.actuator.model}': leave the effect out."
            )
        system = effect.apply(system, **checked(effect, given))
    return system


def checked(effect: Effect, given: Mapping[str, float]) -> dict[str, float]:
    """All parameters of an effect by name, with defaults for those not given.

    Raises:
        InputError: a parameter is unknown, missing, not a number or out of its bounds.
    """
    known = {item.name: item for item in effect.every}
    for name, value in given.items():
        if name not in known:
            raise InputError(f"Unknown parameter '{name}' of effect '{effect.name}': {nearest(name, known)}")
        if not admits(known[name], value):
            raise InputError(
                f"{name} of effect '{effect.name}' is {value!r}, but must be {allowed(known[name])}."
            )
    values = effect.values(given)
    for name, parameter in known.items():
        if name not in values and parameter not in effect.further:
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
