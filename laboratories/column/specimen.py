"""The specimen of a column laboratory as its load cell measures it: the column's model and effects on it.

    f = g(δ_max)·p(δ')·f_column(δ') + friction + c·δ̇ + m·δ̈,    δ' = δ outside the grip's gap

`f_column` is the plan's model or, with the effect of yielding, one of `LAWS`; m and c include the plan's mass and
dashpot. A law learned from a recording adds to the force. Without any of these the force equals exactly that of the
plan's model.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from common.plan.laboratory_tables import Column
from models import preisach, specimens
from models.compiled import jit, jit_apart
from models.registry import Array
from models.specimens import SPECIMENS
from models.system import ColumnEffects

# places in `effects`
PRESENT, STIFFNESS, YIELDS, DEGRADATION, PINCHING, PINCHING_WIDTH, PINCHING_HARDENING = range(7)
FRICTION, PRESLIDING, VISCOUS, INERTIA, SLIP, FRICTION_VELOCITY = range(7, 13)

# places in `cell`
DEFORMATION, RATE, LARGEST, SLIDER, LAST_STEP, REACTION = range(6)
LAWS = (
    "bouc_wen",
    "bilinear",
    "menegotto_pinto",
    "clough",
)  # of yielding, in the order of `ColumnEffects.law`
DEGRADED_AT = (
    2e-3  # m, reference deformation of degradation, at which 63 % of the stiffness is lost that will be
)


class Specimen(NamedTuple):
    """The state and constants of the specimen, which `force` updates."""

    code: int  # of the plan's model
    params: Array
    memory: Array
    effects: Array
    yielding: Array  # parameters of the law of yielding, which replaces the planned stiffness
    yielded: Array  # memory of that law
    cell: Array  # memory of the effects
    learned: Array  # a law of `models.preisach`, empty for none
    learned_memory: Array


def build(column: Column, effects: ColumnEffects | None = None) -> Specimen:
    """Specimen at rest, with the plan's mass and dashpot beside those of the effects."""
    more = effects or ColumnEffects()
    more = replace(more, viscous=more.viscous + column.damping, inertia=more.inertia + column.mass)
    code, params, memory = specimens.pack(column.model, stiffness=column.stiffness, **column.parameters)
    yields = np.isfinite(more.yield_displacement)
    values = [
        float(more != ColumnEffects()),
        column.stiffness,
        float(SPECIMENS[LAWS[int(more.law)]].code if yields else 0),
        more.degradation,
        more.pinching,
        more.pinching_width,
        more.pinching_hardening,
        more.friction,
        more.presliding,
        more.viscous,
        more.inertia,
        more.slip,
        more.friction_velocity,
    ]
    law = np.array(more.learned)
    return Specimen(
        code,
        params,
        memory,
        np.array(values),
        yielding(column.stiffness, more),
        np.zeros(specimens.STATE_SIZE),
        np.zeros(6),
        law,
        preisach.memory(law),
    )


def yielding(stiffness: float, effects: ColumnEffects) -> Array:
    """Parameters of the law by which a column of that stiffness (N/m) yields, in the order of its kernel."""
    limit = effects.yield_displacement if np.isfinite(effects.yield_displacement) else 1.0
    name = LAWS[int(effects.law)]
    if name == "bouc_wen":
        return np.array([stiffness, limit, effects.hardening, effects.exponent, 0.5, 0.5])
    if name == "menegotto_pinto":
        return np.array([stiffness, limit, effects.hardening, effects.exponent, 0.925, 0.15])
    if name == "clough":  # which has no negative hardening
        return np.array([stiffness, limit, max(effects.hardening, 0.0), effects.unloading, 0.0, 0.0])
    return np.array([stiffness, limit, effects.hardening])


def with_rates(column: Column, force: Array, displacement: Array, interval: float) -> Array:
    """Force (n,) N at a displacement (n,) m with the plan's dashpot and mass, by central differences.

    `force` (n,) N is what the column gives without them, unchanged where it has neither; `interval` in s.
    """
    if not (column.mass or column.damping) or displacement.size < 2:
        return force
    velocity = np.gradient(displacement, interval)
    result: Array = force + column.damping * velocity + column.mass * np.gradient(velocity, interval)
    return result


def needs_substeps(effects: ColumnEffects | None) -> bool:
    """Whether an effect depends on the rate of deformation, so that an interval must be divided into short steps."""
    more = effects or ColumnEffects()
    return bool(more.viscous or more.inertia or more.friction)


@jit
def force(specimen: Specimen, deformation: float, step: float) -> float:
    """Reading (N) at a deformation (m) reached from the last one within `step` s; updates the memories.

    `cell[REACTION]` keeps the part that loads the piston, without the fixture's inertia and the viscous force.
    """
    if specimen.effects[PRESENT] == 0.0:
        plain = specimens.step(specimen.code, specimen.params, specimen.memory, deformation)
        specimen.cell[REACTION] = plain
        return plain
    return with_effects(specimen, deformation, step)


@jit_apart
def with_effects(specimen: Specimen, deformation: float, step: float) -> float:
    """`force` for a specimen with effects."""
    effects, cell = specimen.effects, specimen.cell
    half = 0.5 * effects[SLIP]
    inside = min(max(deformation, -half), half)
    within = deformation - inside
    result = specimens.step(specimen.code, specimen.params, specimen.memory, within)
    if effects[YIELDS] != 0.0:
        law = int(effects[YIELDS])
        result += (
            specimens.step(law, specimen.yielding, specimen.yielded, within) - effects[STIFFNESS] * within
        )
    cell[LARGEST] = max(cell[LARGEST], abs(within))
    if effects[DEGRADATION] != 0.0:
        result *= 1.0 - effects[DEGRADATION] * (1.0 - np.exp(-cell[LARGEST] / DEGRADED_AT))
    if effects[PINCHING] != 0.0:
        closed = np.exp(-((within / effects[PINCHING_WIDTH]) ** 2))
        result *= 1.0 - effects[PINCHING] * closed + effects[PINCHING_HARDENING] * (1.0 - closed)
    moved = deformation - cell[DEFORMATION]
    rate = moved / step
    if effects[FRICTION] != 0.0:
        contact = effects[PRESLIDING]
        cell[SLIDER] = min(max(cell[SLIDER] + moved, -contact), contact)
        left = 1.0 if effects[FRICTION_VELOCITY] <= 1e-6 else np.tanh(abs(rate) / effects[FRICTION_VELOCITY])
        result += effects[FRICTION] * cell[SLIDER] / contact * left
    if specimen.learned.size > 0:
        result += preisach.step(specimen.learned, specimen.learned_memory, deformation, rate)
    cell[REACTION] = result
    result += effects[VISCOUS] * rate
    if effects[INERTIA] != 0.0 and cell[LAST_STEP] > 0.0:
        result += effects[INERTIA] * (rate - cell[RATE]) / (0.5 * (step + cell[LAST_STEP]))
    cell[DEFORMATION] = deformation
    cell[RATE] = rate
    cell[LAST_STEP] = step
    return result
