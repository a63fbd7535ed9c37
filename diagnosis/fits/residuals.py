"""A part's residuals in the form that fits use: in units of the noise, averaged over a few ticks, some held out.

The residuals of a part are driven by exactly known commands, so the unit σ is the noise of its sensors. They are
averaged over a few ticks first, which loses nothing that moves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from common.errors import InputError
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import PER_PERIOD, LoggedBuilding
from diagnosis.recorded.ground import Ground
from diagnosis.recorded.joined import laboratory_of
from diagnosis.recorded.parts import EXACT, FINE_ERROR, MODEL_ERROR, Part
from diagnosis.recorded.record import Record
from diagnosis.signals.mask import Mask
from diagnosis.signals.noise import colour
from diagnosis.signals.noise.level import left_behind, white_rms
from diagnosis.signals.noise.model import NoiseModel
from diagnosis.signals.predictors.ceiling import Crosswise
from laboratories.effects import CATALOGUE
from laboratories.effects.effect import Effect
from models.registry import Array
from models.system import System

AVERAGED = 0.008  # s, over which residuals are averaged: the laboratories move much more slowly
FEWEST = 250  # of these that a recording must have: noise of a colour is known from no fewer
BLOCK = 1.0  # s, of the blocks that are held out in turn: longer than a model's error is correlated
HELD_OUT = (2, 4)  # of every five blocks, these
STEPPING = 2.0  # steps over the noise from which on a reading is rounded to more than its noise
COARSE = 3.0  # steps that count as noise where a reading that is rounded to more than its noise rests on few of them
WITHIN = 0.04  # s, within which the steps are counted that such a reading crosses
# Averaged samples that a step lasts where a reading rests on it, and the share of the test in which no step may last so
# long for what it errs by to count as noise of that size.
LONGEST_STEP, MOVING = 5.0, 0.5
HELD = 0.9  # of what a moving reading errs by from its steps, from which on its noise holds that as well
SPARSE = 0.5  # of an averaged sample's ticks that must be there
KEPT = 32  # systems with moved parameters: fits over the parameters of effects keep to one, their slopes to one each
SUMS = 50  # of samples at least, from which the rms of white noise is known to a few per cent
ROUNDED = 1e-9  # of a number of samples that is whole but for the rounding of a computer
FAR = 1e6  # residual, in σ, of a hypothesis that diverges: worse than any that does not


@dataclass(frozen=True)
class Data:
    """A part's residuals in the form that fits use."""

    part: Part
    system: System  # the plan
    sigma: Array  # (signals,) what a residual is measured by: noise, and what a good model may err by
    white: Array  # (signals,) the noise alone
    group: int  # ticks averaged
    train: Mask  # (groups,) fitted on
    rounded: Array  # (signals,) step that a reading is rounded to, 0 for none
    catalogue: Mapping[str, Effect] = field(default_factory=lambda: CATALOGUE)  # the effects of the test
    noise: tuple[NoiseModel, ...] = ()  # of each signal; none: white, of rms `white`
    lines: Array | None = None  # (ticks, signals) what the sensors pick up
    spikes: Mask | None = None  # (ticks, signals) single samples that do not count
    related: Crosswise | None = None  # what may follow from the part's inputs
    planned: Array | None = None  # (signals,) rms noise by the plan, 0 for none
    undoubted: Array | None = None  # (signals,) rms coloured noise of signals that hide no gap, 0 for others
    # (groups, signals) times the noise that an averaged sample behind an impact is known to; None where none is
    vague: Array | None = None
    resting: Array | None = None  # the same beside a coarse step on which a reading rests
    loudness: Array | None = None  # (ticks, signals) of unsteady noise over its rms
    erring: float = MODEL_ERROR  # share of a reading's rms that a good solution of the model may err by
    static: bool = False  # whether its rows have no times

    @cached_property
    def _systems(self) -> dict[bytes, System]:
        """The last systems that `moved` has returned, by their nuisances."""
        return {}

    def moved(self, z: Array) -> System:
        """The plan with its nominal parameters at z (nuisances,) tolerances, without what the logger did."""
        place = z.tobytes()
        system = self._systems.get(place)
        if system is None:
            system = self.system
            for nuisance, by in zip(self.part.nuisances, z, strict=True):
                system = system if nuisance.of_record else nuisance.moved(system, float(by))
            if len(self._systems) >= KEPT:
                self._systems.clear()
            self._systems[place] = system
        return system

    def logged(self, system: System, z: Array) -> System:
        """A system whose readings, with the errors of their sensors, the logger recorded as z (nuisances,) says."""
        for nuisance, by in zip(self.part.nuisances, z, strict=True):
            system = nuisance.moved(system, float(by)) if nuisance.of_record else system
        return system

    @property
    def groups(self) -> int:
        """Number of averaged samples."""
        return self.part.measured.shape[0] // self.group

    @cached_property
    def live(self) -> Mask:
        """Signals (signals,) that have noise: those that were recorded and do not stand still."""
        return np.asarray(self.there.any(axis=0) & (np.ptp(self.part.measured, axis=0) > 0.0))

    @cached_property
    def size(self) -> int:
        """How many averaged samples have noise, those of signals that have any.

        Each costs one where only noise is left. A signal that was not recorded costs nothing, and must not be credited.
        """
        return self.groups * max(1, int(np.count_nonzero(self.live)))

    def residual(self, system: System) -> Array:
        """Recorded minus predicted, (ticks, signals), zero where nothing was recorded and where a reading has a spike.

        Narrow lines that the sensors pick up are taken away.
        """
        with np.errstate(all="ignore"):
            result = self.part.measured - self.part.predict(system)
        if self.lines is not None:
            result -= self.lines[: len(result)]
        if self.missing is not None:
            result[self.missing] = 0.0
        return result

    def white_part(self, residual: Array) -> Array:
        """Rms (signals,) of the white part of residuals (ticks, signals), of the frequencies that a logger passed.

        Its filter cuts off the noise that came through it, and what it left above tells nothing of that. So as many
        samples are averaged first as last half a wave of the highest frequency that it passed, and what the filter took
        below that is given back.
        """
        together, result = self.together(len(residual)), np.empty(residual.shape[1])
        for size in np.unique(together):
            some = residual[: len(residual) // size * size, together == size]
            sums = some.reshape(-1, size, some.shape[1]).sum(axis=1) / math.sqrt(size)
            result[together == size] = white_rms(sums)
        if (lab := laboratory_of(self.part)) is not None:
            result /= left_behind(lab.logged_by, together.tolist(), self.system.plan.test.interval)
        return result

    def together(self, ticks: int) -> NDArray[np.int64]:
        """How many of so many ticks (signals,) to add up so that all frequencies left have passed a logger."""
        half = 0.5 / (self.part.passes * self.system.plan.test.interval)
        return np.clip(np.ceil(half - ROUNDED), 1, max(1, ticks // SUMS)).astype(np.int64)

    @cached_property
    def there(self) -> Mask:
        """Where readings count, (ticks, signals)."""
        present = self.part.present
        return present if self.spikes is None else present & ~self.spikes[: len(present)]

    @cached_property
    def missing(self) -> Mask | None:
        """Where no reading counts, (ticks, signals); None where all count."""
        return None if self.there.all() else ~self.there

    @property
    def judging(self) -> Mask:
        """The averaged samples (groups,) that judge fits: those that no fit sees, or all where fits see all."""
        return self.train if self.train.all() else ~self.train

    @property
    def whole(self) -> Data:
        """The same with nothing withheld."""
        return replace(self, train=np.ones(self.groups, dtype=bool))

    @property
    def fine(self) -> Data:
        """The same measured by what two very good solutions of one model differ by.

        It is the same behind a filter of a logger, or where readings were moved in time: what the filter or the time is
        off, or readings do between the ticks, is more than such solutions differ by.
        """
        if self.part.retimed or np.isfinite(self.part.passes).any():
            return self
        return measured_by(replace(self, erring=FINE_ERROR), self.white)

    @property
    def by_logger(self) -> bool:
        """Whether a logger recorded the readings, which then hold what they do between ticks."""
        return any(one.of_record for one in self.part.nuisances)

    @property
    def good(self) -> Array:
        """Rms (signals,) that a good solution of the model may err by, with what the motion that drives it errs by."""
        return np.asarray(np.hypot(self.erring * self.part.level, self.part.blurred))

    @property
    def beside(self) -> Array:
        """Variance (signals,) that residuals may have beside the noise: of what a model errs by, and of rounding."""
        return np.asarray(self.sigma**2 - self.white**2)

    @cached_property
    def factors(self) -> Array | None:
        """Factors (groups, signals) on the residuals' spectra that make the noise white; None where it is white."""
        return self._factors(self.groups)

    @cached_property
    def _fast_factors(self) -> Array | None:
        """The same on spectra of so many lines that the transforms are fast."""
        return self._factors(colour.fast(self.groups))

    def _factors(self, count: int) -> Array | None:
        """Factors (count, signals) on spectra of so many lines."""
        if all(item.density is None for item in self.noise):
            return None
        columns = np.ones((count, self.sigma.size))
        for place, item in enumerate(self.noise):
            if item.density is not None:
                density = item.density + self.beside[place]
                columns[:, place] = self.sigma[place] * colour.gains(density, count)
        return columns

    def averaged(self, raw: Array) -> Array:
        """Means of ticks (ticks, …) over groups (groups, …), scaled so that white noise keeps its rms."""
        count = self.groups * self.group
        ticks = raw[:count].reshape(self.groups, self.group, *raw.shape[1:])
        sums = ticks[:, 0].copy()
        for tick in range(1, self.group):  # six times as fast as NumPy's sum over a few values side by side
            sums += ticks[:, tick]
        return np.asarray(sums / math.sqrt(self.group))

    def steady(self, raw: Array) -> Array:
        """Ticks (ticks, …) with the mean of each group at all of its ticks, which has less of the noise."""
        result = raw.copy()
        means = np.repeat(self.averaged(raw) / math.sqrt(self.group), self.group, axis=0)
        result[: len(means)] = means
        return result

    def reduced(self, system: System) -> Array:
        """Residuals in σ averaged over groups, (groups, signals), each of unit variance for white noise."""
        with np.errstate(over="ignore", invalid="ignore"):  # of one that diverges
            try:
                raw = self.residual(system) / self.sigma
            except InputError:  # a hypothesis that this plan's model cannot have
                return np.full((self.groups, self.sigma.size), FAR)
            return self.whitened(raw)

    @cached_property
    def energy(self) -> float:
        """Σ (reading/σ)² of the groups that judge, scaled to as many as there are: that of a prediction of nothing."""
        raw = np.where(self.there, self.part.measured, 0.0) / self.sigma
        held = self.whitened(raw)[self.judging]
        return float(np.mean(np.square(held))) * self.groups * self.sigma.size

    @cached_property
    def louder(self) -> Array | None:
        """Rms noise (groups, signals) of averaged samples over that of the record, where any is unsteady."""
        if self.loudness is None:
            return None
        return np.asarray(np.sqrt(self.averaged(self.loudness**2) / math.sqrt(self.group)))

    def whitened(self, raw: Array) -> Array:
        """Residuals in σ (ticks, signals) averaged over groups and whitened, (groups, signals); `raw` may change."""
        result = self.coloured(raw)
        for known in (self.vague, self.resting, self.louder):
            result = result if known is None else result / known[: len(result)]
        return result

    def coloured(self, raw: Array) -> Array:
        """The same where all that was recorded counts alike."""
        if self._fast_factors is None:
            return finite(self.averaged(raw))
        for place in np.flatnonzero(~self.there.all(axis=0)):
            raw[:, place] = filled(raw[:, place], self.there[:, place])
        result = finite(colour.whitened(finite(self.averaged(raw)), self._fast_factors))
        result[self.averaged(self.there.astype(np.float64)) < SPARSE * math.sqrt(self.group)] = 0.0
        return result


def finite(values: Array) -> Array:
    """Residuals of which none is further away than `FAR`."""
    return np.fmax(np.fmin(values, FAR), -FAR)  # a value that is no number becomes FAR


def filled(x: Array, there: Mask) -> Array:
    """A series (n,) with straight lines where nothing is there; zero where there is nothing at all."""
    if there.all() or not there.any():
        return x if there.all() else np.zeros_like(x)
    return np.asarray(np.interp(np.arange(x.size), np.flatnonzero(there), x[there]))


def prepare(part: Part, record: Record, steps: Mapping[str, float] | None = None) -> Data:
    """Residuals of a part; σ from what is left at the highest frequencies once its model is taken away.

    `steps` of readings that are rounded, by signal: a coarse step's error is no white noise and must not
    be taken for a gap.
    """
    system = record.systems[part.role]
    interval = record.plan.test.interval
    group, train = withheld(part.measured.shape[0], interval)
    ones = np.ones(part.measured.shape[1])
    rounded = np.array([(steps or {}).get(name, 0.0) for name in part.signals])
    planned = np.array([record.planned_noise.get(name, 0.0) for name in part.signals])
    data = Data(part, system, ones, 0.0 * ones, group, train, rounded, record.catalogue, planned=planned)
    data = replace(data, static=record.static)
    return measured_by(data, 0.0 * ones if part.exact else data.white_part(data.residual(system)))


def withheld(ticks: int, interval: float, times: int = 1) -> tuple[int, Mask]:
    """How many ticks are averaged, and which of the averaged samples (groups,) fits may see: blocks in turn.

    So many `times` more ticks are averaged than of most parts.
    """
    group, block = usual(interval)
    groups = ticks // group
    if groups < 5 * block:
        return group, np.arange(groups) % 5 < min(HELD_OUT)
    train = ~np.isin((np.arange(groups) // block) % 5, HELD_OUT)
    return group * times, train[::times][: groups // times]


def usual(interval: float) -> tuple[int, int]:
    """How many ticks are averaged of most parts, and how many averaged samples a block has."""
    group = max(1, round(AVERAGED / interval))
    return group, max(1, round(BLOCK / (interval * group)))


def over_longer(data: Data, building: LoggedBuilding) -> Data | None:
    """The residuals of a building averaged over a twelfth of its shortest period, None where that is no longer.

    Its acceleration holds noise that the controller read and the log does not show. The shorter the averages, the more
    of it looks like another mass and stiffness. A block keeps a whole number of averages.
    """
    interval = data.system.plan.test.interval
    group, block = usual(interval)
    longest = min(
        building.shortest / (PER_PERIOD * group * interval), len(building.measured) / (group * FEWEST)
    )
    times = max((one for one in range(1, block + 1) if block % one == 0 and one <= longest), default=1)
    if times == 1:
        return None
    wider, train = withheld(len(building.measured), interval, times)
    return replace(data, group=wider, train=train)


def by_tick(data: Data) -> Data:
    """The residuals of a part without averages, for what changes from tick to tick."""
    train = np.repeat(data.train, data.group)
    rest = np.full(len(data.part.measured) - train.size, train[-1])
    return measured_by(replace(data, group=1, train=np.concatenate([train, rest]), vague=None), data.white)


def withheld_ticks(ticks: int, interval: float) -> Mask:
    """Ticks (ticks,) that no fit sees."""
    group, train = withheld(ticks, interval)
    mask = np.zeros(ticks, dtype=bool)
    mask[: train.size * group] = np.repeat(~train, group)
    return mask


def measured_by(data: Data, white: Array) -> Data:
    """The data with residuals in units of a noise (signals,).

    A reading that moves over coarse steps errs by a twelfth of their square, as by white noise. One that rests on a few
    of them errs by as much, and by the same for long.
    """
    least = (EXACT * data.part.level if data.part.exact else data.good) + 1e-15
    coarse = np.flatnonzero(data.rounded > STEPPING * white)
    lasting = {int(place): steps_last(data, int(place)) for place in coarse}
    still = [place for place, groups in lasting.items() if np.mean(groups > LONGEST_STEP) > 1.0 - MOVING]
    moving = [place for place in lasting if place not in still]
    rounding = data.rounded / math.sqrt(12.0)
    known = np.ones((data.groups, white.size))
    heard = white**2 + rounding**2
    heard[still] = white[still] ** 2 + (COARSE * data.rounded[still]) ** 2
    for place in moving:
        if white[place] > HELD * rounding[place]:
            heard[place] = white[place] ** 2  # which holds what a reading errs by as it moves
    sigma = np.sqrt(heard + least**2)
    for place in moving:
        more = (rounding[place] / sigma[place]) ** 2
        known[:, place] = np.sqrt(1.0 + (lasting[place] - 1.0) * more)
    return replace(data, sigma=sigma, white=white, resting=known if moving else None)


def steps_last(data: Data, place: int) -> Array:
    """How many averaged samples a step of a reading lasts, (groups,), one at least.

    The step of a balance, or of a ground motion between rows, is no reading's and stands for an error that lasts.
    """
    most = 12.0 * COARSE**2
    if isinstance(data.part, Building | Ground):
        return np.full(data.groups, most)
    interval = data.system.plan.test.interval
    size = 2 * max(1, round(0.5 * WITHIN / interval)) + 1
    reading = data.part.measured[: data.groups * data.group, place]
    spans = ndimage.maximum_filter1d(reading, size) - ndimage.minimum_filter1d(reading, size)
    crossed = data.averaged(spans) / (math.sqrt(data.group) * data.rounded[place])
    return np.clip(WITHIN / (interval * data.group) / np.maximum(crossed, 1e-9), 1.0, most)
