"""Readings behind rows that an import lacks."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.diagnose import examine
from diagnosis.findings import which
from diagnosis.recorded import missing_rows
from models.registry import Array
from tests.diagnosis.cases import Cases

T: Array = 0.002 * np.arange(6000, dtype=np.float64)
COMMAND: Array = np.sin(2.0 * np.pi * 2.0 * T)


@pytest.mark.parametrize(
    ("width", "least", "most"), [(0.012, 0.0, 0.004), (0.1, 0.1, 0.3), (2.0, 0.70, 0.71)]
)
def test_a_line_over_a_short_gap_misses_little_of_a_command(width: float, least: float, most: float) -> None:
    assert least <= missing_rows.missed(COMMAND, T, 3.0, 3.0 + width) <= most


@pytest.mark.long
def test_nothing_is_half_as_sure_where_readings_are_not_judged(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = examine(cases.record())
    sure = which.nothing(found)
    monkeypatch.setattr(which, "without_readings", lambda *_: ["damper_stroke"])
    assert which.nothing(found) == pytest.approx(0.5 * sure)
