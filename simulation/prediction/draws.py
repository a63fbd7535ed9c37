"""Laboratories drawn from the findings of a diagnosis and their uncertainty, and the closed loop of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from common.errors import InputError, PlanError
from common.plan.plan import Plan
from common.plan.toml_file import load_tables
from common.reality import spread as spreads
from common.reality.found import BUILDING, for_another_building
from common.reality.reality import Entry, Reality, from_reality
from common.reality.spread import Spread, UncertainParameter
from common.roles import MASTER
from common.terminal.telling import Tell, untold
from laboratories.effects import CATALOGUE
from laboratories.kind import Kind
from laboratories.kinds import kinds_of
from loop import substructure
from loop.closed_loop import Rollout
from loop.links import impairment
from loop.of_reality import refuse_plugins, rolled_out
from loop.realised import true_system
from models.ground_motion import GroundMotion
from models.registry import Array
from models.system import System

# Largest relative change of a nominal parameter that is drawn. Tolerances are a few per cent, so that hardly any draw
# is cut off, and every parameter stays positive.
LARGEST_CHANGE = 0.5
LARGEST = 100.0  # logarithm of a factor beyond which every parameter is at its bound

Moves = Mapping[UncertainParameter, float]


@dataclass(frozen=True)
class FoundLaboratories:
    """A plan's laboratories as a diagnosis found them, with the uncertainty of the findings."""

    truth: Reality
    spread: Spread
    left_out: tuple[str, ...] = ()  # findings that belong to another building than the plan's


class Ensemble(NamedTuple):
    """The closed loop of the laboratories as found, without noise, and of those drawn."""

    central: Rollout
    drawn: tuple[Rollout, ...]  # those that reached the test's end
    diverged: int
    motion: GroundMotion


def load(path: Path, plan: Plan) -> FoundLaboratories:
    """The laboratories of a file that `rths diagnose --found` wrote, on top of a plan.

    Raises:
        PlanError: the file cannot be read, belongs to other nominal models, or does not hold its uncertainty.
        InputError: it names a plug-in, or an effect that the plan's test cannot have.
    """
    tables = load_tables(path, "reality")
    try:
        kept, gone = for_another_building(tables, plan)
        spread = spreads.beside(tables, path.parent)
        check(spread, plan)
        found = FoundLaboratories(from_reality(kept, plan, path.parent), spread, tuple(gone))
        refuse_plugins(found.truth)
        drawn(found, np.zeros(len(spread.parameters)), 0)
    except InputError as error:
        raise PlanError(f"The reality {path}: {error}") from None
    return found


def check(spread: Spread, plan: Plan) -> None:
    """Raise PlanError if the uncertainty is that of laboratories that the plan does not have."""
    kinds = kinds_of(plan)
    known = {
        f"{role}.{BUILDING}.{one.name}" for role in (MASTER, *plan.roles) for one in fields(plan.structure)
    }
    for role, kind in kinds.items():
        parameters = [name for machine in kind.machines(plan.of(role)) for name in machine.parameters]
        known |= {f"{role}.{name}" for name in (*kind.channels.names, *parameters)}
    named = [f"{role}.{name}" for role, levels in spread.noise.items() for name in levels]
    named += [f"{one.laboratory}.{one.parameter}" for one in spread.parameters if not one.effect]
    for name in named:
        if name not in known:
            raise PlanError(
                f"it holds the uncertainty of '{name}', which the plan does not have: give the plan that it was found "
                "with."
            )


def ensemble(found: FoundLaboratories, count: int, tell: Tell = untold) -> Ensemble:
    """The closed loop of `count` laboratories drawn under the plan's seed."""
    truth, spread = found.truth, found.spread
    random = np.random.default_rng([truth.plan.test.seed, count])
    root = square_root(spread.covariance)
    none = np.zeros(len(spread.parameters))
    central = drawn(found, none, truth.seed)
    motion = substructure.motion(central[MASTER].plan)
    as_found = rolled_out(truth, central, motion, noise=False)
    rollouts = []
    for number in range(count):
        tell("drawing laboratories", number, count)
        seed = int(random.integers(2**31))
        place = root @ random.standard_normal(none.size)
        one = replace(truth, seed=seed)
        rollouts.append(rolled_out(one, drawn(found, place, seed), motion, noise=True))
    whole = tuple(one for one in rollouts if one.finite)
    return Ensemble(as_found, whole, count - len(whole), motion)


def has_random_links(truth: Reality) -> bool:
    """Whether messages are lost, or late by chance."""
    links = [impairment(truth.of(role)) for role in truth.plan.roles]
    return any(link.get("loss") or link.get("jitter") for link in links)


def square_root(covariance: Array) -> Array:
    """A matrix (p, p) whose product with its transpose is the covariance; eigenvalues below zero are rounding."""
    if not covariance.size:
        return covariance
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def drawn(found: FoundLaboratories, place: Array, seed: int) -> dict[str, System]:
    """The systems by role, the master's first, with uncertain parameters moved by `place` (p,) from those found."""
    truth = replace(found.truth, seed=seed)
    kinds, result = kinds_of(truth.plan), {}
    for role in (MASTER, *truth.plan.roles):
        moves = {
            one: float(by)
            for one, by in zip(found.spread.parameters, place, strict=True)
            if one.laboratory == role
        }
        known = found.spread.noise.get(role, {})
        one = truth.of(role)
        plan = with_nominal(one.plan, kinds.get(role), moves)
        effects = tuple((name, moved(name, values, moves)) for name, values in silent(one.effects, known))
        kept = replace(one, plan=plan, effects=effects, only=("",) * len(effects))
        system = true_system(kept)
        result[role] = kinds[role].noisy(system, known) if known and role in kinds else system
    return result


def with_nominal(plan: Plan, kind: Kind | None, moves: Moves) -> Plan:
    """The plan of one role with the nominal parameters moved; `kind` of its laboratory."""
    system = System(plan)
    for parameter, by in moves.items():
        factor = 1.0 + float(np.clip(by, -LARGEST_CHANGE, LARGEST_CHANGE))
        if parameter.effect:
            continue
        if parameter.parameter.startswith(f"{BUILDING}."):
            system = of_building(system, parameter, factor)
        elif kind is not None:
            system = kind.scaled(system, parameter.parameter, factor)
    return system.plan


def of_building(system: System, parameter: UncertainParameter, factor: float) -> System:
    """The system with a parameter of the building multiplied, for every storey or the one that `parameter` names."""
    key = parameter.parameter.partition(".")[2]
    values, place = getattr(system.plan.structure, key), parameter.storey - 1
    if place < 0:
        return system.scaled(BUILDING, key, factor)
    if not isinstance(values, tuple) or place >= len(values) or isinstance(values[place], tuple):
        return system
    return system.moved(BUILDING, **{key: (*values[:place], factor * values[place], *values[place + 1 :])})


def moved(name: str, values: Mapping[str, float], moves: Moves) -> Mapping[str, float]:
    """The parameters of an effect, with the uncertain ones moved, each within its bounds."""
    result = dict(values)
    for one, by in moves.items():
        if by and one.effect == name and one.parameter in result:
            value = result[one.parameter]
            value = value * float(np.exp(min(by, LARGEST))) if one.logarithmic else value + by
            result[one.parameter] = min(max(value, one.least), one.most)
    return result


def silent(effects: tuple[Entry, ...], known: Mapping[str, float]) -> tuple[Entry, ...]:
    """The effects without additional sensor noise on signals whose whole noise is already in `known`."""
    return tuple(
        (name, values)
        for name, values in effects
        if not (name in CATALOGUE and CATALOGUE[name].random and CATALOGUE[name].signal in known)
    )
