"""What several tests use."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from common import plan
from common.plan import Plan

ROOT = Path(__file__).resolve().parent.parent


def with_table(base: Plan, table: str, **values: object) -> Plan:
    """A plan with some keys of one table changed."""
    tables = base.tables()
    tables[table] |= values
    return plan.from_tables(tables, base.base)


def without_recorder(base: Plan) -> Plan:
    """A plan that runs without a recorder."""
    return dataclasses.replace(base, recording=dataclasses.replace(base.recording, required=False))


def largest(values: object) -> float:
    """Largest magnitude of an array."""
    return float(np.max(np.abs(np.asarray(values))))
