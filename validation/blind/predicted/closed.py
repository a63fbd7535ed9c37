"""The share of the gap that the effects found close in the next test, to be compared with the share that was stated.

A report states the share for the diagnosed motion, above the noise; here it is that of another motion, half to twice as
strong, against readings without noise. Both compare the laboratories with fitted parameters alone and with the effects.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from common.plan.plan import Plan
from diagnosis.findings.how_far import ROOM
from laboratories.kinds import kinds_of
from loop.of_reality import really
from loop.signals import by_role
from models.registry import Array
from simulation.prediction.draws import FoundLaboratories, has_random_links
from validation.blind.predicted.next_test import Readings

Channels = Sequence[tuple[str, str]]  # role and name
# Gap over noise above which the response shows a gap, as in a report: there the gap with noise, the root of the sum of
# squares, exceeds the noise by `ROOM`.
SHOWN = math.sqrt((1.0 + ROOM) ** 2 - 1.0)


def closed(
    found: FoundLaboratories, plan: Plan, true: Readings, noise: Mapping[str, Mapping[str, float]]
) -> float:
    """The share of the gap of the response that closes; of all readings where the response hardly shows the gap.

    NaN where no effects were found, where messages are lost or late by chance, where neither shows the gap, and where a
    simulation diverges.
    """
    if not found.truth.effects or has_random_links(found.truth):
        return math.nan
    named = replace(found.truth, learned=())
    rollouts = [really(one, noise=False) for one in (replace(named, effects=(), only=()), named)]
    if not all(one.finite for one in rollouts):
        return math.nan
    before, after = (by_role(plan, one) for one in rollouts)
    kinds = kinds_of(plan)
    everything = [(role, name) for role, kind in kinds.items() for name in kind.channels.names]
    response = [
        (role, name)
        for role, kind in kinds.items()
        for name in kind.responses or (kind.channels.position, kind.channels.force)
    ]
    for channels in (response, everything):
        gap = overall(channels, before, true)
        if gap > SHOWN * floor(channels, true, noise):
            return 1.0 - overall(channels, after, true) / gap
    return math.nan


def overall(channels: Channels, simulated: Mapping[str, Mapping[str, Array]], true: Readings) -> float:
    """Root mean square over channels of rms(true − simulated)/rms(true)."""
    shares = []
    for role, name in channels:
        real = true[role][name]
        error = real - simulated[role][name][: real.size]
        shares.append(float(np.mean(error**2)) / power(real))
    return math.sqrt(float(np.mean(shares)))


def floor(channels: Channels, true: Readings, noise: Mapping[str, Mapping[str, float]]) -> float:
    """Root mean square over channels of the noise over the readings."""
    return math.sqrt(
        float(np.mean([noise[role][name] ** 2 / power(true[role][name]) for role, name in channels]))
    )


def power(series: Array) -> float:
    """Mean square; 1 of a reading that is zero."""
    return float(np.mean(series**2)) or 1.0
