"""The specimen of a column laboratory as its load cell measures it: the column's model and effects on it.

    f = g(δ_max)·p(δ')·(f_column(δ') + e(δ')) + friction + c·δ̇ + m·δ̈,    δ' = δ outside the grip's gap

`f_column` is the plan's model or, with the effects of yielding, centring, a slider or a dashpot, another model in its
place; e is the effect of hardening; m and c include the plan's mass and dashpot. A law learned from a recording
adds to the force. Without any of these the force equals exactly that of the plan's model.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from common.plan.laboratory_tables import Column
from models import dashpot, friction, preisach, specimens
from models.compiled import jit, jit_apart
from models.registry import Array
from models.specimens import SPECIMENS, self_centring, slider
from models.system import ColumnEffects

# places in `effects`
PRESENT, STIFFNESS, YIELDS, DEGRADATION, PINCHING, PINCHING_WIDTH, PINCHING_HARDENING = range(7)
FRICTION, PRESLIDING, VISCOUS, INERTIA, SLIP, FRICTION_VELOCITY = range(7, 13)
ASYMMETRY, DROP, SPEED, PLAY, BESIDE, CENTRES, STIFFENING, BEND = range(13, 21)
SECOND_STIFFENING, SECOND_BEND, PINCHING_TAILS, SLIDES, CORNER = range(21, 26)
POWER, DASHPOT, EXPONENT, SPRING, RELAXING, STIFFENING_POWER = range(26, 32)

# places in `cell`; the last three are the specimen's place within play, the force that it carried there, and the force
# of a dashpot behind a spring
DEFORMATION, RATE, LARGEST, SLIDER, LAST_STEP, REACTION, INSIDE, CARRIED, DAMPED = range(9)
LAWS = (
    "bouc_wen",
    "bilinear",
    "menegotto_pinto",
    "clough",
    "trilinear",
    "pinched",
    "pinched",
    "pinched_by_peak",
    "pinched_by_peak",
    "pinched_by_rest",
    "pinched_by_rest",
    "layered",
    "bouc_wen",
    "bwbn",
)  # of yielding, in the order of `ColumnEffects.law`
PLAYS = ORIGIN, RESTING, HELD, PARTLY, ROUNDED = range(5)  # where the gap is: see `column.slip`
IN_PLACE = 2  # of `ColumnEffects.friction_law`: a slider in the place of the planned specimen
LINEAR, BY_POWER, DASHPOT_IN_PLACE, DASHPOT_BESIDE, INSTEAD = range(5)  # of `ColumnEffects.viscous_law`
BENT, TWICE, TO_A_POWER = 1, 2, 3  # of `ColumnEffects.stiffening_law`
STIFFENED_AT = 2e-3  # m, reference deformation of hardening with the square of the deformation
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
    centring: Array  # parameters of the law of centring, likewise
    centred: Array  # memory of that law
    sliding: Array  # parameters of a slider, likewise
    slid: Array  # memory of that slider
    cell: Array  # memory of the effects
    learned: Array  # a law of `models.preisach`, empty for none
    learned_memory: Array


def build(column: Column, effects: ColumnEffects | None = None) -> Specimen:
    """Specimen at rest, with the plan's mass and dashpot beside those of the effects."""
    more, column = effects or ColumnEffects(), left_standing(column, effects)
    power = more.viscous if more.viscous_law else 0.0
    more = replace(more, viscous=more.viscous - power + column.damping, inertia=more.inertia + column.mass)
    code, params, memory = specimens.pack(column.model, stiffness=column.stiffness, **column.parameters)
    yields, centres = np.isfinite(more.yield_displacement), np.isfinite(more.centring)
    bend = more.stiffening_bend if more.stiffening_law in (BENT, TWICE) else 0.0
    vacant = not (yields or centres)  # one law takes the place of the planned specimen
    slides = bool(vacant and more.friction_law == IN_PLACE and more.friction)
    values = [
        float(more != ColumnEffects()),
        column.stiffness,
        float(SPECIMENS[LAWS[int(more.law)]].code if yields else 0),
        more.degradation,
        more.pinching,
        more.pinching_width,
        more.pinching_hardening,
        0.0 if more.friction_law == IN_PLACE else more.friction,
        more.presliding,
        more.viscous,
        more.inertia,
        0.0 if slides else more.slip,  # the slider's joint has it
        more.friction_velocity,
        more.friction_asymmetry,
        more.friction_drop,
        more.friction_speed,
        more.slip_law,
        (1.0 - more.slip_share) * column.stiffness if more.slip_law == PARTLY else 0.0,
        float(centres),
        more.stiffening * column.stiffness,
        bend,
        more.stiffening_second * column.stiffness if more.stiffening_law == TWICE else 0.0,
        more.stiffening_second_bend,
        more.pinching_tails if more.pinching_law else 0.0,
        float(slides),
        corner(more),
        power if more.viscous_law in (BY_POWER, INSTEAD) else 0.0,
        power if vacant and more.viscous_law == DASHPOT_IN_PLACE else 0.0,
        more.viscous_exponent,
        more.viscous_stiffness,
        power if more.viscous_law == DASHPOT_BESIDE else 0.0,
        more.stiffening_exponent if more.stiffening_law == TO_A_POWER else 2.0,
    ]
    law = np.array(more.learned)
    return Specimen(
        code,
        params,
        memory,
        np.array(values),
        yielding(column.stiffness, more),
        np.zeros(specimens.STATE_SIZE),
        np.array([column.stiffness, bending(more.centring), more.centring_hardening, more.centring_loop]),
        np.zeros(self_centring.STATE_SIZE),
        sliding(more),
        np.zeros(slider.STATE_SIZE),
        np.zeros(9),
        law,
        preisach.memory(law),
    )


def bending(place: float) -> float:
    """Where a law bends (m), at any place where it does not."""
    return place if np.isfinite(place) else 1.0


def corner(effects: ColumnEffects) -> float:
    """Length (m) over which a gap closes, 0 where its law has sharp corners."""
    return effects.slip_corner if effects.slip_law == ROUNDED else 0.0


def sliding(effects: ColumnEffects) -> Array:
    """Parameters of a slider in the specimen's place, in its kernel's order; its joint has the play of the grip."""
    push, pull = (effects.friction * (1.0 + side * effects.friction_asymmetry) for side in (1.0, -1.0))
    joint = [effects.slip, corner(effects)]
    return np.array([effects.friction_stiffness, push, pull, *joint])


def yielding(stiffness: float, effects: ColumnEffects) -> Array:
    """Parameters of the law by which a column of that stiffness (N/m) yields, in the order of its kernel."""
    name, hardening = LAWS[int(effects.law)], effects.hardening
    shape: list[float] = []  # behind stiffness, yield displacement and hardening
    if name == "bouc_wen":
        shape = [effects.exponent, effects.yield_loop, 1.0 - effects.yield_loop]
    elif name == "bwbn":
        loop = [effects.exponent, effects.yield_loop, 1.0 - effects.yield_loop]
        loss = [effects.strength_loss, effects.stiffness_loss]
        pinch = [effects.pinch_depth, effects.pinch_place, effects.pinch_rate, effects.pinch_width]
        shape = [*loop, *loss, *pinch, 0.0, effects.pinch_spread]
    elif name == "menegotto_pinto":
        shape = [effects.exponent, 0.925, 0.15, effects.turn]
    elif name == "clough":  # which has no negative hardening
        hardening, shape = max(hardening, 0.0), [effects.unloading, 0.0, 0.0]
    elif name == "layered":
        concrete = [effects.concrete, effects.axial, effects.concrete_strength, effects.spalling]
        stiffness *= effects.uncracked
        beside = [effects.core, effects.rubbing, effects.eccentricity]
        shape = [*concrete, effects.exponent, effects.shaft, effects.focus, *beside]
    elif name != "bilinear":
        # a skeleton of three lines does not stiffen
        shape = [effects.first_bend, max(effects.second_stiffness, hardening)]
    if name.startswith("pinched"):
        corner = [effects.pinch_force, effects.pinch_displacement]
        shape += [*corner, effects.unloading, effects.damage, effects.yield_asymmetry]
    return np.array([stiffness, bending(effects.yield_displacement), hardening, *shape])


def left_standing(column: Column, effects: ColumnEffects | None) -> Column:
    """The column without its planned dashpot where that of an effect takes its place."""
    more = effects or ColumnEffects()
    return replace(column, damping=0.0) if more.viscous and more.viscous_law == INSTEAD else column


def with_rates(
    column: Column, effects: ColumnEffects, force: Array, displacement: Array, interval: float
) -> Array:
    """Force (n,) N at a displacement (n,) m with mass and dashpots beside the specimen, by central differences.

    These are the plan's and those of laws 0, 1 and 4 of `column.viscous`. `force` (n,) N is what `without_rates` gives,
    unchanged where there are none; `interval` in s.
    """
    damping = left_standing(column, effects).damping
    power = effects.viscous if effects.viscous_law in (BY_POWER, INSTEAD) else 0.0
    damping += effects.viscous if effects.viscous_law == LINEAR else 0.0
    if not (column.mass or damping or power) or displacement.size < 2:
        return force
    velocity = np.gradient(displacement, interval)
    result: Array = force + damping * velocity + column.mass * np.gradient(velocity, interval)
    if power:
        dashpot.add_forces(velocity, power, effects.viscous_exponent, result)
    return result


def without_rates(column: Column, effects: ColumnEffects) -> Specimen:
    """Specimen at rest without the mass and the dashpots that `with_rates` adds."""
    if effects.viscous_law in (LINEAR, BY_POWER, INSTEAD):
        effects = replace(effects, viscous=0.0)
    return build(replace(column, mass=0.0, damping=0.0), effects)


def needs_substeps(effects: ColumnEffects | None) -> bool:
    """Whether an effect depends on the rate of deformation, so that an interval must be divided into short steps."""
    more = effects or ColumnEffects()
    return bool(more.viscous or more.inertia or (more.friction and more.friction_law != IN_PLACE))


def depends_on_steps(effects: ColumnEffects | None) -> bool:
    """Whether the force at the end of a motion on a straight line depends on the steps in which it is made.

    Friction and a plain dashpot have one rate on such a line.
    """
    more = effects or ColumnEffects()
    behind_spring = more.viscous and more.viscous_law in (DASHPOT_IN_PLACE, DASHPOT_BESIDE)
    return bool(more.inertia or behind_spring)


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


@jit
def behind_play(effects: Array, cell: Array, deformation: float) -> float:
    """Deformation (m) of a specimen in a grip with play.

    The gap is about the origin, with sharp or with round corners; or where the specimen rests without force, once it
    leaves the contact that loads it; or where it is held, by friction, until the other flank takes it along.
    """
    half = 0.5 * effects[SLIP]
    if half > 0.0 and effects[CORNER] > 0.0:
        s = effects[CORNER]
        return s * (slider.softplus((deformation - half) / s) - slider.softplus((-deformation - half) / s))
    if half == 0.0 or effects[PLAY] == ORIGIN or effects[PLAY] == PARTLY:
        return deformation - min(max(deformation, -half), half)
    if effects[PLAY] == RESTING and cell[CARRIED] != 0.0:
        cell[INSIDE] = deformation - (half if cell[CARRIED] > 0.0 else -half)
    else:
        cell[INSIDE] = min(max(cell[INSIDE], deformation - half), deformation + half)
    return cell[INSIDE]


@jit
def carried(specimen: Specimen, within: float, rate: float, step: float) -> float:
    """Force (N) of the column at its own deformation (m): of the plan's model, or of the laws in its place.

    The friction of a slider and the force of a dashpot depend on the `rate` (m/s) within a `step` (s).
    """
    effects = specimen.effects
    if effects[SLIDES] != 0.0:
        level = friction.left(rate, 0.0, effects[DROP], effects[SPEED])
        result, elastic = slider.moved(specimen.sliding, specimen.slid, within, level), 0.0
    elif effects[DASHPOT] != 0.0:
        result, elastic = damped(effects, specimen.cell, effects[DASHPOT], rate, step), 0.0
    else:
        result = specimens.step(specimen.code, specimen.params, specimen.memory, within)
        elastic = effects[STIFFNESS] * within
    if effects[YIELDS] != 0.0:
        law = int(effects[YIELDS])
        result += specimens.step(law, specimen.yielding, specimen.yielded, within) - elastic
    if effects[CENTRES] != 0.0:
        result += self_centring.step(specimen.centring, specimen.centred, within) - elastic
    if effects[STIFFENING] != 0.0:
        bend = effects[BEND]
        if bend > 0.0:
            stiffened = within - min(max(within, -bend), bend)
        else:
            stiffened = within * (abs(within) / STIFFENED_AT) ** effects[STIFFENING_POWER]
        result += effects[STIFFENING] * stiffened
    if effects[SECOND_STIFFENING] != 0.0:
        farther = effects[SECOND_BEND]
        result += effects[SECOND_STIFFENING] * (within - min(max(within, -farther), farther))
    return result


@jit
def damped(effects: Array, cell: Array, coefficient: float, rate: float, step: float) -> float:
    """Force (N) of a dashpot (N·s/m) behind its spring at the end of a `step` (s) at a rate (m/s)."""
    held = cell[DAMPED] + effects[SPRING] * rate * step
    cell[DAMPED] = dashpot.relaxed(held, effects[SPRING] * step, coefficient, effects[EXPONENT])
    return float(cell[DAMPED])


@jit
def beside(effects: Array, cell: Array, rate: float, step: float) -> float:
    """Force (N) of the dashpots beside the specimen at the end of a `step` (s) at a rate (m/s)."""
    result = effects[VISCOUS] * rate
    if effects[POWER] != 0.0:
        result += dashpot.force(rate, effects[POWER], effects[EXPONENT])
    if effects[RELAXING] != 0.0:
        result += damped(effects, cell, effects[RELAXING], rate, step)
    return float(result)


@jit
def bell(square: float, tails: float) -> float:
    """Share of pinching's reduction that is left at a squared deformation over its width; `tails` as in its law 1."""
    return np.exp(-square) if tails == 0.0 else (1.0 + square / tails) ** -tails


@jit_apart
def with_effects(specimen: Specimen, deformation: float, step: float) -> float:
    """`force` for a specimen with effects."""
    effects, cell = specimen.effects, specimen.cell
    rested, loaded = cell[INSIDE], cell[CARRIED]
    within = behind_play(effects, cell, deformation)
    moved = deformation - cell[DEFORMATION]
    rate = moved / step
    result = carried(specimen, within, rate, step)
    if effects[PLAY] == RESTING and effects[SLIP] > 0.0:
        if result * loaded < 0.0 or (loaded == 0.0 and within == rested):  # between both contacts
            result = 0.0
        cell[CARRIED] = result
    if effects[BESIDE] != 0.0:
        result += effects[BESIDE] * (deformation - within)
    cell[LARGEST] = max(cell[LARGEST], abs(within))
    if effects[DEGRADATION] != 0.0:
        result *= 1.0 - effects[DEGRADATION] * (1.0 - np.exp(-cell[LARGEST] / DEGRADED_AT))
    if effects[PINCHING] != 0.0:
        closed = bell((within / effects[PINCHING_WIDTH]) ** 2, effects[PINCHING_TAILS])
        result *= 1.0 - effects[PINCHING] * closed + effects[PINCHING_HARDENING] * (1.0 - closed)
    if effects[FRICTION] != 0.0:
        contact = effects[PRESLIDING]
        cell[SLIDER] = min(max(cell[SLIDER] + moved, -contact), contact)
        left = friction.left(rate, effects[FRICTION_VELOCITY], effects[DROP], effects[SPEED])
        side = effects[ASYMMETRY] if cell[SLIDER] > 0.0 else -effects[ASYMMETRY]
        result += effects[FRICTION] * (1.0 + side) * cell[SLIDER] / contact * left
    if specimen.learned.size > 0:
        result += preisach.step(specimen.learned, specimen.learned_memory, deformation, rate)
    cell[REACTION] = result
    result += beside(effects, cell, rate, step)
    if effects[INERTIA] != 0.0 and cell[LAST_STEP] > 0.0:
        result += effects[INERTIA] * (rate - cell[RATE]) / (0.5 * (step + cell[LAST_STEP]))
    cell[DEFORMATION] = deformation
    cell[RATE] = rate
    cell[LAST_STEP] = step
    return result
