"""Adaptive time series: the inverse of the actuator, identified from its motion in the last second.

    u = a₀·r + a₁·ṙ + a₂·r̈      (m; a₀ –, a₁ s, a₂ s²)

with `a` from least squares of past commands on the measured displacement and its derivatives, both
low-passed by the same filter, over a moving window: Chae, Kazemibidokhti and Ricles, Earthquake Engineering
and Structural Dynamics 42 (2013) 1697–1715. The coefficients have bounds and bounded rates of change, and they change
only while there is motion: within the newest quarter of the window `|measured|` must have been above the trigger and
must have changed by half of it. So nothing is learnt from a specimen that stays deformed, nor from the decaying end of
a motion alone, in which the three columns are nearly proportional.

- The command of tick k−1 is reached at t_k, where it meets the measurement of tick k. Derivatives are
  central differences, so both sides are those of t_{k−1}. A command that a limiter changed afterwards is
  not known here.
- The normal equations of the window are running sums. A second set of sums, started anew with each window, replaces
  them when it covers a whole window: rounding errors accumulate for two windows at most, and all ticks cost the same.
- Columns are scaled to length one, and the step from the present coefficients is damped by `DAMPING`: directions that
  the window does not determine (a single sine cannot tell a₀ from a₂) stay as they are. If the matrix is singular all
  the same, or not finite, no coefficient changes.

Not to be confused with AMB (Galmez and Fermandois), which follows a gradient instead of solving for a
window, nor with `inverse`, whose coefficients are given.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.schema import Rule
from models.compensators import low_pass
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.registry import Array


class AtsParams(NamedTuple):
    """Initial coefficients, window, trigger and filter, and the bounds of the coefficients."""

    lead: float = 0.044  # s; without a lag a₁ starts there, a₂ at lead²/2
    window: float = 1.0  # s
    trigger: float = 0.0005  # m
    cutoff: float = 20.0  # Hz
    a0_least: float = 0.7  # –
    a0_most: float = 1.3  # –
    a1_most: float = 0.08  # s
    a2_most: float = 0.0032  # s²
    a0_rate: float = 2.0  # 1/s
    a1_rate: float = 0.05  # s/s
    a2_rate: float = 0.001  # s²/s
    time_constant: float = 0.0  # s; of a lag behind that lead: a₁ and a₂ start as its series inverse


RULES = {
    "lead": Rule("delay of the actuator to start from", "s", least=0.0, most=1.0),
    "window": Rule("length of the moving window", "s", least=0.1, most=10.0),
    "trigger": Rule("measured displacement above which coefficients adapt", "m", above=0.0),
    "cutoff": Rule("corner of the low-pass filter", "Hz", above=0.0),
    "a0_least": Rule("lower bound of a0", above=0.0, most=1.0),
    "a0_most": Rule("upper bound of a0", least=1.0),
    "a1_most": Rule("upper bound of a1", "s", least=0.0, most=1.0),
    "a2_most": Rule("upper bound of a2", "s²", least=0.0, most=1.0),
    "a0_rate": Rule("fastest change of a0", "1/s", least=0.0),
    "a1_rate": Rule("fastest change of a1", "s/s", least=0.0),
    "a2_rate": Rule("fastest change of a2", "s²/s", least=0.0),
    "time_constant": Rule("lag of the actuator to start from, beside that delay", "s", least=0.0, most=1.0),
}
LEAD, WINDOW, TRIGGER, CUTOFF, A0_LEAST, A0_MOST, A1_MOST, A2_MOST, A0_RATE, A1_RATE, A2_RATE, LAG = range(12)
LENGTH = 12  # window in ticks
SOS = 13  # the low-pass

ORDER = 6
SECTIONS = ORDER // 2
TIME = 0.05  # s; unit of time of the sums, near 1/ω of 3 Hz, so that x, v and a in the sums have like sizes
# Added to the diagonal of the scaled normal matrix, which is one: a direction with less than a thousandth of the
# window's power, as noise of 3 % of the motion has, hardly changes the coefficients.
DAMPING = 1e-3
SINGULAR = (
    0.1 * DAMPING
)  # without rounding no pivot is below `DAMPING`, so a smaller one than this is rounding

COEFFICIENTS = 0  # a₀, a₁, a₂
TICKS, HEAD, QUIET, COMMAND = 3, 4, 5, 6  # calls; place in the ring; ticks since the trigger; last command
COMMAND_FILTER, MEASURED_FILTER = 7, 13
BEFORE, EARLIER, COMMAND_BEFORE = 19, 20, 21  # filtered measurement one and two ticks ago, filtered command
ANCHOR = 22  # filtered measurement (m) when it last had moved on by half the trigger
SUMS, FRESH = 23, 33  # xx xv xa vv va aa xu vu au, and x
RING = 43  # x v a u of each tick in the window


def pack(params: Array, interval: float) -> Array:
    """Parameters, the window in ticks, the filter's sections and its memory at a constant input.

    Raises:
        InputError: the filter's corner is above what the interval resolves, or the start outside its box.
    """
    sections = low_pass.coefficients("ats", ORDER, float(params[CUTOFF]), interval)
    start = params[LEAD] + params[LAG]
    if start > params[A1_MOST]:
        name = "lead and time_constant" if params[LAG] else "lead"
        raise InputError(
            f"{name} of compensator 'ats' is {start:g}, but must be at most a1_most = {params[A1_MOST]:g}."
        )
    length = max(round(float(params[WINDOW]) / interval), 4)
    return np.concatenate([params, [float(length)], sections])


def state(params: Array, _interval: float) -> Array:
    """Start coefficients, and everything else empty."""
    s = np.zeros(RING + 4 * int(params[LENGTH]))
    lead, lag = float(params[LEAD]), float(params[LAG])
    s[:3] = 1.0, lead + lag, min(lead * lead / 2.0 + lead * lag, float(params[A2_MOST]))
    return s


@jit
def gather(s: Array, at: int, sign: float, x: float, v: float, a: float, u: float) -> None:
    """Add one row's products to the sums from place `at` on, or subtract them (`sign` −1)."""
    s[at] += sign * x * x
    s[at + 1] += sign * x * v
    s[at + 2] += sign * x * a
    s[at + 3] += sign * v * v
    s[at + 4] += sign * v * a
    s[at + 5] += sign * a * a
    s[at + 6] += sign * x * u
    s[at + 7] += sign * v * u
    s[at + 8] += sign * a * u
    s[at + 9] += sign * x


@jit
def observe(p: Array, s: Array, measured: float, interval: float) -> None:
    """Filter the pair of t_k, and move the window on by the row of t_{k−1}."""
    command = low_pass.step(p, SOS, SECTIONS, s, COMMAND_FILTER, s[COMMAND])
    now = low_pass.step(p, SOS, SECTIONS, s, MEASURED_FILTER, measured)
    pace = TIME / interval
    x = s[BEFORE]
    v = 0.5 * pace * (now - s[EARLIER])
    a = pace * pace * (now - 2.0 * s[BEFORE] + s[EARLIER])
    u = s[COMMAND_BEFORE]
    s[EARLIER] = s[BEFORE]
    s[BEFORE] = now
    s[COMMAND_BEFORE] = command
    head = int(s[HEAD])
    at = RING + 4 * head
    gather(s, SUMS, -1.0, s[at], s[at + 1], s[at + 2], s[at + 3])
    gather(s, SUMS, 1.0, x, v, a, u)
    gather(s, FRESH, 1.0, x, v, a, u)
    s[at] = x
    s[at + 1] = v
    s[at + 2] = a
    s[at + 3] = u
    head += 1
    if head == int(p[LENGTH]):
        head = 0
        for i in range(10):
            s[SUMS + i] = s[FRESH + i]
            s[FRESH + i] = 0.0
    s[HEAD] = head
    s[QUIET] += 1.0
    if abs(measured) > p[TRIGGER] and abs(now - s[ANCHOR]) > 0.5 * p[TRIGGER]:
        s[QUIET] = 0.0
        s[ANCHOR] = now


@jit
def moving(p: Array, s: Array) -> bool:
    """Whether the window holds enough motion to adapt: see the module's text.

    A sine of amplitude A has the variance A²/2, so that 8 times the variance exceeds the trigger squared where A
    exceeds half the trigger.
    """
    rows = min(s[TICKS], p[LENGTH])
    mean = s[SUMS + 9] / rows
    variance = s[SUMS] / rows - mean * mean
    return bool(4.0 * s[QUIET] < rows and 8.0 * variance > p[TRIGGER] * p[TRIGGER])


@jit
def toward(now: float, change: float, rate: float, least: float, most: float) -> float:
    """A coefficient after a change, bounded by its rate (per tick) and by its least and largest value."""
    return min(max(now + min(max(change, -rate), rate), least), most)


@jit
def adapt(p: Array, s: Array, interval: float) -> None:
    """Move the coefficients toward the window's least squares; keep them where it has no solution."""
    a0 = s[COEFFICIENTS]
    a1 = s[COEFFICIENTS + 1] / TIME
    a2 = s[COEFFICIENTS + 2] / (TIME * TIME)
    if not (s[SUMS] > 0.0 and s[SUMS + 3] > 0.0 and s[SUMS + 5] > 0.0):
        return
    d0 = 1.0 / math.sqrt(s[SUMS])
    d1 = 1.0 / math.sqrt(s[SUMS + 3])
    d2 = 1.0 / math.sqrt(s[SUMS + 5])
    c01 = d0 * d1 * s[SUMS + 1]
    c02 = d0 * d2 * s[SUMS + 2]
    c12 = d1 * d2 * s[SUMS + 4]
    g0 = d0 * (s[SUMS + 6] - s[SUMS] * a0 - s[SUMS + 1] * a1 - s[SUMS + 2] * a2)
    g1 = d1 * (s[SUMS + 7] - s[SUMS + 1] * a0 - s[SUMS + 3] * a1 - s[SUMS + 4] * a2)
    g2 = d2 * (s[SUMS + 8] - s[SUMS + 2] * a0 - s[SUMS + 4] * a1 - s[SUMS + 5] * a2)
    pivot0 = 1.0 + DAMPING  # elimination of the symmetric matrix, whose diagonal is this
    l1 = c01 / pivot0
    l2 = c02 / pivot0
    pivot1 = pivot0 - l1 * c01
    if not pivot1 > SINGULAR:
        return
    rest = c12 - l1 * c02
    l3 = rest / pivot1
    pivot2 = pivot0 - l2 * c02 - l3 * rest
    if not pivot2 > SINGULAR:
        return
    g1 -= l1 * g0
    z2 = (g2 - l2 * g0 - l3 * g1) / pivot2
    z1 = g1 / pivot1 - l3 * z2
    z0 = g0 / pivot0 - l1 * z1 - l2 * z2
    e0 = d0 * z0
    e1 = d1 * z1 * TIME
    e2 = d2 * z2 * TIME * TIME
    if not (math.isfinite(e0) and math.isfinite(e1) and math.isfinite(e2)):
        return
    s[0] = toward(s[0], e0, p[A0_RATE] * interval, p[A0_LEAST], p[A0_MOST])
    s[1] = toward(s[1], e1, p[A1_RATE] * interval, 0.0, p[A1_MOST])
    s[2] = toward(s[2], e2, p[A2_RATE] * interval, 0.0, p[A2_MOST])


@jit
def step(p: Array, s: Array, wanted: Wanted, interval: float) -> float:
    """Command (m); before the first tick, command and measurement count as still."""
    present, measured = wanted.present, wanted.measured
    if s[TICKS] == 0.0:
        s[COMMAND] = present
        low_pass.settle(p, SOS, SECTIONS, s, COMMAND_FILTER, present)
        low_pass.settle(p, SOS, SECTIONS, s, MEASURED_FILTER, measured)
        s[BEFORE] = measured
        s[EARLIER] = measured
        s[ANCHOR] = measured
        s[COMMAND_BEFORE] = present
    s[TICKS] += 1.0
    observe(p, s, measured, interval)
    if moving(p, s):
        adapt(p, s, interval)
    command = s[0] * wanted.target + s[1] * wanted.rate + s[2] * wanted.acceleration
    s[COMMAND] = command
    return command
