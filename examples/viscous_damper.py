"""A kind of laboratory of one's own: an actuator moves the piston of a viscous damper.

Try it:    rths run examples/viscous_damper.toml --virtual

Spring (oil and brace) and dashpot are in series, a Maxwell element. With the piston at x and the dashpot at d:

    f = k·(x − d) = c·|v|^α·sgn v,    v = ḋ

Nominal k, c and α are those of OpenSees' example of a one-storey frame with viscous dampers, by S. Akcelyan and
D. G. Lignos: 25 kN/mm, 20.74 kN·(s/mm)^0.35, 0.35. The actuator is a first-order lag with dead time.
"""

from __future__ import annotations

import math
from typing import Any

from laboratories.device import Channels, Device, Fault, Limited, Nominal, Signal, kernel
from models.registry import Array
from models.transfer_systems import delay, first_order

SUBSTEPS = 8  # of an interval: 0.25 ms at 2 ms, a fortieth of the relaxation time c/k of 9 ms (α = 1)
MEMORY = 512  # commands kept: enough for the largest dead time, 50 ms, at the shortest interval, 0.1 ms

# indices of `parameters`: the interval, then `nominal`, then `faults`
INTERVAL, STIFFNESS, COEFFICIENT, EXPONENT, DELAY, TIME_CONSTANT, LEAK, AIR = range(8)
PISTON, DASHPOT, COMMANDS = range(3)  # indices of `state`: m, m, past commands (m) from the newest on


class ViscousDamper(Device):
    """A viscous damper under an actuator, between two floors of the building."""

    name = "viscous_damper"
    says = "actuator and viscous damper"
    channels = Channels(
        target=Signal("piston_target", "m", "target displacement of the piston"),
        command=Signal("piston_command", "m", "command, to be reached at the end of the interval"),
        measured=(
            Signal("piston_displacement", "m", "measured displacement of the piston"),
            Signal("piston_force", "N", "measured force of the damper"),
        ),
        position="piston_displacement",
        force="piston_force",
    )
    nominal = {
        "stiffness": Nominal(25e6, "N/m", "spring of oil and brace", tolerance=0.05),
        "coefficient": Nominal(232.7e3, "N·(s/m)^α", "c of the dashpot", tolerance=0.02),
        "exponent": Nominal(0.35, "", "α of the dashpot", least=0.1, most=2.0),
        "delay": Nominal(0.008, "s", "dead time of the actuator", most=0.05),
        "time_constant": Nominal(0.012, "s", "lag of the actuator", least=1e-4),
    }
    faults = {
        "leak": Fault("oil leaks: c is lower", "share", "", 0.0, 0.0, 0.9, (0.05, 0.1, 0.2, 0.4)),
        "air": Fault("trapped air: a dead band", "width", "m", 0.0, 0.0, 0.02, (2e-4, 5e-4, 1e-3, 3e-3)),
    }
    states = COMMANDS + MEMORY
    rms = {"piston_displacement": 5e-6, "piston_force": 300.0}
    limited = Limited(velocity="piston_velocity", error="piston_error")
    most = {
        "piston_displacement": 0.1,
        "piston_command": 0.1,
        "piston_force": 400e3,
        "piston_velocity": 1.0,
        "piston_error": 0.02,
    }

    @staticmethod
    def step(parameters: Array, state: Array, truth: Array, command: float, _effort: float) -> None:
        """Advance actuator and damper by one interval."""
        commands = state[COMMANDS:]
        delay.remember(commands, command)
        length = parameters[INTERVAL] / SUBSTEPS
        q = length / parameters[TIME_CONSTANT]
        late = 1.0 + math.expm1(-q) / q
        row: Any = (math.exp(-q), -math.expm1(-q) - late, late)
        ago = 1.0 + parameters[DELAY] / parameters[INTERVAL]  # intervals
        before = command_at(commands, ago)
        for i in range(SUBSTEPS):
            after = command_at(commands, ago - (i + 1) / SUBSTEPS)
            piston = first_order.step(row, state[PISTON], before, after)
            state[DASHPOT] = dashpot_after(parameters, state[DASHPOT], state[PISTON], piston, length)
            state[PISTON] = piston
            before = after
        truth[0] = state[PISTON]
        truth[1] = force(parameters, state[PISTON] - state[DASHPOT])


@kernel
def command_at(commands: Array, ago: float) -> float:
    """The command (m) `ago` intervals before the end of the present one, interpolated linearly."""
    whole = int(ago)
    return commands[whole] + (ago - whole) * (commands[whole + 1] - commands[whole])


@kernel
def force(parameters: Array, stretch: float) -> float:
    """Force (N) of the spring at its stretch (m); trapped air takes part of the stretch without force."""
    half = 0.5 * parameters[AIR]
    return parameters[STIFFNESS] * (stretch - min(max(stretch, -half), half))


@kernel
def dashpot_velocity(parameters: Array, stretch: float) -> float:
    """Velocity (m/s) of the dashpot under the force of the spring at its stretch (m)."""
    f, c = force(parameters, stretch), (1.0 - parameters[LEAK]) * parameters[COEFFICIENT]
    return math.copysign((abs(f) / c) ** (1.0 / parameters[EXPONENT]), f)


@kernel
def dashpot_after(
    parameters: Array, dashpot: float, piston: float, piston_after: float, length: float
) -> float:
    """The dashpot (m) after `length` s of constant piston velocity, by the fourth-order method of Runge and Kutta."""
    middle = 0.5 * (piston + piston_after)
    first = dashpot_velocity(parameters, piston - dashpot)
    second = dashpot_velocity(parameters, middle - dashpot - 0.5 * length * first)
    third = dashpot_velocity(parameters, middle - dashpot - 0.5 * length * second)
    last = dashpot_velocity(parameters, piston_after - dashpot - length * third)
    return dashpot + length / 6.0 * (first + 2.0 * second + 2.0 * third + last)
