"""Trips without a cause in an hour of virtual time over a link with 1 % loss and 1 ms of jitter.

Loops, drive, endpoints and codec run on a simulated clock and link (`rths faults`) in pieces of a minute, each with
its own seeds for noise and link. The storey drift of a piece is compared with that of the same test over a cable.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.result import BenchmarkFigure
from common.plan.plan import Plan
from common.plan.read import with_test
from common.plan.tables import RecordingTable
from common.reality.reality import as_planned
from common.roles import MASTER
from models.indicators import nrmse, peak_error
from models.registry import Array
from validation.faults.invariants import judge
from validation.faults.lab import Simulation, Surrounding
from validation.faults.wire import CABLE, Conditions

MINUTES = int(os.environ.get("RTHS_FALSE_TRIPS_MINUTES", "60"))
PIECE, QUICK_PIECE = 60.0, 1.0  # s; the pieces are independent, and one takes about ten seconds
# The jitter is exponential with a mean of 1 ms, half an interval: a poor network between two cities. Frames may
# overtake each other, as over UDP, or keep their order, as over TCP.
IN_ORDER = Conditions(minimum=CABLE.minimum, mean=1e-3, loss=0.01)
FREE = "frames may overtake"
LINKS = {FREE: IN_ORDER._replace(reorder=1.0), "frames keep their order": IN_ORDER}


class Piece(NamedTuple):
    """One piece over one link: how it ended, and the difference of its storey drift from that over the cable."""

    link: str
    seed: int
    seconds: float  # simulated
    trips: int  # 0 or 1
    violations: int  # of the invariants of `rths faults`
    holds: int  # of both laboratories
    lost: int  # commands and feedbacks
    nrmse: float | None  # of the storey drift; None if the piece ended early
    peak: float | None  # largest difference over the largest drift; None if the piece ended early


def planned(seed: int, seconds: float) -> Plan:
    """The default test with a piece's duration (s), without a recorder."""
    plan = with_test(Plan(), duration=seconds)
    return replace(plan, test=replace(plan.test, seed=seed), recording=RecordingTable(required=False))


def played(plan: Plan, conditions: Conditions) -> Simulation:
    """The finished simulation of a test over a link."""
    simulation = Simulation(plan, as_planned(plan), Surrounding(plan.test.seed, conditions))
    simulation.run()
    return simulation


def drift(simulation: Simulation) -> Array:
    """Storey drift (ticks - 1,), m."""
    return np.array(simulation.probes[MASTER].log.drifts[1 : simulation.plan.ticks])


def pieces_of(seed: int, seconds: float) -> list[Piece]:
    """The results of one piece over each link."""
    plan = planned(seed, seconds)
    perfect = drift(played(plan, CABLE))
    return [piece(link, played(plan, conditions), perfect) for link, conditions in LINKS.items()]


def piece(link: str, poor: Simulation, perfect: Array) -> Piece:
    """The result of one piece."""
    plan, master = poor.plan, poor.loops[MASTER]
    tripped = any(loop.lab.error is not None for loop in poor.loops.values())
    holds = sum(
        one.data["code"] == "mode" and one.data["text"].endswith("(hold)")
        for told in poor.events.values()
        for one in told
    )
    lost = sum(len(way.ledger.numbers["lost"]) for way in poor.wire.directions)
    gaps = (None, None) if tripped else (nrmse(perfect, drift(poor)), peak_error(perfect, drift(poor)))
    seconds = master.ticks * plan.test.interval
    return Piece(link, plan.test.seed, seconds, int(tripped), len(judge(poor)), holds, lost, *gaps)


def gap_figure(which: str, link: str, values: list[float]) -> BenchmarkFigure:
    """Smallest and median value of the pieces; the name of the figure has the largest."""
    worst = f", worst {max(values):.3g}" if values else ""
    middle = statistics.median(values) if values else None
    name = f"added gap in the storey drift, {which}, {link}{worst}"
    return BenchmarkFigure(name, "of the drift", min(values, default=None), middle)


def figures(pieces: list[Piece]) -> list[BenchmarkFigure]:
    """Trips, holds and the added difference over one link.

    The target is judged only where frames may overtake each other: in order, one lost frame delays all later ones, so
    that a trip has a cause.
    """
    hours = sum(one.seconds for one in pieces) / 3600.0
    trips, link = sum(one.trips for one in pieces), pieces[0].link
    holds = sum(one.holds for one in pieces) / hours
    judged = link == FREE
    met = trips == 0 and not any(one.violations for one in pieces)
    points = [one._asdict() for one in pieces]
    return [
        BenchmarkFigure(
            f"trips in {hours:.2g} h, {link}",
            "trips",
            float(trips),
            float(trips),
            "0" if judged else "",
            met if judged else None,
            points=points,
        ),
        BenchmarkFigure(f"holds of either laboratory, {link}", "per hour", holds, holds),
        gap_figure("NRMSE", link, [one.nrmse for one in pieces if one.nrmse is not None]),
        gap_figure("largest", link, [one.peak for one in pieces if one.peak is not None]),
    ]


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """Simulate all pieces; writes a line of progress after each."""
    began, pieces = time.monotonic(), []
    count, seconds = (1, QUICK_PIECE) if quick else (MINUTES, PIECE)
    for seed in range(1, count + 1):
        pieces += pieces_of(seed, seconds)
        trips = {link: sum(one.trips for one in pieces if one.link == link) for link in LINKS}
        told = ", ".join(f"{count} trips where {link}" for link, count in trips.items())
        sys.stderr.write(f"{seed} of {count} pieces: {told}, {time.monotonic() - began:.0f} s\n")
    return [figure for link in LINKS for figure in figures([one for one in pieces if one.link == link])]
