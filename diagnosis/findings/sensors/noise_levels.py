"""How loud the noise of a part's sensors is, by what the verdict on the part leaves."""

from __future__ import annotations

import numpy as np

from diagnosis.fits import hypothesis
from diagnosis.fits.search import Search
from diagnosis.fits.unexplained import MATERIAL, gaps
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals.noise.colour import SEGMENT
from models.registry import Array

# Share of a gap's rms that may be taken for coloured noise where only the residual itself is evidence: a sixth of its
# energy.
OWN = 0.4


def noise_rms(search: Search) -> Array:
    """Rms noise (signals,) of a part's sensors; that of the highest frequencies where the rest of it is doubtful."""
    white = search.data.white
    return np.minimum(white, highest_rms(search)) if unproven(search) else white


def highest_rms(search: Search) -> Array:
    """Rms noise (signals,) of a part's sensors at the highest frequencies, without the lines that they pick up."""
    data, fit = search.data, search.chosen
    return data.white_part(data.residual(hypothesis.lay(data, fit.z, fit.values)))


def sensors_rms(search: Search) -> Array:
    """Rms noise (signals,) at the highest frequencies that is a sensor's: no more than before the test, where known.

    What a machine does between the ticks, as a mass that follows each step of a command, looks like noise in the test.
    """
    data, level = search.data, highest_rms(search)
    kept = data.part.rest if isinstance(data.part, LaboratoryPart) else ()
    for place, readings in enumerate(kept):
        if readings is not None and readings.size >= SEGMENT * data.group:
            still = np.zeros((readings.size, level.size))
            still[:, place] = readings - readings.mean()
            level[place] = min(level[place], data.white_part(still)[place])
    return level


def lines_rms(search: Search) -> Array:
    """Rms (signals,) of the narrow lines that a part's sensors pick up."""
    lines = search.data.lines
    return np.zeros(search.data.sigma.size) if lines is None else np.sqrt(np.mean(np.square(lines), axis=0))


def unproven(search: Search) -> bool:
    """Whether a large share of a gap is taken for noise for which the residual itself is the only evidence."""
    before, after = search.commissioned, search.chosen
    left = [
        np.sqrt(np.mean(np.square(fit.data.residual(hypothesis.lay(fit.data, fit.z, fit.values))), axis=0))
        for fit in (before, after)
    ]
    seen = np.array([item.ratio > MATERIAL for item in gaps(before, search.data.group)])
    own = np.array([item.unproven for item in search.data.noise])
    if not own.size or not np.any(seen & own):
        return False
    was, is_ = (np.square(rms / search.data.sigma)[seen & own].sum() for rms in left)
    return bool(is_ > OWN**2 * was)
