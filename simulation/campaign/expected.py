"""What a test of the candidates is expected to show: the parts as the corrected simulation would record them."""

from __future__ import annotations

import contextlib
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
from diagnosis.findings.found import Diagnosis
from diagnosis.fits import fitting, hypothesis, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Problem
from diagnosis.fits.residuals import Data
from diagnosis.recorded import record
from diagnosis.recorded.divided import parts_of
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
from simulation.campaign.hypotheses import HiddenCauses, PartCauses, Sight, sight
from simulation.campaign.information import Expected

SCARCE = 1e-5  # probability of a hidden cause below which no test is judged by it
SIZES = (
    0.5,
    2.0,
)  # of the size of a hidden cause, for which it stands: the catalogue gives three over a decade
TINY = 1e-12  # σ², a change that nothing shows

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


def rolled_out(plan: Plan, systems: Mapping[str, System], seed: int | None = None) -> Rollout:
    """The closed loop of a plan with these laboratories; with a `seed` the sensors have their noise."""
    master, given = systems[MASTER], plan.ground_motion
    motion = kept_motion(given.record, plan.base, given.dt, given.unit)
    ground = substructure.ground_rows(plan, motion, master.effects.time_shift)
    slaves = {role: systems[role] for role in plan.roles}
    return simulate(master.plan, ground, seed=seed, effects=master.effects, slaves=slaves)


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


def rehearsed(plan: Plan) -> list[tuple[str, Fit]]:
    """Fits without effects of the parts of a test in the laboratories as planned, by role of the slave."""
    systems = laboratories({}, plan)
    run = recorded(plan, rolled_out(plan, systems, plan.test.seed))
    found = []
    for place, role in enumerate(plan.roles or (MASTER,)):
        own = record.build(run, plan, role=role)
        for part in parts_of(own):
            if part.role == role or (place == 0 and part.role == MASTER):
                found.append(
                    (role, fitting.at(residuals.prepare(part, own), {}, np.zeros(len(part.nuisances))))
                )
    return found


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

    Sizes of one effect are one cause. A cause is told from another one of its part by what is left of its changes once
    the other one has been fitted to them, and from those of other parts if the test shows either.
    """
    count = len(causes.causes)
    more = np.zeros((count, count))
    for place, (fit, part) in enumerate(zip(causes.fits, parts_, strict=True)):
        if part is not None:
            own = [number for number, one in enumerate(causes.causes) if one.part == place]
            before, there = causes.sights[place], changed(causes, place, bare(fit, part))
            more[np.ix_(own, own)] = before.beside(there).left() - before.left()
    names = ["", *(one.name for one in causes.causes)]
    return information.expected(causes.weights, apart_by_changes(more), names)


def changed(causes: HiddenCauses, place: int, there: BarePrediction) -> Sight:
    """What the causes of a part would change in a simulated test; those that are too improbable count as none."""
    z = causes.fits[place].z
    columns = []
    for one, weight in zip(causes.causes, causes.weights[1:], strict=True):
        if one.part != place:
            continue
        change = np.zeros_like(there.reduced)
        if weight >= SCARCE:
            with contextlib.suppress(InputError):  # an effect that this plan's model cannot have
                change = there.data.reduced(hypothesis.lay(there.data, z, one.values)).ravel() - there.reduced
        columns.append(change)
    return sight(np.stack(columns, axis=1), there.slopes)


def apart_by_changes(more: Array) -> Array:
    """How far apart a test moves nothing (first) and causes, in σ², from the products of what they change (n, n).

    `apart[i, j]` is what is left where i is true and j is tried at the best of the sizes for which it stands.
    """
    own = np.clip(np.diag(more), 0.0, None)
    size = np.clip(more / np.maximum(own, TINY)[None, :], *SIZES)
    left = own[:, None] - 2.0 * size * more + size**2 * own[None, :]
    found = np.zeros((own.size + 1, own.size + 1))
    found[0, 1:] = found[1:, 0] = own
    found[1:, 1:] = np.maximum(0.0, left)
    return found


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
