"""Explicit integration methods for `M·a + C·v + f(x) = p(t)` with measured forces, one file each.

At tick k the state's row NEXT_DISPLACEMENT holds x_k, at which all restoring forces were evaluated or
measured; `step` takes `g = p_k − f(x_k)` and gives v_k, a_k and x_{k+1}. For every method
`M·a_k + C·v_k = g_k` holds. A method is a file with `coefficients`, `initial_state` and `step`; it is added
by its line in `INTEGRATORS` and one in `step`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from common.errors import InputError
from common.plan.schema import Rule, nearest
from models.compiled import jit
from models.integrators import central_difference, cr, kr_alpha, newmark_explicit, rk4
from models.integrators.state import ROWS
from models.registry import Array


@dataclass(frozen=True)
class Integrator:
    """One method: its code in `step`, the functions that prepare it, its options, order and stability limit."""

    name: str
    code: int
    coefficients: Callable[..., Array]  # (M, C, K, interval, **options) -> (m, n, n)
    initial_state: Callable[..., Array]  # (c, M, C, x0, v0, g0, interval) -> (ROWS, n)
    stability: str
    limit: float = math.inf  # stable while the highest ω·h stays below
    order: int = 2
    of_numerical: bool = False  # whether its K is that of the numerical part alone, not of everything
    excess: Callable[[Array, Array, Array, float], float] | None = (
        None  # (M, C, K, interval): beyond 0 it diverges
    )
    options: Mapping[str, float] = field(default_factory=dict)  # with defaults
    rules: Mapping[str, Rule] = field(default_factory=dict)  # ranges of the options


BOUNDED = "stable while the highest ω·interval is below 2, whatever the damping"
ALWAYS = "stable for any ω·interval while no stiffness exceeds the initial one"
GROWTH = 1e-9  # largest growth per step that may be rounding: in a million steps it stays below 0.1 %
HELD = (
    "stable while the highest ω·interval of the numerical part is below 2.6, and beyond critical damping the highest "
    "rate of decay times the interval below 2.78; order 4 where nothing but the numerical part acts"
)

INTEGRATORS = {
    method.name: method
    for method in (
        Integrator(
            "newmark_explicit",
            0,
            newmark_explicit.coefficients,
            newmark_explicit.initial_state,
            BOUNDED,
            limit=2.0,
        ),
        Integrator(
            "central_difference",
            1,
            central_difference.coefficients,
            central_difference.initial_state,
            BOUNDED,
            limit=2.0,
        ),
        Integrator("cr", 2, cr.coefficients, cr.initial_state, ALWAYS),
        Integrator(
            "kr_alpha",
            3,
            kr_alpha.coefficients,
            kr_alpha.initial_state,
            ALWAYS,
            options={"rho_infinity": 0.5},
            rules={"rho_infinity": Rule("spectral radius at infinity", least=0.0, most=1.0)},
        ),
        Integrator(
            "rk4",
            4,
            rk4.coefficients,
            rk4.initial_state,
            HELD,
            limit=2.6,
            order=1,
            of_numerical=True,
            excess=rk4.excess,
        ),
    )
}


@dataclass(frozen=True)
class Method:
    """A method prepared for one structure and interval."""

    code: int
    coefficients: Array  # (m, n, n)
    integrator: Integrator
    M: Array
    C: Array
    interval: float  # s

    def start(self, x0: Array, v0: Array, g0: Array) -> Array:
        """State (ROWS, n) before the first step for displacement m, velocity m/s and force N, each (n,).

        `g0` is `p(t_0) − f(x0)`, without damping. From rest under a load that does not begin at zero this
        keeps order 2, where a state of zeros keeps order 1.
        """
        return self.integrator.initial_state(self.coefficients, self.M, self.C, x0, v0, g0, self.interval)


def rest(n: int) -> Array:
    """State (ROWS, n) before the first step of a structure at rest that is not loaded yet, for any method."""
    return np.zeros((ROWS, n))


def build(
    name: str, M: Array, C: Array, K: Array, interval: float, rho_infinity: float | None = None
) -> Method:
    """A method prepared for matrices (n, n) in kg, N·s/m, N/m and an interval in s.

    `M` and `C` are those of the numerical part, `K` the initial stiffness of everything, measured or computed; of a
    method with `of_numerical` that of the numerical part alone. `rho_infinity` goes to methods that have such an
    option, which take their default without it.

    Raises:
        InputError: the method is unknown, an option is out of range, or the test would diverge.
    """
    if name not in INTEGRATORS:
        raise InputError(f"Unknown integrator '{name}' in [structure]: {nearest(name, INTEGRATORS)}")
    integrator = INTEGRATORS[name]
    options = dict(integrator.options)
    if rho_infinity is not None and "rho_infinity" in options:
        options["rho_infinity"] = rho_infinity
    for option, value in options.items():
        rule = integrator.rules[option]
        if not rule.admits(value):
            raise InputError(f"{option} of integrator '{name}' is {value:g}, but must be {rule.allowed()}.")
    check_stability(integrator, M, C, K, interval)
    c = integrator.coefficients(M, C, K, interval, **options)
    return Method(integrator.code, c, integrator, M, C, interval)


def check_stability(integrator: Integrator, M: Array, C: Array, K: Array, interval: float) -> None:
    """Raise InputError where the highest mode of the initial stiffness, or the method's own step, makes it diverge."""
    omega = math.sqrt(float(np.abs(np.linalg.eigvals(np.linalg.solve(M, K))).max()))
    if omega * interval >= integrator.limit:
        raise InputError(
            f"Integrator '{integrator.name}' diverges at ω·interval = {omega * interval:.3g} of the highest"
            f" mode: take an interval below {integrator.limit / omega:.3g} s, or cr or kr_alpha."
        )
    if integrator.excess is not None and integrator.excess(M, C, K, interval) > GROWTH:
        raise InputError(
            f"Integrator '{integrator.name}' diverges by the dashpots of the numerical part at an interval of "
            f"{interval:g} s: take a shorter one, less damping in [structure], or cr or kr_alpha."
        )


@jit
def step(kind: int, c: Array, s: Array, g: Array, interval: float) -> None:
    """One tick of the method with code `kind`: `g` (n,) N, not changed, moves `s` on by the interval (s)."""
    if kind == 1:
        central_difference.step(c, s, g, interval)
    elif kind == 2:
        cr.step(c, s, g, interval)
    elif kind == 3:
        kr_alpha.step(c, s, g, interval)
    elif kind == 4:
        rk4.step(c, s, g, interval)
    else:
        newmark_explicit.step(c, s, g, interval)
