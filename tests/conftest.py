"""Fixtures of all tests."""

from __future__ import annotations

import faulthandler
import math
import os
import sys
import threading
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from common.host import running
from common.plan import read as plans
from common.plan.patience import strict
from common.plan.plan import Plan
from common.reality import reality
from common.terminal import cli
from simulation import virtual
from tests.limited import Left, adopt, children, descendants, end, look

# of libraries, which end them with the interpreter: joblib's idle workers, the counters of shared memory
KEPT = ("joblib.externals.loky", "resource_tracker")
OUT_OF_REACH_S = 60.0  # after its limit a test that no signal has ended takes its interpreter with it
STDERR = pytest.StashKey[int]()
SYSTEM = Path(__file__).with_name("system")

settings.register_profile(
    "rths", deadline=None, derandomize=True, max_examples=50
)  # the same on every machine
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
def no_leaked_process() -> Iterator[None]:
    """A test that leaves a process behind fails, and the process is killed: one in real time starves the others."""
    before = set(children(os.getpid()))
    yield
    left = end(lambda: below(before))
    assert [str(process) for process in left] == []


@pytest.fixture(autouse=True)
def no_leaked_priority() -> Iterator[None]:
    """A test that leaves its worker at another priority or bound to a processor fails, and both are taken back.

    All processes of later tests would inherit them.
    """
    if sys.platform != "linux":
        yield
        return
    before = os.sched_getscheduler(0), os.sched_getaffinity(0)
    priority = os.sched_getparam(0)
    yield
    left = os.sched_getscheduler(0), os.sched_getaffinity(0)
    if left != before:
        os.sched_setscheduler(0, before[0], priority)
        os.sched_setaffinity(0, before[1])
    assert left == before


def below(before: set[int]) -> list[Left]:
    """Processes that run below this one, apart from those before and those of libraries."""
    started = [child for child in children(os.getpid()) if child not in before]
    found = [process for child in started if (process := look(child)) is not None]
    return [one for process in found if not kept(process) for one in (process, *descendants(process.pid))]


def kept(process: Left) -> bool:
    """Whether a process belongs to a library."""
    return any(name in process.words for name in KEPT)


def pytest_configure(config: pytest.Config) -> None:
    """Orphans of a test come to this process; the standard error stays in reach while a test's is caught."""
    adopt()
    config.stash[STDERR] = os.dup(2)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests of whole processes come first: they wait while types are checked, and no long one is left to the end."""
    items.sort(key=lambda item: SYSTEM not in item.path.parents)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """A test that hangs where Python hears no signal writes the stacks of all threads and ends its interpreter."""
    marker = item.get_closest_marker("timeout")
    limit = float(marker.args[0] if marker else item.config.getini("timeout"))
    faulthandler.dump_traceback_later(limit + OUT_OF_REACH_S, exit=True, file=item.config.stash[STDERR])
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Nothing outlives the tests: what a fixture has left is named and killed."""
    left = end(lambda: [one for one in descendants(os.getpid()) if not kept(one)])
    for process in left:
        os.write(session.config.stash[STDERR], f"killed what was left: {process}\n".encode())


@pytest.fixture(autouse=True)
def unhurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """No command prints progress because this machine is slow at the moment."""
    monkeypatch.setattr("report.text.progress.UNSAID", math.inf)


@pytest.fixture(scope="session", autouse=True)
def apart(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Tests announce what they run in a place of their own: nobody else's test on this machine refuses it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(running.FOLDER, str(tmp_path_factory.mktemp("running")))
        yield


@pytest.fixture(scope="session")
def default_plan() -> Plan:
    """The default test with the strict figures of rigs."""
    return strict(plans.load(cli.plan_path(None)))


@pytest.fixture(scope="session")
def short_plan(default_plan: Plan) -> Plan:
    """Its first four seconds, in which the strongest motion lies."""
    return plans.with_test(default_plan, duration=4.0)


@pytest.fixture(scope="session")
def virtual_recording(short_plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the short test in virtual time."""
    path = tmp_path_factory.mktemp("recordings") / "short.mcap"
    error = virtual.run(virtual.assemble(short_plan, reality.as_planned(short_plan), path), lambda: "")
    assert error is None
    return path
