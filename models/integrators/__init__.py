"""Integration methods of the numerical substructure: one file each, listed here.

All solve `M·a + C·v + f(x) = p` with forces measured at a displacement that is known before them, and
are second order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from common.errors import InputError
from common.schema import nearest
from models.compiled import jit
from models.integrators import central_difference, cr, kr_alpha, newmark_explicit
from models.integrators.state import rest
from models.registry import Array

__all__ = ["INTEGRATORS", "Integrator", "Method", "build", "rest", "step"]


@dataclass(frozen=True)
class Integrator:
    """One method: its code in the dispatch below, its matrices, its start from x0 and v0."""

    code: int
    coefficients: Callable[[Array, Array, Array, float, float], Array]
    start: Callable[[Array, Array, Array, Array, Array, float], Array]
    stable_below: float  # largest ω·Δt of an undamped linear structure


INTEGRATORS = {
    "newmark_explicit": Integrator(0, newmark_explicit.coefficients, newmark_explicit.start, 2.0),
    "central_difference": Integrator(1, central_difference.coefficients, central_difference.start, 2.0),
    "cr": Integrator(2, cr.coefficients, cr.start, np.inf),
    "kr_alpha": Integrator(3, kr_alpha.coefficients, kr_alpha.start, np.inf),
}


@dataclass(frozen=True)
class Method:
    """A method made for one structure and interval."""

    code: int
    coefficients: Array


def build(name: str, M: Array, C: Array, K: Array, interval: float, rho_infinity: float) -> Method:
    """The method for a structure; raises InputError for an unknown name, or where the interval is unstable."""
    if name not in INTEGRATORS:
        raise InputError(f"Unknown integrator '{name}' in [structure]: {nearest(name, INTEGRATORS)}")
    method = INTEGRATORS[name]
    fastest = float(np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.max(initial=0.0)))
    if fastest * interval >= method.stable_below:
        raise InputError(
            f"Integrator '{name}' in [structure] is unstable: ω·Δt of the fastest mode is {fastest * interval:.2f}, "
            f"but must be below {method.stable_below:g}; choose 'cr' or 'kr_alpha', or a shorter interval."
        )
    return Method(method.code, np.ascontiguousarray(method.coefficients(M, C, K, interval, rho_infinity)))


@jit
def step(code: int, c: Array, s: Array, g: Array, interval: float) -> None:
    """Move a state on by one tick; `g` is the external minus the restoring force at NEXT_DISPLACEMENT, N."""
    if code == 0:
        newmark_explicit.step(c, s, g, interval)
    elif code == 1:
        central_difference.step(c, s, g, interval)
    elif code == 2:
        cr.step(c, s, g, interval)
    else:
        kr_alpha.step(c, s, g, interval)
