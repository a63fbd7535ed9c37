"""How well the nominal models of an import tell its readings, behind what its logger is taken to have done."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from diagnosis.findings.logged.filters import AS_LIKELY, SPOILT
from diagnosis.findings.sensors import readings
from diagnosis.fits import fitting, hypothesis, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.residuals import Data
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import BALANCE, LoggedBuilding, logged
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.parts import LaboratoryPart, Part
from diagnosis.recorded.record import Record
from diagnosis.signals import low_pass
from diagnosis.signals.mask import Mask
from diagnosis.signals.strength import BEYOND
from models.registry import Array

NYQUIST, ROWS = 0.49, 0.45  # of the rate of the ticks, and of rows that were interpolated, highest frequency
BANDS = 24
OF_BALANCE = 20.0  # Hz, up to which any filter passes noise of forces and of the motion alike
REACH = 25  # ticks beside missing rows, which count for no shape

Name = tuple[str, str]  # topic and name of a reading


class NominalFits(NamedTuple):
    """How well a record is told by the nominal models of its laboratories at their best."""

    record: Record
    fits: list[tuple[Part, Fit]]  # laboratories, and the building
    of: dict[Name, float]  # −2·log of how probable each reading is, up to a constant
    missed: dict[Name, float]  # share of each reading's rms that its model leaves

    def surprise(self, counted: Iterable[Name]) -> float:
        """−2·log of how probable those readings and the nominal parameters are, up to a constant."""
        return sum(self.of[name] for name in sorted(counted)) + sum(fit.prior for _, fit in self.fits)

    def far_likelier(self, other: NominalFits, counted: Collection[Name]) -> bool:
        """Whether the readings are far likelier than in another one, and none is much less likely.

        A reading may lose a part of what all gain, as nominal parameters follow them all.
        """
        gain = other.surprise(counted) - self.surprise(counted)
        lost = max(self.of[name] - other.of[name] for name in counted)
        return gain > BEYOND and lost < max(BEYOND, AS_LIKELY * gain)

    def told(self, names: Iterable[Name]) -> set[Name]:
        """Those of the readings that their models tell, or all of them where they tell none."""
        return {name for name in names if self.missed.get(name, 1.0) < SPOILT} or set(names)


def nominal_fits(
    record: Record, there: Mapping[Name, Mask], loose: float = 1.0, near: NominalFits | None = None
) -> NominalFits:
    """A record with the nominal models of its laboratories at their best, by what is `there` of each reading (ticks,).

    The same ticks count behind every shape. The plan's parameters have `loose` times their tolerances. The best ones
    are looked for from those of one that is `near`.
    """
    labs = [loosened(lab, loose).logged(record.late) for lab in laboratories(record)]
    return weighed(NominalFits(record, [], {}, {}), labs, there, near.fits[: len(labs)] if near else [])


def balanced(found: NominalFits, there: Mapping[Name, Mask], near: NominalFits | None = None) -> NominalFits:
    """The same with the balance of the building, in which the forces are that passed a filter."""
    parts = balances(found.record)
    return weighed(found, parts, there, near.fits[len(found.fits) :] if near else [])


def weighed(
    found: NominalFits, parts: Sequence[Part], there: Mapping[Name, Mask], near: Sequence[tuple[Part, Fit]]
) -> NominalFits:
    """The same with further parts at their best, from fits that are `near`."""
    steps = readings.resolutions(found.record, {})
    result = NominalFits(found.record, list(found.fits), dict(found.of), dict(found.missed))
    for place, part in enumerate(parts):
        data = residuals.prepare(part, found.record, steps)
        fit = fitted(data, near[place][1] if place < len(near) else None)
        result.fits.append((part, fit))
        columns = zip(named(part), part.measured.T, predicted(part, fit).T, strict=True)
        for name, *pair in (row for row in columns if row[0] in there):
            read, said = ((values * there[name])[:, None] for values in pair)
            none, interval = np.zeros((*read.shape, 0)), found.record.plan.test.interval
            looked = low_pass.spectra(read, said, none, interval, highest(part, interval), BANDS)
            result.of[name] = low_pass.surprise_as_is(looked)
            result.missed[name] = float(np.std(read - said) / np.std(read))
    return result


def fitted(data: Data, near: Fit | None) -> Fit:
    """The nominal model of a part at its best, from one that is near, with the slopes that it had."""
    alike = near is not None and near.reduced.shape == (data.groups, data.sigma.size)
    if near is None or not alike or near.z.size != len(data.part.nuisances):
        return fitting.fit(data, {})
    return fitting.fit(data, {}, near.z, slopes=near.jacobian, rounds=2)


def balances(record: Record) -> list[LoggedBuilding]:
    """The building of a record by the balance of its forces, where their filter shows in it and the model is linear."""
    found = [part for part in parts_of(record) if isinstance(part, Building)]
    return [logged(part) for part in found if part.linear and part.sources]


def loosened(lab: LaboratoryPart, times: float) -> LaboratoryPart:
    """A laboratory whose parameters have so many times their tolerances."""
    return lab.replaced(
        nuisances=tuple(replace(one, tolerance=times * one.tolerance) for one in lab.nuisances)
    )


def known(record: Record) -> dict[Name, Mask]:
    """Where each reading that was recorded and moves is present (ticks,), by topic and name, and so the balance."""
    found = {}
    parts: list[Part] = [*laboratories(record), *balances(record)]
    for part in parts:
        columns = zip(named(part), part.signals, part.measured.T, part.present.T, strict=True)
        for name, signal, read, there in columns:
            moves = there.any() and np.ptp(read[there]) > 0.0
            if moves and (signal == BALANCE or record.has(signal)):
                found[name] = ndimage.binary_erosion(there, np.ones(2 * REACH + 1), border_value=1)
    return found


def predicted(part: Part, fit: Fit) -> Array:
    """What a part reads (ticks, signals) by a fit."""
    return part.predict(hypothesis.lay(fit.data, fit.z, fit.values))


def highest(part: Part, interval: float) -> float:
    """The highest frequency (Hz) at which a part's readings tell of a filter."""
    if not isinstance(part, LaboratoryPart):
        return OF_BALANCE
    rows = [one.rate for one in part.channels if one.interpolated and one.rate > 0.0]
    return min(NYQUIST / interval, *(ROWS * rate for rate in rows), math.inf)


def laboratories(record: Record) -> list[LaboratoryPart]:
    """The laboratories of a record of which any reading counts."""
    parts = [part for part in parts_of(record) if isinstance(part, LaboratoryPart)]
    return [part for part in parts if part.present.any()]


def named(part: Part) -> list[Name]:
    """Topic and name of a part's readings; of a building the balance and the number of each storey."""
    if isinstance(part, LaboratoryPart):
        return [(part.role, name) for name in part.lab.kind.channels.names]
    return [(BALANCE, str(storey)) for storey in range(len(part.signals))]


def force(record: Record, signal: str) -> bool:
    """Whether a reading measures a force."""
    return record.unit(signal) == "N"
