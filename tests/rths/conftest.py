"""Fixtures of the tests of commands."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from common.recording.reader import read
from common.recording.run import Run
from rths.__main__ import main
from tests.rths.imports import PLAN


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


@pytest.fixture
def bring(call: Any, tmp_path: Path) -> Any:
    """Import data under a map; exit code and the recording, None where there is none."""

    def brought(
        data: str, rows: str, top: str = 'time = "t"\n', *more: str, plan: str = PLAN
    ) -> tuple[int, Run | None]:
        (tmp_path / "plan.toml").write_text(plan)
        (tmp_path / "data.csv").write_bytes(data.encode("latin-1"))
        (tmp_path / "map.toml").write_text(f'plan = "plan.toml"\n{top}[signals]\n{rows}')
        out = tmp_path / "a.mcap"
        code = call(
            "import", tmp_path / "data.csv", "--map", tmp_path / "map.toml", "-o", out, "--force", *more
        )
        return code, read(out) if code == 0 else None

    return brought
