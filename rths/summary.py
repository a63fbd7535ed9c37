"""What a recording amounts to: peaks, completeness, latency; used by `run` and `inspect`."""

from __future__ import annotations

from typing import Any

import numpy as np

from common import signals
from common.errors import InputError
from common.plan import Plan, parse
from common.recording.reader import Run, Values
from common.signals import Kind
from models import indicators

PERCENTILES = (50, 90, 99, 99.9)
LEAST_TICKS = 500
# topic, part, target, measurement, ticks by which the target stands before the measurement that it belongs to
PATHS = (
    ("master", "actuator", "column_target", "column_displacement", 0),
    ("slave", "table", "table_target", "table_displacement", 1),
)
SEGMENTS = (
    "wake_lateness",
    "compute_time",
    "command_one_way",
    "slave_time",
    "feedback_one_way",
    "round_trip",
)


def plan_of(run: Run) -> Plan | None:
    """The plan inside a recording, None where there is none."""
    text = run.metadata.get("plan", {}).get("toml")
    return parse(text, run.path.parent, f"the plan in {run.path}") if text else None


def summarize(run: Run) -> dict[str, Any]:
    """Everything that `inspect` reports, as plain values."""
    plan = plan_of(run)
    return {
        "file": str(run.path),
        "test": run.test,
        "finished": run.finished,
        "ground_motion": run.metadata.get("ground_motion", {}),
        "ticks_expected": plan.ticks if plan else None,
        "topics": {topic: completeness(run, topic, plan) for topic in run.columns},
        "recorder": dict(run.metadata.get("summary", {})),
        "peaks": peaks(run),
        "tracking": tracking(run),
        "error_energy": error_energy(run, plan) if plan else None,
        "latency": latency(run),
        "late_ticks": int(np.sum(run.columns["latency"]["deadline_missed"])) if run.has("latency") else None,
        "events": run.events,
    }


def completeness(run: Run, topic: str, plan: Plan | None) -> dict[str, Any]:
    """How many messages of a topic there are, how many are missing, and the first holes."""
    sequence = run.sequences[topic]
    last = plan.ticks if plan else int(sequence.max(initial=-1)) + 1
    missing = np.setdiff1d(np.arange(last), sequence)
    breaks = np.flatnonzero(np.diff(missing) > 1) + 1
    holes = [[int(part[0]), int(part[-1])] for part in np.split(missing, breaks) if part.size]
    return {
        "recorded": int(sequence.size),
        "missing": int(missing.size),
        "holes": holes[:10],
        "repeated": int(sequence.size - np.unique(sequence).size),
    }


def peaks(run: Run) -> dict[str, dict[str, Any]]:
    """Largest magnitude of every recorded quantity with a unit, and when it occurs."""
    result = {}
    for topic in ("master", "slave"):
        t = run.columns.get(topic, {}).get("t")
        for row in signals.TOPICS[topic]:
            values = run.columns.get(topic, {}).get(row.name)
            if (
                row.kind not in (Kind.NUMBER, Kind.STOREYS)
                or values is None
                or not values.size
                or row.unit == "s"
            ):
                continue
            magnitude = np.abs(values).reshape(len(values), -1).max(axis=1)
            place = int(np.argmax(magnitude))
            at = float(t[place]) if t is not None else None
            result[f"{topic}/{row.name}"] = {"peak": float(magnitude[place]), "t": at, "unit": row.unit}
    return result


def tracking(run: Run) -> dict[str, dict[str, float | None]]:
    """How the transfer systems followed their targets: delay (s) two ways, amplitude, NRMSE, peak error."""
    result: dict[str, dict[str, float | None]] = {}
    for topic, part, target, measured, late in PATHS:
        columns = run.columns.get(topic, {})
        if not {target, measured, "t"} <= columns.keys() or columns["t"].size <= LEAST_TICKS:
            continue
        wanted, got = columns[target][: columns["t"].size - late], columns[measured][late:]
        if not np.all(np.isfinite([wanted, got])) or not np.ptp(wanted) or not np.ptp(got):
            continue
        interval = float(np.median(np.diff(columns["t"])))
        path = indicators.frequency_evaluation_index(wanted, got, interval)
        result[part] = {
            "delay": path.delay,
            "amplitude": path.amplitude,
            "frequency": path.frequency,
            "correlation_delay": correlation_delay(wanted, got, interval),
            "nrmse": indicators.nrmse(wanted, got),
            "peak_error": indicators.peak_error(wanted, got),
            "enclosed_area": float(indicators.tracking_indicator(wanted, got)[-1]),
        }
    return result


def error_energy(run: Run, plan: Plan) -> float | None:
    """Largest share of energy that tracking errors put in or took out at the column; None without its signals."""
    columns = run.columns.get("master", {})
    needed = {"t", "column_target", "column_displacement", "column_force", "ground_acceleration", "velocity"}
    if not needed <= columns.keys() or not columns["t"].size:
        return None
    column, structure = plan.column, plan.structure
    target, measured = (
        columns[name] / column.deformation_ratio for name in ("column_target", "column_displacement")
    )
    strain = 0.5 * structure.stiffness[column.storey - 1] * float(np.max(np.abs(target))) ** 2
    if strain == 0.0 or not all(np.all(np.isfinite(columns[name])) for name in needed):
        return None
    momentum = columns["velocity"].reshape(columns["t"].size, -1) @ np.array(structure.mass)
    given = np.cumsum(-columns["ground_acceleration"] * momentum) * plan.test.interval
    force = column.represents * columns["column_force"]
    share = indicators.hybrid_simulation_error_energy(target, measured, force, given, strain)
    return float(share[np.argmax(np.abs(share))])


def correlation_delay(wanted: Values, got: Values, interval: float) -> float | None:
    """Delay (s) by cross-correlation, None where there is none within its search."""
    try:
        return indicators.correlation_delay(wanted, got, interval)
    except InputError:
        return None


def latency(run: Run) -> dict[str, dict[str, float]]:
    """Percentiles of every segment of the ticks' time, s, over the ticks in which it was measured."""
    columns = run.columns.get("latency", {})
    result = {}
    for name in SEGMENTS:
        values = columns.get(name, np.array([]))
        values = values[np.isfinite(values)]
        if values.size:
            result[name] = {f"p{p:g}": float(np.percentile(values, p)) for p in PERCENTILES}
            result[name]["max"] = float(values.max())
    return result
