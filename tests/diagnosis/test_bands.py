"""Prediction bands cover as often as stated: known causes are fitted, the next test is predicted and then run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from common.plan.plan import Plan
from common.reality import reality
from common.reality.reality import Reality
from common.recording.reader import read
from diagnosis.findings.for_prediction.as_reality import as_reality
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.sensors import readings
from diagnosis.findings.sensors.noise_levels import noise_rms
from diagnosis.findings.verdict import judge
from diagnosis.fits import fitting, residuals
from diagnosis.fits.search import Search
from diagnosis.recorded import record
from diagnosis.recorded.divided import parts_of
from loop import substructure
from loop.closed_loop import Rollout
from loop.of_reality import really
from rths.examine.diagnose import write_found
from rths.prepare.simulate import write as write_recording
from simulation.prediction import bands, draws, file, held
from tests.diagnosis.cases import Effects, jitter, short, tables

SECONDS = 6.0
OTHER = "loma_prieta_1989_corralitos_000"
YIELDING = {"column.yielding": {"yield_displacement": 1.5e-3, "hardening": 0.3}}


class Case(NamedTuple):
    """A hidden cause, what is fitted, and the next test."""

    hidden: Effects
    fitted: Effects
    scale: float
    motion: str = ""


FOUND = {
    "damper friction, another motion": Case(
        {"damper.friction": {"force": 3.0}}, {"damper.friction": {"force": 2.4}}, 0.1, OTHER
    ),
    "column friction, twice": Case(
        {"column.friction": {"force": 900.0}}, {"column.friction": {"force": 720.0}}, 0.2
    ),
    "actuator delay, half": Case(
        {"actuator.delay": {"delay": 5e-3}}, {"actuator.delay": {"delay": 4e-3}}, 0.05
    ),
    "yielding, twice": Case(
        YIELDING, {"column.yielding": {"yield_displacement": 1.2e-3, "hardening": 0.24}}, 0.2
    ),
    "nothing, twice": Case({}, {}, 0.2),
}
STANDING_IN = {
    "yielding taken for friction": Case(YIELDING, {"column.friction": {"force": 900.0}}, 0.1, OTHER),
    "pinching not found": Case(
        {"column.pinching": {"factor": 0.3}, "damper.viscous": {"factor": 1.4}},
        {"damper.viscous": {"factor": 1.2}},
        0.15,
        OTHER,
    ),
}


class Outcome(NamedTuple):
    """How a prediction compares with the test."""

    inside: float  # share of the time, over all signals
    ratio: float  # error after over error before


def recorded(plan: Plan, truth: Reality, path: Path) -> Path:
    """A recording of a test in true laboratories."""
    motion = substructure.motion(plan)
    write_recording(path, plan, really(truth, noise=True), motion, substructure.ground_rows(plan, motion))
    return path


def fitted(path: Path, effects: Effects) -> Diagnosis:
    """The fit of known causes, without a search."""
    shown = record.build(read(path))
    verdicts = []
    for part in parts_of(shown):
        data = residuals.prepare(part, shown)
        own = {
            name: shown.catalogue[name].values(values)
            for name, values in effects.items()
            if any(effect.name == name for effect in part.candidates)
        }
        bare = fitting.fit(data, {})
        verdicts.append(judge(Search(data, bare, fitting.fit(data, own) if own else bare, ())))
    white = readings.levels(
        [one.search.data for one in verdicts], [noise_rms(one.search) for one in verdicts]
    )
    return Diagnosis(shown, verdicts, (), (), {}, white)


def responses(rollout: Rollout) -> Mapping[str, np.ndarray]:
    """The signals by which a test is judged."""
    own, other = rollout.master, rollout.slaves["slave"]
    return {name: own[name] for name in ("column_displacement", "column_force")} | {
        name: other[name] for name in ("table_acceleration", "damper_force")
    }


def error(rollout: Rollout, true: Rollout) -> float:
    """Rms of the relative errors of the responses."""
    one, other = responses(rollout), responses(true)
    return float(
        np.sqrt(np.mean([np.mean((one[k] - other[k]) ** 2) / np.mean(other[k] ** 2) for k in other]))
    )


def play(case: Case, seed: int, folder: Path) -> Outcome:
    """Fit the first test, predict the next one, and run it."""
    first, following = short(SECONDS), short(SECONDS, scale=case.scale)
    if case.motion:
        motion = replace(following.ground_motion, record=case.motion)
        following = replace(following, ground_motion=motion)
    given = tables(first, case.hidden, jitter(seed), seed)
    path = recorded(first, reality.from_reality(dict(given), first, folder), folder / "first.mcap")
    write_found(folder / "found.toml", as_reality({"slave": fitted(path, case.fitted)}), force=True)
    found = draws.load(folder / "found.toml", following)
    file.write(folder / "next.mcap", bands.predict(found, following), "found.toml")
    truth = reality.from_reality(given | {"seed": seed + 100}, following, folder)
    played = recorded(following, truth, folder / "second.mcap")
    true, nominal = really(truth, noise=False), really(reality.as_planned(following), noise=False)
    after, before = (error(one, true) for one in (really(found.truth, noise=False), nominal))
    return Outcome(held.held(read(played), read(folder / "next.mcap")).inside, after / before)


@pytest.mark.long
def test_a_prediction_band_covers_its_stated_share_where_the_cause_was_found(tmp_path: Path) -> None:
    outcome = play(FOUND["actuator delay, half"], 5, tmp_path)
    assert 0.85 <= outcome.inside <= 0.95
    assert outcome.ratio < 0.1


@pytest.mark.slow
def test_prediction_bands_cover_their_stated_share_over_causes_and_tests(tmp_path: Path) -> None:
    found = [play(case, seed, tmp_path) for seed, case in enumerate(FOUND.values(), 3)]
    others = [play(case, seed, tmp_path) for seed, case in enumerate(STANDING_IN.values(), 8)]
    assert 0.85 <= np.mean([one.inside for one in (*found, *others)]) <= 0.95
    assert np.median([one.ratio for one in found]) < 0.1
    assert min(one.inside for one in (*found, *others)) > 0.7
