"""The generated parts of the documents agree with the code."""

from __future__ import annotations

import ast
import dataclasses
import math
import random
import re

import pytest

from common.lab import preflight
from common.plan.patience import strict
from common.plan.plan import Plan
from common.plan.tables import Limits
from common.protocol.exchange import Event
from common.protocol.messages import Command
from common.rig import ColumnCommand, ColumnMeasurement, TableCommand, TableMeasurement
from common.roles import BUILDING
from common.safety.modes import TURNS, Mode, Turn
from common.signals import OF_STOREYS, SENT
from docs import generate
from laboratories.checks import PATIENCE
from laboratories.table.kind import TABLE
from master.building import Outputs
from master.limits import MasterLimits
from rths.__main__ import VERBS
from slave.limits import SlaveLimits
from tests.faults.rows import motion_bound
from tests.helpers import ROOT

NAMES = [field.name for field in dataclasses.fields(Limits)]
SHOWN_ONLY = {
    "await_client",
    "await_start",
    "lacking",
    "open_link",
    "stranger",
}  # before anything is recorded
BY_CONSTANT = {
    "slow_rig",
    "traceback",
    preflight.PASSED,
    preflight.SENSORS,
    preflight.LINK,
    preflight.RIG,
    BUILDING,
    preflight.ACCEPTED,
}


@pytest.mark.parametrize("name", generate.parts())
def test_a_generated_document_equals_what_the_code_generates(name: str) -> None:
    text = (generate.FOLDER / name).read_text(encoding="utf-8")
    assert generate.renewed(text, generate.parts()[name]) == text, "run `make docs`"


def test_a_generated_part_without_a_place_in_its_document_is_refused() -> None:
    with pytest.raises(ValueError, match="no place for 'modes'"):
        generate.renewed("<!-- modes -->\n", {"modes": ""})


def test_the_picture_of_the_safety_machine_has_every_mode_and_transition() -> None:
    drawn = (generate.FOLDER / "pictures/modes.svg").read_text(encoding="utf-8")
    shown = {text for words in re.findall(r">([^<>]+)</text>", drawn) for text in re.split(r" / |: ", words)}
    turns = {turn.value for row in TURNS.values() for turn in row}
    assert shown == {mode.value for mode in Mode} | turns | {"from every mode"}
    for words in re.findall(r">([^<>]+ / [^<>]+)</text>", drawn):
        assert any(set(words.split(" / ")) <= {turn.value for turn in row} for row in TURNS.values())


@pytest.mark.parametrize("name", NAMES)
def test_every_limit_is_checked_by_the_laboratories_named_in_the_table(name: str) -> None:
    checked = {"A": master_trips(name), "B": slave_trips(name)}
    assert {lab for lab, trips in checked.items() if trips} == {
        lab for lab, names in generate.CHECKED_BY.items() if name in names
    }


def only(name: str) -> Plan:
    """A plan with one limit, which is close to zero."""
    most = dict.fromkeys(NAMES, math.inf) | {"displacement": 0.15, name: 1e-12}
    return Plan(limits=Limits(**most))


def master_trips(name: str) -> bool:
    checks, draw = MasterLimits(only(name)), random.Random(1)
    for _ in range(10):
        measured = ColumnMeasurement(*(draw.random() * 0.1 for _ in ColumnMeasurement._fields))
        sent, storeys = ([draw.random() * 0.1 for _ in names] for names in (SENT, OF_STOREYS))
        ground, target, command, effort = (draw.random() * 0.1 for _ in range(4))
        outputs = Outputs(ground, target, command, effort, [tuple(sent)], storeys)
        violation = checks.violation(measured, ColumnCommand(outputs.command), outputs)
        if violation is not None:
            assert violation.name == name
            return True
    return False


def slave_trips(name: str) -> bool:
    checks, draw = SlaveLimits(TABLE, only(name)), random.Random(1)
    for tick in range(2 * PATIENCE):
        measured = TableMeasurement(*(draw.random() * 0.1 for _ in TableMeasurement._fields))
        values = [draw.random() * 0.1 for _ in Command._fields[5:]]
        wanted = TableCommand(draw.random() * 0.1, draw.random())
        violation = checks.violation(measured, Command(1, tick, 0, 0, 0, *values), wanted)
        if violation is not None:
            assert violation.name == name
            return True
        checks.written(wanted)
    return False


def test_the_documented_bound_of_motion_is_that_of_the_fault_matrix_plus_a_margin_for_the_jerk() -> None:
    rows = [line.split("|")[1:-1] for line in generate.motion(Plan()).splitlines()[2:]]
    for role, row in zip(("master", "slave"), rows, strict=True):
        through, halt, jerk, together = (float(cell.split()[0]) * 1e-3 for cell in row[2:])
        assert through + halt == pytest.approx(motion_bound(Plan(), role), abs=1e-5)
        assert through + halt + jerk == pytest.approx(together, abs=1e-5)
        assert jerk < 0.1 * together


def test_every_event_of_the_processes_is_in_the_list() -> None:
    text = (generate.FOLDER / "reference/events.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^\| `([a-z_]+)` \| (?:info|warning|error)", text, flags=re.MULTILINE))
    assert listed == (emitted() | BY_CONSTANT | {"begin"}) - SHOWN_ONLY
    for code in SHOWN_ONLY:
        assert f"`{code}`" in text


def emitted() -> set[str]:
    """Codes that the sources of the processes give as literals."""
    found: set[str] = set()
    for folder in ("common", "master", "slave", "recorder"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                found |= set(codes(node))
    return found


def codes(node: ast.AST) -> list[str]:
    """Codes of events in one node: `note("…")`, `warn("…")`, `_trip(…, "…")`, `code="…"`, `{"code": "…"}`."""
    values: list[ast.expr | None] = []
    if isinstance(node, ast.Call):
        called = getattr(node.func, "attr", getattr(node.func, "id", ""))
        place = {"note": 0, "warn": 0, "_trip": 1}.get(called, len(node.args))
        values += node.args[place : place + 1]
        values += [keyword.value for keyword in node.keywords if keyword.arg == "code"]
    elif isinstance(node, ast.Dict):
        named = zip(node.keys, node.values, strict=True)
        values += [value for key, value in named if isinstance(key, ast.Constant) and key.value == "code"]
    return [
        value.value for value in values if isinstance(value, ast.Constant) and isinstance(value.value, str)
    ]


def test_the_plan_that_documents_the_keys_equals_the_default_plan() -> None:
    from common.plan.read import load

    assert strict(load(ROOT / "rths/plans/default.toml")).digest() == Plan().digest()


def test_the_table_of_verbs_has_every_event_of_the_protocol_and_every_safety_transition() -> None:
    page = (generate.FOLDER / "reference" / "words.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"^\| ([a-z]+)", page[page.index("## The verbs") :], flags=re.MULTILINE))
    named = {"secured": "secure", "settled": "settle"}  # a verb's table says what is done, a turn that it was
    assert {named.get(one.value, one.value) for one in (*Event, *Turn)} <= shown


def test_the_table_of_commands_has_every_command() -> None:
    page = (generate.FOLDER / "reference" / "words.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([a-z0-9, ]+) \|", page[page.index("## The commands") :], flags=re.MULTILINE)
    assert sorted(", ".join(rows[1:]).split(", ")) == sorted(VERBS)
