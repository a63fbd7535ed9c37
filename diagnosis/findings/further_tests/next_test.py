"""Which further test would tell the remaining candidates apart: both are simulated in each test of a short list.

The separation of two hypotheses in a test is what remains of the difference of their predictions once the second one's
own parameters and the nominal ones have been fitted to imitate the first, in standard deviations of the sensors' noise
(T-optimality, Atkinson and Fedorov, Biometrika 62 (1975) 57).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from diagnosis.findings.found import Diagnosis
from diagnosis.fits import hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Problem
from diagnosis.fits.residuals import Data
from diagnosis.fits.search import Search, exchanged_pair
from diagnosis.recorded.parts import LaboratoryPart
from models.registry import Array

SECONDS = 10.0  # length of a proposed test: one cycle of the slowest motion on the list, 0.1 Hz
# Standard deviations from which on two hypotheses count as separated; by chance once in 370 times.
ENOUGH = 3.0
# 1/s, largest velocity of a proposed sine over the displacement that the recording reached. It bounds the sines above
# 1.3 Hz, about where buildings respond, so that a rig is not asked for velocities that it has not shown.
STEEPEST = 8.0
MOST = 3  # pairs compared in each part: the nearest alternatives are the ones worth another test
# Difference in cost up to which a candidate is worth another test. A fit prefers one hypothesis over another by 6
# standard deviations at a cost of 36; beyond that the recording has decided.
OPEN = 40.0


class ChosenTest(NamedTuple):
    """A test, and how well it separates a pair."""

    test: str
    separation: float
    pair: tuple[str, str]


def choices(found: Diagnosis) -> list[ChosenTest]:
    """Tests for the pairs that are still open, the one that separates best first."""
    result: list[ChosenTest] = []
    for verdict in found.verdicts:
        search = verdict.search
        if not isinstance(search.data.part, LaboratoryPart) or not search.chosen.names:
            continue
        for other in search.alternatives[:MOST]:
            pair = exchanged_pair(search.chosen, other)
            close = (other.cost - search.chosen.cost) < OPEN * max(
                1.0, search.chosen.chi / search.chosen.data.size
            )
            if pair is not None and close:
                result += [ChosenTest(name, value, pair) for name, value in separations(search, other)]
    return sorted(result, key=lambda item: -item.separation)


def separations(search: Search, other: Fit) -> list[tuple[str, float]]:
    """Every proposed test that the models can have, with the separation of the chosen fit and another."""
    found = []
    for name, data in menu(search.data):
        try:
            found.append((name, separation(data, search.chosen, other)))
        except (InputError, np.linalg.LinAlgError):
            continue
    return found


def separation(data: Data, one: Fit, other: Fit) -> float:
    """Distance of two hypotheses in a test, in standard deviations of the noise."""
    truth = data.part.predict(hypothesis.lay(data, one.z, one.values))
    part = played(data, truth)
    problem = Problem(part, other.values)
    p = problem.place(other.values, other.z)
    here = problem.reduced(p).ravel()
    slopes = np.concatenate([problem.jacobian(p, here), np.eye(problem.count, p.size)])
    rest = np.concatenate([here, np.zeros(problem.count)])
    left = rest - slopes @ np.linalg.lstsq(slopes, rest, rcond=1e-10)[0]
    return math.sqrt(float(left @ left))


def played(data: Data, truth: Array) -> Data:
    """Data of a test whose readings are `truth` (ticks, signals), without the spikes and lines of the recorded one."""
    part = data.part
    if isinstance(part, LaboratoryPart):
        read = np.broadcast_to(part.present.any(axis=0), truth.shape).copy()
        part = part.replaced(measured=np.where(read, truth, 0.0), present=read)
    return replace(data, part=part, lines=None, spikes=None)


def menu(data: Data) -> list[tuple[str, Data]]:
    """Tests to choose from in a part's laboratory: the same motion at other scales, sines, and slow cycles.

    A device that did not move is left out, since nothing tells how far it can.
    """
    part = data.part
    if not isinstance(part, LaboratoryPart):
        return []
    interval = data.system.plan.test.interval
    ticks = round(SECONDS / interval)
    t = np.arange(ticks) * interval
    tests: list[tuple[str, dict[str, Array]]] = []
    for key, device in part.devices.items():
        reached = float(np.max(np.abs(part.inputs[key]), initial=0.0))
        if reached == 0.0:
            continue
        for factor in (0.5, 2.0):
            tests.append(
                (
                    f"the same motion of the {device} at {factor:g} times the scale",
                    {k: factor * v for k, v in part.inputs.items()},
                )
            )
        for frequency in (0.5, 2.0, 6.0):
            size = reached * min(1.0, STEEPEST / (2.0 * math.pi * frequency))
            wave = size * np.sin(2.0 * math.pi * frequency * t) * np.minimum(1.0, t)
            text = (
                f"a sine of {frequency:g} Hz and {size:.3g} {part.units[key]} on the {device}, {SECONDS:g} s"
            )
            tests.append((text, {key: wave}))
        slow = 2.0 * reached * np.sin(0.2 * math.pi * t)
        tests.append(
            (f"slow cycles (0.1 Hz, {2 * reached:.3g} {part.units[key]}) on the {device}", {key: slow})
        )
    return [(name, replace(data, part=part.another_test(inputs))) for name, inputs in tests]


def sentence(found: list[ChosenTest], describe: Callable[[str], str] = str) -> str:
    """The advice in one sentence, empty where no two candidates need to be separated."""
    if not found:
        return ""
    best = found[0]
    first, second = (describe(name) for name in best.pair)
    if best.separation < ENOUGH:
        return (
            f"No proposed motion separates {first} from {second} (the best one by {best.separation:.1f} standard "
            "deviations): check the sensor or the part by itself, with a dead weight or a second sensor."
        )
    apart = f"it separates {first} from {second} by {best.separation:.0f} standard deviations of the noise"
    return f"Run {best.test}: {apart}."
