"""The closed loop's benchmark and its peer in another interpreter, with few steps."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks import closed_loop, opensees_peer
from benchmarks.opensees_peer import PYTHON, PeerAnswer, PeerCase
from common.plan.plan import Plan
from loop import substructure
from loop.closed_loop import simulate
from loop.signals import signals

CASE = PeerCase(160e3, 25e6, 200e3, 0.002, [0.0, 1.0, 0.5, 0.0], repeats=2)

STUB = """
class Silent:
    def version(self): return "0.0"
    def nodeDisp(self, node, direction): return 0.25
    def analyze(self, steps, interval):
        print("WARNING: chatter")
        return 0
    def __getattr__(self, name): return lambda *arguments: None
import sys
sys.modules[__name__] = Silent()
"""


@pytest.mark.slow
def test_plain_python_computes_the_same_building() -> None:
    plan = closed_loop.bare(Plan()).with_ticks(500)
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    x = signals(plan, simulate(plan, ground))["displacement"]
    figure = closed_loop.difference("any", x, np.array(closed_loop.plain_python(plan, ground)))
    assert figure.best is not None
    assert figure.best < 1e-10
    assert figure.met


def test_the_peer_interpreter_is_understood_whatever_it_prints_around_its_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "openseespy"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "opensees.py").write_text(STUB)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.delenv(PYTHON, raising=False)
    answer = opensees_peer.ask(CASE)
    assert isinstance(answer, PeerAnswer)
    assert answer.version == "0.0"
    assert answer.displacement == [0.25] * 4
    assert len(answer.at_once) == len(answer.by_step) == 2


def test_a_peer_that_cannot_be_started_is_reported_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(PYTHON, "/nowhere/python")
    answer = opensees_peer.ask(CASE)
    assert isinstance(answer, str)
    (figure,) = closed_loop.opensees(answer, np.zeros(4), 1.0, 1.0)
    assert figure.name.startswith("OpenSeesPy: not installed here (")
    assert "No such file" in figure.name
    assert figure.best is None


def test_the_reported_reason_is_the_last_error_of_the_traceback() -> None:
    trace = "Traceback\n  File\nModuleNotFoundError: No module named 'openseespy'\nProcess 0 Terminating\n"
    assert opensees_peer.reason(trace) == "No module named 'openseespy'"
    assert opensees_peer.reason("") == "it ended without an answer"


def test_opensees_computes_the_same_building() -> None:
    plan = closed_loop.bare(Plan()).with_ticks(1_000)
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    answer = opensees_peer.ask(closed_loop.case_of(plan, ground)._replace(repeats=1))
    if isinstance(answer, str):
        pytest.skip(f"OpenSeesPy does not load here: {answer}")
    x = signals(plan, simulate(plan, ground))["displacement"]
    *rates, difference = closed_loop.opensees(answer, x, 1.0, 1.0)
    assert all(figure.best and figure.best > 0.0 for figure in rates)
    assert difference.best is not None
    assert difference.best < 1e-8
    json.dumps([figure._asdict() for figure in rates], allow_nan=False)
