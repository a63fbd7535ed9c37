"""What is known of plan, machine and test at a moment, for the panel's pages; times in ns of the server's clock."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from common.plan.plan import Plan

NONE: Mapping[str, Any] = MappingProxyType({})


class CheckResult(NamedTuple):
    """The newest check of plan or machine: what the command found, or its complaint."""

    found: Mapping[str, Any] = NONE
    complaint: str = ""
    at: int = 0  # when it was begun, 0 for never
    busy: bool = False


class RunReports(NamedTuple):
    """What the processes of a test have reported to the panel that started it."""

    modes: Mapping[str, tuple[str, int]] = NONE  # by laboratory, and when it came
    alive: tuple[str, ...] = ()  # the processes that ran
    alive_at: int = 0
    causes: tuple[tuple[str, str], ...] = ()  # laboratory and sentence, the first first
    lines: tuple[str, ...] = ()  # other lines, the newest last


class Shown(NamedTuple):
    """The test that runs on this machine."""

    test: str  # a name of its own: that of the plan and the number of its process
    name: str
    plan: Plan
    digest: str
    recording: Path | None
    own: bool  # whether this panel has started it
    linked: bool  # whether its master is connected to the panel
    reports: RunReports = RunReports()
    unlinked_at: int = 0  # when that connection was lost, 0 where it was not
    since_ns: int = 0  # Unix time of its begin: a recording that was written before is another test's


class Snapshot(NamedTuple):
    """Everything at a moment."""

    file: str  # of the plan that can be armed
    shown: Shown | None = None
    plan: CheckResult = CheckResult()
    machine: CheckResult = CheckResult()
    last: tuple[
        tuple[str, str], ...
    ] = ()  # which laboratories said why the newest test of this panel's ended
    ending: str = (
        ""  # the sentence with which the command of that test ended, empty where it ended as planned
    )
