"""How much of a residual any model of its part could explain, beside the catalogue; and what the rest depends on."""

from __future__ import annotations

import numpy as np

from common.errors import InputError
from diagnosis.findings import where
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.verdict import UNNAMED, WITHOUT_GAP, PartVerdict
from diagnosis.fits import fitting, hypothesis, residuals
from diagnosis.fits.search import Search
from diagnosis.fits.unexplained import gaps
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.report.evidence import Ceiling, Coordinate, Dependence, Unknown
from diagnosis.signals import windows
from diagnosis.signals.predictors.ceiling import ceiling, depends_on
from models.registry import Array

COORDINATE: dict[str, Coordinate] = {
    "m": "displacement",
    "N": "force",
    "m/s²": "acceleration",
}  # by a reading's unit
PREDICTED = "predicted "  # before the name of a reading
# Share of a residual's energy below which a coordinate is not listed: 2 % of the energy is 14 % of the rms, which
# is invisible in a plot of the residual over that coordinate.
FAINT = 0.02


def worst(search: Search, fit: fitting.Fit) -> int:
    """Index of the signal in which a fit leaves the largest systematic residual over its noise."""
    return int(np.argmax([item.ratio for item in gaps(fit, search.data.group)]))


def inputs_of(found: Diagnosis, search: Search) -> dict[str, Array]:
    """Commands of a part, and its readings as predicted without effects; constant signals are left out."""
    part = search.data.part
    result: dict[str, Array] = {}
    if isinstance(part, LaboratoryPart):
        result |= {name: values for name, values in part.inputs.items() if np.ptp(values) > 0.0}
    predicted = part.predict(hypothesis.lay(search.data, search.chosen.z, {}))
    for name, values in zip(part.signals, predicted.T, strict=True):
        if np.ptp(values) > 0.0:
            result[PREDICTED + name] = values
    return result


def ceilings(found: Diagnosis) -> tuple[Ceiling, ...]:
    """Per part with a gap: what a flexible model explains of its residual on withheld time, and the catalogue."""
    result = []
    for verdict in found.verdicts:
        search = verdict.search
        if verdict.outcome in WITHOUT_GAP or search.data.part.exact:
            continue
        flexible = flexible_share(found, search)
        if flexible is not None:
            site = where.unexplained(verdict).site
            if verdict.effects:
                site = where.traces(search.data, search.chosen)[0].site
            result.append(Ceiling(site=site, flexible=flexible, catalogue=max(0.0, search.explained)))
    return tuple(result)


def flexible_share(found: Diagnosis, search: Search) -> float | None:
    """Share of the commissioned residual's energy that a flexible model explains, None where data are too few."""
    interval = found.record.plan.test.interval
    place = worst(search, search.commissioned)
    residual = search.data.residual(hypothesis.lay(search.data, search.commissioned.z, {}))[:, place]
    columns = inputs_of(found, search)
    if not columns:
        return None
    held = residuals.withheld_ticks(residual.size, interval)
    try:
        return ceiling(
            np.column_stack(list(columns.values())),
            residual,
            ~held,
            held,
            float(search.data.sigma[place]),
            interval,
        )
    except InputError:
        return None


def unknowns(found: Diagnosis) -> tuple[Unknown, ...]:
    """Descriptions of the residuals that no effect of the catalogue explains, the largest over its noise first."""
    left = [item for item in found.verdicts if item.outcome in UNNAMED]
    return tuple(described(found, item) for item in sorted(left, key=lambda item: -item.search.left))


def described(found: Diagnosis, verdict: PartVerdict) -> Unknown:
    """Description of the residual that the chosen effects leave in one part."""
    search, trace = verdict.search, where.unexplained(verdict)
    data = search.data
    place = data.part.signals.index(trace.signal)
    residual = data.residual(hypothesis.lay(data, search.chosen.z, search.chosen.values))[:, place]
    interval = found.record.plan.test.interval
    shares = dependence(found, search, residual, float(data.sigma[place]))
    spectrum = windows.bands(residual, float(data.white[place]), interval)
    peak = int(np.argmax(spectrum.residual[1:])) + 1 if spectrum.residual.size > 1 else 0
    return Unknown(
        site=trace.site,
        depends_on=tuple(item for item in shares if (item.share or 0.0) > FAINT),
        frequency=float(spectrum.frequency[peak]),
        amplitude=float(np.sqrt(2.0 * np.mean(residual**2))),
        unit=found.record.unit(data.part.signals[place]),
    )


def dependence(found: Diagnosis, search: Search, residual: Array, noise: float) -> list[Dependence]:
    """How much of a residual a function of one coordinate alone explains, for each coordinate of its part."""
    interval = found.record.plan.test.interval
    coordinates: dict[Coordinate, Array] = {"time": found.record.time}
    for name, values in inputs_of(found, search).items():
        read = name.startswith(PREDICTED)
        short = COORDINATE.get(found.record.unit(name.removeprefix(PREDICTED))) if read else "command"
        if short and short not in coordinates:
            coordinates[short] = values
        if short == "displacement" and "velocity" not in coordinates:
            coordinates["velocity"] = np.gradient(values, interval)
    try:
        shares = depends_on(coordinates, residual, noise)
    except InputError:
        return []
    return [Dependence(on=name, share=share) for name, share in shares]
