"""The catalogue of unmodelled effects: one file each, in the folder of its site.

A file in a site's folder is all that an effect needs: the catalogue finds it. It defines `EFFECT`, or `EFFECTS` where
one law exists once per signal.
"""

from __future__ import annotations

import math
import pkgutil
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module

from common.errors import InputError
from common.plan.schema import Rule, nearest
from laboratories.effects.effect import Effect, Parameter
from laboratories.effects.sites import SITES
from models.system import System

Entry = tuple[str, Mapping[str, float]]  # name of an effect, its parameters


def files() -> Iterator[Effect]:
    """The effects of all files in the folders of sites: of the whole test, then of each kind of laboratory."""
    for package in (__name__, "laboratories.column.effects", "laboratories.table.effects"):
        for folder in pkgutil.iter_modules(import_module(package).__path__, f"{package}."):
            if not folder.ispkg:
                continue
            for item in pkgutil.iter_modules(import_module(folder.name).__path__, f"{folder.name}."):
                module = vars(import_module(item.name))
                yield from module.get("EFFECTS") or (module["EFFECT"],)


CATALOGUE: dict[str, Effect] = {
    item.name: item for item in sorted(files(), key=lambda item: list(SITES).index(item.site))
}
"""Every effect by its name, in the order of sites, within a site by the names of the files."""


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
