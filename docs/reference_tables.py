"""The reference pages from the code's own tables: keys of a plan, commands, effects, methods, exit codes."""

from __future__ import annotations

import argparse
import ast
import dataclasses
import inspect
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, get_type_hints

from common import errors
from common.plan.patience import FIGURES
from common.plan.plan import TABLES, Plan
from common.plan.schema import Rule, required, table_fields
from common.udp import packets
from common.udp.packets import Field
from diagnosis.report import schema
from docs.markdown import quantity, table
from laboratories.effects import CATALOGUE
from laboratories.effects.effect import Effect, Parameter
from laboratories.effects.reading import SIGNALS
from laboratories.effects.sites import SITES
from laboratories.kinds import KINDS
from models.compensators import COMPENSATORS
from models.ground_motion import MOTIONS
from models.integrators import INTEGRATORS
from models.specimens import SPECIMENS
from rths.__main__ import EXAMPLES, VERBS, parser_for

ROOT = Path(__file__).resolve().parent.parent
NO_ROOMS = frozenset({"tests", "docs"})
EASED = "; larger with [emulated laboratories](../explanation/safety.md#emulated-laboratories)"
KEY_HEAD = ("key", "default", "unit", "allowed", "meaning")
TYPES = {
    "float": "number",
    "int": "whole number",
    "str": "text",
    "bool": "true or false",
    "Storeys": "number, or one per storey",
    "StoreysOrMatrix": "matrix; or number, or one per storey",
}


def plan() -> str:
    """Every table of a plan with its keys."""
    shared = Plan()
    names = list(TABLES)
    return "\n".join(text for name in names for text in plan_table(name, getattr(shared, name)))


def plan_table(name: str, values: Any) -> list[str]:
    """A table of the plan and the tables within it."""
    fields = table_fields(values)
    rows = [key_row(field, getattr(values, field.name)) for field in fields if "rule" in field.metadata]
    rows = [(*row[:-1], row[-1] + EASED * (f"{name}.{row[0].strip('`')}" in FIGURES)) for row in rows]
    text = f"## `[{name}]`\n\n{inspect.getdoc(type(values))}\n\n{table(KEY_HEAD, rows)}"
    inner = {
        field.name: getattr(values, field.name) or blank(field.metadata["table"])
        for field in fields
        if "table" in field.metadata
    }
    own = [text] if rows else []
    return own + [part for field, within in inner.items() for part in plan_table(f"{name}.{field}", within)]


def blank(cls: type[Any]) -> Any:
    """A table that is absent unless it is given, None for the keys that it must have then."""
    return cls(**{field.name: None for field in table_fields(cls) if required(field)})


def key_row(field: dataclasses.Field[Any], default: Any) -> tuple[str, ...]:
    """One key; those that a model takes beside its name share one row."""
    rule: Rule = field.metadata["rule"]
    if field.metadata["more"]:
        given = ", ".join(f"`{name} = {value:g}`" for name, value in default.items())
        return ("further numbers", given, "", "", rule.text)
    kind = "a table" if isinstance(default, dict) else TYPES[str(field.type)]
    kind = "" if rule.pattern else kind
    return (
        f"`{field.name.rstrip('_')}`",
        "must be given" if required(field) else quantity(default),
        rule.unit,
        f"{kind}{bounds(rule)}".removeprefix(", "),
        rule.text,
    )


def bounds(rule: Rule) -> str:
    """The range of a value after its type; empty where any will do."""
    words = dataclasses.replace(rule, unit="").allowed()
    ends = "" if words == "finite" else f", {words}"
    return f"{ends}, or inf" if rule.infinite else ends


def commands() -> str:
    """All commands in a table, then each with its options and an example."""
    rows = ((f"[`rths {verb}`](#rths-{verb})", text) for verb, text in VERBS.items())
    return "\n".join([table(("command", "does"), rows), *map(command, VERBS)])


def command(verb: str) -> str:
    """One command: what it does, its arguments and options, an example."""
    parser = parser_for(verb)
    actions = [action for action in parser._actions if action.dest != "help"]
    words = [f"rths {verb}", *(usage(action) for action in actions if not action.option_strings)]
    words += ["[options]"] if any(action.option_strings for action in actions) else []
    rows = ((f"`{spelled(action)}`", default(action), said(action)) for action in actions)
    options = table(("argument or option", "default", "meaning"), rows) if actions else ""
    text = (
        f"## `rths {verb}`\n\n{VERBS[verb][0].upper()}{VERBS[verb][1:]}: `{' '.join(words)}`\n\n{options}\n"
    )
    return f"{text}Example: `{EXAMPLES[verb]}`\n"


def usage(action: argparse.Action) -> str:
    """A positional argument as the usage shows it."""
    name = str(action.metavar or action.dest)
    return f"[{name}]" if action.nargs == "?" else name


def spelled(action: argparse.Action) -> str:
    """How an argument or option is given."""
    names = ", ".join(action.option_strings) or str(action.metavar or action.dest)
    takes = action.option_strings and action.nargs != 0
    choices = f"{{{','.join(map(str, action.choices))}}}" if action.choices else ""
    value = action.metavar or choices or action.dest.upper()
    return f"{names} {value}" if takes else names


def default(action: argparse.Action) -> str:
    """The default value as a text, where there is one."""
    plain = action.default is None or isinstance(action.default, bool) or action.default in ("", [])
    return "" if plain or action.default is argparse.SUPPRESS else f"`{action.default}`"


def said(action: argparse.Action) -> str:
    """The help of an argument or option."""
    return str(action.help or "").replace("<", "&lt;")


def effects() -> str:
    """The catalogue by site; effects on readings once, as they exist for every signal."""
    texts = [f"## {site.capitalize()}\n\n{effect_table(of_site(site))}" for site in SITES if "." not in site]
    names = ", ".join(f"`{name}`" for name in SIGNALS)
    table_ = effect_table(of_any_signal(), sized=False)
    return "\n".join([*texts, f"## Sensors\n\n`<signal>` is one of {names}.\n\n{table_}"])


def of_site(site: str) -> list[Effect]:
    """The effects at one site, in the catalogue's order."""
    return [effect for effect in CATALOGUE.values() if effect.site == site]


def of_any_signal() -> list[Effect]:
    """The effects on readings as the reference lists them for all: with `<signal>` and "its unit"."""
    having: dict[str, list[tuple[str, Effect]]] = {}
    for signal in SIGNALS:
        for effect in of_site(f"sensor.{signal}"):
            having.setdefault(effect.fault, []).append((signal, effect))
    return [generic(found) for _, found in sorted(having.items())]


def generic(found: Sequence[tuple[str, Effect]]) -> Effect:
    """An effect on readings for all signals that can have it, with their names."""
    signal, effect = found[0]
    unit = SIGNALS[signal].unit
    units = {unit: "its unit", f"{unit}/s": "its unit/s"}
    parameters = (dataclasses.replace(item, unit=units.get(item.unit, item.unit)) for item in effect.every)
    some = ", ".join(f"`{name}`" for name, _ in found)
    return dataclasses.replace(
        effect,
        name=effect.name.replace(signal, "<signal>"),
        says=effect.says + (f": {some}" if len(found) < len(SIGNALS) else ""),
        parameters=tuple(parameters),
        further=(),
    )


def effect_table(found: Iterable[Effect], *, sized: bool = True) -> str:
    """Effects with their parameters; `sized` with the values from barely visible to strong."""
    rows = []
    for effect in found:
        for place, parameter in enumerate(effect.every):
            of = f", of the actuator `{'` or `'.join(effect.actuators)}`" if effect.actuators else ""
            first = (f"`{effect.name}`", effect.says + of) if place == 0 else ("", parameter.says)
            rows.append((*first, f"`{parameter.name}`", parameter.unit, *numbers(parameter, sized)))
    head = ("effect", "says", "parameter", "unit", "none at", "allowed")
    return table((*head, "from barely visible to strong") if sized else head, rows)


def numbers(parameter: Parameter, sized: bool) -> tuple[str, ...]:
    """Null value, bounds and sizes of a parameter."""
    null = f"default {quantity(parameter.default)}" if parameter.shape else quantity(parameter.null)
    allowed = f"{quantity(parameter.least)} to {quantity(parameter.most)}"
    sizes = ", ".join(map(quantity, parameter.sizes))
    return (null, allowed, sizes) if sized else (null, allowed)


def compensators() -> str:
    """Every compensator with its parameters."""
    return methods({name: (method.params, method.rules) for name, method in COMPENSATORS.items()}, "##")


def specimens() -> str:
    """Every force-deformation model with its parameters."""
    return methods({name: (model.params, model.rules) for name, model in SPECIMENS.items()}, "###")


def methods(found: Mapping[str, tuple[type[Any], Mapping[str, Rule]]], level: str) -> str:
    """Methods with what their file says of them first, and the parameters they take."""
    texts = []
    for name, (params, rules) in found.items():
        defaults = params._field_defaults
        rows = [
            (
                f"`{field}`",
                quantity(defaults[field]) if field in defaults else "",
                rules[field].unit,
                bounds(rules[field]).removeprefix(", "),
                rules[field].text,
            )
            for field in get_type_hints(params)
        ]
        given = table(KEY_HEAD, rows) if rows else "No parameters.\n"
        texts.append(f"{level} `{name}`\n\n{first_line(params)}\n\n{given}")
    return "\n".join(texts)


def first_line(params: type[Any]) -> str:
    """What the file of a method says of it first."""
    return (sys.modules[params.__module__].__doc__ or "").splitlines()[0]


def integrators() -> str:
    """The integration methods with what they claim."""
    rows = [
        (
            f"`{method.name}`",
            str(method.order),
            method.stability,
            ", ".join(f"`{name}`" for name in method.options),
        )
        for method in INTEGRATORS.values()
    ]
    return table(("method", "order", "stability", "further keys of `[structure]`"), rows)


def motions() -> str:
    """The records that ship."""
    rows = ((f"`{name}`", motion.name, motion.version) for name, motion in MOTIONS.items())
    return table(("record", "earthquake", "version"), rows)


def packet(fields: Sequence[Field]) -> str:
    """The bytes of a packet."""
    rows, place = [], 0
    for field in fields:
        size = packets.layout([field]).size
        rows.append((str(place), str(size), f"`{field.name}`", field.kind, field.text))
        place += size
    return table(("from byte", "bytes", "field", "type", "says"), rows)


def numbered(texts: Iterable[str]) -> str:
    """Words by their numbers, from 0."""
    return table(("number", "says"), ((str(number), text) for number, text in enumerate(texts)))


def channels() -> str:
    """Commands and measurements of the kinds that ship, with the number of their channels."""
    rows = []
    for name, kind in KINDS.items():
        driving = [kind.channels.command, *([kind.channels.effort] if kind.channels.effort else [])]
        told, read = (
            ", ".join(f"`{row.name}` {row.unit}" for row in part)
            for part in (driving, kind.channels.measured)
        )
        rows.append((f"`{name}`", told, read, f"`{packets.number(kind.channels):#010x}`"))
    return table(("kind", "commands", "measured", "`channels`"), rows)


def exits() -> str:
    """The classes of errors with their exit codes."""
    found = [
        kind
        for kind in vars(errors).values()
        if isinstance(kind, type) and issubclass(kind, errors.RthsError)
    ]
    rows = (
        (str(kind.exit_code), f"`{kind.__name__}`", (kind.__doc__ or "").splitlines()[0]) for kind in found
    )
    return table(("exit", "class in `common.errors`", "says"), sorted(rows))


def budget() -> str:
    """The text of the shipped latency budget."""
    from report.budget.limits import DEFAULT

    return f"```toml\n{DEFAULT.read_text(encoding='utf-8')}```\n"


def rooms() -> str:
    """Every package outside the tests with the first sentence of its own text."""
    files = (path for top in ROOT.glob("[a-z]*/__init__.py") for path in top.parent.rglob("__init__.py"))
    files = (path for path in files if path.relative_to(ROOT).parts[0] not in NO_ROOMS)
    rows = ((f"`{path.parent.relative_to(ROOT)}/`", first_sentence(path)) for path in sorted(files))
    return table(("folder", "holds"), rows)


def first_sentence(path: Path) -> str:
    """The first line of the text that a file begins with."""
    return (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").splitlines()[0]


def report() -> str:
    """The records of a diagnosis report, each with its keys."""
    found = schema.schema()
    records = {"Report": found} | found["$defs"]
    texts = []
    for name, record in records.items():
        rows = (
            (
                f"`{key}`",
                kind(value),
                "" if key in record["required"] else "may be absent",
                value["description"],
            )
            for key, value in record["properties"].items()
        )
        texts.append(
            f"## {name}\n\n{record['description']}\n\n{table(('key', 'holds', '', 'meaning'), rows)}"
        )
    return "\n".join(texts)


def kind(value: dict[str, Any]) -> str:
    """What a JSON schema lets a value be, in words."""
    if "anyOf" in value:
        return " or ".join(kind(item) for item in value["anyOf"])
    if "$ref" in value:
        name = value["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "const" in value or "enum" in value:
        return ", ".join(f"`{item}`" for item in value.get("enum", [value.get("const")]))
    types = value["type"] if isinstance(value["type"], list) else [value["type"]]
    if "array" in types:
        return " or ".join([several(value), *types[1:]])
    if "additionalProperties" in value:
        return f"object of {kind(value['additionalProperties'])}"
    return "empty object" if types == ["object"] else " or ".join(types)


NAMES = {"number": "numbers", "string": "texts"}


def several(value: dict[str, Any]) -> str:
    """A list of a JSON schema in words; its numbers may be null."""
    items = value["items"]
    if items.get("type") == "array":
        return f"list of {several(items).replace('pair', 'pairs', 1).replace('list', 'lists', 1)}"
    single = items["type"][0] if isinstance(items.get("type"), list) else items.get("type")
    inner = NAMES[single] if single in NAMES else kind(items)
    return f"{'pair' if 'maxItems' in value else 'list'} of {inner}"
