"""Recordings of a machine by itself, whose plan has a building of which nothing is recorded."""

from __future__ import annotations

import tomllib

import tomli_w

from common import signals
from common.plan.plan import Plan
from common.recording.run import Run

OF_BUILDING = {row.name for row in (*signals.BUILDING, signals.NUMERICAL)} - {"seq", "t"}
APART = ("import", "bench")  # metadata of recordings that need not be of a whole test
TABLES = ("structure", "ground_motion")


def by_itself(run: Run) -> bool:
    """Whether a recording is of a machine by itself: imported, or of a bench test, without a signal of the building."""
    names = {name for columns in run.columns.values() for name in columns}
    return any(one in run.metadata for one in APART) and not names & OF_BUILDING


def own_plan(run: Run) -> str:
    """The recorded plan (TOML); of a machine by itself without the tables of a building that are the default test's."""
    from report.facts.laboratories import whole_plan  # slow to load, and `by_itself` does without it

    text = run.metadata.get("plan", {}).get("toml", "")
    plan = whole_plan(run) if text and by_itself(run) else None
    if plan is None:
        return text
    unstated = {name for name in TABLES if getattr(plan, name) == getattr(Plan, name)}
    return tomli_w.dumps({name: table for name, table in tomllib.loads(text).items() if name not in unstated})
