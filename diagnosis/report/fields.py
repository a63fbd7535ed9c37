"""How the fields of a report are described: text, unit, what a value must fulfil, and what JSON holds for None."""

from __future__ import annotations

import dataclasses
import enum
import functools
from collections.abc import Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints


class Absent(enum.Enum):
    """What JSON holds where a field is None."""

    NULL = "null"
    LEFT_OUT = "the key is left out"
    EMPTY = "an object without keys"


@dataclasses.dataclass(frozen=True)
class FieldRule:
    """What a value must fulfil beside its type."""

    least: float | None = None
    most: float | None = None
    pattern: str = ""
    fewest: int = 0  # items of a list


Number = float | None  # None: not determined
Ends = tuple[Number, Number]  # of an interval, lower and upper
Series = tuple[Number, ...]
Share = Annotated[Number, FieldRule(least=0.0, most=1.0)]
PLACE = r"ground|structure|actuator|column|link|table|damper|device|sensor\.[a-z][a-z0-9_]*"
# the laboratory stands before it where two of a report have that site
Site = Annotated[str, FieldRule(pattern=rf"^((master|slave(\.[a-z][a-z0-9_]*)?)\.)?({PLACE})$")]
EffectName = Annotated[str, FieldRule(pattern=r"^[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)+$")]


def noted(
    text: str, *, unit: str = "", absent: Absent = Absent.NULL, default: Any = dataclasses.MISSING
) -> Any:
    """Field of a report with its description; one without a default must be given, also in JSON."""
    metadata = {"text": text, "unit": unit, "absent": absent}
    if isinstance(default, dict):
        return dataclasses.field(default_factory=default.copy, metadata=metadata)
    if isinstance(default, type):
        return dataclasses.field(default_factory=default, metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


class Entry:
    """A part of the report: a frozen dataclass whose fields are `noted`."""

    def plain(self) -> dict[str, Any]:
        """The values as JSON holds them: dicts, lists, numbers, texts, None."""
        found = ((field, getattr(self, field.name)) for field in fields(type(self)))
        return {
            key(field): {} if value is None and field.metadata["absent"] is Absent.EMPTY else plain(value)
            for field, value in found
            if value is not None or field.metadata["absent"] is not Absent.LEFT_OUT
        }


def plain(value: Any) -> Any:
    """A value of a field as JSON holds it."""
    if isinstance(value, Entry):
        return value.plain()
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, tuple) else value


def fields(entry: Any) -> tuple[dataclasses.Field[Any], ...]:
    """The fields of an entry's class."""
    return dataclasses.fields(entry)


def key(field: dataclasses.Field[Any]) -> str:
    """A field's name in JSON; one that is a word of Python ends with an underscore here."""
    return field.name.rstrip("_")


def required(field: dataclasses.Field[Any]) -> bool:
    """Whether a field has no default, so that JSON must give it."""
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


@dataclasses.dataclass(frozen=True)
class Shape:
    """The type of a field, taken apart."""

    kind: Literal["number", "integer", "string", "boolean", "choice", "entry", "list", "object"]
    nullable: bool = False
    item: Shape | None = None  # of a list or an object
    length: int | None = None  # of a list, None: any
    entry: Any = None  # the class of an entry
    choices: tuple[Any, ...] = ()
    rule: FieldRule = FieldRule()


PLAIN: dict[Any, Literal["number", "integer", "string", "boolean"]] = {
    float: "number",
    int: "integer",
    str: "string",
    bool: "boolean",
}


def shape(hint: Any) -> Shape:
    """A type, taken apart."""
    origin, args = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return dataclasses.replace(shape(args[0]), rule=args[1])
    if origin in (Union, UnionType):
        (inner,) = (item for item in args if item is not NoneType)
        return dataclasses.replace(shape(inner), nullable=True)
    if origin is Literal:
        return Shape("choice", choices=args)
    if origin is tuple:
        return Shape("list", item=shape(args[0]), length=None if args[1] is Ellipsis else len(args))
    if origin is Mapping:
        return Shape("object", item=shape(args[1]))
    return Shape(PLAIN[hint]) if hint in PLAIN else Shape("entry", entry=hint)


@functools.cache
def shapes(entry: Any) -> dict[str, Shape]:
    """The shape of every field of an entry's class, by its name in Python."""
    hints = get_type_hints(entry, include_extras=True)
    return {field.name: shape(hints[field.name]) for field in fields(entry)}
