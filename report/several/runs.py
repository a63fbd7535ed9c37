"""The recordings that are compared: signals over the time since the start, and what a table says of each."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.plan_difference import changed
from common.plan.schema import nearest
from common.plan.units import converted
from common.recording.outcome import outcome
from common.recording.reader import read
from common.recording.run import Run, Values
from common.roles import MASTER, kind_of, name_of
from common.terminal.telling import Tell, untold
from report.facts.laboratories import laboratories, whole_plan
from report.facts.summary import tracking

MOST = 50  # recordings; more lines in one picture cannot be told apart
DRIFT = "drift"  # of each storey, computed from the displacements


class OneRun(NamedTuple):
    """A recording: its label, its signals in SI units by name, and the figures that tables show.

    The signals of a named slave are called `NAME.signal`, those of storeys `signal.1`, `signal.2` from the lowest up.
    """

    label: str
    time: dict[str, Values]  # s since the first tick, by signal
    signals: dict[str, Values]
    units: dict[str, str]
    usual: tuple[str, ...]  # signals that are shown where none are chosen
    plan: dict[str, str]  # keys that are not at their defaults, with their values
    facts: dict[str, str]
    tracking: dict[str, dict[str, Any]]


class ChosenSignal(NamedTuple):
    """A signal that is shown, in a unit of which one is `factor` SI units; without a unit the scale is chosen later."""

    name: str
    unit: str = ""
    factor: float = 1.0


def several(paths: Sequence[Path], tell: Tell = untold) -> list[OneRun]:
    """The recordings, labelled by what their paths do not share.

    Raises:
        InputError: there are more than 50, one is given twice, cannot be read, or holds no ticks.
    """
    if len(paths) > MOST:
        raise InputError(f"{len(paths)} recordings are given, but at most {MOST} can be compared at once.")
    if len({path.resolve() for path in paths}) < len(paths):
        raise InputError("A recording is given twice: name each file once.")
    labels, found = labelled(paths), []
    for place, (path, label) in enumerate(zip(paths, labels, strict=True)):
        tell("reading", place, len(paths))
        found.append(one(read(path), label))
    return found


def labelled(paths: Sequence[Path]) -> list[str]:
    """The names of files, with their folders where two have one name."""
    names = [path.name for path in paths]
    if len(set(names)) == len(names):
        return [path.stem for path in paths]
    shared = os.path.commonpath([path.resolve().parent for path in paths])
    return [str(path.resolve().relative_to(shared).with_suffix("")) for path in paths]


def one(run: Run, label: str) -> OneRun:
    """What is compared of a recording; raises InputError where it holds no ticks."""
    topics = [topic for topic in (MASTER, *run.roles) if run.has(topic)]
    if not topics:
        raise InputError(f"{run.path} holds no ticks of a master or a slave to compare.")
    labs, plan = laboratories(run), whole_plan(run)
    time, signals, units = {}, {}, {}
    for topic in topics:
        columns = run.columns[topic]
        for name, unit, values in of_topic(run, topic):
            if name not in signals:
                time[name], signals[name], units[name] = columns["t"] - columns["t"][0], values, unit
    usual = [name for name in signals if name.split(".")[0] == DRIFT]
    usual += [named(lab.topic, name) for lab in labs for name in (lab.channels.position, lab.channels.force)]
    motion = run.metadata.get("ground_motion", {})
    facts = {
        "outcome": outcome(run.metadata.get("summary", {})),
        "motion": motion.get("record", "").partition(" (")[0].partition(", dt ")[0],
        "scale": f"{float(motion['scale']):g}" if "scale" in motion else "",
    }
    shown = tuple(name for name in usual if name in signals)
    return OneRun(
        label, time, signals, units, shown, changed(plan) if plan else {}, facts, tracking(run, labs)
    )


def of_topic(run: Run, topic: str) -> Iterator[tuple[str, str, Values]]:
    """Name, unit and values (n,) of each quantity of a topic; a drift follows from each storey's displacement."""
    columns, units = run.columns[topic], run.units.get(topic, {})
    for name, unit in units.items():
        if unit and unit != "ns" and name not in ("t", "seq") and name in columns:
            yield from spread(named(topic, name), unit, columns[name])
    if topic == MASTER and "displacement" in columns:
        floors = columns["displacement"].reshape(columns["t"].size, -1)
        yield from spread(
            DRIFT, units.get("displacement", "m"), np.diff(floors, axis=1, prepend=0.0).squeeze()
        )


def spread(name: str, unit: str, values: Values) -> Iterator[tuple[str, str, Values]]:
    """A signal, or one of each storey."""
    if values.ndim == 1:
        yield name, unit, values.astype(float)
    else:
        yield from (
            (f"{name}.{place + 1}", unit, values[:, place].astype(float)) for place in range(values.shape[1])
        )


def named(topic: str, name: str) -> str:
    """The name of a topic's signal."""
    return f"{name_of(topic)}.{name}" if kind_of(topic) != MASTER and name_of(topic) else name


def chosen(runs: Sequence[OneRun], words: Sequence[str]) -> list[ChosenSignal]:
    """The signals that words such as `drift` or `column_force:kN` choose; without any, the usual ones.

    Raises:
        InputError: no recording has such a signal, or its unit does not fit.
    """
    if not words:
        return [ChosenSignal(name) for name in dict.fromkeys(name for run in runs for name in run.usual)]
    units = {name: unit for run in runs for name, unit in run.units.items()}
    found = []
    for word in words:
        name, _, unit = word.partition(":")
        if name not in units:
            raise InputError(f"No recording has a signal '{name}': {nearest(name, units)}")
        from decimal import Decimal

        factor = converted(Decimal(1), unit, units[name], f"--signals {name}") if unit else 1.0
        found.append(ChosenSignal(name, unit, factor))
    return found
