"""How far the true effects close the gap of a case: the most that a diagnosis can reach."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from common.plan.plan import Plan
from common.reality.reality import Reality
from common.recording.reader import read
from common.recording.run import Run
from diagnosis.report.records import Report
from laboratories import kinds
from master.building import BuildingStep
from simulation import virtual

# Share of the gap that the truth closes. Where it is smaller, nine tenths of the gap are a chance difference of two
# draws of noise, and a share of the rest would divide by almost nothing.
LEAST = 0.1
NEVER = 100_000  # readings in a row, the most that a plan takes: more than a trial has


def silent_run(plan: Plan, reality: Reality, path: Path, building: BuildingStep | None = None) -> Run:
    """The test with the true laboratories and sensors without noise; its recording is written to `path`.

    With a `building` the master serves it instead of computing the reality's own.
    """
    virtual.run(virtual.assemble(without_noise(plan), reality, path, building=building), lambda: "")
    return read(path)


def without_noise(plan: Plan) -> Plan:
    """The plan for sensors without noise, of which one that reads the same while a play is crossed is not frozen."""
    return replace(plan, safety=replace(plan.safety, frozen_readings=NEVER))


def gaps(recorded: Run, true: Run, plan: Plan) -> dict[str, float]:
    """rms(recorded - true)/rms(recorded) of every measured signal; of a name at several roles, that of the first."""
    found: dict[str, float] = {}
    for role, kind in kinds.kinds_of(plan).items():
        for name in kind.channels.names:
            if recorded.ticks(role) and true.ticks(role) and name not in found:
                read_, wanted = (run.columns[role][name] for run in (recorded, true))
                size = min(read_.size, wanted.size)
                level = float(np.sqrt(np.mean(read_[:size] ** 2)))
                left = float(np.sqrt(np.mean((read_[:size] - wanted[:size]) ** 2)))
                found[name] = left / level if level else math.nan
    return found


def best_closed(reports: Sequence[Report], left: Mapping[str, float]) -> float:
    """Share of the gap above the noise that the true effects close; NaN where chance makes the gap.

    `left` are the gaps of the true laboratories by signal. Of several reports the largest share counts; where no report
    has a gap, it is 1.
    """
    shares = [share for report in reports if not math.isnan(share := share_closed(report, left))]
    best = max(shares, default=1.0)
    return best if best >= LEAST else math.nan


def share_closed(report: Report, left: Mapping[str, float]) -> float:
    """The same of one report."""
    far = report.how_far
    names = [name for name in report.gap.signals if name in left and math.isfinite(left[name])]
    if far.before is None or far.noise_floor is None or not names or far.before <= far.noise_floor:
        return math.nan
    after = math.sqrt(float(np.mean([left[name] ** 2 for name in names])))
    return (far.before - max(after, far.noise_floor)) / (far.before - far.noise_floor)
