"""Errors of a reading and effects of the machine before it, where both are one function of the same motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from common.recording.imported import NOTHING_STATED
from diagnosis.findings.sites.likely import TRUE_LEAVES
from diagnosis.fits import candidates, hypothesis, worth
from diagnosis.fits.fitting import Fit, excess
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.search import Search
from diagnosis.recorded.joined import column_of

# Share of the most energy that a specimen ever held, from which on it gave some that it never had: of steps in time and
# of noise in commands 0.002 was the most; a load cell that lags by 0.8 % of its range had 0.23.
GIVEN = 0.05
STATIC = ("gain", "saturation")  # errors of a reading that depend on what it reads and on nothing else


def machine_alone(search: Search) -> Search:
    """A search without static errors of a reading that shows nothing but another effect, where that explains the gap.

    What a specimen does and how its load cell errs are then one function of the same motion. Only their formulas tell
    them apart, and the law of no specimen is exactly one of the catalogue's: it leaves what a true mechanism may.
    """
    fit = search.chosen
    for name in errors(fit):
        less = candidates.without(fit, name)
        if excess(less) < TRUE_LEAVES * excess(search.commissioned):
            fit = less
    if fit is search.chosen:
        return search
    return replace(search, chosen=fit, alternatives=(search.chosen, *search.alternatives))


def errors(fit: Fit) -> list[str]:
    """The effects of a fit that are static errors of a reading which a machine's effect changes alone."""
    catalogue, signals = fit.data.catalogue, fit.data.part.signals
    seen = [size > worth.SEEN**2 * fit.data.group for size in worth.changes(fit)]
    machines = [
        shown for name, shown in zip(fit.names, seen, strict=True) if catalogue[name].kind == "physics"
    ]
    single = {signals[int(np.argmax(shown))] for shown in machines if shown.sum() == 1}
    return [
        name for name in fit.names if catalogue[name].signal in single and catalogue[name].fault in STATIC
    ]


def of_column(fit: Fit) -> tuple[str, Values]:
    """The site of the column in a fit's laboratory, and the effects there; empty where the laboratory has no column."""
    part = column_of(fit.data.part)
    if part is None:
        return "", {}
    site = part.lab.site("column")
    return site, {
        name: values for name, values in fit.values.items() if fit.data.catalogue[name].site == site
    }


def gives_energy(fit: Fit) -> str:
    """The effects of a fit with which a column gives more energy than it ever took, in words, empty for none.

    Its force falls later than it rises. No specimen by itself does that, while a load cell with hysteresis reads any
    specimen so.
    """
    data, part = fit.data, column_of(fit.data.part)
    _, own = of_column(fit)
    if part is None or not own:
        return ""
    unfiltered = part.replaced(channels=(NOTHING_STATED,) * len(part.channels))
    displacement, force = unfiltered.predict(hypothesis.lay(data, fit.z, own).unread).T
    begun = 0.5 * float(max(force[0] * displacement[0], 0.0))  # J, held before the first tick
    energy = begun + np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(displacement))
    return " and ".join(own) if energy.min() < -GIVEN * energy.max() else ""
