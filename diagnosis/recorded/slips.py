"""Slips of units and signs: a reading that is about a hundred times its prediction or more, or has the opposite sign.

One that is several times its prediction may be in g, cm or volts, and may be right: it is only told.

A nominal model that is merely wrong is no slip: nobody plans a laboratory a hundred times too stiff, but it is easily
forgotten that a data column is in millimetres. So only factors count that no wrong model has, and signs of readings
whose shape is that of the prediction. A specimen with wide loops has another shape than its elastic model; but no
specimen gives work to the machine that moves it, so that its sign is also wrong where it seems to.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from common.errors import InputError
from common.recording.imported import imported
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.recorded.record import Record
from models.registry import Array

FAR = 90.0  # factor from which on it is a slip: cm for m makes 100, while 9.81 for g may be a wrong model
TOLD = 5.0  # factor from which on it is told
ALIKE = 0.5  # correlation from which on two signals have the same shape: that of sines 60° apart
# correlation, negative, from which on a sign is wrong: sines 154° apart; less may be a wrong phase, or a mass that
# bounces off a stop.
OPPOSED = 0.9
# Where a mass bounces off a stop for long it is 154° too, but not before it comes there. Share of its peak up to which
# a reading is compared by itself, over as many times the longest lag at least.
BEGINNING, LAGS = 0.3, 4
# Share of the work exchanged that a specimen seems to give, from which on its sign is wrong. Where its force runs
# against its deformation a tenth does, which no delay of a spring's force makes there. Where it has another shape, as
# that of friction, half does: the force of a spring would be late by 60° then.
GIVEN, GIVEN_UNLIKE = 0.1, 0.5
LONGEST_LAG = 0.1  # s, delay within which shapes are compared: several times that of actuators and filters
ABOVE_NOISE = 10.0  # rms over the sensor's noise without which the shape of a reading is not compared
USUAL = {1e3: "a factor of 1000", 1e2: "a factor of 100", 1e6: "a factor of a million"}
NEAR = 2.0  # factor within which a power of ten is named


@dataclass(frozen=True)
class ReadingSlip:
    """A reading that does not fit its command."""

    signal: str
    commands: tuple[str, ...]
    factor: float  # reading over prediction, negative where it runs against it
    given: float = 0.0  # share of the work exchanged that a specimen seems to give to what moves it

    @property
    def sentence(self) -> str:
        """What is wrong, and where to look."""
        names = " and ".join(self.commands)
        if self.given > 0.0:
            return (
                f"'{self.signal}' gives work to what moves the specimen along {names}, which no specimen does: "
                f"check the sign of its column and of {names}"
            )
        if self.factor < 0.0 and not self.far:
            return (
                f"'{self.signal}' has the opposite sign of what the plan predicts from {names}: "
                f"check the sign of its column and of {names}"
            )
        times = (
            f"{three_digits(abs(self.factor))} times"
            if abs(self.factor) >= 1.0
            else f"1/{three_digits(1.0 / abs(self.factor))} of"
        )
        return (
            f"'{self.signal}' is {times} what the plan predicts from {names}{self._guess}: "
            f"check the units of its column and of {names}"
        )

    @property
    def far(self) -> bool:
        """Whether the size is wrong, not only the sign."""
        return not 1.0 / FAR < abs(self.factor) < FAR

    @property
    def sure(self) -> bool:
        """Whether size or sign are so wrong that no model is."""
        return self.far or self.factor < 0.0

    @property
    def _guess(self) -> str:
        size = max(abs(self.factor), 1.0 / abs(self.factor))
        found = next((text for ten, text in USUAL.items() if ten / NEAR < size < NEAR * ten), "")
        return f", which is about {found}" if found else ""


def refuse_slips(record: Record, data: Path) -> None:
    """Raise InputError where imported `data` have a slip, unless they were imported as they are."""
    stated = imported(record.run)
    found = slips(record) if stated is not None and not stated.as_is else []
    if found and found[0].sure:
        raise InputError(f"{data}: {found[0].sentence}; if it is right, import it with --as-is.")


def doubtful(record: Record) -> list[str]:
    """Sentences on readings that are several times their prediction, the farthest first."""
    return [f"{slip.sentence}, unless that is what the test is about" for slip in slips(record)]


def slips(record: Record) -> list[ReadingSlip]:
    """The slips of a recording and what may be some, surest and largest first."""
    found = [slip for lab in record.labs for slip in (*of_laboratory(record, lab), *giving(record, lab))]
    return sorted(found, key=lambda slip: (not slip.sure, -abs(np.log(abs(slip.factor)))))


def of_laboratory(record: Record, lab: RecordedLaboratory) -> Iterator[ReadingSlip]:
    """The slips of one laboratory whose commands were recorded, or of a column whose deformation was.

    A motion without a restoring force is compared by what forces did to it from piece to piece, where neither a phase
    nor a bounce off a stop turns a sign round.
    """
    inputs = tuple(name for name in lab.commands if record.has(name) and np.ptp(record.signals[name]) > 0.0)
    position = lab.signal(lab.kind.channels.position)
    alone = any(machine.site == "column" for machine in lab.kind.machines(lab.plan)) and record.has(position)
    if not inputs and not alone:
        return
    part = LaboratoryPart(record, lab) if inputs else ColumnAlone(record, lab)
    commands = inputs or (position,)
    most = round(LONGEST_LAG / record.plan.test.interval)
    read, wanted = part.measured.copy(), part.predict(record.systems[lab.role])
    freed = part.signals[part.freed] if isinstance(part, LaboratoryPart) and part.freed >= 0 else ""
    if isinstance(part, LaboratoryPart) and freed:
        for values in (read, wanted):
            values[:, part.freed] -= part.begun_elsewhere(values[:, part.freed])
    for name, one, other in zip(part.signals, read.T, wanted.T, strict=True):
        if not record.has(name):
            continue
        opposed = ALIKE if name == freed else OPPOSED
        factor = compared(one, other, lab.noise.get(name, 0.0), most, opposed)
        if factor is not None and (factor < 0.0 or not 1.0 / TOLD < factor < TOLD):
            yield ReadingSlip(name, commands, factor)


def giving(record: Record, lab: RecordedLaboratory) -> Iterator[ReadingSlip]:
    """The force of a specimen that seems to give work over its measured deformation."""
    names = lab.signal(lab.kind.channels.position), lab.signal(lab.kind.channels.force)
    if not any(machine.site == "column" for machine in lab.kind.machines(lab.plan)) or not record.has(*names):
        return
    there = record.present[names[0]] & record.present[names[1]]
    motion, force = (record.signals[name][there] for name in names)
    noise = [lab.noise.get(name, 0.0) for name in names]
    if any(np.std(values) < ABOVE_NOISE * rms for values, rms in zip((motion, force), noise, strict=True)):
        return
    share = given(motion, force)
    if share > 0.0:
        yield ReadingSlip(names[1], names[:1], -1.0, share)


def given(motion: Array, force: Array) -> float:
    """The share of the work exchanged that a specimen gives, 0 where this may be a delay or chance."""
    centred = force - np.mean(force)
    work = 0.5 * (centred[1:] + centred[:-1]) * np.diff(motion)
    exchanged = float(np.sum(np.abs(work)))
    if exchanged == 0.0 or np.ptp(force) == 0.0:
        return 0.0
    share = -float(np.sum(work)) / exchanged
    likeness = float(np.corrcoef(motion, force)[0, 1])
    least = GIVEN if likeness <= -ALIKE else GIVEN_UNLIKE
    return share if share >= least and likeness < ALIKE else 0.0


def compared(
    measured: Array, predicted: Array, noise: float, most: int, opposed: float = OPPOSED
) -> float | None:
    """The factor between two signals of the same shape, at most `most` ticks apart; None where the shapes differ.

    It is negative where the signs are opposite, from a correlation of −`opposed` on.
    """
    read, wanted = (values - np.mean(values) for values in (measured, predicted))
    sizes = np.sqrt(np.mean(read**2)), np.sqrt(np.mean(wanted**2))
    if not np.all(np.isfinite(wanted)) or min(sizes) == 0.0 or max(sizes) < ABOVE_NOISE * noise:
        return None
    likeness = correlation(read / sizes[0], wanted / sizes[1], most)
    factor = float(sizes[0] / sizes[1])
    if likeness <= -opposed:
        return None if begins_alike(read, wanted, most) else -factor
    return factor if likeness >= ALIKE else None


def begins_alike(read: Array, wanted: Array, most: int) -> bool:
    """Whether two signals have the same sign as long as the first one is small, which a slip does not explain."""
    small = int(np.argmax(np.abs(read) > BEGINNING * np.max(np.abs(read))))
    if small < LAGS * max(most, 1):
        return False
    one, other = (values[:small] - np.mean(values[:small]) for values in (read, wanted))
    sizes = float(np.std(one)), float(np.std(other))
    return min(sizes) > 0.0 and correlation(one / sizes[0], other / sizes[1], most) >= OPPOSED


def correlation(one: Array, other: Array, most: int) -> float:
    """The correlation of largest magnitude within this many ticks of lag."""
    size = 2 * one.size
    product = np.fft.irfft(np.fft.rfft(one, size) * np.conj(np.fft.rfft(other, size)), size) / one.size
    near = np.concatenate([product[: most + 1], product[-most:] if most else product[:0]])
    return float(near[np.argmax(np.abs(near))])


def three_digits(value: float) -> str:
    """A factor of one or more in three digits, without an exponent."""
    return f"{float(f'{value:.3g}'):,.0f}" if value >= 100.0 else f"{value:.3g}"
