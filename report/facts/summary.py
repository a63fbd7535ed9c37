"""The summary of a recording: peaks, completeness, latency; used by `run` and `inspect`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from common.recording.holds import added, holds
from common.recording.imported import is_static
from common.recording.run import Run, Values
from common.roles import LATENCY, MASTER, SLAVE, kind_of, latency_topic, name_of
from laboratories.column.kind import COLUMN
from laboratories.kind import Follows
from loop.force_path import force_path as force_path_of
from loop.nominal.partition import storey_stiffness
from models import indicators
from report.facts import circumstances, storeys
from report.facts import late as lateness
from report.facts.accounts import accounts
from report.facts.due import due
from report.facts.laboratories import LaboratoryFacts, laboratories, plan_of

Result = TypeVar("Result")
PERCENTILES = (50, 90, 99, 99.9)
# A second at 2 ms: two cycles of a building of 2 Hz, without which a delay is not determined.
LEAST_TICKS = 500
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


def summarize(run: Run) -> dict[str, Any]:
    """Everything that `inspect` reports, as plain values."""
    plan, real_time = plan_of(run), lateness.late_ticks(run)
    expected, labs = due(run, plan), laboratories(run)
    paths = force_paths(run, labs)
    return {
        "file": str(run.path),
        "test": run.test,
        "finished": run.finished,
        "damage": run.damage,
        "slaves": [name_of(role) for role in run.roles if name_of(role)],
        "clock": circumstances.clock_of(run),
        "circumstances": circumstances.sentence(run, plan),
        "ground_motion": run.metadata.get("ground_motion", {}),
        "holds": (held := told_holds(run, plan)),
        "ticks_planned": plan.ticks + sum(one["added"] for one in held) if plan else None,
        "ticks_expected": max(expected.values(), default=0) if plan else None,
        "topics": {topic: completeness(run, topic, ticks) for topic, ticks in expected.items()},
        "recorder": dict(run.metadata.get("summary", {})),
        "peaks": peaks(run),
        "storeys": (floors := storeys.storeys(run, plan, labs) if plan else []),
        "modes": storeys.modes(plan) if plan and floors else [],
        "tracking": tracking(run, labs),
        "force_path": next(iter(paths.values()), None),
        "force_paths": paths,
        "error_energy": error_energy(run, labs),
        "error_energy_at": next((whereabouts(lab) for lab in labs if lab.topic == MASTER), ""),
        "latency": latencies(run),
        "late_ticks": late_ticks(run),
        "real_time": real_time,
        "beside_client": lateness.beside_client(run),
        "warnings": [text for text in (lateness.warning(real_time),) if text],
        "patience": patience(run),
        "missed_ticks": missed_ticks(run),
        "rejected": rejected(run),
        "exchange": accounts(run),
        "events": run.events,
    }


def told_holds(run: Run, plan: Plan | None) -> list[dict[str, Any]]:
    """Every hold of the test: when it began (s), where the earthquake's time stood (s), how long it took (s).

    `added` are the ticks by which it made the test longer; what is not known where the test ended in it is None.
    """
    if plan is None:
        return []
    interval, result, behind = plan.test.interval, [], 0
    last = max(map(run.ticks, run.columns), default=0)
    for hold in holds(run.events, interval):
        more = added([hold], last)
        over = hold.over
        result.append(
            {
                "t": hold.begun * interval,
                "earthquake_time": (hold.begun - behind + 0.5 * hold.ramp) * interval,
                "duration": None if over is None else (over - hold.begun) * interval,
                "added": more,
            }
        )
        behind += more
    return result


def completeness(run: Run, topic: str, expected: int) -> dict[str, Any]:
    """The messages of a topic that are recorded, the ticks due that are missing, and the first ten holes."""
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
    """Largest magnitude of every recorded quantity with a unit, and when it occurs: None where rows have no times."""
    result = {}
    for topic, columns in run.columns.items():
        t = None if is_static(run) else columns.get("t")
        for name, unit in units_of(run, topic).items() if kind_of(topic) in (MASTER, SLAVE) else ():
            values = columns.get(name)
            if values is None or not values.size:
                continue
            magnitude = np.abs(values).reshape(len(values), -1).max(axis=1)
            if np.isnan(magnitude).all():  # a client that was handed no force yet
                continue
            place = int(np.nanargmax(magnitude))
            at = float(t[place]) if t is not None else None
            result[f"{topic}/{name}"] = {"peak": float(magnitude[place]), "t": at, "unit": unit}
    return result


def units_of(run: Run, topic: str) -> dict[str, str]:
    """The units of the quantities of a topic, as the recording says them; numbers of ticks and times are none."""
    return {name: unit for name, unit in run.units.get(topic, {}).items() if unit not in ("", "s", "ns")}


def tracking(run: Run, labs: list[LaboratoryFacts]) -> dict[str, dict[str, Any]]:
    """How the transfer systems followed their targets: delay (s) by two methods, amplitude, NRMSE, peak error.

    The result is by system. The system of a named slave is `table.NAME`; that of a slave without a name, if the master
    has a system of the same name, `actuator.slave`. A delay that is not determined is None, and `undetermined` says
    why.
    """
    result: dict[str, dict[str, Any]] = {}
    for lab in [] if is_static(run) else labs:
        columns, late = run.columns[lab.topic], lab.late
        target, measured = lab.channels.target.name, lab.channels.position
        if not {target, measured, "t"} <= columns.keys() or columns["t"].size <= LEAST_TICKS:
            continue
        wanted, got = columns[target][: columns["t"].size - late], columns[measured][late:]
        if not np.all(np.isfinite([wanted, got])) or not np.ptp(wanted) or not np.ptp(got):
            continue
        interval = float(np.median(np.diff(columns["t"])))
        result[system(lab, labs)] = {
            **following(wanted, got, interval),
            "nrmse": indicators.nrmse(wanted, got),
            "peak_error": indicators.peak_error(wanted, got),
            "enclosed_area": float(indicators.tracking_indicator(wanted, got)[-1]),
        }
    return result


def system(lab: LaboratoryFacts, labs: list[LaboratoryFacts]) -> str:
    """The name of a laboratory's transfer system in tables, which no other system has."""
    name = name_of(lab.topic)
    first = next(other for other in labs if other.pictured.system == lab.pictured.system)
    return (
        f"{lab.pictured.system}.{name or SLAVE}" if name or first.topic != lab.topic else lab.pictured.system
    )


def whereabouts(lab: LaboratoryFacts) -> str:
    """A laboratory's device in a sentence: `the column`, or `column A` where there are two."""
    return lab.name if lab.letter else f"the {lab.name}"


def force_paths(run: Run, labs: list[LaboratoryFacts]) -> dict[str, dict[str, Any]]:
    """Delay (s) with its interval and gain of each column's force, which tracking does not show, by its system."""
    columns = [] if is_static(run) else [lab for lab in labs if lab.channels == COLUMN.channels]
    found = ((system(lab, labs), force_path(run, lab)) for lab in columns)
    return {name: facts for name, facts in found if facts is not None}


def force_path(run: Run, lab: LaboratoryFacts) -> dict[str, Any] | None:
    """Delay, its interval, and gain of one column's force; None where they are unknown."""
    columns, position, force = run.columns[lab.topic], lab.channels.position, lab.channels.force
    if lab.plan is None or not {position, force} <= columns.keys():
        return None
    moved, felt = columns[position], columns[force]
    if felt.size <= LEAST_TICKS or not np.all(np.isfinite([moved, felt])):
        return None
    found = force_path_of(lab.plan, moved, felt)
    return None if found is None else {**found._asdict(), "interval": list(found.interval)}


def error_energy(run: Run, labs: list[LaboratoryFacts]) -> float | None:
    """Largest share of energy that tracking errors put in or took out in laboratory A; None without its signals."""
    lab = next((one for one in labs if one.topic == MASTER), None)
    coupling = lab.coupling if lab is not None else None
    if lab is None or lab.plan is None or coupling is None or coupling.follows is not Follows.DRIFT:
        return None
    columns, plan = run.columns[MASTER], lab.plan
    own = (lab.channels.target.name, lab.channels.position, lab.channels.force)
    needed = {"t", *own, "ground_acceleration", "velocity"}
    if not needed <= columns.keys() or not columns["t"].size:
        return None
    target, measured = (columns[name] / coupling.ratio for name in own[:2])
    strain = 0.5 * storey_stiffness(plan) * float(np.max(np.abs(target))) ** 2
    if strain == 0.0 or not all(np.all(np.isfinite(columns[name])) for name in needed):
        return None
    momentum = columns["velocity"].reshape(columns["t"].size, -1) @ np.array(plan.structure.mass)
    given = np.cumsum(-columns["ground_acceleration"] * momentum) * plan.test.interval
    force = coupling.scale * columns[own[2]]
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
    """The value of an indicator, None where it raises an InputError."""
    try:
        return indicator(*signals)
    except InputError:
        return None


def late_ticks(run: Run) -> int | None:
    """Ticks in which a deadline was missed in the exchange with any slave, None where latency is not recorded."""
    return ticks_where(run, "deadline_missed", lambda missed: missed.astype(bool))


def patience(run: Run) -> str:
    """The sentence on figures of the plan that were larger because all laboratories are emulated; empty without any."""
    return next((event["text"] for event in run.events if event["code"] == "patience"), "")


def missed_ticks(run: Run) -> int | None:
    """How many of the late ticks sent no command, because the master was late by a whole interval."""
    return ticks_where(run, "command_sent_ns", lambda sent: sent == 0)


def rejected(run: Run) -> dict[str, dict[str, int]]:
    """Frames that were rejected, by laboratory and reason; each event holds the counts since the start of the test."""
    found = {}
    for event in run.events:
        if event["code"] == "rejected":
            found[event["lab"]] = {reason: int(count) for reason, count in event["values"].items()}
    return found


def ticks_where(run: Run, name: str, condition: Callable[[Values], Values]) -> int | None:
    """Ticks in which a signal of the exchange with any slave meets a condition, None where it is not recorded."""
    tables = lateness.exchanges(run, "seq", name)
    if not any(columns["seq"].size for columns in tables):
        return None
    return int(
        np.unique(np.concatenate([columns["seq"][condition(columns[name])] for columns in tables])).size
    )


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
