"""Parameters of a part from its recording: what `rths identify` finds."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from common.recording.imported import imported, is_static, logged_alone
from common.recording.run import Run
from common.roles import kind_of, name_of
from laboratories.device import Device
from laboratories.identification import actuator, column, damper, device, step_response, table
from laboratories.identification.estimate import Estimate
from models.excitation import ProgrammeSegment
from models.registry import Array
from report.facts import force_range
from report.facts.laboratories import plan_of

NEEDED = {
    "column": ("master", ("column_displacement", "column_force")),
    "actuator": ("master", ("actuator_command", "column_displacement")),
    "table": ("slave", ("table_command", "table_displacement")),
    "damper": ("slave", ("damper_command", "damper_stroke")),
}
NEEDED_TOPICS = ("master", "slave")
EQUIVALENT_LAG = "equivalent first-order lag of a servo-hydraulic actuator"
# S behind a step over which the tangent is fitted: about ten time constants of the default actuator.
TAIL = 0.4


def part_of(run: Run) -> str:
    """The part that a bench test tested, empty for any other recording."""
    return run.metadata.get("bench", {}).get("part", "")


def segments(run: Run) -> list[ProgrammeSegment]:
    """The pieces of a bench recording, none in any other."""
    text = run.metadata.get("bench", {}).get("segments", "[]")
    return [ProgrammeSegment(**item) for item in json.loads(text)]


def possible(run: Run) -> list[str]:
    """Parts whose inputs and outputs a recording holds."""
    return [part for part in NEEDED if topic_of(run, part)]


def topic_of(run: Run, part: str) -> str:
    """The topic that holds a part's inputs and outputs, the default plan's first; empty where none does."""
    usual, names = NEEDED[part]
    topics = (usual, *(topic for topic in NEEDED_TOPICS if topic != usual))
    return next((topic for topic in topics if set(names) <= run.columns.get(topic, {}).keys()), "")


def identify(run: Run, part: str = "", most: float = math.inf) -> dict[str, Any]:
    """The identification of a part as plain values: parameters with 95 % intervals, and what else the test shows.

    Of a column only rows with a force up to `most` (N) are used.

    Raises:
        InputError: the recording lacks the part's signals, or they cannot carry an identification.
    """
    part = part or part_of(run)
    if part not in possible(run):
        topic, names = NEEDED[part]
        raise InputError(
            f"{run.path} cannot identify the {part}: it needs {', '.join(names)} of the {topic}."
        )
    interval = interval_of(run)
    found = of_column(run, interval, most) if part == "column" else IDENTIFIERS[part](run, interval)
    return {"part": part, **found}


def interval_of(run: Run) -> float:
    """The control interval: the plan's, or that of the recorded times, s."""
    plan = plan_of(run)
    if plan is not None:
        return plan.test.interval
    t = next(iter(run.columns.values()))["t"]
    return float(np.median(np.diff(t)))


def plain(found: dict[str, Estimate]) -> dict[str, dict[str, Any]]:
    """Estimates as plain values; the ends of an interval are None where the motion does not determine it."""
    result = {}
    for name, item in found.items():
        known = math.isfinite(item.low) and math.isfinite(item.high)
        low, high = (item.low, item.high) if known else (None, None)
        result[name] = {"value": item.value, "low": low, "high": high, "unit": item.unit}
    return result


def of_column(run: Run, interval: float, most: float) -> dict[str, Any]:
    """Elastic stiffness, with the dashpot where the plan has one; with a static cyclic test also every cycle.

    Rows with a force above `most` (N) are left out, and cycles with such a row.
    """
    columns = run.columns[topic_of(run, "column")]
    deformation, force = seen(run, "column", "column_force", "column_displacement"), columns["column_force"]
    used = force_range.within(run, force, most)
    left_out = force_range.said(used, most)
    static = [segment for segment in segments(run) if segment.name == "static"]
    if not static:
        plan, causes = plan_of(run), {"stiffness": (deformation[used], "N/m")}
        if plan is not None and plan.column.damping > 0.0 and not is_static(run):
            causes["damping"] = np.gradient(deformation, interval)[used], "N·s/m"
            if plan.column.stiffness == 0.0:  # a law of a dashpot alone
                causes = dict(reversed(causes.items()))
        fit = column.regression(causes, force[used])
        return {"parameters": plain(fit.parameters), "nrmse": fit.nrmse, **left_out}
    part = slice(static[0].begin, static[0].end)
    amplitudes = [value for name, value in static[0].values.items() if name.startswith("amplitude")]
    found = column.cycles(deformation[part], force[part], amplitudes)
    whole = [cycle for cycle in found.cycles if used[part][cycle.begin : cycle.end].all()]
    smallest = min(amplitudes)
    if any(cycle.nominal == smallest for cycle in {*found.cycles} - {*whole}):
        raise InputError(
            f"{run.path}: the cycles of {1e3 * smallest:g} mm, which show the elastic stiffness, have a column_force "
            f"above --max-force {most:g} N: give a larger one."
        )
    return {
        "parameters": plain({"elastic_stiffness": found.stiffness}),
        "cycles": [cycle._asdict() for cycle in whole],
        **left_out,
    }


def of_actuator(run: Run, interval: float) -> dict[str, Any]:
    """L, T, K by least squares on everything, and by the tangent where there are steps.

    Where the plan's actuator is servo-hydraulic they are those of the lag that comes nearest to it, as `model` says.
    """
    columns = run.columns[topic_of(run, "actuator")]
    plan, measured = plan_of(run), columns["column_displacement"]
    held = plan is not None and plan.actuator.command == "held"
    given = seen(run, "actuator", "column_displacement", "actuator_command")
    command = given if held else written(run, given)
    fit = actuator.least_squares(command, measured, interval, held=held)
    result: dict[str, Any] = {"parameters": plain(fit.parameters), "nrmse": fit.nrmse}
    if plan is not None and plan.actuator.model == "servo_hydraulic":
        result["model"] = EQUIVALENT_LAG
    begins = [
        tick for segment in segments(run) if segment.name == "step" for tick in step_ticks(command, segment)
    ]
    if begins:
        length = round(TAIL / interval)
        found = step_response.tangents(columns["t"], command, measured, begins, length, held=held)
        result["tangent"] = plain(found._asdict())
    return result


def seen(run: Run, part: str, reading: str, given: str) -> Array:
    """What a part is given (ticks,) behind the filter and the delay with which a logger recorded one of its readings.

    A part that is linear then answers as it was read. What was recorded of a given signal itself behind a filter or a
    delay was that signal already.
    """
    topic = topic_of(run, part)
    values, stated = run.columns[topic][given], imported(run)
    if stated is None or stated.channel(topic, given) == stated.channel(topic, reading):
        return values
    return stated.channel(topic, reading).through(values, interval_of(run))


def written(run: Run, command: Array) -> Array:
    """A command (ticks,) at the ticks before those where it is reached, as the models take it."""
    return np.append(command[1:], command[-1]) if logged_alone(run) else command


def step_ticks(command: Array, segment: ProgrammeSegment) -> list[int]:
    """Ticks at which the command of a segment jumps; it is written one tick ahead of the target."""
    jumps = np.diff(command[segment.begin - 2 : segment.end])
    height = segment.values["height"]
    return [segment.begin - 1 + int(place) for place in np.flatnonzero(np.abs(jumps) > 0.5 * height)]


def of_table(run: Run, interval: float) -> dict[str, Any]:
    """Frequency, damping ratio and dead time; bandwidth where the motion covers it."""
    columns = run.columns[topic_of(run, "table")]
    command = written(run, seen(run, "table", "table_displacement", "table_command"))
    measured = columns["table_displacement"]
    fit = table.least_squares(command, measured, interval)
    result: dict[str, Any] = {"parameters": plain(fit.parameters), "nrmse": fit.nrmse}
    sweeps = [segment for segment in segments(run) if segment.name == "sweep"]
    if sweeps:
        part = slice(sweeps[0].begin, sweeps[0].end)
        response = table.frequency_response(command[part], measured[part], interval)
        result["bandwidth"] = table.bandwidth(response)._asdict()
    return result


def of_damper(run: Run, interval: float) -> dict[str, Any]:
    """Mass, spring, dashpot, friction, a constant force, lag and gain of the motor.

    A spring or a lag of the motor that the plan says is absent is not fitted.
    """
    columns = run.columns[topic_of(run, "damper")]
    plan = plan_of(run)
    still, ridden = part_of(run) == "damper", "table_acceleration"
    force = columns.get("damper_force")
    # The motor's gain cannot be separated from the mass without a measured force.
    free = [name for name in damper.NAMES if name != "gain" or force is not None]
    absent = ("stiffness", "motor_time_constant")
    free = [name for name in free if not (plan and name in absent and getattr(plan.damper, name) == 0.0)]
    fit = damper.least_squares(
        seen(run, "damper", "damper_stroke", "damper_command"),
        columns["damper_stroke"],
        force,
        None if still or ridden not in columns else seen(run, "damper", "damper_stroke", ridden),
        interval,
        free=free,
        nominal=plan.damper if plan else None,
    )
    misfits = {"damper_stroke": fit.stroke_nrmse} | (
        {"damper_force": fit.force_nrmse} if force is not None else {}
    )
    return {"parameters": plain(fit.parameters), "nrmse": misfits}


def of_device(run: Run, plan: Plan, role: str, kind: Device) -> dict[str, Any] | None:
    """The nominal parameters of a user's kind that a role hosts; None where the recording lacks its signals.

    `plan` is the role's. A bench recording has one topic for the slave, whatever its name.
    """
    channels = kind.channels
    needed = {*channels.drives, *channels.names}
    columns = next(
        (
            run.columns[topic]
            for topic in (role, kind_of(role))
            if needed <= run.columns.get(topic, {}).keys()
        ),
        None,
    )
    if columns is None:
        return None
    commands = np.ascontiguousarray(written(run, columns[channels.command.name]))
    efforts = columns[channels.effort.name] if channels.effort else np.zeros(commands.size)
    measured = np.column_stack([columns[name] for name in channels.names])
    fit = device.least_squares(kind, plan, commands, np.ascontiguousarray(efforts), measured)
    name = f"{kind.name}.{name_of(role)}" if name_of(role) else kind.name
    return {"part": name, "parameters": plain(fit.parameters), "nrmse": fit.nrmse}


IDENTIFIERS: dict[str, Callable[[Run, float], dict[str, Any]]] = {  # of parts without a range of forces
    "actuator": of_actuator,
    "table": of_table,
    "damper": of_damper,
}
