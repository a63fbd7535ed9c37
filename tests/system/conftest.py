"""Fixtures of the tests of whole processes."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.system.started import end_started


@pytest.fixture(autouse=True)
def started_processes_end() -> Iterator[None]:
    """A test that leaves a process which it started fails; the process is killed, and its pipes are closed."""
    yield
    assert end_started() == []
