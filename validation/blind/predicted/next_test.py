"""The next test of a case: another motion, half to twice as strong, played in the same hidden laboratories."""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from common.errors import InputError, InterlockError
from common.plan import read as plans
from common.recording.reader import read
from laboratories.kinds import kinds_of
from models.ground_motion.motions import MOTIONS
from models.registry import Array
from validation.blind import lots
from validation.blind.cases.basis import TrialBasis, log_uniform
from validation.blind.cases.case import Case, reality
from validation.blind.cases.computed import strange
from validation.blind.logger.log import log
from validation.blind.oracle import RANDOM

Readings = Mapping[str, Mapping[str, Array]]  # by role and name
# Plays whose mean is the truth where messages are lost or late by chance, which nobody can predict: their scatter in
# the mean is a third of that of one play.
PLAYS = 8
BY_CHANCE = ("link.loss", "link.jitter")
# Peak drift of the linear building over that of the first test.
STRONGER = (0.5, 2.0)


@dataclass(frozen=True)
class FollowingTest:
    """A case with the plan of its next test, and with another draw of the noise."""

    case: Case
    stronger: float  # peak drift of the linear building over that of the diagnosed test


@dataclass(frozen=True)
class PlayedTest:
    """The next test as it was recorded, and as sensors without noise would have recorded it.

    Where messages are lost or late by chance the latter is a mean of several plays.
    """

    recording: Path
    silent: Readings
    stopped: str  # why it ended early, empty where it was completed


def next_test(case: Case, seed: int, set_: str, trial: TrialBasis) -> FollowingTest:
    """The next test of a case; the motion is neither that of the diagnosed test nor that of its validation."""
    lot = (seed, set_, case.index)
    plan = plans.from_tables(case.plan, Path())
    first, damper = plan.ground_motion, plan.control.amd
    seen = {first.record, case.other.get("ground_motion", {}).get("record")}
    record = lots.chosen((name for name in MOTIONS if name not in seen), *lot, "next motion")
    stronger = log_uniform(lots.generator(*lot, "next scale"), *STRONGER)
    scale = (
        stronger * first.scale * trial.drift(first.record, damper=damper) / trial.drift(record, damper=damper)
    )
    tables = plan.tables()
    tables["ground_motion"] = {"record": record, "scale": round(scale, 4)}
    noise = int(lots.generator(*lot, "next noise").integers(2**31))
    return FollowingTest(replace(case, plan=tables, seed=noise, other={}), stronger)


def play(following: FollowingTest, folder: Path) -> PlayedTest:
    """Play a next test in virtual time, once as it is and once without any noise; a limit may end it early."""
    case = following.case
    path = folder / f"{secrets.token_hex(8)}.mcap"
    played = path.with_suffix(".true") if case.logger else path
    stopped = driven(case, played, without_noise=False)
    if case.logger:
        plan = plans.from_tables(case.plan, Path())
        log(case, plan, played, path)
        played.unlink()
    plays = PLAYS if any(item.name in BY_CHANCE for item in case.laid) else 1
    silent = [silently(replace(case, seed=case.seed + place), folder) for place in range(plays)]
    return PlayedTest(path, mean(silent), stopped)


def silently(case: Case, folder: Path) -> Readings:
    """The readings of a test without noise."""
    path = folder / f"{secrets.token_hex(8)}.silent"
    driven(case, path, without_noise=True)
    run = read(path)
    path.unlink()
    kinds = kinds_of(plans.from_tables(case.plan, Path()))
    return {
        role: {name: np.asarray(run.columns[role][name], dtype=np.float64) for name in kind.channels.names}
        for role, kind in kinds.items()
    }


def mean(played: Sequence[Readings]) -> Readings:
    """The mean of readings over the ticks that all of them have."""
    first = played[0]
    return {
        role: {name: of_all([one[role][name] for one in played]) for name in own}
        for role, own in first.items()
    }


def of_all(series: Sequence[Array]) -> Array:
    """The mean of series over the ticks that all of them have."""
    ticks = min(one.size for one in series)
    return np.asarray(np.mean([one[:ticks] for one in series], axis=0))


def driven(case: Case, path: Path, *, without_noise: bool) -> str:
    """Record the test of a case; why a limit ended it, empty where it was completed.

    Without noise, effects that are noise are left out as well: nobody can predict a draw of them.
    """
    from simulation import virtual

    laid = tuple(item for item in case.laid if not (without_noise and item.name.endswith(RANDOM)))
    plan = plans.from_tables(case.plan, Path())
    true = reality(case, laid, silent=without_noise)
    ended = virtual.run(virtual.assemble(plan, true, path, building=strange(true, laid)), lambda: "")
    if ended is not None and not isinstance(ended, InterlockError):
        raise InputError(f"The next test of case {case.index} cannot be recorded: {ended}")
    return str(ended or "")
