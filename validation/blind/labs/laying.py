"""Effects as options: names, formulas and parameters that change a laboratory's true values."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from common.errors import InputError
from common.plan.schema import as_type, nearest

Values = dict[str, float]


class KnownEffect(NamedTuple):
    """An effect that a laboratory knows."""

    apply: Callable[..., None]  # takes the values to change and the parameters by name
    formulas: Mapping[str, int]  # codes by formula; the first is used where none is given
    place: str = ""  # name of the value that is set to the code


PLAIN = {"plain": 0}


def check(effects: object) -> list[dict[str, Any]]:
    """The tables of the option `effects`."""
    if not isinstance(effects, list | tuple) or not all(isinstance(item, Mapping) for item in effects):
        raise InputError("effects must be a list of tables with name, formula and parameters.")
    for item in effects:
        if not isinstance(item.get("name"), str):
            raise InputError(f"The name of an effect is {item.get('name')!r}, but must be a text.")
        for key in item:
            if key not in ("name", "formula", "parameters"):
                hint = nearest(str(key), ("name", "formula", "parameters"))
                raise InputError(f"Unknown key '{key}' of effect '{item['name']}': {hint}")
    return [dict(item) for item in effects]


def lay(values: Values, effects: Iterable[Mapping[str, Any]], known: Mapping[str, KnownEffect]) -> None:
    """Change values by effects; raises InputError where a name, formula or parameter is not known."""
    for item in effects:
        name = item["name"]
        if name not in known:
            raise InputError(f"Unknown effect '{name}' of this laboratory: {nearest(name, known)}")
        entry = known[name]
        formula = item.get("formula") or next(iter(entry.formulas))
        if formula not in entry.formulas:
            hint = nearest(str(formula), entry.formulas)
            raise InputError(f"Unknown formula '{formula}' of '{name}': {hint}")
        entry.apply(values, **parameters(name, item.get("parameters", {}), entry.apply))
        if entry.place:
            values[entry.place] = float(entry.formulas[formula])


def names(apply: Callable[..., None]) -> tuple[str, ...]:
    """The parameters of an effect; `signal` is bound already where it is one on a reading."""
    return tuple(
        item.name
        for item in inspect.signature(apply).parameters.values()
        if item.kind is inspect.Parameter.KEYWORD_ONLY and item.name != "signal"
    )


def parameters(name: str, given: object, apply: Callable[..., None]) -> Values:
    """The parameters of an effect, checked to be complete and known."""
    if not isinstance(given, Mapping):
        raise InputError(f"parameters of '{name}' must be a table.")
    known = names(apply)
    for key in given:
        if key not in known:
            raise InputError(f"Unknown parameter '{key}' of '{name}': {nearest(str(key), known)}")
    values = {key: as_type("float", value, f"{key} of '{name}'") for key, value in given.items()}
    for key in known:
        if key not in values and inspect.signature(apply).parameters[key].default is inspect.Parameter.empty:
            raise InputError(f"'{name}' needs the parameter {key}.")
    return values
