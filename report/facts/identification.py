"""Parameters of a part from its recording: what `rths identify` finds."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np

from common.errors import InputError
from common.recording.reader import Run
from laboratories.identification import actuator, column, damper, step_response, table
from laboratories.identification.estimate import Estimate
from models.excitation import Segment
from models.registry import Array
from report.facts.laboratories import plan_of

NEEDED = {
    "column": ("master", ("column_displacement", "column_force")),
    "actuator": ("master", ("actuator_command", "column_displacement")),
    "table": ("slave", ("table_command", "table_displacement")),
    "damper": ("slave", ("damper_command", "damper_stroke")),
}
EQUIVALENT_LAG = "equivalent first-order lag of a servo-hydraulic actuator"
TAIL = 0.4  # s behind a step that the tangent looks at


def part_of(run: Run) -> str:
    """The part that a bench recording is of, empty for any other recording."""
    return run.metadata.get("bench", {}).get("part", "")


def segments(run: Run) -> list[Segment]:
    """The pieces of a bench recording, none in any other."""
    text = run.metadata.get("bench", {}).get("segments", "[]")
    return [Segment(**item) for item in json.loads(text)]


def possible(run: Run) -> list[str]:
    """Parts whose in- and outputs a recording holds."""
    return [
        part for part, (topic, names) in NEEDED.items() if set(names) <= run.columns.get(topic, {}).keys()
    ]


def identify(run: Run, part: str = "") -> dict[str, Any]:
    """What can be said of a part, as plain values: parameters with 95 % intervals, and what else the test shows.

    Raises:
        InputError: the recording lacks the part's signals, or they cannot carry an identification.
    """
    part = part or part_of(run)
    if part not in possible(run):
        topic, names = NEEDED[part]
        raise InputError(
            f"{run.path} cannot identify the {part}: it needs {', '.join(names)} of the {topic}."
        )
    return {"part": part, **IDENTIFIERS[part](run, interval_of(run))}


def interval_of(run: Run) -> float:
    """The control interval: the plan's, or that of the recorded times, s."""
    plan = plan_of(run)
    if plan is not None:
        return plan.test.interval
    t = next(iter(run.columns.values()))["t"]
    return float(np.median(np.diff(t)))


def plain(found: dict[str, Estimate]) -> dict[str, dict[str, Any]]:
    """Estimates as plain values."""
    return {
        name: {"value": item.value, "low": item.low, "high": item.high, "unit": item.unit}
        for name, item in found.items()
    }


def of_column(run: Run, _interval: float) -> dict[str, Any]:
    """Elastic stiffness; with a static cyclic test also every cycle."""
    columns = run.columns["master"]
    deformation, force = columns["column_displacement"], columns["column_force"]
    static = [segment for segment in segments(run) if segment.name == "static"]
    if not static:
        return {"parameters": plain({"stiffness": column.slope(deformation, force)})}
    part = slice(static[0].begin, static[0].end)
    amplitudes = [value for name, value in static[0].values.items() if name.startswith("amplitude")]
    found = column.cycles(deformation[part], force[part], amplitudes)
    return {
        "parameters": plain({"elastic_stiffness": found.stiffness}),
        "cycles": [cycle._asdict() for cycle in found.cycles],
    }


def of_actuator(run: Run, interval: float) -> dict[str, Any]:
    """L, T, K by least squares on everything, and by the tangent where there are steps.

    Where the plan's actuator is servo-hydraulic they are those of the lag that comes nearest to it, as `model` says.
    """
    columns = run.columns["master"]
    command, measured = columns["actuator_command"], columns["column_displacement"]
    plan = plan_of(run)
    held = plan is not None and plan.actuator.command == "held"
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


def step_ticks(command: Array, segment: Segment) -> list[int]:
    """Ticks at which the command of a segment jumps; it is written one tick ahead of the target."""
    jumps = np.diff(command[segment.begin - 2 : segment.end])
    height = segment.values["height"]
    return [segment.begin - 1 + int(place) for place in np.flatnonzero(np.abs(jumps) > 0.5 * height)]


def of_table(run: Run, interval: float) -> dict[str, Any]:
    """Frequency, damping ratio and dead time; bandwidth where the motion covers it."""
    columns = run.columns["slave"]
    command, measured = columns["table_command"], columns["table_displacement"]
    fit = table.least_squares(command, measured, interval)
    result: dict[str, Any] = {"parameters": plain(fit.parameters), "nrmse": fit.nrmse}
    sweeps = [segment for segment in segments(run) if segment.name == "sweep"]
    if sweeps:
        part = slice(sweeps[0].begin, sweeps[0].end)
        response = table.frequency_response(command[part], measured[part], interval)
        result["bandwidth"] = table.bandwidth(response)._asdict()
    return result


def of_damper(run: Run, interval: float) -> dict[str, Any]:
    """Mass, spring, dashpot, friction, lag and gain of the motor."""
    columns = run.columns["slave"]
    plan = plan_of(run)
    still = part_of(run) == "damper"
    fit = damper.least_squares(
        columns["damper_command"],
        columns["damper_stroke"],
        columns.get("damper_force"),
        None if still else columns.get("table_acceleration"),
        interval,
        nominal=plan.damper if plan else None,
    )
    return {
        "parameters": plain(fit.parameters),
        "nrmse": {"damper_stroke": fit.stroke_nrmse, "damper_force": fit.force_nrmse},
    }


IDENTIFIERS: dict[str, Callable[[Run, float], dict[str, Any]]] = {
    "column": of_column,
    "actuator": of_actuator,
    "table": of_table,
    "damper": of_damper,
}
