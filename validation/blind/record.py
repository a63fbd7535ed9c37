"""Recording a case; its truth stays in the memory of the calling process."""

from __future__ import annotations

import math
import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from common.errors import InputError, InterlockError
from common.plan import read as plans
from common.recording.reader import read
from simulation.workers.pool import spread
from validation.blind.best import gaps, silent_run, without_noise
from validation.blind.cases.case import Case, reality
from validation.blind.cases.computed import strange
from validation.blind.logger.log import log
from validation.blind.oracle import separation
from validation.blind.size import sizes
from validation.blind.worker import OTHER


@dataclass(frozen=True)
class RecordedCase:
    """The recording of a case, and the sizes of its hidden effects."""

    index: int
    name: str  # of the file; drawn at random, so that it reveals nothing
    sizes: tuple[float, ...]  # residual to noise of every effect by itself
    stopped: str  # why the test ended early, empty where it was completed
    separation: float = math.inf  # of all effects together, as an oracle sees them
    left: Mapping[str, float] = field(
        default_factory=dict
    )  # gap of the true laboratories without noise, by signal


def record_all(cases: Sequence[Case], folder: Path, jobs: int = 1) -> Iterator[RecordedCase]:
    """Record every case into a folder, in an order that reveals nothing."""
    order = np.random.default_rng(secrets.randbits(64)).permutation(len(cases))
    yield from spread(partial(record, folder=folder), [cases[place] for place in order], jobs)


def record(case: Case, folder: Path) -> RecordedCase:
    """Play a case in virtual time, and log it; a test that a limit stops is kept up to there."""
    from simulation import virtual

    plan = plans.from_tables(case.plan, Path())
    path = folder / f"{secrets.token_hex(8)}.mcap"
    played = path.with_suffix(".true") if case.logger else path
    try:
        true = reality(case)
        published = without_noise(plan) if case.logger else plan
        bench = virtual.assemble(published, true, played, building=strange(true, case.laid))
    except InputError as error:
        raise InputError(f"Case {case.index} ({truth(case)}) cannot be built: {error}") from None
    ended = virtual.run(bench, lambda: "")
    if ended is not None and not isinstance(ended, InterlockError):
        raise InputError(f"Case {case.index} ({truth(case)}) cannot be recorded: {ended}")
    if case.other:
        play_other(case, path.with_suffix(OTHER))
    quiet = path.with_suffix(".true")
    if case.logger:
        log(case, plan, played, path)
        silent = read(quiet)
    else:
        noiseless = reality(case, silent=True)
        silent = silent_run(plan, noiseless, quiet, strange(noiseless, case.laid))
    quiet.unlink()
    run = read(path)
    seen, left = separation(case, run), gaps(run, silent, plan)
    return RecordedCase(case.index, path.name, sizes(case, path), str(ended or ""), seen, left)


def play_other(case: Case, path: Path) -> None:
    """Record the same laboratories under the case's second motion."""
    from simulation import virtual

    second = replace(case, plan=case.other)
    plan = plans.from_tables(second.plan, Path())
    true = reality(second)
    virtual.run(virtual.assemble(plan, true, path, building=strange(true, case.laid)), lambda: "")


def truth(case: Case) -> str:
    """The hidden effects of a case in words."""
    return " and ".join(item.name for item in case.laid) or "clean"
