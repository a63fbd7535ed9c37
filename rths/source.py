"""Two kinds of the same thing: a recording, or a plan whose simulation stands for one."""

from __future__ import annotations

from functools import reduce
from pathlib import Path

import numpy as np

from common import cli, plan
from common.recording.reader import Run, Values, read


def columns(name: str) -> tuple[Values, dict[str, Values]]:
    """Tick numbers and signals by name of a recording, or of the simulation of a plan (.toml, default, paper).

    Raises:
        InputError: it can be neither read nor simulated.
    """
    if name in ("default", "paper") or name.endswith(".toml"):
        return simulated(cli.plan_path(name))
    return recorded(read(Path(name)))


def simulated(path: Path) -> tuple[Values, dict[str, Values]]:
    """The simulation of a plan."""
    from models import substructure
    from models.closed_loop import signals, simulate

    test = plan.load(path)
    rollout = simulate(test, substructure.ground_rows(test, substructure.motion(test)))
    values = signals(test, rollout)
    return (values["t"] / test.test.interval).round().astype(int), values


def recorded(run: Run) -> tuple[Values, dict[str, Values]]:
    """The signals of a recording on the ticks that master and slave have in common."""
    topics = [topic for topic in ("master", "slave") if run.has(topic)]
    ticks = reduce(np.intersect1d, (run.sequences[topic] for topic in topics))
    values: dict[str, Values] = {}
    for topic in topics:
        _, _, chosen = np.intersect1d(ticks, run.sequences[topic], return_indices=True)
        for name, column in run.columns[topic].items():
            values.setdefault(name, column[chosen])
    return ticks, values
