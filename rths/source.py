"""Two kinds of the same thing: a recording, or a plan whose simulation stands for one."""

from __future__ import annotations

from functools import reduce
from pathlib import Path
from typing import NamedTuple

import numpy as np

from common import cli, plan
from common.recording.reader import Run, Values, read


class Source(NamedTuple):
    """What there is to compare: tick numbers, signals by name, and a line on the ground motion."""

    ticks: Values
    signals: dict[str, Values]
    motion: str


def columns(name: str) -> Source:
    """What there is in a recording, or of the simulation of a plan (.toml, default, paper).

    Raises:
        InputError: it can be neither read nor simulated.
    """
    if name in ("default", "paper") or name.endswith(".toml"):
        return simulated(cli.plan_path(name))
    return recorded(read(Path(name)))


def simulated(path: Path) -> Source:
    """The simulation of a plan."""
    from models import substructure
    from models.closed_loop import signals, simulate

    test = plan.load(path)
    record = substructure.motion(test)
    values = signals(test, simulate(test, substructure.ground_rows(test, record)))
    ticks = (values["t"] / test.test.interval).round().astype(int)
    return Source(ticks, values, f"{record.describe()}, scaled by {test.ground_motion.scale!r}")


def recorded(run: Run) -> Source:
    """The signals of a recording on the ticks that master and slave have in common."""
    topics = [topic for topic in ("master", "slave") if run.has(topic)]
    ticks = reduce(np.intersect1d, (run.sequences[topic] for topic in topics))
    values: dict[str, Values] = {}
    for topic in topics:
        _, _, chosen = np.intersect1d(ticks, run.sequences[topic], return_indices=True)
        for name, column in run.columns[topic].items():
            values.setdefault(name, column[chosen])
    motion = run.metadata.get("ground_motion")
    line = f"{motion['record']}, scaled by {motion['scale']}" if motion else "ground motion not recorded"
    return Source(ticks, values, line)
