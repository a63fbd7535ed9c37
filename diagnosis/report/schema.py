"""The JSON schema of a report, made from the records; `python -m docs.generate` writes it to schema.json."""

from __future__ import annotations

import inspect
import json
from pathlib import Path
from typing import Any

from diagnosis.report.fields import Absent, FieldRule, Shape, fields, key, required, shapes
from diagnosis.report.records import Report

PUBLISHED = Path(__file__).with_name("schema.json")


def schema() -> dict[str, Any]:
    """The schema (draft 2020-12) of version 2."""
    definitions: dict[str, Any] = {}
    whole = described(Report, definitions)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "urn:rths:diagnosis-report:2",
        "title": "Diagnosis report of rths, version 2",
        **whole,
        "description": f"{whole['description']} SI units. null: not determined.",
        "$defs": dict(sorted(definitions.items())),
    }


def text() -> str:
    """The text of the published schema."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


def described(cls: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    """The schema of an entry's class; those of the entries within it are added to the definitions."""
    properties = {}
    for field in fields(cls):
        unit = field.metadata["unit"]
        found = allowed(shapes(cls)[field.name], definitions, field.metadata["absent"])
        said = field.metadata["text"] + (f" ({unit})" if unit else "")
        properties[key(field)] = {"description": said, **found}
    return {
        "description": inspect.cleandoc(cls.__doc__ or "").partition("\n")[0],
        "type": "object",
        "properties": properties,
        "required": [key(field) for field in fields(cls) if required(field)],
        "additionalProperties": False,
    }


def allowed(shape: Shape, definitions: dict[str, Any], absent: Absent = Absent.NULL) -> dict[str, Any]:
    """What a value of this shape may be."""
    whole = bare(shape, definitions)
    if not shape.nullable or absent is Absent.LEFT_OUT:
        return whole
    if absent is Absent.EMPTY:
        return {"anyOf": [whole, {"type": "object", "maxProperties": 0}]}
    if "type" in whole:
        return whole | {"type": [whole["type"], "null"]}
    return {"anyOf": [whole, {"type": "null"}]}


def bare(shape: Shape, definitions: dict[str, Any]) -> dict[str, Any]:
    """What a value of this shape may be, null aside."""
    if shape.kind == "entry":
        name = shape.entry.__name__
        if name not in definitions:
            definitions[name] = {}  # an entry may hold others of its class
            definitions[name] = described(shape.entry, definitions)
        return {"$ref": f"#/$defs/{name}"}
    if shape.kind == "choice":
        return {"const": shape.choices[0]} if len(shape.choices) == 1 else {"enum": list(shape.choices)}
    if shape.kind == "object" and shape.item is not None:
        return {"type": "object", "additionalProperties": allowed(shape.item, definitions)}
    if shape.kind == "list" and shape.item is not None:
        return {"type": "array", "items": allowed(shape.item, definitions), **sizes(shape)}
    return {"type": shape.kind, **bounds(shape.rule)}


def sizes(shape: Shape) -> dict[str, int]:
    """How many items a list holds."""
    if shape.length is not None:
        return {"minItems": shape.length, "maxItems": shape.length}
    return {"minItems": shape.rule.fewest} if shape.rule.fewest else {}


def bounds(rule: FieldRule) -> dict[str, Any]:
    """The rule of a number or a text."""
    found = {"minimum": rule.least, "maximum": rule.most, "pattern": rule.pattern or None}
    return {name: value for name, value in found.items() if value is not None}
