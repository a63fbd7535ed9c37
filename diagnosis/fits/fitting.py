"""Fits of a hypothesis: nominal parameters inside their tolerances, and the parameters of its effects.

    cost = Σ (residual/σ)²/κ + Σ z²

The residuals of a part are driven by exactly known commands, so σ is the noise of its sensors; they are
averaged over a few ticks first, which loses nothing that moves. z counts tolerances, so the second sum is
the prior that the plan states: a maximum a posteriori fit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from common.errors import InputError
from diagnosis.recorded.parts import EXACT, MODEL_ERROR, Building, Part
from diagnosis.recorded.record import Record
from diagnosis.signals import colour
from diagnosis.signals.ceiling import Crosswise
from diagnosis.signals.mask import Mask
from diagnosis.signals.noise_model import NoiseModel
from laboratories.effects import CATALOGUE
from laboratories.effects.effect import Effect, Parameter
from models.registry import Array
from models.system import System

AVERAGED = 0.008  # s, over which residuals are averaged: the laboratories move much more slowly
BLOCK = 1.0  # s, of the blocks that are held out in turn: longer than a model's error is correlated
HELD_OUT = (2, 4)  # of every five blocks, these
STEPPING = 2.0  # steps over the noise from which on a reading is rounded to more than its noise
COARSE = 3.0  # steps that count as noise where a reading is rounded to more than its noise
SHORTEST, LONGEST = 6.0, 0.7  # of a beginning: seconds, and share of the test
SPARSE = 0.5  # of an averaged sample's ticks that must be there
FAR = 1e6  # residual, in σ, of a hypothesis that diverges: worse than any that does not
TOLERANCES = 3.0  # most that a nominal parameter is moved: beyond it the plan is wrong
STEP, FINE_STEP = 0.4, 2e-3  # tolerances between differences: over the kinks of friction, or exactly
ROUNDS = 4  # fits with the signals' weights renewed in between
REUSED = 3  # iterations for which the slopes over the nominal parameters serve again

Values = dict[str, dict[str, float]]  # effect → parameter → value


@dataclass(frozen=True)
class Data:
    """A part's residuals in the form that fits use."""

    part: Part
    system: System  # the plan
    sigma: Array  # (signals,) what a residual is measured by: noise, and what a good model may err by
    white: Array  # (signals,) the noise alone
    group: int  # ticks averaged
    train: Mask  # (groups,) fitted on; the others judge
    rounded: Array  # (signals,) step that a reading is rounded to, 0 for none
    catalogue: Mapping[str, Effect] = field(default_factory=lambda: CATALOGUE)  # the effects of the test
    noise: tuple[NoiseModel, ...] = ()  # of each signal; none: white, of rms `white`
    lines: Array | None = None  # (ticks, signals) what the sensors pick up
    spikes: Mask | None = None  # (ticks, signals) single samples that do not count
    related: Crosswise | None = None  # what may follow from the part's inputs

    @property
    def groups(self) -> int:
        """Number of averaged samples."""
        return self.part.measured.shape[0] // self.group

    def residual(self, system: System) -> Array:
        """Recorded minus predicted, (ticks, signals), zero where nothing was recorded and where a reading has a spike.

        Narrow lines that the sensors pick up are taken away.
        """
        with np.errstate(all="ignore"):
            result = self.part.measured - self.part.predict(system)
        if self.lines is not None:
            result -= self.lines[: len(result)]
        result[~self.there] = 0.0
        return result

    @cached_property
    def there(self) -> Mask:
        """Where readings count, (ticks, signals)."""
        present = self.part.present
        return present if self.spikes is None else present & ~self.spikes[: len(present)]

    @cached_property
    def factors(self) -> Array | None:
        """Factors (groups, signals) on the residuals' spectra that make the noise white; None where it is white."""
        if all(item.density is None for item in self.noise):
            return None
        columns = np.ones((self.groups, self.sigma.size))
        for place, item in enumerate(self.noise):
            if item.density is not None:
                others = (
                    self.sigma[place] ** 2 - self.white[place] ** 2
                )  # what a model may err by, and rounding
                columns[:, place] = self.sigma[place] * colour.gains(item.density + others, self.groups)
        return columns

    def averaged(self, raw: Array) -> Array:
        """Means of ticks (ticks, …) over groups (groups, …), scaled so that white noise keeps its rms."""
        count = self.groups * self.group
        sums = raw[:count].reshape(self.groups, self.group, *raw.shape[1:]).sum(axis=1)
        return np.asarray(sums / math.sqrt(self.group))

    def reduced(self, system: System) -> Array:
        """Residuals in σ averaged over groups, (groups, signals), each of unit variance for white noise."""
        try:
            raw = self.residual(system) / self.sigma
        except InputError:  # a hypothesis that this plan's model cannot have
            return np.full((self.groups, self.sigma.size), FAR)
        if self.factors is None:
            return finite(self.averaged(raw))
        for place in np.flatnonzero(~self.there.all(axis=0)):
            raw[:, place] = filled(raw[:, place], self.there[:, place])
        result = finite(colour.whitened(finite(self.averaged(raw)), self.factors))
        result[self.averaged(self.there.astype(np.float64)) < SPARSE * math.sqrt(self.group)] = 0.0
        return result


def finite(values: Array) -> Array:
    """Residuals of which none is further away than `FAR`."""
    return np.clip(np.nan_to_num(values, nan=FAR, posinf=FAR, neginf=-FAR), -FAR, FAR)


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
    data = Data(part, system, ones, 0.0 * ones, group, train, rounded, record.catalogue)
    return measured_by(data, 0.0 * ones if part.exact else noise(data.residual(system)))


def withheld(ticks: int, interval: float) -> tuple[int, Mask]:
    """How many ticks are averaged, and which of the averaged samples (groups,) fits may see: blocks in turn."""
    group = max(1, round(AVERAGED / interval))
    groups = ticks // group
    block = max(1, round(BLOCK / (interval * group)))
    if groups < 5 * block:
        return group, np.arange(groups) % 5 < min(HELD_OUT)
    return group, ~np.isin((np.arange(groups) // block) % 5, HELD_OUT)


def withheld_ticks(ticks: int, interval: float) -> Mask:
    """Ticks (ticks,) that no fit sees."""
    group, train = withheld(ticks, interval)
    mask = np.zeros(ticks, dtype=bool)
    mask[: train.size * group] = np.repeat(~train, group)
    return mask


def measured_by(data: Data, white: Array) -> Data:
    """The data with residuals in units of a noise (signals,)."""
    level = np.sqrt(np.mean(np.square(data.part.measured), axis=0))
    least = (EXACT if data.part.exact else MODEL_ERROR) * level + 1e-15
    rounding = np.where(
        data.rounded > STEPPING * white, COARSE * data.rounded, data.rounded / math.sqrt(12.0)
    )
    return replace(data, sigma=np.sqrt(white**2 + least**2 + rounding**2), white=white)


def beginning(data: Data, fit: Fit, share: float) -> Data:
    """The beginning of a test that holds a share of what a fit leaves; the whole test where that is long."""
    energy = np.cumsum(np.sum(np.square(fit.reduced), axis=1))
    groups = int(np.searchsorted(energy, share * energy[-1])) + 1
    least = round(SHORTEST / (data.system.plan.test.interval * data.group))
    groups = max(groups, least)
    if groups > LONGEST * data.groups or data.part.exact or isinstance(data.part, Building):
        return data
    return replace(data, part=data.part.first(groups * data.group), train=data.train[:groups])


def noise(residual: Array) -> Array:
    """Rms of the white part of each residual (ticks, signals)."""
    rough = np.diff(residual, n=4, axis=0)
    result: Array = 1.4826 * np.median(np.abs(rough), axis=0) / math.sqrt(70.0)
    return result


@dataclass(frozen=True)
class Free:
    """One parameter of an effect that a fit moves, on the scale it is moved on."""

    effect: str
    parameter: Parameter
    scale: float
    logarithmic: bool

    def inward(self, value: float) -> float:
        """From the parameter's value to the fit's."""
        if self.logarithmic:
            return math.log(value)
        return (value - self._origin) / self.scale

    def outward(self, place: float) -> float:
        """From the fit's value to the parameter's."""
        if self.logarithmic:
            return math.exp(place)
        return self._origin + place * self.scale

    @property
    def _origin(self) -> float:
        return 0.0 if self.parameter.shape else self.parameter.null

    @property
    def bounds(self) -> tuple[float, float]:
        """Range of the fit's value."""
        least, most = self.parameter.least, min(self.parameter.most, self.parameter.believed)
        if self.logarithmic:
            return math.log(max(least, 1e-12)), math.log(most)
        return self.inward(least), self.inward(most)


def free(effect: Effect, values: Mapping[str, float]) -> list[Free]:
    """The parameters of an effect as a fit moves them, from where it starts."""
    result = []
    law = effect.law(values)
    for parameter in effect.every:
        if law and parameter.shape and parameter.name not in law.shapes:
            continue
        logarithmic = math.isinf(parameter.null) or (parameter.shape and parameter.least > 0.0)
        if parameter.shape and parameter.default == parameter.least == values[parameter.name]:
            continue  # a shape that is left out
        size = abs(values[parameter.name] - (0.0 if parameter.shape else parameter.null))
        scale = size if size > 0.0 and math.isfinite(size) else 1.0
        result.append(Free(effect.name, parameter, scale, logarithmic))
    return result


@dataclass(frozen=True)
class Fit:
    """A hypothesis at its best: where its parameters are and what it costs."""

    data: Data
    values: Values
    z: Array  # (nuisances,)
    reduced: Array  # (groups, signals) residuals in σ

    @property
    def names(self) -> tuple[str, ...]:
        """Its effects."""
        return tuple(self.values)

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of the residuals over z, then over the effects' parameters, (groups·signals, parameters)."""
        problem = Problem(self.data, self.values)
        return problem.jacobian(problem.place(self.values, self.z), self.reduced.ravel())

    @property
    def prior(self) -> float:
        """Σ z²."""
        return float(self.z @ self.z)

    @property
    def chi(self) -> float:
        """Σ (residual/σ)² of the withheld groups, scaled to as many as there are."""
        held = self.reduced[~self.data.train]
        return float(np.mean(np.square(held))) * self.reduced.size

    @property
    def cost(self) -> float:
        """The figure by which hypotheses are ranked: on withheld time, with the prior."""
        return self.chi + self.prior


def lay(data: Data, z: Array, values: Values) -> System:
    """The plan with parameters moved and effects laid over it."""
    system = data.system
    for nuisance, place in zip(data.part.nuisances, z, strict=True):
        system = nuisance.moved(system, float(place))
    for name, given in values.items():
        system = data.catalogue[name].apply(system, **given)
    return system


class Problem:
    """One hypothesis as `least_squares` takes it.

    `slopes` of the residuals over the nominal parameters, known from elsewhere, serve as long as
    the fit goes on; without them they are computed anew every few iterations.
    """

    def __init__(
        self, data: Data, start: Values, slopes: Array | None = None, weights: Array | None = None
    ) -> None:
        self.data = data
        self._start = start
        kept = int(np.sum(data.train))
        self._weights = np.tile(weights, kept) if weights is not None else 1.0
        self._train = np.repeat(data.train, data.sigma.size)
        self.names = tuple(start)
        self.frees = tuple(item for name in start for item in free(data.catalogue[name], start[name]))
        self.count = len(data.part.nuisances)
        self._step = FINE_STEP if data.part.exact else STEP
        self._slopes = slopes
        self._uses = 0 if slopes is None else -1

    def place(self, values: Values, z: Array) -> Array:
        """What the fit moves, from the parameters."""
        inside = [item.inward(values[item.effect][item.parameter.name]) for item in self.frees]
        return np.concatenate([z, np.array(inside)])

    def values(self, p: Array) -> Values:
        """The effects' parameters at a place of the fit."""
        result: Values = {name: dict(values) for name, values in self._start.items()}
        for item, place in zip(self.frees, p[self.count :], strict=True):
            value = item.outward(float(place))
            result[item.effect][item.parameter.name] = min(
                max(value, item.parameter.least), item.parameter.most
            )
        return result

    def reduced(self, p: Array) -> Array:
        """Residuals at a place."""
        return self.data.reduced(lay(self.data, p[: self.count], self.values(p)))

    def stacked(self, p: Array) -> Array:
        """Residuals and prior in one vector."""
        fitted = self.reduced(p).ravel()[self._train]
        return np.concatenate([fitted * self._weights, p[: self.count]])

    def bounds(self) -> tuple[Array, Array]:
        """Bounds of all that is moved."""
        ranges = [(-TOLERANCES, TOLERANCES)] * self.count + [item.bounds for item in self.frees]
        low, high = np.array(ranges, dtype=np.float64).reshape(-1, 2).T
        return low, high

    def jacobian(self, p: Array, here: Array | None = None, first: int = 0, last: int | None = None) -> Array:
        """Differences of the residuals over some of the parameters, (groups·signals, parameters)."""
        here = self.reduced(p).ravel() if here is None else here
        columns = []
        _, high = self.bounds()
        for place in range(first, p.size if last is None else last):
            step = self._step * (1.0 if place < self.count else 0.1 * max(1.0, abs(p[place])))
            if p[place] + step > high[place]:
                step = -step
            moved = p.copy()
            moved[place] += step
            columns.append((self.reduced(moved).ravel() - here) / step)
        return np.stack(columns, axis=1) if columns else np.zeros((here.size, 0))

    def stacked_jacobian(self, p: Array) -> Array:
        """Derivative of `stacked`."""
        here = self.reduced(p).ravel()
        if self._slopes is None or self._uses == 0:
            self._slopes, self._uses = self.jacobian(p, here, last=self.count), REUSED
        self._uses -= 1
        slopes = np.concatenate([self._slopes, self.jacobian(p, here, first=self.count)], axis=1)
        fitted = (slopes[self._train].T * self._weights).T
        return np.concatenate([fitted, np.eye(self.count, p.size)])


def fit(
    data: Data,
    start: Values,
    z: Array | None = None,
    steps: int = 12,
    slopes: Array | None = None,
    rounds: int = ROUNDS,
) -> Fit:
    """Best parameters from a start; without effects it is the commissioning fit.

    `z` (nuisances,) where the nominal parameters begin, `slopes` as `Problem` takes them. A signal that
    a hypothesis misses by far more than noise counts by what it misses, round by round, so that it does
    not drag along the parameters that other signals know better.
    """
    found = at(data, start, z if z is not None else np.zeros(len(data.part.nuisances)))
    for _ in range(rounds):
        missed = np.maximum(1.0, np.mean(np.square(found.reduced), axis=0))
        before, found = found, moved(data, found, steps, slopes, 1.0 / np.sqrt(missed))
        if abs(before.chi - found.chi) < 1.0 + 1e-3 * excess(found):
            break
    return found


def excess(fit: Fit) -> float:
    """What a fit costs beyond noise."""
    return max(0.0, fit.chi - fit.reduced.size) + fit.prior


def moved(data: Data, fit: Fit, steps: int, slopes: Array | None, weights: Array) -> Fit:
    """A fit moved to the best parameters under weights of the signals."""
    problem = Problem(data, fit.values, slopes, weights)
    low, high = problem.bounds()
    p = np.clip(problem.place(fit.values, fit.z), low + 1e-9, high - 1e-9)
    if p.size:
        arguments: dict[str, Any] = {"bounds": (low, high), "x_scale": "jac", "ftol": 1e-6, "xtol": 1e-6}
        p = least_squares(problem.stacked, p, jac=problem.stacked_jacobian, max_nfev=steps, **arguments).x
    return Fit(data, problem.values(p), p[: problem.count], problem.reduced(p))


def at(data: Data, values: Values, z: Array) -> Fit:
    """A hypothesis at given parameters, nothing fitted."""
    return Fit(data, values, z, data.reduced(lay(data, z, values)))
