"""The signals of a recording, or of the simulation of a plan, for a comparison."""

from __future__ import annotations

from functools import reduce
from pathlib import Path
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan import read as plans
from common.recording.holds import before_hold
from common.recording.reader import read
from common.recording.run import Run, Values
from common.roles import MASTER, name_of
from common.terminal import cli
from common.terminal.telling import Tell, untold

OF_THE_TICK = ("seq", "t")


class ComparedRun(NamedTuple):
    """Tick numbers (ticks,), signals by name (ticks,), and a line of text on the ground motion.

    The signals of a named slave are called `NAME.signal`.
    """

    ticks: Values
    signals: dict[str, Values]
    motion: str


def columns(name: str, tell: Tell = untold) -> ComparedRun:
    """The signals of a recording, or of the simulation of a plan (a .toml file, or the name of a plan of rths).

    Raises:
        InputError: the recording cannot be read, or the plan cannot be simulated.
    """
    if name in cli.SHIPPED or name.endswith(".toml"):
        return simulated(cli.plan_path(name))
    tell(f"reading {name}", 0, 0)
    return recorded(read(Path(name)))


def simulated(path: Path) -> ComparedRun:
    """The simulation of a plan."""
    from loop import substructure
    from loop.closed_loop import simulate
    from loop.signals import signals

    test = plans.load(path)
    record = substructure.motion(test)
    values = signals(test, simulate(test, substructure.ground_rows(test, record)))
    ticks = (values["t"] / test.test.interval).round().astype(int)
    return ComparedRun(ticks, values, f"{record.describe()}, scaled by {test.ground_motion.scale!r}")


def recorded(run: Run) -> ComparedRun:
    """The signals of a recording, up to its first hold, at the ticks that master and slaves have in common.

    Raises:
        InputError: it holds no ticks of a master or a slave.
    """
    run, held = before_hold(run)
    topics = [topic for topic in (MASTER, *run.roles) if run.has(topic)]
    if not topics:
        raise InputError(f"{run.path} holds no ticks of a master or a slave to compare.")
    ticks = reduce(np.intersect1d, (run.sequences[topic] for topic in topics))
    values: dict[str, Values] = {}
    for topic in topics:
        _, _, chosen = np.intersect1d(ticks, run.sequences[topic], return_indices=True)
        for name, column in run.columns[topic].items():
            if not name_of(topic):
                values.setdefault(name, column[chosen])
            elif name not in OF_THE_TICK:
                values[f"{name_of(topic)}.{name}"] = column[chosen]
    motion = run.metadata.get("ground_motion")
    line = f"{motion['record']}, scaled by {motion['scale']}" if motion else "ground motion not recorded"
    line += f"; held at {held:.3f} s, and compared up to there" if held is not None else ""
    return ComparedRun(ticks, values, line)
