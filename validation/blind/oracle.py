"""The separation of a case's effects from noise and tolerances, by a test that knows everything else: the oracle.

The oracle knows which effects a case hides and how large they are, the noise of every sensor with its colour and what
the logger does; of the laboratories' parameters it knows only the nominal values and their tolerances. With r(z) the
difference of all readings, under the recorded commands, between the laboratory with its effects and one without them
whose parameters are moved by z standard deviations of their tolerances, whitened with the noise, the separation is that
of the laboratory which comes nearest:

    s² = min over z of ‖r(z)‖² + ‖z‖²

For small changes the most powerful test has this separation (J. Neyman, E. S. Pearson, Phil. Trans. R. Soc. A 231
(1933) 289-337). A test of the separation `SEEN` that raises one false alarm in a thousand misses one effect in a
thousand.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from common.plan import read as plans
from common.plan.kinds import TABLES_OF_KIND, known_kind
from common.recording.run import Run
from common.roles import MASTER, SLAVE, name_of
from laboratories.effects.sites import LINK
from laboratories.kinds import kind_of, kinds_of
from models.registry import Array
from validation.blind.cases.case import Case, Laid, of_role
from validation.blind.cases.truths import tolerance
from validation.blind.logger.logged import DECIMALS, MAINS, RANGE, colour_shape
from validation.blind.logger.loggers import LOGGERS, Logger
from validation.blind.size import levels, messages, play, play_building

SEEN = 6.18  # twice the 99.9 % point of the normal distribution
FLOOR = 1e-4  # of white noise, in amplitude: where coloured noise fades, two solutions of one model differ by this much
WIDTH = 1.0  # Hz, to each side of the mains, which hum hides: where the leakage of a line in 30 s has fallen to 1 %
RANDOM = (
    ".noise",
    ".missing",
    ".clock",
)  # effects without a waveform of their own: only their energy can be tested
UNIFORM = math.sqrt(3.0)  # half the width of a uniform distribution over its standard deviation
NEAREST = 0.5, 2.0  # times its true value: within these a parameter of the nearest laboratory is looked for
STEP = 0.05  # standard deviations of the parameters, for the slopes with which it is looked for
RENEWED = 3  # slopes of a building, which swings on by itself: a frequency that is 5 % off is no small change
ROUNDS, SETTLED = 10, 1e-2  # how often it is moved, and the share of its distance from which on that goes on
Signals = Mapping[str, Array]
Played = Callable[[Case, tuple[Laid, ...]], Signals]


class Tolerated(NamedTuple):
    """A parameter that is known within a tolerance: its table, its name, and its standard deviation over its value."""

    table: str
    name: str
    width: float


def separation(case: Case, run: Run) -> float:
    """The separation of all effects of a case together, 0 for a clean laboratory, NaN where it was not recorded."""
    if not case.laid:
        return 0.0
    if not all(map(run.has, (MASTER, *plans.from_tables(case.plan, Path()).roles))):
        return math.nan
    squares = 0.0
    for role in {item.role for item in case.laid}:
        here = tuple(item for item in case.laid if item.role == role)
        inside = tuple(item for item in here if item.site != LINK)
        squares += at_role(case, role, inside, run) ** 2 if inside else 0.0
        squares += at_link(case, role, run) if len(inside) < len(here) else 0.0
    return math.sqrt(squares)


def at_role(case: Case, role: str, laid: tuple[Laid, ...], run: Run) -> float:
    """The separation of the effects of one role's laboratory, or of the building (no role)."""

    def played(other: Case, effects: tuple[Laid, ...]) -> Signals:
        return play(other, effects, run, role) if role else play_building(other, effects, run)

    truly, without = played(case, laid), played(case, ())
    whitened = whitening(case, truly, noise_at(case, role))
    change = whitened(less(truly, without))
    if all(item.name.endswith(RANDOM) for item in laid):
        return float(change @ change) / math.sqrt(2.0 * change.size)  # of the energy, over its scatter
    return nearest(case, role, lambda other: whitened(less(truly, played(other, ()))))


def nearest(case: Case, role: str, apart: Callable[[Case], Array]) -> float:
    """The separation from the nearest laboratory without effects; `apart` is the whitened difference from a case.

    Slopes follow the steps (Broyden, Mathematics of Computation 19 (1965) 577-593).
    """
    known = tolerated(case, role)
    if not known:
        return float(np.linalg.norm(apart(case)))

    def left(z: Array) -> Array:
        return np.concatenate([apart(moved(case, role, known, z)), z])

    z = np.zeros(len(known))
    here, widths = left(z), np.array([item.width for item in known])
    low, high = ((factor - 1.0) / widths for factor in NEAREST)
    for _ in range(1 if role else RENEWED):
        slopes = np.stack([(left(z + step) - here) / STEP for step in STEP * np.eye(z.size)], axis=1)
        for _ in range(ROUNDS):
            step = np.clip(z - np.linalg.lstsq(slopes, here)[0], low, high) - z
            if not step.any():
                break
            there = left(z + step)
            slopes += np.outer(there - here - slopes @ step, step) / (step @ step)
            gain = float(here @ here - there @ there)
            if gain > 0.0:
                z, here = z + step, there
            if 0.0 <= gain < SETTLED * float(here @ here):
                break
    return float(np.linalg.norm(here))


def less(one: Signals, other: Signals) -> dict[str, Array]:
    """Differences by name."""
    return {name: values - other[name] for name, values in one.items()}


def noise_at(case: Case, role: str) -> dict[str, tuple[float, str]]:
    """Rms and unit of the noise of each signal of a role; for the building that of the laboratories' positions."""
    plan = plans.from_tables(case.plan, Path())
    if role:
        noise = levels(case, role)
        return {row.name: (noise[row.name], row.unit) for row in kind_of(plan, role).channels.measured}
    kinds = kinds_of(plan)
    found = {one: (levels(case, one)[kind.channels.position], "m") for one, kind in kinds.items()}
    return {"": (case.truths["sensors"]["table_acceleration"], "m/s²"), **found}


def tolerated(case: Case, role: str) -> list[Tolerated]:
    """The true parameters of a role, or of the building, that are known within tolerances."""
    plan = plans.from_tables(case.plan, Path())
    true = of_role(case.truths, role)
    known = TABLES_OF_KIND[known_kind(plan.kinds[role])] if role else ("structure",)
    found = []
    for table in (name for name in known if name in true):
        for name, value in true[table].items():
            if isinstance(value, float) or (isinstance(value, list) and isinstance(value[0], float)):
                width = tolerance(plan, table, name) / (1.0 if case.normal else UNIFORM)
                found.append(Tolerated(table, name, width))
    return found


def moved(case: Case, role: str, known: Sequence[Tolerated], z: Array) -> Case:
    """The case with true parameters of a role, or of the building, moved by z standard deviations each."""
    truths = case.truths
    for (table, name, width), count in zip(known, z.tolist(), strict=True):
        true, factor = of_role(truths, role)[table][name], 1.0 + count * width
        value = [item * factor for item in true] if isinstance(true, list) else true * factor
        truths = with_value(truths, role, table, name, value)
    return replace(case, truths=truths)


def with_value(truths: Mapping[str, Any], role: str, table: str, name: str, value: Any) -> dict[str, Any]:
    """True parameters with another value of one of them."""
    slave = name_of(role)
    if slave:
        own = with_value(truths[SLAVE][slave], "", table, name, value)
        return {**truths, SLAVE: {**truths[SLAVE], slave: own}}
    return {**truths, table: {**truths[table], name: value}}


def whitening(
    case: Case, truly: Signals, noise: Mapping[str, tuple[float, str]]
) -> Callable[[Signals], Array]:
    """A function that stacks changes of readings, divided by the amplitude of their noise at every frequency."""
    interval = case.plan["test"]["interval"]
    logger = LOGGERS[case.logger] if case.logger else Logger("")
    amplitudes = {
        name: amplitude(logger, *noise[name], np.asarray(values), interval)
        for name, values in truly.items()
        if noise[name][0] > 0.0
    }

    def whitened(changes: Signals) -> Array:
        stacked = []
        for name, rms in amplitudes.items():
            spectrum = np.fft.rfft(changes[name], norm="ortho")[1:] * math.sqrt(2.0) / rms
            stacked += [spectrum.real, spectrum.imag]
        return np.concatenate(stacked)

    return whitened


def amplitude(logger: Logger, level: float, unit: str, values: Array, interval: float) -> Array:
    """Noise amplitude at each frequency above zero, for noise of rms `level`, including that of the logger."""
    frequency: Array = np.asarray(np.fft.rfftfreq(values.size, interval)[1:], dtype=np.float64)
    shape = colour_shape(logger.colour, frequency, 1.0 / interval)
    power = level**2 * (shape**2 + FLOOR**2)
    if logger.printed:
        power = power + DECIMALS[unit] ** 2 / 12.0
    if logger.bits:
        middle = math.sqrt(RANGE[0] * RANGE[1])
        power = power + (2.0 * middle * float(np.max(np.abs(values))) / 2**logger.bits) ** 2 / 12.0
    if logger.clock is not None:  # the noise of a row, of which there are more or fewer than ticks
        power = power / (logger.clock.rate * interval)
    if logger.hum:
        power = np.where(np.abs(frequency - MAINS) < WIDTH, np.inf, power)
    return np.asarray(np.sqrt(power))


def at_link(case: Case, role: str, run: Run) -> float:
    """The square of the separation of a link's effects, from the changed messages of a slave."""
    changed = messages(case, run, role)
    return sum(float(np.sum((values / level) ** 2)) for values, level in changed if level > 0.0)
