"""The calibration of sensors as a plan states it: `[report.calibration.SIGNAL]` with dates, and who certified what."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from datetime import date, datetime
from typing import Any, NamedTuple

from common.errors import PlanError
from common.plan.plan import Plan
from common.plan.schema import nearest
from common.plan.tables import ReportTable


class Calibration(NamedTuple):
    """The calibration of a sensor: when it was made and until when it holds (both may be unknown), by whom."""

    signal: str
    calibrated: date | None = None
    due: date | None = None
    by: str = ""
    certificate: str = ""


DATES = ("date", "due")
KEYS = (*DATES, "by", "certificate")


def checked(table: ReportTable) -> ReportTable:
    """The table with dates as texts; raises PlanError where a calibration has another key, type or no date."""
    found = {name: entry(name, given) for name, given in table.calibration.items()}
    return dataclasses.replace(table, calibration=found)


def entry(signal: str, given: Any) -> dict[str, str]:
    """One calibration of the plan as texts; raises PlanError where it cannot be read."""
    where = f"[report.calibration.{signal}]"
    if not isinstance(given, dict):
        raise PlanError(
            f"{signal} in [report.calibration] must be a table with {' and '.join(DATES)}, not {given!r}."
        )
    found = {}
    for name, value in given.items():
        if name not in KEYS:
            raise PlanError(f"Unknown key '{name}' in {where}: {nearest(name, KEYS)}")
        text = value.isoformat() if isinstance(value, date) else value
        if not isinstance(text, str) or (name in DATES and day(text) is None):
            wanted = "a date such as 2026-05-01" if name in DATES else "a text in quotes"
            raise PlanError(f"{name} in {where} must be {wanted}, not {value!r}.")
        found[name] = text
    if not set(DATES) & found.keys():
        raise PlanError(f"{where} gives no date: give `date`, `due`, or both.")
    return found


def day(text: str) -> date | None:
    """The day of an ISO 8601 text, None where it is none."""
    try:
        return datetime.fromisoformat(text).date()
    except ValueError:
        return None


def calibrations(plan: Plan) -> list[Calibration]:
    """All calibrations of a plan, in its order."""
    return [
        Calibration(
            name,
            day(one.get("date", "")),
            day(one.get("due", "")),
            one.get("by", ""),
            one.get("certificate", ""),
        )
        for name, one in plan.report.calibration.items()
    ]


def overdue(plan: Plan, today: date) -> Iterator[str]:
    """A sentence, without its full stop, on each calibration that holds no longer on that day."""
    for one in calibrations(plan):
        if one.due is not None and one.due < today:
            yield f"the calibration of {one.signal} was due on {one.due.isoformat()}"
