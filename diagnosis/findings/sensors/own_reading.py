"""Errors of a reading that its machine alone makes, beside an effect of that machine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.findings.sites.likely import REST
from diagnosis.fits import candidates, worth
from diagnosis.fits.fitting import Fit, excess
from diagnosis.fits.search import Search

STATIC = ("gain", "saturation")  # errors of a reading that depend on what it reads and on nothing else


def machine_alone(search: Search) -> Search:
    """A search without static errors of a reading that shows nothing but another effect, where that explains the gap.

    What a specimen does and how its load cell errs are then one function of the same motion. Only their formulas tell
    them apart, and the law of no specimen is exactly one of the catalogue's: it leaves what a true mechanism may.
    """
    fit = search.chosen
    for name in errors(fit):
        less = candidates.without(fit, name)
        if excess(less) < REST * excess(search.commissioned):
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
