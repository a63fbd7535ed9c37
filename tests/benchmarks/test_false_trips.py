"""One short piece of the benchmark of false trips, and its figures."""

from __future__ import annotations

import json

import pytest

from benchmarks import false_trips


def test_a_piece_gives_figures(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(false_trips, "PIECE", 1.0)
    monkeypatch.setattr(false_trips, "MINUTES", 1)
    trips, holds, *gaps = false_trips.run()[:4]
    assert trips.points[0]["violations"] == 0
    assert trips.met == (trips.points[0]["trips"] == 0)
    assert holds.median is not None
    assert all(gap.median is None or 0.0 < gap.median < 0.1 for gap in gaps)
    json.dumps([trips._asdict(), holds._asdict()], allow_nan=False)
    assert "1 of 1 min" in capsys.readouterr().err
