"""Mass, dashpot, spring, motor, friction and a constant force of the active mass damper.

    m·(s̈ + ÿ) = −k·s − c·ṡ − F_c·sgn(ṡ) + F_0 + u,    T·u̇ + u = gain·command
    force on the table = k·s + c·ṡ + F_c·sgn(ṡ) − F_0 − u = −m·(s̈ + ÿ)

The sign of the friction is regularised to `tanh(ṡ/v₀)`. On a still table the stroke alone
shows ratios only (gain/m, c/m, k/m, F_c/m): the mass, and with it the gain, comes from the force. Without
a measured force those intervals are infinite.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.laboratory_tables import Damper
from common.plan.schema import nearest
from laboratories.identification import checks, estimate
from laboratories.identification.estimate import Estimate
from models.compiled import jit
from models.registry import Array

LEAST = 100  # samples: more than ten for each parameter of the fit
SUBSTEP = 0.25e-3  # s: an eighth of the usual interval, short beside the motor's lag
# s: a drive without a spring is simulated in pieces of this length, because the effect of a wrong force grows with t²;
# a second holds several cycles of the motions with which a damper is tested
PIECE = 1.0
# ticks on each side from which initial stroke and velocity are read: 20 ms, less than half a period of 20 Hz
REACH = 10
# v₀, m/s: 0.01 % of the velocities of a test, so that the friction force has no jump. It is larger where friction would
# stop the mass within a step, which the steps could not follow.
SLOWEST = 1e-5
# share of a signal's scatter that its weight takes as least misfit, so that an exact fit has a finite weight
WORST = 1e-9
ROUNDS = (
    3  # of weighting both signals by their misfit; it ends earlier when the weights change by less than 10 %
)
STEPS = 40  # of a fit in each of these: near an exact solution friction goes on in ever smaller ones
NAMES = ("mass", "damping", "stiffness", "motor_time_constant", "gain", "friction", "offset")
UNITS = ("kg", "N·s/m", "N/m", "s", "", "N", "N")


@dataclass(frozen=True)
class DamperFit:
    """The result of a fit: `parameters` holds an estimate for each free name."""

    parameters: dict[str, Estimate]
    stroke_nrmse: float
    force_nrmse: float  # nan without a force

    def __getitem__(self, name: str) -> Estimate:
        return self.parameters[name]


class DamperRecord(NamedTuple):
    """Input and output of a damper at each tick; (n,) each."""

    command: Array  # N, of the motor
    ground: Array  # m/s², acceleration of the table
    stroke: Array  # m
    force: Array  # N


@jit
def respond(
    p: Array, interval: float, substeps: int, record: DamperRecord, begin: tuple[float, float, float]
) -> None:
    """Fill stroke (m) and force (N) of a record from `begin`: stroke, its rate (m/s) and the motor's force (N).

    `p` is in the order of NAMES.

    The method is Runge-Kutta's of fourth order; the motor's lag is exact for its held command, and the table's
    acceleration is linear between ticks.
    """
    command, ground, stroke, force = record.command, record.ground, record.stroke, record.force
    mass, damping, stiffness, lag, gain, friction, offset = p[0], p[1], p[2], p[3], p[4], p[5], p[6]
    h = interval / substeps
    creep = max(SLOWEST, abs(friction) * h / mass)
    fade = np.exp(-0.5 * h / lag) if lag > 0.0 else 0.0
    x, v, u = begin[0], begin[1], begin[2]
    for k in range(command.size):
        stroke[k] = x
        force[k] = stiffness * x + damping * v + friction * np.tanh(v / creep) - offset - u
        if k == command.size - 1:
            break
        target = gain * command[k]
        slope = (ground[k + 1] - ground[k]) / substeps
        if lag <= 0.0:
            u = target
        for i in range(substeps):
            u_middle = target + (u - target) * fade
            u_end = target + (u_middle - target) * fade
            y0 = ground[k] + slope * i
            a1 = (u + offset - stiffness * x - damping * v - friction * np.tanh(v / creep)) / mass - y0
            xm, vm = x + 0.5 * h * v, v + 0.5 * h * a1
            drive = (u_middle + offset) / mass - y0 - 0.5 * slope
            a2 = drive - (stiffness * xm + damping * vm + friction * np.tanh(vm / creep)) / mass
            xn, vn = x + 0.5 * h * vm, v + 0.5 * h * a2
            a3 = drive - (stiffness * xn + damping * vn + friction * np.tanh(vn / creep)) / mass
            xe, ve = x + h * vn, v + h * a3
            drive = (u_end + offset) / mass - y0 - slope
            a4 = drive - (stiffness * xe + damping * ve + friction * np.tanh(ve / creep)) / mass
            x += h * (v + 2.0 * vm + 2.0 * vn + ve) / 6.0
            v += h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
            u = u_end


def response(
    values: Array,
    command: Array,
    ground: Array,
    interval: float,
    start: float = 0.0,
    rate: float = 0.0,
    motor: float = 0.0,
) -> tuple[Array, Array]:
    """Stroke (m) and force (N), each (n,), for parameters (7,) in the order of NAMES.

    They begin at a stroke `start` (m), its `rate` (m/s) and a force of the `motor` (N).
    """
    stroke, force = np.empty(command.size), np.empty(command.size)
    substeps = max(int(np.ceil(interval / SUBSTEP - 1e-9)), 1)
    begin = (start, rate, motor)
    respond(values, interval, substeps, DamperRecord(command, ground, stroke, force), begin)
    return stroke, force


def anew(stroke: Array, interval: float) -> list[tuple[int, float, float]]:
    """Ticks, strokes (m) and rates (m/s) at which the simulation of a drive without a spring restarts.

    Without a spring the error of a force accumulates. Strokes and rates are those of a cubic fitted to `REACH` ticks on
    each side.
    """
    length = max(4 * REACH, round(PIECE / interval))
    found = []
    for tick in range(0, max(1, stroke.size - length // 2), length):
        window = np.arange(max(0, tick - REACH), min(stroke.size, tick + REACH + 1))
        cubic = np.polynomial.polynomial.polyfit((window - tick) * interval, stroke[window], 3)
        found.append((tick, float(cubic[0]), float(cubic[1])))
    return found


def in_pieces(
    values: Array,
    command: Array,
    ground: Array,
    read: Array,
    interval: float,
    begins: Sequence[tuple[int, float, float]],
) -> tuple[Array, Array]:
    """Stroke (m) and force (N), each (n,), of a drive without a spring, simulated separately from each beginning.

    A beginning is read from a few noisy samples only, so the stroke and the rate at it are taken with which the piece
    fits the strokes `read` (n,) best.
    """
    mass, damping = float(values[0]), float(values[1])
    motor = motor_forces(values, command, interval)
    ends = [*(tick for tick, _, _ in begins[1:]), command.size]
    strokes, forces = [], []
    for (tick, place, rate), end in zip(begins, ends, strict=True):
        stroke, force = response(
            values, command[tick:end], ground[tick:end], interval, place, rate, float(motor[tick])
        )
        fading = np.exp(-damping / mass * interval * np.arange(end - tick))
        slid = np.concatenate([[0.0], np.cumsum(0.5 * interval * (fading[1:] + fading[:-1]))])
        moved, faster = np.linalg.lstsq(
            np.column_stack([np.ones(slid.size), slid]), read[tick:end] - stroke, rcond=None
        )[0]
        strokes.append(stroke + moved + faster * slid)
        forces.append(force + damping * faster * fading)
    return np.concatenate(strokes), np.concatenate(forces)


def motor_forces(values: Array, command: Array, interval: float) -> Array:
    """Force (n,) N of the motor at each tick, from rest on, under a command (n,) N that is held."""
    from scipy import signal

    lag, gain = float(values[3]), float(values[4])
    fade = math.exp(-interval / lag) if lag > 0.0 else 0.0
    return np.asarray(signal.lfilter([0.0, gain * (1.0 - fade)], [1.0, -fade], command))


def least_squares(
    damper_command: Array,
    stroke: Array,
    force: Array | None,
    table_acceleration: Array | None,
    interval: float,
    free: Sequence[str] = NAMES,
    nominal: Damper | None = None,
) -> DamperFit:
    """Parameters of damper and motor from stroke and force under a motor command or a moving table.

    `damper_command` (N, held from tick k to k + 1), `stroke` (m), `force` (N, on the table; None where not measured)
    and `table_acceleration` (m/s²; None on a still table) have one value per tick of `interval` (s). `free` names
    what is fitted, of mass (kg), damping (N·s/m), stiffness (N/m), motor_time_constant (s), gain, friction (N) and
    offset (N, along +x); the others keep the `nominal` damper's values, gain 1, and no friction or offset, from which
    the fit also starts. The initial state is fitted too; a drive whose nominal stiffness is 0 is simulated anew every
    second, from the stroke and rate that fit its motion best. The output error is minimised, with both signals
    weighted by their scatter; intervals follow from Jacobian and residual, corrected for the autocorrelation of each
    signal (`estimate.of_fit`). A friction near zero may be estimated as negative within its interval. Parameters that
    the record cannot separate (mass and gain without a force) have infinite intervals.

    Raises:
        InputError: too short, unequal lengths, not finite, no excitation, constant stroke, or an unknown
            free name.

    Source: Ljung, System Identification (1999), section 7.
    """
    checks.positive("interval", interval)
    given = {"damper_command": damper_command, "stroke": stroke}
    if force is not None:
        given["force"] = force
    if table_acceleration is not None:
        given["table_acceleration"] = table_acceleration
    signals = dict(zip(given, checks.signals(LEAST, **given), strict=True))
    command = signals["damper_command"]
    ground = signals.get("table_acceleration", np.zeros(command.size))
    if float(np.abs(command).max()) == 0.0:
        checks.moves("table_acceleration" if table_acceleration is not None else "damper_command", ground)
    outputs = [signals[name] for name in ("stroke", "force") if name in signals]
    for name in ("stroke", "force"):
        if name in signals:
            checks.moves(name, signals[name])
    return fit(command, ground, outputs, interval, chosen(free), nominal if nominal is not None else Damper())


def chosen(free: Sequence[str]) -> list[int]:
    """Places of the free names among NAMES."""
    if not free:
        raise InputError("No parameter of the damper is free: name at least one.")
    for name in free:
        if name not in NAMES:
            raise InputError(f"Unknown parameter '{name}' of the damper: {nearest(name, NAMES)}")
    return [NAMES.index(name) for name in free]


def fit(
    command: Array, ground: Array, outputs: list[Array], interval: float, places: list[int], nominal: Damper
) -> DamperFit:
    """Fit the parameters: first with equal weights of both signals, then with weights by their misfit."""
    from scipy import optimize

    values = np.array(
        [nominal.mass, nominal.damping, nominal.stiffness, nominal.motor_time_constant, 1.0, 0.0, 0.0]
    )
    effort = max(float(np.std(command)), nominal.mass * float(np.std(ground)))
    scales = np.where(values > 0.0, values, [1.0, 1.0, 1.0, interval, 1.0, 0.05 * effort, 0.05 * effort])
    travel = float(np.std(outputs[0]))
    speed = max(float(np.std(np.gradient(outputs[0], interval))), 1e-9)
    nuisance = np.array([travel, speed])
    begins = anew(outputs[0], interval) if nominal.stiffness == 0.0 else []

    def model(x: Array) -> tuple[Array, Array]:
        now = values.copy()
        now[places] = x[:-2] * scales[places]
        if begins:
            return in_pieces(now, command, ground, outputs[0], interval, begins)
        begin = x[-2:] * nuisance
        return response(now, command, ground, interval, float(begin[0]), float(begin[1]))

    x = np.append(values[places] / scales[places], [outputs[0][0] / travel, 0.0])
    least = np.array([1e-2, 0.0, 0.0, 0.0, 1e-3, -1e3, -1e3])[places]
    low = np.append(least, [-np.inf, -np.inf])
    high = np.append(np.full(len(places), 1e3), [np.inf, np.inf])
    weights = [1.0 / float(np.std(output)) for output in outputs]
    for _ in range(ROUNDS):

        def residual(x: Array, weights: list[float] = weights) -> Array:
            parts = zip(model(x), outputs, weights, strict=False)
            return np.concatenate([(fitted - output) * weight for fitted, output, weight in parts])

        start = np.clip(x, low, high)
        x = optimize.least_squares(residual, start, bounds=(low, high), x_scale="jac", max_nfev=STEPS).x
        left = [float(np.std(fitted - output)) for fitted, output in zip(model(x), outputs, strict=False)]
        least_left = [WORST * float(np.std(output)) for output in outputs]
        last, weights = weights, [1.0 / max(pair) for pair in zip(left, least_left, strict=True)]
        if np.allclose(last, weights, rtol=0.1):
            break
    # the Jacobian again with central differences, whose accuracy shows parameters that cannot be separated
    result = optimize.least_squares(
        lambda x: residual(x, weights), x, bounds=(low, high), x_scale="jac", jac="3-point", max_nfev=1
    )
    names, units = [NAMES[i] for i in places], [UNITS[i] for i in places]
    blocks = [output.size for output in outputs]
    parameters = estimate.of_fit(result, names, units, scales[places], blocks)
    fitted_stroke, fitted_force = model(x)
    misfit = estimate.nrmse(outputs[1], fitted_force) if len(outputs) > 1 else float("nan")
    return DamperFit(parameters, estimate.nrmse(outputs[0], fitted_stroke), misfit)
