"""Which share of the response gap each site causes."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from diagnosis.findings.gaps import RecordingGaps
from diagnosis.findings.where import SiteTrace
from diagnosis.recorded.loop import overall
from diagnosis.report.evidence import LoopShare
from diagnosis.signals.mask import Mask
from models.registry import Array

# Sites among which shares are computed exactly: each subset takes one simulation of the closed loop, and six sites have
# 64 subsets.
PLAYERS = 6
NO_SHARE = 1e-4  # sum of the shares, as gaps, below which the response shows none of the sites


def shares(
    own: RecordingGaps, traces: Sequence[SiteTrace]
) -> tuple[dict[str, tuple[float, float, float]], tuple[LoopShare, ...]]:
    """Share of the response gap that each site causes, with its range over the thirds of the test.

    Returned with it: exact Shapley values, and what correcting each site takes away as the first and as the last one.
    A site whose cause is unknown is corrected by adding what is left of its laboratory's readings, which goes round the
    loop as a force or a motion would.
    """
    sites = [trace.site for trace in sorted(traces, key=lambda item: -item.ratio)]
    if len(sites) < 2:
        return dict.fromkeys(sites, (1.0, 1.0, 1.0)), ()
    players, left = sites[:PLAYERS], {trace.site: trace.left for trace in traces}
    simulated: dict[frozenset[str], Mapping[str, Array] | None] = {}

    def value(mask: Mask, subset: frozenset[str]) -> float:
        if subset not in simulated:
            rest = [item for site in subset for item in left[site].items()]
            simulated[subset] = own.signals(subset, dict(rest))
        return -overall(own.gap(simulated[subset], mask))

    ticks = np.arange(own.record.ticks)
    masks = [ticks >= 0, *(ticks * 3 // own.record.ticks == third for third in range(3))]
    found = [shapley(players, functools.partial(value, mask)) for mask in masks]
    weights = [normalised(item, traces) for item in found]
    result = {}
    for site in sites:
        drawn = [item.get(site, 0.0) for item in weights]
        result[site] = (drawn[0], min(drawn), max(drawn))
    rows = tuple(
        LoopShare(
            site=site,
            shapley=values[0],
            interval=(min(item[site][0] for item in found), max(item[site][0] for item in found)),
            first_in=values[1],
            last_out=values[2],
        )
        for site, values in found[0].items()
    )
    return result, rows


def normalised(
    found: Mapping[str, tuple[float, float, float]], traces: Sequence[SiteTrace]
) -> dict[str, float]:
    """Shares that sum to one; where the response shows none of the sites, the traces in their own parts decide."""
    sizes = {site: max(share, 0.0) for site, (share, _, _) in found.items()}
    ratios = {trace.site: trace.ratio for trace in traces}
    if sum(sizes.values()) <= NO_SHARE:
        sizes = {site: ratios[site] for site in found}
    total = sum(sizes.values()) or 1.0
    return {site: size / total for site, size in sizes.items()}


def shapley(
    players: Sequence[str], value: Callable[[frozenset[str]], float]
) -> dict[str, tuple[float, float, float]]:
    """Per player: exact Shapley share of `value(all) − value(none)`, its gain as the first and as the last one added.

    Source: Shapley, A value for n-person games (1953). `value` is asked for all 2ⁿ subsets.
    """
    known = {
        frozenset(subset): value(frozenset(subset))
        for size in range(len(players) + 1)
        for subset in itertools.combinations(players, size)
    }
    count, everyone, nobody = len(players), frozenset(players), frozenset[str]()
    result = {}
    for player in players:
        share = 0.0
        for subset, worth in known.items():
            if player in subset:
                continue
            weight = math.factorial(len(subset)) * math.factorial(count - len(subset) - 1)
            share += weight / math.factorial(count) * (known[subset | {player}] - worth)
        first = known[frozenset({player})] - known[nobody]
        last = known[everyone] - known[everyone - {player}]
        result[player] = (share, first, last)
    return result
