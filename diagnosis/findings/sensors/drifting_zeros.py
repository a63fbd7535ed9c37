"""Zeros of sensors that drift by less than can be seen beside their noise, as every sensor's does."""

from __future__ import annotations

from diagnosis.findings.certainty.other_causes import small
from diagnosis.fits import fitting, worth
from diagnosis.fits.search import Search
from diagnosis.fits.unexplained import MATERIAL, exceeds, gaps, leaves, model_error, remaining


def drifting_zeros(search: Search) -> tuple[str, ...]:
    """The readings whose zeros drift, where this leaves nothing of a gap that is smaller than can be seen.

    Empty where it does not, or where effects were found that a motion causes. A gap is also too small where two good
    solutions of one model may differ by it. A drift need not be steady: a zero and its rate stand side by side.
    """
    bare = search.commissioned
    catalogue, data = bare.data.catalogue, bare.data
    if not all(catalogue[name].motionless for name in search.chosen.names) or worth.strained(bare):
        return ()
    if not (remaining(bare) < worth.SEEN or small(search)):
        return ()
    found = zip(data.part.signals, gaps(bare, data.group), strict=True)
    signals = tuple(signal for signal, gap in found if exceeds(gap, MATERIAL))
    zeros = {
        effect.name: {item.name: item.null for item in effect.parameters}
        for effect in catalogue.values()
        if effect.motionless and effect.signal in signals
    }
    if not zeros:
        return ()
    beside = fitting.fit(data, zeros, bare.z)
    return () if leaves(beside, model_error(beside)) else signals
