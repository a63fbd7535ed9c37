"""Identified values with their 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.registry import Array

COVERAGE = 0.95
# Share of the largest singular value of the Jacobian below which a direction is not identified: the accuracy of its
# finite differences.
SINGULAR = 1e-7
INVOLVED = 1e-6  # share of a parameter in such a direction at which the parameter counts as not identified


@dataclass(frozen=True)
class Estimate:
    """A value and the ends of its 95 % interval, all in `unit`.

    The ends are ±inf where the data do not determine it.
    """

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Identified:
    """The result of a fit: the estimates by name, and the misfit over the measurement's standard deviation."""

    parameters: dict[str, Estimate]
    nrmse: float

    def __getitem__(self, name: str) -> Estimate:
        return self.parameters[name]


def quantile(freedom: float) -> float:
    """Two-sided 95 % quantile of Student's t with the degrees of freedom given (at least 1)."""
    from scipy.stats import t

    return float(t.ppf(0.5 + COVERAGE / 2.0, max(freedom, 1.0)))


def around(value: float, deviation: float, unit: str, freedom: float = np.inf) -> Estimate:
    """Estimate from a value, its standard deviation and the degrees of freedom behind that."""
    half = quantile(freedom) * deviation
    return Estimate(float(value), float(value - half), float(value + half), unit)


def inflation(residual: Array) -> float:
    """The number of samples (≥ 1) of an autocorrelated residual that count as one independent sample.

    `1 + 2·Σ ρ_j`, summed up to the first autocorrelation that is within the 95 % band of white noise. Source: Bayley
    and Hammersley, The effective number of independent observations in an autocorrelated time series (1946).
    """
    centred = residual - residual.mean()
    n = centred.size
    power = float(centred @ centred)
    if power == 0.0 or n < 4:
        return 1.0
    spectrum = np.fft.rfft(centred, 2 * n)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2, 2 * n)[: n // 2] / power
    noise = np.flatnonzero(correlation[1:] < 1.96 / np.sqrt(n))
    last = int(noise[0]) if noise.size else n // 2 - 1
    return float(max(1.0 + 2.0 * correlation[1 : last + 1].sum(), 1.0))


def deviations(jacobian: Array, residual: Array, blocks: Sequence[int]) -> tuple[Array, float]:
    """Standard deviations of fitted parameters, and the effective degrees of freedom.

    `jacobian` (n, p) and `residual` (n,) are those at the minimum; `blocks` are the lengths of the signals
    stacked in them, each of which has its own variance and its own effective sample number:
    `(JᵀJ)⁻¹·(Σ v_b·J_bᵀJ_b)·(JᵀJ)⁻¹`. A parameter with a share in a direction without influence on the residual has an
    infinite deviation.
    """
    scale = np.linalg.norm(jacobian, axis=0)
    safe = np.where(scale > 0.0, scale, 1.0)
    scaled = jacobian / safe
    _, size, rows = np.linalg.svd(scaled, full_matrices=False)
    seen = size > SINGULAR * max(float(size[0]), 1e-300)
    inverse = (rows[seen].T / size[seen] ** 2) @ rows[seen]
    middle = np.zeros((scale.size, scale.size))
    independent, begin = 0.0, 0
    for length in blocks:
        part = slice(begin, begin + length)
        begin += length
        factor = inflation(residual[part])
        share = scale.size * length / residual.size
        variance = float(residual[part] @ residual[part]) / max(length - share, 1.0)
        middle += variance * factor * scaled[part].T @ scaled[part]
        independent += length / factor
    result = np.sqrt(np.maximum(np.diag(inverse @ middle @ inverse), 0.0)) / safe
    hidden = np.abs(rows[~seen]).max(axis=0, initial=0.0) > INVOLVED
    result[hidden | (scale == 0.0)] = np.inf
    return result, independent - scale.size


def of_fit(
    result: Any,
    names: Sequence[str],
    units: Sequence[str],
    scales: Sequence[float] | Array,
    blocks: Sequence[int] | None = None,
) -> dict[str, Estimate]:
    """Estimates from a `scipy.optimize.least_squares` result (`x`, `jac`, `fun`).

    The first parameters of the fit carry `names`, any others are nuisances; `scales` turn the fit's
    parameters into `units`; `blocks` are the lengths of the stacked signals (default: one signal). The
    residual's variance is corrected for its autocorrelation by the effective sample number, signal by signal.
    """
    jacobian = np.asarray(result.jac, dtype=np.float64)
    residual = np.asarray(result.fun, dtype=np.float64)
    spread, freedom = deviations(jacobian, residual, blocks if blocks is not None else [residual.size])
    return {
        name: around(float(result.x[i] * scales[i]), float(spread[i] * abs(scales[i])), units[i], freedom)
        for i, name in enumerate(names)
    }


def nrmse(measured: Array, fitted: Array) -> float:
    """Root mean square of the misfit over the measurement's standard deviation."""
    return float(np.sqrt(np.mean((measured - fitted) ** 2)) / np.std(measured))
