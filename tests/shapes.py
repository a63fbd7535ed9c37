"""Tests of every shape: other kinds of laboratory at the master and the slaves; shipped plans, and a few more."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from common.plan.plan import Plan
from common.plan.read import from_tables
from tests.helpers import ROOT

SHIPPED = {  # shape -> what `rths run` is given
    "two_columns": "two_columns",
    "two_storeys": "two_storeys",
    "single_site": "single_site",
    "two_slaves": "two_slaves",
    "viscous_damper": str(ROOT / "examples/viscous_damper.toml"),
}
DEVICE = f"{ROOT / 'examples/viscous_damper.py'}:ViscousDamper"
SWAPPED: dict[str, Any] = {"master": {"kind": "table"}, "slave": {"kind": "column"}}
OWN: dict[str, Any] = {"slave": {"kind": DEVICE}}  # a kind of a user's beside the master's column
OWN_LOST: dict[str, Any] = {"slave": {"kind": "nowhere.py:Device"}}  # its class is nowhere
MORE = {"default": {}, "swapped": SWAPPED, "own": OWN, "own_lost": OWN_LOST}


def plan_of(shape: str, **given: dict[str, Any]) -> Plan:
    """The plan of a shape, with other values in some of its tables."""
    if shape in MORE:
        return from_tables(merged(MORE[shape], given), ROOT)
    path = Path(SHIPPED[shape])
    path = path if path.suffix else ROOT / "rths" / "plans" / f"{shape}.toml"
    return from_tables(merged(tomllib.loads(path.read_text(encoding="utf-8")), given), path.parent)


def merged(tables: dict[str, Any], given: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The tables, with given values in place of their own."""
    return tables | {name: tables.get(name, {}) | values for name, values in given.items()}
