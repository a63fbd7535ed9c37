"""A test and its prediction in one recording, on the same times, for viewers that draw signals over each other."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.read import parse
from common.recording.run import GROUND, Run
from common.recording.writer import Recording
from common.roles import MASTER
from common.signals import Signal
from laboratories import kinds
from simulation.prediction import file

PREDICTED = (
    "predicted"  # prefix of the topics of the laboratories as found; the prefixes of the band are `file`'s
)
BESIDE = "beside"  # metadata: the files that stand beside each other
ENDS = {PREDICTED: "", file.LOWER: file.LOWER, file.UPPER: file.UPPER}  # prefix here, and in the prediction


def write(path: Path, measured: Run, predicted: Run) -> None:
    """Write the ticks and events of a test, and beside them its prediction at the times of the same ticks.

    The topics are those of the test, and the same with `predicted.`, `lower.` and `upper.` in front. Rows of the
    prediction at ticks that the test does not have are left out.

    Raises:
        InputError: one of them holds no plan, or they have other slaves or another number of storeys.
    """
    plan, other = plan_in(measured), plan_in(predicted)
    if plan.kinds != other.kinds or plan.storeys != other.storeys:
        raise InputError(
            f"{measured.path} and {predicted.path} differ in laboratories or storeys: give that test's prediction."
        )
    every = kinds.topics(plan)
    topics = {topic: every[topic] for topic in (MASTER, *plan.roles)}
    more = {file.band_topic(end, topic): rows for end in ENDS for topic, rows in topics.items()}
    topics_written = {**topics, "event": every["event"], **more}
    recording = Recording(path, measured.test, plan.storeys, topics_written, plan.roles)
    for name in ("plan", "ground_motion", "clock"):
        if name in measured.metadata:
            recording.metadata(name, measured.metadata[name])
    recording.metadata(
        BESIDE,
        {"measured": measured.path.name, "predicted": predicted.path.name, "prefixes": json.dumps([*ENDS])},
    )
    recording.describe()
    if GROUND in measured.attachments:
        recording.attach(GROUND, measured.attachments[GROUND], "application/octet-stream")
    add_events(recording, measured)
    for topic, rows in topics.items():
        add(recording, topic, measured, topic, measured.log_ns[topic], rows)
        for end, theirs in ENDS.items():
            source = file.band_topic(theirs, topic) if theirs else topic
            add(
                recording,
                file.band_topic(end, topic),
                predicted,
                source,
                stamps(measured, topic, predicted),
                rows,
            )
    recording.close(measured.metadata.get("summary", {}))


def plan_in(run: Run) -> Plan:
    """The plan of a recording; raises InputError where it holds none."""
    if "plan" not in run.metadata:
        raise InputError(f"{run.path} holds no plan, by which its signals are known.")
    return parse(run.metadata["plan"]["toml"], run.path.parent, f"the plan in {run.path}")


def stamps(measured: Run, topic: str, predicted: Run) -> np.ndarray:
    """The time (ns) of each tick of the prediction in the test, −1 where the test does not have the tick."""
    there = dict(zip(measured.sequences[topic].tolist(), measured.log_ns[topic].tolist(), strict=True))
    return np.array([there.get(tick, -1) for tick in predicted.sequences[topic].tolist()], dtype=np.int64)


def add_events(recording: Recording, run: Run) -> None:
    """Write the events of a test at their times, which count from its first tick."""
    first = min((int(stamp[0]) for stamp in run.log_ns.values() if stamp.size), default=0)
    names = [row.name for row in recording.topics["event"]]
    for event in run.events:
        at = first + round(1e9 * event["t"])
        recording.add("event", at, at, [event[name] for name in names])


def add(
    recording: Recording, topic: str, run: Run, source: str, at_ns: np.ndarray, rows: tuple[Signal, ...]
) -> None:
    """Write the rows of the topic `source` of a recording as those of `topic`, at their times in ns."""
    columns = run.columns.get(source, {})
    if any(row.name not in columns for row in rows):
        raise InputError(
            f"{run.path} lacks signals of {source}: {', '.join(r.name for r in rows if r.name not in columns)}."
        )
    table = zip(*(columns[row.name].tolist() for row in rows), strict=True)
    for at, values in zip(at_ns.tolist(), table, strict=True):
        if at >= 0:
            recording.add(topic, at, at, values)
