"""The composition of each part's gap: tolerances, named effects, the unexplained rest, and noise."""

from __future__ import annotations

import math

import numpy as np

from diagnosis.findings.found import Diagnosis
from diagnosis.findings.gaps import QUIET
from diagnosis.findings.sensors.noise_levels import noise_rms
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits import hypothesis, residuals
from diagnosis.fits.residuals import Data
from diagnosis.recorded.building.logged_building import BALANCE
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.recorded.record import Record
from diagnosis.report.records import NoiseEntry, PartOfGap
from diagnosis.signals.noise.model import NoiseModel
from models.registry import Array
from models.system import System


def parts(found: Diagnosis, require: float | None = None) -> tuple[PartOfGap, ...]:
    """The parts in the order of the test; `require` is the gap that may be left in each."""
    return tuple(part(verdict, found, require) for verdict in found.verdicts)


def part(verdict: PartVerdict, found: Diagnosis, require: float | None) -> PartOfGap:
    """One part: what each correction in turn takes away from its gap above noise."""
    search = verdict.search
    data, bare, fit = search.data, search.commissioned, search.chosen
    noise = rms(noise_rms(search) / levels(data), data)
    systems = [data.system, hypothesis.lay(data, bare.z, {}), hypothesis.lay(data, fit.z, fit.values)]
    systems.append(systems[-1])
    for law in found.learned:
        if law.site in sites_of(data):
            systems[-1] = law.laid(systems[-1])
    steps = [above(data, system, noise) for system in systems]
    nominal, moved, named, left = (min(steps[: place + 1]) for place in range(4))
    return PartOfGap(
        part=name_of(data),
        outcome=verdict.outcome,
        effects=verdict.effects,
        gap=nominal,
        tolerances=nominal - moved,
        named=moved - named,
        learned=named - left,
        left=left,
        noise=noise,
        adequate=None if require is None else left <= require,
        noise_model=noises(data, found.record),
    )


def sites_of(data: Data) -> set[str]:
    """The sites of machines in a part."""
    part = data.part
    if isinstance(part, LaboratoryPart | ColumnAlone):
        return {part.lab.site(name) for name in part.lab.kind.sites}
    return set()


def name_of(data: Data) -> str:
    """What a part is called; a laboratory of a role with a name by that role."""
    return data.part.lab.title if isinstance(data.part, LaboratoryPart) else data.part.name


def levels(data: Data) -> Array:
    """Rms of each reading (signals,), infinite for those that do not stand out of their noise while others do."""
    level = np.sqrt(np.mean(np.square(data.part.measured), axis=0))
    stands_out = (level > 0.0) & (data.white < QUIET * level)
    return np.where(stands_out, level, np.inf) if stands_out.any() else np.where(level > 0.0, level, np.inf)


def above(data: Data, system: System, noise: float) -> float:
    """Rms over the readings of rms(recorded - predicted)/rms(recorded), without the noise's share."""
    residual = np.nan_to_num(
        data.residual(system), nan=residuals.FAR, posinf=residuals.FAR, neginf=-residuals.FAR
    )
    whole = rms(np.sqrt(np.mean(np.square(residual), axis=0)) / levels(data), data)
    return math.sqrt(max(0.0, whole**2 - noise**2))


def rms(shares: Array, data: Data) -> float:
    """Rms over the readings that count."""
    counted = np.isfinite(levels(data))
    return float(np.sqrt(np.mean(shares[counted] ** 2))) if counted.any() else 0.0


def noises(data: Data, record: Record) -> dict[str, NoiseEntry]:
    """The noise of a part's sensors by signal; none for a part that is computed."""
    if data.part.exact:
        return {}
    models = data.noise or (None,) * len(data.part.signals)
    result = {}
    for name, model, white, there in zip(
        data.part.signals, models, data.white, data.part.present.T, strict=True
    ):
        if not there.any():
            continue
        known = model or NoiseModel(float(white))
        result[name] = NoiseEntry(
            kind=known.kind,
            order=known.order,
            rms=known.rms,
            unit="N" if name == BALANCE else record.unit(name),
            from_=known.source,
            lines=known.lines,
            resolution=known.resolution or None,
        )
    return result
