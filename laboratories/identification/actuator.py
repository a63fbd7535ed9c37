"""Dead time, lag and gain of the actuator from any motion, by least squares on its exact response."""

from __future__ import annotations

import numpy as np

from common.errors import InputError
from laboratories.identification import checks, estimate
from laboratories.identification.estimate import Identified
from models.compiled import jit
from models.registry import Array
from models.transfer_systems import delay, first_order

LEAST = 20  # samples: several for each parameter of the fit
NAMES = ("delay", "time_constant", "gain")
UNITS = ("s", "s", "")
LONGEST = 0.5  # s, for dead time and lag: a slower actuator cannot take part in a test in real time
SHORTEST = 1e-6  # s, of a time constant: a shorter lag has no influence at any control interval
HOPELESS = 0.9  # nrmse above which the fit is rejected: a constant has the nrmse 1
STEP = 1e-6  # relative step of the derivatives: the error of forward differences is smallest near √1e-12
CONVERGED = (
    1e-12  # relative change of parameters and misfit at which the fit ends: far below any interval's width
)


@jit
def respond(
    taps: Array, rows: Array, history: Array, command: Array, start: float, result: Array, held: bool
) -> None:
    """Displacement at each tick, from `start` at tick 0; the command written at tick k acts from there on."""
    displacement = start
    result[0] = start
    for k in range(command.size - 1):
        delay.remember(history, command[k])
        before = delay.delayed(history, taps, 0)
        for i in range(rows.shape[0]):
            after = delay.delayed(history, taps, i + 1)
            if held:
                before = after
            displacement = first_order.step(rows[i], displacement, before, after)
            before = after
        result[k + 1] = displacement


def response(
    command: Array,
    interval: float,
    dead_time: float,
    time_constant: float,
    start: float = 0.0,
    *,
    held: bool = False,
) -> Array:
    """Exact response (n,) of `T·ẏ + y = u(t − L)` to a ramped or `held` command that was zero before."""
    segments = delay.split(interval, dead_time, held=held)
    rows = first_order.propagators(1.0, time_constant, segments.lengths)
    result = np.empty(command.size)
    respond(segments.taps, rows, np.zeros(segments.memory), command, start, result, held)
    return result


def columns(
    command: Array, interval: float, dead_time: float, time_constant: float, *, held: bool = False
) -> Array:
    """The terms whose sum is the displacement: response, level, decay of the initial state; (n, 3)."""
    moved = response(command, interval, dead_time, time_constant, held=held)
    fading = np.exp(-interval * np.arange(command.size) / time_constant)
    return np.column_stack([moved, np.ones(command.size), fading])


def first_guess(
    command: Array, measured: Array, interval: float, *, held: bool = False
) -> tuple[float, float, Array]:
    """Best dead time and time constant (s) of a coarse grid, with the weights (3,) of `columns`.

    Raises:
        InputError: no point of the grid fits with a positive gain.
    """
    horizon = min(LONGEST, 0.3 * interval * command.size)
    least, place = np.inf, (0.0, 0.0)
    best: Array = np.zeros(3)
    for dead_time in np.concatenate([[0.0], np.geomspace(interval, horizon, 14)]):
        for time_constant in np.geomspace(interval / 2.0, horizon, 10):
            base = columns(command, interval, float(dead_time), float(time_constant), held=held)
            weights = np.asarray(np.linalg.lstsq(base, measured, rcond=None)[0], dtype=np.float64)
            cost = float(np.sum((base @ weights - measured) ** 2))
            if cost < least and weights[0] > 0.0:
                least, place, best = cost, (float(dead_time), float(time_constant)), weights
    if not np.isfinite(least):
        raise InputError(
            "The measured displacement does not follow the command: check the sensor's sign and the cabling."
        )
    return *place, best


def least_squares(command: Array, measured: Array, interval: float, *, held: bool = False) -> Identified:
    """Dead time `delay` L (s), `time_constant` T (s) and `gain` K of `T·ẏ + y = K·u(t − L)` from any motion.

    `command` (m) and `measured` (m) have one value per tick of `interval` (s): the command written at tick k
    is ramped and reached at tick k + 1, or acts as a step where `held`. The sensor's level and the initial state are
    fitted too, so the record may begin at any level, preferably at rest. The prediction uses the exact kernels of the
    emulated actuator; the intervals follow from Jacobian and residual, corrected for autocorrelation
    (`estimate.of_fit`). A steady sine alone does not separate the three parameters, and the intervals are then wide.

    Raises:
        InputError: too short, unequal lengths, not finite, constant, or a measurement that does not follow.

    Source: eq. (1) of Yokoyama et al. (17WCEE, 2020); Ljung, System Identification (1999), section 7.
    """
    from scipy import optimize

    checks.positive("interval", interval)
    command, measured = checks.signals(LEAST, command=command, measured_displacement=measured)
    checks.moves("command", command)
    checks.moves("measured_displacement", measured)
    moved = np.ascontiguousarray(command - command[0])
    dead_time, time_constant, weights = first_guess(moved, measured, interval, held=held)
    spread = float(np.std(measured))
    scales = np.array([interval, interval, 1.0, spread, spread])
    start = np.array([dead_time, time_constant, *weights]) / scales

    def model(x: Array) -> Array:
        values = x * scales
        return columns(moved, interval, float(values[0]), float(values[1]), held=held) @ values[2:]

    low = np.array([0.0, SHORTEST, -np.inf, -np.inf, -np.inf]) / scales
    high = np.array([2.0 * LONGEST, 2.0 * LONGEST, np.inf, np.inf, np.inf]) / scales
    result = optimize.least_squares(
        lambda x: (model(x) - measured) / spread,
        np.clip(start, low, high),
        bounds=(low, high),
        x_scale="jac",
        diff_step=STEP,
        xtol=CONVERGED,
        ftol=CONVERGED,
    )
    misfit = estimate.nrmse(measured, model(result.x))
    if misfit > HOPELESS:
        raise InputError("The measured displacement does not follow the command: check sensor and cabling.")
    return Identified(estimate.of_fit(result, NAMES, UNITS, scales), misfit)
