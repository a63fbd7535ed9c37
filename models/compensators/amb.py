"""Adaptive model-based compensation: the inverse of an actuator with its specimen, found by a gradient.

    u = a₀·r + a₁·ṙ + a₂·r̈ + a₃·r⃛      (m; a₀ –, a₁ s, a₂ s², a₃ s³)
    ȧ = Γ·φ·(u_f − aᵀφ)/(1 + φᵀφ),   a ≥ 0,   Γ = diag(10^g₀, 10^g₁, 10^g₂, 10^g₃)

with `φ` the measured displacement and its first three derivatives in SI and `u_f` the command, both behind the
same Butterworth low-pass of fourth order: Fermandois, Gálmez and Valdebenito, paper C001077 of the 17WCEE, 2020. The
default gains are those for the benchmark problem of real-time hybrid simulation; the starting coefficients are
those of its plant.

- The command of tick k−1 is reached at t_k, where it meets the measurement of tick k. A command that a limiter
  changed afterwards is not known here.
- The derivatives of target and measurement are the same backward differences, so that coefficients learnt from one
  fit the other although both are late. Smoother derivatives would be later still and leave less stability margin at
  the resonance of the actuator's oil column.
- The rule is integrated by the implicit Euler method, which here needs no solution of equations: it adds `h·φᵀΓφ` to
  the denominator. For any gains, the error of the pair just seen decreases and keeps its sign.
- The coefficients adapt only if the filtered measurement changed by `trigger` within the last `memory` seconds:
  noise alone would reduce those of the higher derivatives to zero.

Not to be confused with `ats`, which solves for a window by least squares, nor with `series`, whose coefficients
are given.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.plan.schema import Rule
from models.compensators import low_pass, series
from models.compensators.wanted import Wanted
from models.compiled import jit, jit_apart
from models.registry import Array


class AmbParams(NamedTuple):
    """Initial coefficients, exponents of the adaptive gains, low-pass filter, and the condition for adaptation."""

    a0: float = 0.99254  # –
    a1: float = 0.024889  # s
    a2: float = 1.0662e-4  # s²
    a3: float = 3.8564e-7  # s³
    g0: float = 8.4  # 10^g₀ in 1/(m²·s)
    g1: float = 6.2  # 10^g₁ in s/m²
    g2: float = 2.1  # 10^g₂ in s³/m²
    g3: float = 0.8  # 10^g₃ in s⁵/m²
    cutoff: float = 20.0  # Hz
    trigger: float = 0.0001  # m
    memory: float = 0.25  # s


EXPONENT = "decimal exponent of the gain (SI) on the factor of the"
RULES = {
    **series.RULES,
    "g0": Rule(f"{EXPONENT} target", least=-20.0, most=20.0),
    "g1": Rule(f"{EXPONENT} target's rate", least=-20.0, most=20.0),
    "g2": Rule(f"{EXPONENT} target's acceleration", least=-20.0, most=20.0),
    "g3": Rule(f"{EXPONENT} target's jerk", least=-20.0, most=20.0),
    "cutoff": Rule("corner of the low-pass filter", "Hz", above=0.0),
    "trigger": Rule("change of the filtered measurement that counts as motion", "m", above=0.0),
    "memory": Rule("time without such a change after which coefficients rest", "s", above=0.0, most=10.0),
}
G0, CUTOFF, TRIGGER, MEMORY = 4, 8, 9, 10
GAINS = 11  # four factors h·Γ
SOS = 15  # the low-pass

ORDER = 4
SECTIONS = ORDER // 2
# the coefficients are the first four places of the memory
TICKS, QUIET, ANCHOR, COMMAND = (
    4,
    5,
    6,
    7,
)  # calls; s since the last motion; position then, m; last command, m
COMMAND_FILTER, MEASURED_FILTER = 8, 12
FILTERED = 16  # filtered command, m
TARGETS, MEASURED = 17, 21  # targets and filtered measurements, newest first
KEPT = 4


def pack(params: Array, interval: float) -> Array:
    """Parameters, the gains per tick and the filter.

    Raises:
        InputError: the filter's corner is above what the interval (s) resolves.
    """
    gains = interval * 10.0 ** params[G0 : G0 + 4]
    filtering = low_pass.coefficients("amb", ORDER, float(params[CUTOFF]), interval)
    return np.concatenate([params, gains, filtering])


def state(params: Array, _interval: float) -> Array:
    """Start coefficients, and everything else empty."""
    s = np.zeros(MEASURED + KEPT)
    s[:4] = params[:4]
    return s


@jit
def rest(p: Array, s: Array, command: float, measured: float) -> None:
    """Initialize the memory as if command and measurement had been constant at these values (m)."""
    s[COMMAND] = command
    s[ANCHOR] = measured
    s[QUIET] = p[MEMORY]
    low_pass.settle(p, SOS, SECTIONS, s, COMMAND_FILTER, command)
    low_pass.settle(p, SOS, SECTIONS, s, MEASURED_FILTER, measured)
    for i in range(KEPT):
        s[TARGETS + i] = command
        s[MEASURED + i] = measured


@jit
def push(s: Array, at: int, value: float) -> None:
    """Insert a value before those kept from place `at` on, and drop the oldest."""
    for i in range(KEPT - 1, 0, -1):
        s[at + i] = s[at + i - 1]
    s[at] = value


@jit
def first_derivative(s: Array, at: int, interval: float) -> float:
    """First derivative of the values kept from place `at` on, by the backward difference."""
    return (s[at] - s[at + 1]) / interval


@jit
def second_derivative(s: Array, at: int, interval: float) -> float:
    """Second derivative of those values, by the backward difference."""
    return (s[at] - 2.0 * s[at + 1] + s[at + 2]) / interval**2


@jit
def third_derivative(s: Array, at: int, interval: float) -> float:
    """Third derivative of those values, by the backward difference."""
    return (s[at] - 3.0 * s[at + 1] + 3.0 * s[at + 2] - s[at + 3]) / interval**3


@jit
def series_of(s: Array, at: int, interval: float) -> float:
    """The sum (m) of coefficients times the newest of the values kept from place `at` on and its derivatives."""
    early = s[0] * s[at] + s[1] * first_derivative(s, at, interval)
    return early + s[2] * second_derivative(s, at, interval) + s[3] * third_derivative(s, at, interval)


@jit
def observe(p: Array, s: Array, measured: float, interval: float) -> None:
    """Filter command and measurement of t_k, and update the time since the last motion."""
    s[FILTERED] = low_pass.step(p, SOS, SECTIONS, s, COMMAND_FILTER, s[COMMAND])
    push(s, MEASURED, low_pass.step(p, SOS, SECTIONS, s, MEASURED_FILTER, measured))
    s[QUIET] += interval
    if abs(s[MEASURED] - s[ANCHOR]) > p[TRIGGER]:
        s[ANCHOR] = s[MEASURED]
        s[QUIET] = 0.0


@jit
def adapt(p: Array, s: Array, interval: float) -> None:
    """One step of the coefficients along the gradient of the pair of t_k."""
    x, v = s[MEASURED], first_derivative(s, MEASURED, interval)
    a, j = second_derivative(s, MEASURED, interval), third_derivative(s, MEASURED, interval)
    error = s[FILTERED] - series_of(s, MEASURED, interval)
    size = 1.0 + (1.0 + p[GAINS]) * x * x + (1.0 + p[GAINS + 1]) * v * v
    size += (1.0 + p[GAINS + 2]) * a * a + (1.0 + p[GAINS + 3]) * j * j
    pull = error / size
    if not np.isfinite(pull):
        return
    s[0] = max(s[0] + p[GAINS] * x * pull, 0.0)
    s[1] = max(s[1] + p[GAINS + 1] * v * pull, 0.0)
    s[2] = max(s[2] + p[GAINS + 2] * a * pull, 0.0)
    s[3] = max(s[3] + p[GAINS + 3] * j * pull, 0.0)


@jit_apart
def step(p: Array, s: Array, wanted: Wanted, interval: float) -> float:
    """Command (m); before the first tick, command and measurement count as still."""
    if s[TICKS] == 0.0:
        rest(p, s, wanted.present, wanted.measured)
    s[TICKS] += 1.0
    observe(p, s, wanted.measured, interval)
    if s[QUIET] < p[MEMORY]:
        adapt(p, s, interval)
    push(s, TARGETS, wanted.target)
    s[COMMAND] = series_of(s, TARGETS, interval)
    return s[COMMAND]
