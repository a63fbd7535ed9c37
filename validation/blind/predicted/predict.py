"""What a diagnosis found, judged by the next test that it predicts.

The error of a simulation is the root mean square, over all readings, of rms(simulated - true)/rms(true), where the true
readings are those without noise; where messages are lost or late by chance, the mean of several plays. Readings that
noise hides are left out.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from common.errors import RthsError
from common.plan import read as plans
from common.plan.plan import Plan
from common.reality.reality import as_planned
from common.recording.reader import read
from laboratories.kinds import kinds_of
from loop.closed_loop import Rollout
from loop.of_reality import really
from loop.signals import by_role
from models.registry import Array
from report.prediction import sentences
from simulation.prediction import bands, draws, file, held
from simulation.prediction.rest import BEYOND, OUTSIDE
from simulation.workers.pool import spread
from validation.blind.cases.names import CaseNames
from validation.blind.predicted.closed import closed
from validation.blind.predicted.next_test import FollowingTest, PlayedTest, Readings, play
from validation.blind.size import levels
from validation.blind.worker import ENDINGS


@dataclass(frozen=True)
class PredictedCase:
    """The prediction of one case's next test, judged."""

    index: int
    kind: str
    truth: list[str]
    motion: str
    stronger: float  # peak drift of the linear building over that of the diagnosed test
    before: float  # error of the nominal simulation
    after: float  # error of the prediction; infinite where nothing could be predicted
    inside: (
        float  # share of the time that the recorded test lay inside the band; NaN where nothing was predicted
    )
    said: list[str]  # sentences of the prediction and of the comparison with the recorded test
    signals: Mapping[str, float] = field(default_factory=dict)  # share inside by signal
    closed: float = (
        math.nan
    )  # share of the gap that the effects found close in this test; NaN where it is not judged
    stated: float = math.nan  # that share as the report stated it; NaN where it named nothing
    # Where the prediction states that the test leaves the observed range, by role: how many times the largest
    # amplitude, and which share of the target's energy lies at other frequencies.
    farther: Mapping[str, float] = field(default_factory=dict)
    elsewhere: Mapping[str, float] = field(default_factory=dict)
    stopped: str = ""  # why the next test ended early, empty where it was completed
    error: str = ""  # why nothing was predicted

    @property
    def ratio(self) -> float:
        """Error after over error before."""
        return self.after / self.before if self.before > 0.0 else math.inf


def predict(work: tuple[FollowingTest, Path], kept: Path | None = None) -> PredictedCase:
    """Predict the next test of a case from the file of what was found, play it, and compare.

    Prediction, played test and the files of what was found are copied into a folder in `kept`, if given.
    """
    following, found = work
    case = following.case
    plan = plans.from_tables(case.plan, Path())
    with tempfile.TemporaryDirectory(prefix="rths-next-") as place:
        played = play(following, Path(place))
        noise = case_levels(following, plan)
        before = error(plan, really(as_planned(plan), noise=False), played.silent, noise)
        names = CaseNames(plan)
        about: dict[str, Any] = {
            "index": case.index,
            "kind": case.kind,
            "truth": [names.effect(item) for item in case.laid],
            "motion": plan.ground_motion.record,
            "stronger": following.stronger,
            "before": before,
            "stopped": played.stopped,
        }
        try:
            laboratories = draws.load(found, plan)
            prediction = bands.predict(laboratories, plan)
            closes = closed(laboratories, plan, played.silent, noise)
        except RthsError as problem:
            return PredictedCase(**about, after=math.inf, inside=math.nan, said=[], error=str(problem))
        written = Path(place) / "predicted.mcap"
        file.write(written, prediction, found.name)
        came_out = held.held(read(played.recording), read(written))
        if kept:
            keep(kept / f"case-{case.index:05d}", found, played, written)
    return PredictedCase(
        **about,
        after=error(plan, prediction.middle, played.silent, noise),
        inside=came_out.inside,
        closed=closes,
        said=[*prediction.sentences, *sentences.every(came_out)],
        signals={name: one.inside for name, one in came_out.signals.items()},
        farther={role: one.ratio for role, one in prediction.reaches.items() if one.ratio > BEYOND},
        elsewhere={role: one.outside for role, one in prediction.reaches.items() if one.outside > OUTSIDE},
    )


def predict_all(
    work: Sequence[tuple[FollowingTest, Path]], jobs: int = 1, kept: Path | None = None
) -> Iterator[PredictedCase]:
    """As `predict`, for many cases, in the order in which they are ready; each is kept in a folder of its own."""
    yield from spread(partial(predict, kept=kept), work, jobs)


def case_levels(following: FollowingTest, plan: Plan) -> dict[str, dict[str, float]]:
    """True rms noise of the readings by role and name."""
    return {role: levels(following.case, role) for role in kinds_of(plan)}


def error(plan: Plan, rollout: Rollout, true: Readings, noise: Mapping[str, Mapping[str, float]]) -> float:
    """The error of a simulation of a test, over the ticks that were recorded; 0 where no reading stands out."""
    columns = by_role(plan, rollout)
    squares = [
        square(columns[role][name], true[role][name], noise[role][name])
        for role, kind in kinds_of(plan).items()
        for name in kind.channels.names
    ]
    known = [one for one in squares if not math.isnan(one)]
    return math.sqrt(float(np.mean(known))) if known else 0.0


def square(simulated: Array, true: Array, noise: float) -> float:
    """The squared relative error of one reading; NaN where the noise is larger than the reading."""
    simulated = simulated[: true.size]
    power = float(np.mean(true**2)) if true.size else 0.0
    if not power > noise**2:
        return math.nan
    return float(np.mean((simulated - true) ** 2)) / power


def keep(folder: Path, found: Path, played: PlayedTest, predicted: Path) -> None:
    """Copy the findings, the prediction and the played test into a folder."""
    import shutil

    folder.mkdir(exist_ok=True)
    for ending in ENDINGS:
        shutil.copy(found.with_suffix(ending), folder / f"found{ending}")
    shutil.copy(predicted, folder / "predicted.mcap")
    shutil.copy(played.recording, folder / "next.mcap")
