"""Control steps per second of the compiled closed loop, compared with plain Python and with OpenSeesPy.

All rates are per second of processor time, because the machine is shared. They include the time to build the loop and
to name its signals.
"""

from __future__ import annotations

import statistics
from dataclasses import replace
from time import process_time

import numpy as np

from benchmarks import opensees_peer, virtual_time
from benchmarks.opensees_peer import PeerAnswer, PeerCase
from benchmarks.result import BenchmarkFigure, rate_figure, rates
from common.plan.laboratory_tables import Control
from common.plan.plan import Plan, ideal
from common.plan.read import with_test
from loop import substructure
from loop.closed_loop import simulate
from loop.signals import signals
from models.registry import Array

TARGET = 5e6  # steps/s: 250 simulations of the default test (20,000 ticks) per second
REPEATS = 7  # of work that takes about 1 s; odd, so that the median is a measured value
COMPILED_REPEATS = (
    100  # of work that takes a few ms: some of them run without other processes on the same core
)
QUICK_S = 2.0  # duration of the test
# Largest difference over the peak. The methods are algebraically the same (they shorten the period by (ω·h)²/24), so
# that they differ by rounding only, 2e-11; another method or input differs by more than 1e-3.
SAME = 1e-3


def plain_python(plan: Plan, ground: Array) -> list[float]:
    """Displacements (m) of the nominal building alone by the central difference method, step by step in Python."""
    (mass,), (stiffness,), (damping,) = plan.structure.mass, plan.structure.stiffness, plan.structure.damping
    dt, before, now = plan.test.interval, 0.0, 0.0
    left = mass / dt**2 + damping / (2.0 * dt)
    right = mass / dt**2 - damping / (2.0 * dt)
    found = []
    for acceleration in ground[0, :-1].tolist():
        found.append(now)
        load = -mass * acceleration - stiffness * now + 2.0 * mass / dt**2 * now - right * before
        before, now = now, load / left
    return found


def bare(plan: Plan) -> Plan:
    """The plan without the damper and with ideal transfer systems; its response is that of the building alone."""
    return replace(ideal(plan), control=Control(amd=False))


def difference(name: str, x: Array, theirs: Array) -> BenchmarkFigure:
    """The largest difference between two responses (ticks,) in m, over the peak of the first."""
    found = float(np.max(np.abs(x - theirs)) / np.max(np.abs(x)))
    return BenchmarkFigure(name, "of the peak", found, found, f"≤ {SAME:g}", found <= SAME)


def case_of(plan: Plan, ground: Array) -> PeerCase:
    """The only storey of the plan, including the specimen, for OpenSeesPy."""
    structure = plan.structure
    return PeerCase(
        structure.mass[0],
        structure.stiffness[0],
        structure.damping[0],
        plan.test.interval,
        ground[0, :-1].tolist(),
    )


def opensees(answer: PeerAnswer | str, x: Array, compiled: float, objects: float) -> list[BenchmarkFigure]:
    """OpenSeesPy's rates with their ratios to ours, `compiled` and of the loop `objects` (steps/s).

    The last figure is the difference of OpenSeesPy's displacements from `x` (ticks,) in m.
    """
    if isinstance(answer, str):
        return [BenchmarkFigure(f"OpenSeesPy: not installed here ({answer[:60]})", "", None, None)]
    theirs = np.array(
        [0.0, *answer.displacement[:-1]]
    )  # OpenSees's first value is of the end of the first interval
    return [
        rate_figure(
            f"OpenSeesPy {answer.version}, building alone, all in one call",
            "steps/s",
            answer.at_once,
            peer="our compiled closed loop, laboratories included",
            beside=compiled,
        ),
        rate_figure(
            f"OpenSeesPy {answer.version}, building alone, read step by step",
            "steps/s",
            answer.by_step,
            peer="our loops, with laboratories, noise and protocol",
            beside=objects,
        ),
        difference("difference from OpenSeesPy, ideal test", x, theirs),
    ]


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """The default test without and with noise; the ideal test compared with plain Python and OpenSeesPy."""
    plan, repeats = (with_test(Plan(), duration=QUICK_S), 1) if quick else (Plan(), REPEATS)
    often = 1 if quick else COMPILED_REPEATS
    alone = bare(plan)
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    peer = statistics.median(rates(lambda: len(plain_python(plan, ground)), repeats, process_time))
    compiled = rates(lambda: simulate(plan, ground).ticks, often, process_time)
    noisy = rates(lambda: simulate(plan, ground, seed=1).ticks, often, process_time)
    objects = [pace.processor for pace in virtual_time.unrecorded(plan, repeats)]
    x = signals(alone, simulate(alone, ground))["displacement"]
    words = "central difference of the building alone in plain Python"
    return [
        rate_figure("compiled closed loop", "steps/s", compiled, least=TARGET, peer=words, beside=peer),
        rate_figure("compiled closed loop with noise", "steps/s", noisy),
        difference("difference from that peer, ideal test", x, np.array(plain_python(plan, ground))),
        *opensees(
            opensees_peer.ask(case_of(plan, ground)._replace(repeats=repeats)),
            x,
            statistics.median(compiled),
            statistics.median(objects),
        ),
    ]
