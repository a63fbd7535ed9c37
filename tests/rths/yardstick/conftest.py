"""The benchmark played once for all tests that look at its results."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from common.terminal.telling import untold
from simulation.workers.parts import Way
from validation.benchmark2020 import evidence, figures, late_force, page, text
from validation.benchmark2020.evidence import BenchmarkEvidence
from validation.benchmark2020.problem import SETTINGS
from validation.proof import draw_all


class Played(NamedTuple):
    """The results of the command for a few settings, plants and delays."""

    evidence: BenchmarkEvidence
    checks: list[evidence.GoalCheck]
    json: dict[str, Any]
    page: Path


@pytest.fixture(scope="session")
def played(tmp_path_factory: pytest.TempPathFactory) -> Played:
    folder = tmp_path_factory.mktemp("benchmark2020")
    settings = {name: SETTINGS[name] for name in ("sample", "amb", "ats", "none")}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(late_force, "DELAYS", (0.0, 1e-3, 2e-3, 10e-3))
        found = evidence.gather(folder, settings, 1, 2020, Way(), untold)
    checks = evidence.checks(found)
    pictures = draw_all(figures.wanted(found), found, folder)
    place = folder / "index.html"
    place.write_text(page.page(found, checks, pictures), encoding="utf-8")
    return Played(found, checks, json.loads(json.dumps(text.as_json(found, checks), allow_nan=False)), place)
