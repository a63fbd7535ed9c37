"""What a test of the candidates is expected to show: the parts as the corrected simulation would record them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from common.recording.run import Run
from common.roles import MASTER
from common.signals import shared
from diagnosis.diagnose import parts_of
from diagnosis.findings.found import Diagnosis
from diagnosis.fits import hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Problem
from diagnosis.fits.residuals import Data
from diagnosis.recorded import record
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.parts import LaboratoryPart, Part, with_fields
from laboratories.kinds import topics as topics_of
from loop import substructure
from loop.closed_loop import Rollout, simulate
from loop.signals import topics
from models.ground_motion.motions import load
from models.registry import Array
from models.system import System
from simulation.campaign import information
from simulation.campaign.hypotheses import HiddenCauses, PartCauses, sight
from simulation.campaign.information import Expected

SCARCE = 1e-5  # probability of a hidden cause below which no test is judged by it

kept_motion = lru_cache(maxsize=64)(load)
"""The record of a motion; the same few are scaled again and again."""


def laboratories(found: Mapping[str, Diagnosis], plan: Plan) -> dict[str, System]:
    """The systems by role as diagnoses of one test found them, on the plan of another test."""
    result = {role: System(plan.of(role)) for role in (MASTER, *plan.roles)}
    for place, (role, one) in enumerate(found.items()):
        systems = one.corrected({known: plan.of(known) for known in one.record.plans})
        result[role] = systems[role]
        if place == 0:
            result[MASTER] = systems[MASTER]
    return result


def exchanged(found: Mapping[str, Diagnosis], part: PartCauses, fit: Fit) -> dict[str, Diagnosis]:
    """The diagnoses with another cause in one part."""
    return {
        role: replace(
            one,
            verdicts=[
                replace(verdict, search=replace(verdict.search, chosen=fit))
                if (role, verdict.search.data.part.name) == (part.role, part.title)
                else verdict
                for verdict in one.verdicts
            ],
        )
        for role, one in found.items()
    }


def rolled_out(plan: Plan, systems: Mapping[str, System]) -> Rollout:
    """The closed loop of a plan with these laboratories, without noise."""
    master, given = systems[MASTER], plan.ground_motion
    motion = kept_motion(given.record, plan.base, given.dt, given.unit)
    ground = substructure.ground_rows(plan, motion, master.effects.time_shift)
    slaves = {role: systems[role] for role in plan.roles}
    return simulate(master.plan, ground, effects=master.effects, slaves=slaves)


def recorded(plan: Plan, rollout: Rollout) -> Run:
    """A simulation as the content of a recording."""
    columns = topics(plan, rollout)
    ticks = {topic: np.asarray(own["seq"]) for topic, own in columns.items()}
    forces = dict(shared(topics_of(plan)[MASTER])) if plan.slaves else {}
    return Run(
        Path("the simulated test"),
        plan.test.name,
        plan.roles,
        columns=columns,
        sequences=ticks,
        log_ns=ticks,
        units={topic: {} for topic in columns},
        texts={topic: {} for topic in columns},
        shared=forces,
    )


def parts(plan: Plan, rollout: Rollout, role: str) -> dict[str, Part]:
    """The parts of a simulated test by name, as the diagnosis of one slave's role would see them."""
    return {one.name: one for one in parts_of(record.build(recorded(plan, rollout), plan, role=role))}


def data_of(data: Data, part: Part) -> Data:
    """The data of the same part in a simulated test, in units of the noise that was found, all of it seen."""
    before = data.part.pieces[0] if isinstance(data.part, JoinedPart) else data.part
    if isinstance(before, LaboratoryPart) and isinstance(part, LaboratoryPart):
        fields = {name: getattr(part, name) for name in ("inputs", "wanted", "measured", "present", "anew")}
        part = before.replaced(**fields)
    else:
        part = with_fields(part, {"nuisances": before.nuisances})
    groups = part.measured.shape[0] // data.group
    return replace(data, part=part, train=np.ones(groups, dtype=bool), lines=None, spikes=None)


def told(causes: PartCauses, part: Part) -> tuple[Expected, Array]:
    """What a test tells about the causes of a part's gap, and how far apart it moves each pair of them, in σ².

    `apart[i, j]` is what remains of the difference of their predictions once cause j has been fitted to a test in which
    i is true, without giving up what it explained before.
    """
    data = data_of(causes.data, part)
    there = [reduced(data, fit) for fit in causes.fits]
    apart = np.zeros((len(there), len(there)))
    for place, (fit, known) in enumerate(zip(causes.fits, causes.known, strict=True)):
        problem = Problem(data, fit.values)
        slopes = problem.jacobian(problem.place(fit.values, fit.z), there[place])
        changes = np.stack([there[place] - other for other in there], axis=1)
        moved = slopes.T @ changes
        fitted = moved * np.linalg.lstsq(known + slopes.T @ slopes, moved, rcond=1e-12)[0]
        apart[:, place] = np.maximum(0.0, np.sum(changes**2, axis=0) - fitted.sum(axis=0))
    noise = max(1.0, causes.fits[0].chi / causes.fits[0].reduced.size)
    return information.expected(causes.weights, apart / noise), apart / noise


def reduced(data: Data, fit: Fit) -> Array:
    """Residuals of a cause in a simulated test, in σ (groups·signals,)."""
    return data.reduced(hypothesis.lay(data, fit.z, fit.values)).ravel()


def shown(causes: HiddenCauses, parts_: Sequence[Part | None]) -> Expected:
    """What a test tells about hidden causes; `parts_` are those of the causes' fits in the test.

    A cause that the test would show is told from all others.
    """
    problems = [None if one is None else bare(fit, one) for fit, one in zip(causes.fits, parts_, strict=True)]
    more = np.zeros(len(causes.causes))
    for place, (cause, before) in enumerate(zip(causes.causes, causes.sights, strict=True)):
        there = problems[cause.part]
        if there is None or causes.weights[place + 1] < SCARCE:
            continue
        fit = causes.fits[cause.part]
        try:
            change = (
                there.data.reduced(hypothesis.lay(there.data, fit.z, cause.values)).ravel() - there.reduced
            )
        except InputError:
            continue
        least = np.eye(before.slopes.size)
        both = before.beside(sight(change, there.slopes))
        more[place] = max(0.0, both.imitated(least) - before.imitated(least))
    seen = np.concatenate([[0.0], more])
    apart = np.maximum(seen[:, None], seen[None, :])
    np.fill_diagonal(apart, 0.0)
    return information.expected(causes.weights, apart)


class BarePrediction(NamedTuple):
    """A part of a simulated test without effects."""

    data: Data
    reduced: Array  # (groups·signals,)
    slopes: Array  # (groups·signals, nuisances)


def bare(fit: Fit, part: Part) -> BarePrediction:
    """A part of a simulated test as a fit without effects predicts it."""
    data = data_of(fit.data, part)
    problem = Problem(data, {})
    here = reduced(data, fit)
    return BarePrediction(data, here, problem.jacobian(fit.z, here))
