"""Fills dataclasses from TOML tables, and checks every key, type and range."""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
from collections.abc import Iterable, Mapping
from typing import Any, TypedDict, TypeVar, Unpack

from common.errors import PlanError
from common.plan.units import in_si

Table = TypeVar("Table")

Storeys = tuple[float, ...]
StoreysOrMatrix = tuple[Any, ...]  # one number per storey, or one row of a matrix


MODELS = ("kind", "model")  # keys of a table that choose which further parameters it has
NAME = "[a-z0-9_-]+"
PATTERNS = {NAME: "lower-case letters, digits, - and _"}  # the patterns in words for the user


@dataclasses.dataclass(frozen=True)
class Rule:
    """The text, the unit and the allowed range of a key."""

    text: str
    unit: str = ""
    above: float | None = None
    least: float | None = None
    most: float | None = None
    choices: tuple[str, ...] = ()
    pattern: str = ""
    infinite: bool = False

    def allowed(self) -> str:
        """The allowed range in words."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        if self.pattern:
            return PATTERNS[self.pattern]
        bounds = []
        if self.above is not None:
            bounds.append(f"above {self.above:g}")
        if self.least is not None:
            bounds.append(f"at least {self.least:g}")
        if self.most is not None:
            bounds.append(f"at most {self.most:g}")
        return " and ".join(bounds or ["finite"]) + (f" {self.unit}" if self.unit else "")

    def admits(self, value: float | str) -> bool:
        """Whether one value lies in the range."""
        if isinstance(value, str):
            return (not self.choices or value in self.choices) and bool(
                re.fullmatch(self.pattern or ".*", value)
            )
        return (
            not math.isnan(value)
            and (self.infinite or not math.isinf(value))
            and (self.above is None or value > self.above)
            and (self.least is None or value >= self.least)
            and (self.most is None or value <= self.most)
        )


class Allowed(TypedDict, total=False):
    """The fields of `Rule` that describe the allowed range of a key."""

    unit: str
    above: float
    least: float
    most: float
    choices: tuple[str, ...]
    pattern: str
    infinite: bool


def key(
    text: str,
    *,
    default: Any = dataclasses.MISSING,
    more: bool = False,
    **allowed: Unpack[Allowed],
) -> Any:
    """Field of a plan's table: a text for the reference, a default, and the allowed range.

    Without a default the key must be given. With `more`, the field is a dict that takes all other numbers of the table:
    the parameters of a model, which the model's registry checks.
    """
    rule = Rule(text, **allowed)
    metadata = {"rule": rule, "more": more}
    if isinstance(default, dict):
        return dataclasses.field(default_factory=default.copy, metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def inner(table: type[Any]) -> Any:
    """Field of a plan's table that is itself a table, with its defaults where the plan does not give it."""
    return dataclasses.field(default_factory=table, metadata={"table": table, "more": False})


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint with the known word nearest to `word`, or with all known words where none is near."""
    names = sorted(known)
    match = difflib.get_close_matches(word, names, n=1)
    return f"did you mean {match[0]}?" if match else "known here: " + ", ".join(names)


def fill(cls: type[Table], values: object, where: str) -> Table:
    """Instance of a table's dataclass from parsed TOML; `where` names the table in errors.

    Raises:
        PlanError: unknown key, wrong type, value out of range, or a key without a default that is not given.
    """
    if not isinstance(values, Mapping):
        raise PlanError(f"[{where}] must be a table, not {values!r}.")
    fields = {field.name.rstrip("_"): field for field in table_fields(cls)}
    open_to_more = next((field for field in fields.values() if field.metadata["more"]), None)
    given: dict[str, Any] = {open_to_more.name: {}} if open_to_more else {}
    for name, value in values.items():
        if name in fields and fields[name] is not open_to_more:
            given[fields[name].name] = convert(fields[name], value, where)
        elif open_to_more:
            given[open_to_more.name][name] = as_type("float", value, f"{name} in [{where}]", None)
        else:
            raise PlanError(f"Unknown key '{name}' in [{where}]: {nearest(str(name), fields)}")
    for name, field in fields.items():
        if required(field) and field.name not in given:
            raise PlanError(f"{name} is missing in [{where}], which has no default for it: give it.")
    return cls(**given)


def required(field: dataclasses.Field[Any]) -> bool:
    """Whether a key has no default, so that its table must give it."""
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def table_fields(cls: object) -> tuple[dataclasses.Field[Any], ...]:
    """The fields of a table's dataclass or of an instance of it."""
    return dataclasses.fields(cls)  # type: ignore[arg-type]


def convert(field: dataclasses.Field[Any], value: object, where: str) -> object:
    """One value, converted to the field's type and checked against its range."""
    if "table" in field.metadata:
        return fill(field.metadata["table"], value, f"{where}.{field.name}")
    rule: Rule = field.metadata["rule"]
    name = f"{field.name.rstrip('_')} in [{where}]"
    if (
        field.type == "StoreysOrMatrix"
        and isinstance(value, list)
        and any(isinstance(row, list) for row in value)
    ):
        return tuple(matrix_row(row, rule.unit, name) for row in value)
    if field.type in ("Storeys", "StoreysOrMatrix"):
        items = value if isinstance(value, list) else [value]
        return tuple(in_range(as_type("float", item, name, rule.unit), rule, name) for item in items)
    return in_range(as_type(str(field.type), value, name, rule.unit), rule, name)


def matrix_row(row: object, unit: str, name: str) -> Storeys:
    """One row of a matrix; its range is that of the whole matrix, which the plan checks."""
    if not isinstance(row, list):
        raise PlanError(
            f"{name} mixes rows and numbers: give one value per storey, or a matrix as a list of rows."
        )
    return tuple(in_range(as_type("float", item, name, unit), Rule(""), name) for item in row)


def as_type(kind: str, value: object, name: str, unit: str | None = "") -> Any:
    """`value` as a float, int, bool, str or table; a float may be given as an int or as a text with a unit.

    Such a text is converted to the SI `unit`. Raises PlanError where the value is of another type.
    """
    if kind == "float" and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if kind == "float" and isinstance(value, str):
        return in_si(value, unit, name)
    types: dict[str, type] = {"int": int, "str": str, "bool": bool}
    if kind in types and isinstance(value, types[kind]) and (kind == "bool" or not isinstance(value, bool)):
        return value
    if kind.startswith("dict") and isinstance(value, dict):
        return value
    words = {"float": "a number", "int": "a whole number", "str": "a text in quotes", "bool": "true or false"}
    raise PlanError(f"{name} must be {words.get(kind, 'a table')}, not {value!r}.")


def in_range(value: Any, rule: Rule, name: str) -> Any:
    """`value` itself, or a PlanError that names the allowed range and, for a choice, the nearest name."""
    if isinstance(value, int | float | str) and not isinstance(value, bool) and not rule.admits(value):
        if rule.pattern:
            raise PlanError(f"{name} is {value!r}: use {rule.allowed()}.")
        hint = nearest(value, rule.choices) if rule.choices and isinstance(value, str) else ""
        end = f"; {hint}" if hint.endswith("?") else f"{'; ' * bool(hint)}{hint}."
        raise PlanError(f"{name} is {value!r}, but must be {rule.allowed()}{end}")
    return value


def without_other_model(cls: object, entries: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """The entries of a table, of class `cls`, over which those that are given may be laid.

    Further parameters belong to the model of the entries: they go where another one is given.
    """
    if all(key not in given or given[key] == entries.get(key) for key in MODELS):
        return dict(entries)
    own = {field.name for field in table_fields(cls)}
    return {key: value for key, value in entries.items() if key in own}


def plain(table: Any) -> dict[str, Any]:
    """The values of a table's dataclass as nested values of TOML's types, defaults included."""
    result: dict[str, Any] = {}
    for field in table_fields(table):
        value = getattr(table, field.name)
        if field.metadata.get("more"):
            result |= value
            continue
        if value is None:  # a table that was not given
            continue
        if dataclasses.is_dataclass(value):
            value = plain(value)
        elif isinstance(value, tuple) and any(isinstance(row, tuple) for row in value):
            value = [list(row) for row in value]
        elif isinstance(value, tuple):
            value = value[0] if len(value) == 1 else list(value)
        result[field.name.rstrip("_")] = value
    return result
