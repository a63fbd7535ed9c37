"""Fixtures of the tests of commands."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from rths.__main__ import main


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """A command in this process; its exit code."""

    def rths(*words: str | Path) -> int:
        monkeypatch.setattr(sys, "argv", ["rths", *map(str, words)])
        try:
            return main()
        except SystemExit as end:
            return int(end.code or 0)

    return rths
