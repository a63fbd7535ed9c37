"""Fixtures of all tests."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from common import cli, plan, reality
from common.plan import Plan
from rths import virtual

settings.register_profile("rths", deadline=None, derandomize=True)  # the same cases on every machine
settings.load_profile("rths")


@pytest.fixture(autouse=True)
def no_leaked_thread() -> Iterator[None]:
    """A test that leaves a thread behind fails."""
    before = set(threading.enumerate())
    yield
    left = [thread for thread in threading.enumerate() if thread not in before and not thread.daemon]
    for thread in left:
        thread.join(timeout=5.0)
    assert [thread.name for thread in left if thread.is_alive()] == []


@pytest.fixture(autouse=True)
def unhurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """No command says how far it is because this machine is slow today."""
    monkeypatch.setattr("rths.progress.UNSAID", math.inf)


@pytest.fixture(scope="session")
def default_plan() -> Plan:
    """The default test as it ships."""
    return plan.load(cli.plan_path(None))


@pytest.fixture(scope="session")
def short_plan(default_plan: Plan) -> Plan:
    """Its first four seconds, in which the strongest motion lies."""
    return default_plan.with_test(duration=4.0)


@pytest.fixture(scope="session")
def virtual_recording(short_plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the short test in virtual time."""
    path = tmp_path_factory.mktemp("recordings") / "short.mcap"
    error = virtual.run(virtual.assemble(short_plan, reality.as_planned(short_plan), path), lambda: "")
    assert error is None
    return path
