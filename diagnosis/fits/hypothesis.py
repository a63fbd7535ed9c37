"""A hypothesis as a fit moves it: nominal parameters within their tolerances, and effects laid over the plan."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from diagnosis.fits.residuals import Data
from diagnosis.fits.threads import each
from laboratories.effects.effect import Effect, Parameter
from models.registry import Array
from models.system import System

TOLERANCES = 3.0  # most that a nominal parameter is moved: beyond it the plan is wrong
STEP, FINE_STEP = 0.4, 2e-3  # tolerances between differences: over the kinks of friction, or exactly
OF_SIZE = 0.1  # of such a step, in the distance of an effect's parameter from its null value
# Of such a step, in the logarithm of a parameter: 1 % of its value. An end stop's place decides on all impacts, and
# steps of 4 % ended twenty times as far from it (set "normal", seed 8101).
OF_LOGARITHM = 0.025
KEPT = 3  # residuals of the last places that are kept: a fit asks for those of a step and of the one before it again
HIGHEST = 700.0  # logarithm of what a number can hold, nearly: a simplex steps beyond any range
RENEWED = 3  # steps after which slopes over the effects' parameters are computed anew

Values = dict[str, dict[str, float]]  # effect → parameter → value


def lay(data: Data, z: Array, values: Values) -> System:
    """The plan with parameters moved and effects laid over it, behind the logger."""
    system = data.moved(z)
    for name, given in values.items():
        system = data.catalogue[name].apply(system, **given)
    return data.logged(system, z)


def values_of_plan(data: Data, values: Values) -> list[str]:
    """The effects that are nothing but another value of a parameter of the plan, as a mass or a delay.

    Such an effect lays no law over the plan's models.
    """
    effects = data.system.effects
    return [
        name
        for name, given in values.items()
        if data.catalogue[name].apply(data.system, **given).effects == effects
    ]


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
            return math.exp(min(place, HIGHEST))
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


def left_out(parameter: Parameter, values: Mapping[str, float]) -> bool:
    """Whether a shape is at the end of its range where it has no influence, so that a fit leaves it there."""
    return parameter.shape and parameter.default == parameter.least == values[parameter.name]


def free(effect: Effect, values: Mapping[str, float]) -> list[Free]:
    """The parameters of an effect that have values, as a fit moves them from there."""
    result = []
    law = effect.law(values)
    for parameter in effect.every:
        if parameter.name not in values:
            continue
        if law and parameter.shape and parameter.name not in law.shapes:
            continue
        logarithmic = math.isinf(parameter.null) or (parameter.shape and parameter.least > 0.0)
        if left_out(parameter, values):
            continue
        size = abs(values[parameter.name] - (0.0 if parameter.shape else parameter.null))
        scale = size if size > 0.0 and math.isfinite(size) else 1.0
        result.append(Free(effect.name, parameter, scale, logarithmic))
    return result


class Problem:
    """One hypothesis as `least_squares` takes it.

    `slopes` are those of the residuals over the nominal parameters where they are known from elsewhere.
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
        self._kept: dict[bytes, Array] = {}
        self._last: tuple[Array, Array] | None = None
        self._turn = 0

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
        """Residuals at a place (groups, signals)."""
        known = self._kept.get(p.tobytes())
        if known is not None:
            return known
        return self.keep(p, self.data.reduced(lay(self.data, p[: self.count], self.values(p))))

    def keep(self, p: Array, reduced: Array) -> Array:
        """Keep the residuals of a place instead of the oldest ones, and return them."""
        if len(self._kept) >= KEPT:
            del self._kept[next(iter(self._kept))]
        self._kept[p.tobytes()] = reduced
        return reduced

    def stacked(self, p: Array) -> Array:
        """Residuals and prior in one vector."""
        fitted = self.reduced(p).ravel()[self._train]
        return np.concatenate([fitted * self._weights, p[: self.count]])

    def bounds(self) -> tuple[Array, Array]:
        """Bounds of all that is moved."""
        ranges = [(-TOLERANCES, TOLERANCES)] * self.count + [item.bounds for item in self.frees]
        low, high = np.array(ranges, dtype=np.float64).reshape(-1, 2).T
        return low, high

    def jacobian(
        self, p: Array, here: Array | None = None, first: int = 0, last: int | None = None, side: float = 1.0
    ) -> Array:
        """Differences of the residuals over some of the parameters, (groups·signals, parameters), to a side: 1, -1."""
        here = self.reduced(p).ravel() if here is None else here
        low, high = self.bounds()

        def slope(place: int) -> Array:
            step = side * self._step * self._share(place, float(p[place]))
            if not low[place] <= p[place] + step <= high[place]:
                step = -step
            moved = p.copy()
            moved[place] += step
            there = self.data.reduced(lay(self.data, moved[: self.count], self.values(moved)))
            return np.asarray((there.ravel() - here) / step)

        columns = each(slope, range(first, p.size if last is None else last))
        return np.stack(columns, axis=1) if columns else np.zeros((here.size, 0))

    def _share(self, place: int, value: float) -> float:
        """How large a difference is for what a fit moves, over that for a nominal parameter."""
        if place < self.count:
            return 1.0
        if self.frees[place - self.count].logarithmic:
            return OF_LOGARITHM
        return OF_SIZE * max(1.0, abs(value))

    def stacked_jacobian(self, p: Array) -> Array:
        """Derivative of `stacked`.

        It is computed at the first place. At others it follows from how the residuals changed over the last step, and
        every few steps what belongs to the effects is computed anew.
        """
        here = self.reduced(p).ravel()
        if self._slopes is None:
            self._slopes = self.jacobian(p, here, last=self.count)
        elif self._last is not None:
            self._slopes = secant(*self._last, p, here, self._slopes)
        if self._turn == 0:
            anew = self.jacobian(p, here, first=self.count)
            self._slopes = np.concatenate([self._slopes[:, : self.count], anew], axis=1)
        self._turn = (self._turn + 1) % RENEWED
        self._last = p.copy(), here
        fitted = (self._slopes[self._train].T * self._weights).T
        return np.concatenate([fitted, np.eye(self.count, p.size)])


def secant(before: Array, old: Array, p: Array, new: Array, slopes: Array) -> Array:
    """Slopes (residuals, parameters) changed as little as the residuals after a step demand.

    `old` (residuals,) are the residuals at the place `before` (parameters,), `new` those at `p`. Each parameter counts
    by how far it changes the residuals (C. G. Broyden, Mathematics of Computation 19 (1965), 577-593, eq. 4.5, scaled).
    """
    step = p - before
    along = step * np.sum(np.square(slopes), axis=0)
    total = float(step @ along)
    if total == 0.0:
        return slopes
    return np.asarray(slopes + np.outer(new - old - slopes @ step, along / total))
