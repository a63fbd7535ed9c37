"""The summary of a recording: peaks, completeness, latency; used by `run` and `inspect`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from common import signals
from common.errors import InputError
from common.plan.plan import Plan, parse
from common.recording.reader import Run, Values
from common.roles import LATENCY, MASTER, SLAVE, kind_of, latency_topic, name_of
from common.signals import Kind
from loop.force_path import force_path as force_path_of
from loop.nominal.partition import storey_stiffness
from models import indicators
from report.facts import circumstances, storeys
from report.facts import late as lateness
from report.facts.accounts import accounts
from report.facts.due import due

Result = TypeVar("Result")
PERCENTILES = (50, 90, 99, 99.9)
LEAST_TICKS = 500  # a second at 2 ms: less holds too few cycles of a building for a delay
# topic, part, target, measurement, ticks by which the target stands before the measurement that it belongs to
PATHS = (
    ("master", "actuator", "column_target", "column_displacement", 0),
    ("slave", "table", "table_target", "table_displacement", 1),
)
SEGMENTS = (
    "wake_lateness",
    "compute_time",
    "encode_time",
    "command_one_way",
    "slave_time",
    "slave_compute_time",
    "feedback_one_way",
    "decode_time",
    "round_trip",
    "age_at_use",
)


def plan_of(run: Run) -> Plan | None:
    """The plan inside a recording, as the slave sees it whose part of a recording it is; None where there is none."""
    text = run.metadata.get("plan", {}).get("toml")
    plan = parse(text, run.path.parent, f"the plan in {run.path}") if text else None
    return plan.of(run.part_of) if plan and run.part_of else plan


def summarize(run: Run) -> dict[str, Any]:
    """Everything that `inspect` reports, as plain values."""
    plan, real_time = plan_of(run), lateness.late_ticks(run)
    expected = due(run, plan)
    return {
        "file": str(run.path),
        "test": run.test,
        "finished": run.finished,
        "damage": run.damage,
        "slaves": [name_of(role) for role in run.roles if name_of(role)],
        "clock": circumstances.clock_of(run),
        "circumstances": circumstances.sentence(run, plan),
        "ground_motion": run.metadata.get("ground_motion", {}),
        "ticks_planned": plan.ticks if plan else None,
        "ticks_expected": max(expected.values(), default=0) if plan else None,
        "topics": {topic: completeness(run, topic, ticks) for topic, ticks in expected.items()},
        "recorder": dict(run.metadata.get("summary", {})),
        "peaks": peaks(run),
        "storeys": (floors := storeys.storeys(run, plan) if plan else []),
        "modes": storeys.modes(plan) if plan and floors else [],
        "tracking": tracking(run),
        "force_path": force_path(run, plan) if plan else None,
        "error_energy": error_energy(run, plan) if plan else None,
        "latency": latencies(run),
        "late_ticks": late_ticks(run),
        "real_time": real_time,
        "warnings": [text for text in (lateness.warning(real_time),) if text],
        "patience": patience(run),
        "missed_ticks": missed_ticks(run),
        "rejected": rejected(run),
        "exchange": accounts(run),
        "events": run.events,
    }


def completeness(run: Run, topic: str, expected: int) -> dict[str, Any]:
    """How many messages of a topic there are, how many of the ticks that were due are missing, and the first holes."""
    sequence = run.sequences[topic]
    missing = np.setdiff1d(np.arange(expected), sequence)
    breaks = np.flatnonzero(np.diff(missing) > 1) + 1
    holes = [[int(part[0]), int(part[-1])] for part in np.split(missing, breaks) if part.size]
    return {
        "expected": expected,
        "recorded": int(sequence.size),
        "missing": int(missing.size),
        "holes": holes[:10],
        "repeated": int(sequence.size - np.unique(sequence).size),
    }


def peaks(run: Run) -> dict[str, dict[str, Any]]:
    """Largest magnitude of every recorded quantity with a unit, and when it occurs."""
    result = {}
    for topic, columns in run.columns.items():
        t = columns.get("t")
        for row in signals.TOPICS[kind_of(topic)] if kind_of(topic) in (MASTER, SLAVE) else ():
            values = columns.get(row.name)
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


def tracking(run: Run) -> dict[str, dict[str, Any]]:
    """How the transfer systems followed their targets: delay (s) two ways, amplitude, NRMSE, peak error.

    By part; the table of a named slave is `table.NAME`. Where the delay is not determined it is None and `undetermined`
    says why.
    """
    result: dict[str, dict[str, Any]] = {}
    paths = ((path, topic) for path in PATHS for topic in run.columns if kind_of(topic) == path[0])
    for (_, part, target, measured, late), topic in paths:
        columns = run.columns[topic]
        if not {target, measured, "t"} <= columns.keys() or columns["t"].size <= LEAST_TICKS:
            continue
        wanted, got = columns[target][: columns["t"].size - late], columns[measured][late:]
        if not np.all(np.isfinite([wanted, got])) or not np.ptp(wanted) or not np.ptp(got):
            continue
        interval = float(np.median(np.diff(columns["t"])))
        result[part + topic.removeprefix(kind_of(topic))] = {
            **following(wanted, got, interval),
            "nrmse": indicators.nrmse(wanted, got),
            "peak_error": indicators.peak_error(wanted, got),
            "enclosed_area": float(indicators.tracking_indicator(wanted, got)[-1]),
        }
    return result


def force_path(run: Run, plan: Plan) -> dict[str, Any] | None:
    """Delay (s) with its interval and gain of the column force, which tracking does not show; None where unknown."""
    columns = run.columns.get("master", {})
    if not {"column_displacement", "column_force"} <= columns.keys():
        return None
    displacement, force = columns["column_displacement"], columns["column_force"]
    if force.size <= LEAST_TICKS or not np.all(np.isfinite([displacement, force])):
        return None
    found = force_path_of(plan, displacement, force)
    return None if found is None else {**found._asdict(), "interval": list(found.interval)}


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
    strain = 0.5 * storey_stiffness(plan) * float(np.max(np.abs(target))) ** 2
    if strain == 0.0 or not all(np.all(np.isfinite(columns[name])) for name in needed):
        return None
    momentum = columns["velocity"].reshape(columns["t"].size, -1) @ np.array(structure.mass)
    given = np.cumsum(-columns["ground_acceleration"] * momentum) * plan.test.interval
    force = column.represents * columns["column_force"]
    share = indicators.hybrid_simulation_error_energy(target, measured, force, given, strain)
    return float(share[np.argmax(np.abs(share))])


def following(wanted: Values, got: Values, interval: float) -> dict[str, Any]:
    """Delay (s) and amplitude of a measurement (n,) behind its target; each None where it is not determined."""
    path = known(indicators.aligned_evaluation, wanted, got, interval)
    correlation = known(indicators.correlation_delay, wanted, got, interval)
    delay, reason = None, "the motion has too few cycles for a delay"
    if path is not None and correlation is not None:
        delay = indicators.tracking_delay(path.delay, correlation, interval)
        reason = (
            f"{1e3 * path.delay:.1f} ms by the frequency evaluation index and {1e3 * correlation:.1f} ms by "
            "correlation do not agree"
        )
    return {
        "delay": delay,
        "amplitude": None if path is None or delay is None else path.amplitude,
        "frequency": None if path is None or delay is None else path.frequency,
        "correlation_delay": correlation,
        "undetermined": "" if delay is not None else reason,
    }


def known(indicator: Callable[..., Result], *signals: Any) -> Result | None:
    """What an indicator says, None where it refuses."""
    try:
        return indicator(*signals)
    except InputError:
        return None


def late_ticks(run: Run) -> int | None:
    """Ticks in which a deadline was missed in the exchange with any slave, None where latency is not recorded."""
    return ticks_where(run, lambda columns: columns["deadline_missed"].astype(bool))


def patience(run: Run) -> str:
    """Which figures of the plan were larger because all laboratories were emulated, and why; empty where none was."""
    return next((event["text"] for event in run.events if event["code"] == "patience"), "")


def missed_ticks(run: Run) -> int | None:
    """How many of the late ticks sent no command, because the master was late by a whole interval."""
    return ticks_where(run, lambda columns: columns["command_sent_ns"] == 0)


def rejected(run: Run) -> dict[str, dict[str, int]]:
    """Frames that were rejected, by laboratory and reason: each event counts from the test's beginning."""
    found = {}
    for event in run.events:
        if event["code"] == "rejected":
            found[event["lab"]] = {reason: int(count) for reason, count in event["values"].items()}
    return found


def ticks_where(run: Run, condition: Callable[[dict[str, Values]], Values]) -> int | None:
    """Ticks in which a condition holds in the exchange with any slave, None where latency is not recorded."""
    tables = [columns for topic, columns in run.columns.items() if kind_of(topic) == LATENCY]
    if not any(columns["seq"].size for columns in tables):
        return None
    return int(np.unique(np.concatenate([columns["seq"][condition(columns)] for columns in tables])).size)


def latencies(run: Run) -> dict[str, Any]:
    """Percentiles of every segment, of named slaves a table each by name; none in virtual time, which measures none."""
    if circumstances.clock_of(run) == circumstances.VIRTUAL:
        return {}
    if run.roles == (SLAVE,):
        return latency(run, LATENCY)
    tables = {name_of(role): latency(run, latency_topic(role)) for role in run.roles}
    return {name: table for name, table in tables.items() if table}


def latency(run: Run, topic: str) -> dict[str, dict[str, float]]:
    """Percentiles of every segment of the ticks' time, s, over the ticks in which it was measured."""
    columns = run.columns.get(topic, {})
    result = {}
    for name in SEGMENTS:
        values = columns.get(name, np.array([]))
        values = values[np.isfinite(values)]
        if values.size:
            result[name] = {f"p{p:g}": float(np.percentile(values, p)) for p in PERCENTILES}
            result[name]["max"] = float(values.max())
    return result
