"""A report read back from JSON: every key, type and range is checked, and an error is reported in one sentence."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from common.errors import InputError
from diagnosis.report.fields import Absent, Shape, fields, key, required, shapes
from diagnosis.report.records import Report

WORDS = {
    "number": "a number",
    "integer": "a whole number",
    "string": "a text",
    "list": "a list",
    "object": "an object",
    "entry": "an object",
}


def read(path: Path) -> Report:
    """The report in a file.

    Raises:
        InputError: the file cannot be read, is no JSON, or holds no report of this version.
    """
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read as a diagnosis report: {error}.") from None
    return report(values, str(path))


def report(values: object, name: str = "The report") -> Report:
    """The report that plain values hold; `name` says in errors where they come from.

    Raises:
        InputError: a key is missing or unknown, or a value is not what it must be.
    """
    try:
        found: Report = entry(Report, values, "")
    except ValueError as error:
        raise InputError(
            f"{name} is no diagnosis report: {error}; write one with rths diagnose --json."
        ) from None
    return found


def entry(cls: Any, values: object, place: str) -> Any:
    """An entry of a report from plain values; ValueError says what is wrong at `place`."""
    if not isinstance(values, Mapping):
        raise ValueError(f"{place or 'it'} must be an object")
    known = {key(field): field for field in fields(cls)}
    at = f"{place}." if place else ""
    for name in values:
        if name not in known:
            raise ValueError(f"{at}{name} is unknown")
    given = {}
    for name, field in known.items():
        if name not in values:
            if required(field):
                raise ValueError(f"{at}{name} is missing")
            continue
        found = values[name]
        if found == {} and field.metadata["absent"] is Absent.EMPTY:
            found = None
        given[field.name] = value(shapes(cls)[field.name], found, f"{at}{name}")
    return cls(**given)


def value(shape: Shape, given: object, place: str) -> Any:
    """A value of a field from plain values."""
    if given is None and shape.nullable:
        return None
    if shape.kind == "entry":
        return entry(shape.entry, given, place)
    if shape.kind == "list":
        return items(shape, given, place)
    if shape.kind == "object":
        return members(shape, given, place)
    if shape.kind == "choice":
        if given not in shape.choices:
            raise ValueError(f"{place} must be one of {', '.join(map(str, shape.choices))}, not {given!r}")
        return given
    return single(shape, given, place)


def items(shape: Shape, given: object, place: str) -> tuple[Any, ...]:
    """The items of a list."""
    if not isinstance(given, list | tuple) or shape.item is None:
        raise ValueError(f"{place} must be a list")
    if shape.length not in (None, len(given)) or len(given) < shape.rule.fewest:
        raise ValueError(f"{place} must hold {shape.length or f'at least {shape.rule.fewest}'} values")
    return tuple(value(shape.item, item, f"{place}[{number}]") for number, item in enumerate(given))


def members(shape: Shape, given: object, place: str) -> dict[str, Any]:
    """The members of an object whose names are free."""
    if not isinstance(given, Mapping) or shape.item is None:
        raise ValueError(f"{place} must be an object")
    return {str(name): value(shape.item, item, f"{place}.{name}") for name, item in given.items()}


def single(shape: Shape, given: object, place: str) -> float | int | str:
    """A number or a text within its rule."""
    rule = shape.rule
    if shape.kind == "boolean":
        if not isinstance(given, bool):
            raise ValueError(f"{place} must be true or false, not {given!r}")
        return given
    if isinstance(given, str) and shape.kind == "string":
        if not re.fullmatch(rule.pattern or ".*", given, re.DOTALL):
            raise ValueError(f"{place} cannot be {given!r}")
        return given
    kinds: tuple[type, ...] = {"number": (int, float), "integer": (int,)}.get(shape.kind, ())
    if not isinstance(given, kinds) or isinstance(given, bool) or not math.isfinite(given):  # type: ignore[arg-type]
        raise ValueError(f"{place} must be {WORDS[shape.kind]}, not {given!r}")
    number: float | int = given  # type: ignore[assignment]
    if (rule.least is not None and number < rule.least) or (rule.most is not None and number > rule.most):
        raise ValueError(f"{place} must lie from {rule.least:g} to {rule.most:g}, not be {number!r}")
    return float(number) if shape.kind == "number" else number
