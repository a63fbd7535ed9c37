"""Where a gap lies: sites of the effects found, and of what no effect explains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from diagnosis.findings.sites.likely import likely_sites
from diagnosis.findings.verdict import PartVerdict, pinned
from diagnosis.fits import hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.residuals import Data
from diagnosis.fits.unexplained import gaps
from diagnosis.fits.worth import SEEN
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.joined import laboratory_of
from diagnosis.recorded.record import Record
from diagnosis.signals import windows
from models.registry import Array

# A window belongs to a trace from this share of the trace's largest window on, but never above the second, so that the
# strongest window always counts.
PART_OF_PEAK, BELOW_PEAK = 0.25, 0.9
ASKED = 8  # fits whose sites are kept: a report asks for those of each part several times


@dataclass(frozen=True)
class SiteTrace:
    """What one site does to a part's signals, in standard deviations σ of the noise."""

    site: str
    series: Array  # (ticks,) of the signal that shows it most
    ratio: float  # its rms
    signal: str
    sigma: float
    left: Mapping[str, Array] = field(
        default_factory=dict
    )  # (ticks,) by signal, of a site without a named cause


def traces(data: Data, fit: Fit) -> list[SiteTrace]:
    """What each site's effects do to the signals: the prediction with all effects against that without them."""
    whole = data.part.predict(hypothesis.lay(data, fit.z, fit.values))
    sites: dict[str, list[str]] = {}
    for name in fit.names:
        sites.setdefault(data.catalogue[name].site, []).append(name)
    result = []
    for site, names in sites.items():
        less = {name: values for name, values in fit.values.items() if name not in names}
        change = (whole - data.part.predict(hypothesis.lay(data, fit.z, less))) / data.sigma
        change[~data.part.present] = 0.0
        result.append(shown(site, data, change))
    return result


def shown(site: str, data: Data, change: Array) -> SiteTrace:
    """The trace of a site from changes (ticks, signals) in σ."""
    ratios = np.sqrt(np.mean(change**2, axis=0))
    place = int(np.argmax(ratios))
    return SiteTrace(
        site, change[:, place], float(ratios[place]), data.part.signals[place], float(data.sigma[place])
    )


def unexplained(verdict: PartVerdict) -> SiteTrace:
    """Trace of what the effects of a verdict leave, at the site where it most likely arises."""
    data, fit, own = verdict.search.data, verdict.search.chosen, verdict.own
    if own is not None:
        data = replace(data, spikes=None)
    residual = data.residual(hypothesis.lay(data, fit.z, fit.values)) / data.sigma
    left = [item.ratio for item in gaps(fit, data.group)]
    place = int(np.argmax(left)) if own is None else data.part.signals.index(own.signal)
    return SiteTrace(
        sites(verdict)[0],
        residual[:, place],
        left[place] if own is None else own.ratio,
        data.part.signals[place],
        float(data.sigma[place]),
        dict(zip(data.part.signals, (data.steady(residual) * data.sigma).T, strict=True)),
    )


def sites(verdict: PartVerdict) -> tuple[str, ...]:
    """The sites from which what the effects of a verdict leave may come, the likeliest first."""
    fit, own = verdict.search.chosen, verdict.own
    if own is not None and own.sites:
        return own.sites
    far = [
        site for site, dot, _ in (name.rpartition(".") for name in pinned(fit)) if dot
    ]  # a logger has no site
    # a parameter at its bound that leaves nothing to be seen took the gap upon itself
    if own is None and far and verdict.search.left < SEEN:
        return (far[0],)
    return culprits(fit)


@lru_cache(maxsize=ASKED)
def culprits(fit: Fit) -> tuple[str, ...]:
    """The sites from which what a fit leaves may come, the likeliest first; several where no reading tells."""
    part = laboratory_of(fit.data.part)
    if part is None:
        alone = fit.data.part
        return (alone.lab.site(alone.name) if isinstance(alone, ColumnAlone) else alone.name,)
    return likely_sites(fit) or (part.lab.site(part.lab.kind.sites[0]),)


def undecided(verdicts: Sequence[PartVerdict]) -> list[str]:
    """A sentence for each unknown effect that may lie at several sites."""
    found = [sites(item) for item in verdicts if item.outcome == "unknown"]
    return [
        f"What no effect explains may arise at {' or at '.join(several)}: these signals cannot tell them apart."
        for several in found
        if len(several) > 1
    ]


def when(trace: SiteTrace, record: Record, threshold: float = 1.0) -> tuple[tuple[float, float], ...]:
    """Windows of time in which a site's trace stands out of the noise."""
    parts = windows.windows(trace.series, 1.0, record.plan.test.interval)
    peak = float(np.max(parts.ratio, initial=0.0))
    spans = windows.intervals(parts, min(max(threshold, PART_OF_PEAK * peak), BELOW_PEAK * peak))
    return tuple((begin, end) for begin, end in spans)


def frequencies(trace: SiteTrace, record: Record) -> tuple[float, float]:
    """Band that holds most of a site's trace, Hz."""
    return windows.band(trace.series, 0.0, record.plan.test.interval)
