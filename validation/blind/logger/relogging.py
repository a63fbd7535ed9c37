"""A recording as a separate data logger would write it, beside the controllers that ran the test.

The controllers see true values; the recording has those of the logger, with noise of its own for every sensor. The
force of a slave that the master used is read from the same log, by the number of its message. Nothing in the file says
which logger it was: it is an import.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from common.plan.plan import Plan
from common.recording.reader import read
from common.recording.run import GROUND, Run, Values
from common.recording.writer import SIGNALS, Recording
from common.roles import MASTER
from common.signals import Channels
from laboratories import kinds
from validation.blind import lots
from validation.blind.logger.logged import logged
from validation.blind.logger.loggers import Logger

IMPORTED = {"data": "measurements"}  # metadata `import`, the same for every logger
WRITTEN_ANEW = ("summary", SIGNALS, "import")
Columns = dict[str, dict[str, Values]]  # by topic and name


def relog(
    path: Path, output: Path, plan: Plan, logger: Logger, levels: Mapping[str, float], seed: int
) -> None:
    """Write into `output` what a logger records of a test with sensors without noise.

    `levels` are the sensors' rms by signal; the noise of each is drawn from a generator named by `seed` and signal.
    """
    run = read(path)
    rewrite(run, output, plan, relogged(run, plan, logger, levels, seed))


def relogged(run: Run, plan: Plan, logger: Logger, levels: Mapping[str, float], seed: int) -> Columns:
    """The columns of every topic, with the measured ones behind the logger."""
    columns = {topic: dict(values) for topic, values in run.columns.items()}
    for role, kind in kinds.kinds_of(plan).items():
        if not run.ticks(role):
            continue
        for row in kind.channels.measured:
            generator = lots.generator(seed, "logger", role, row.name)
            true = np.asarray(columns[role][row.name], dtype=np.float64)
            columns[role][row.name] = logged(
                logger, row, true, levels[row.name], plan.test.interval, generator
            )
        if role != MASTER:
            use(run, columns, role, kind.channels)
    return columns


def use(run: Run, columns: Columns, role: str, channels: Channels) -> None:
    """Replace the force that the master used by the logged force of the slave, by the number of the message."""
    force, used = channels.force, channels.used
    if used not in columns.get(MASTER, {}):
        return
    roles = run.shared.get(used, (role,))
    place = roles.index(role)
    shape = columns[MASTER][used].shape
    replaced = np.array(columns[MASTER][used], dtype=np.float64).reshape(shape[0], -1)
    seq = columns[MASTER][channels.used_seq].reshape(shape[0], -1)[:, place].astype(np.int64)
    there = (seq >= 0) & (seq < columns[role][force].size)
    replaced[there, place] = columns[role][force][seq[there]]
    columns[MASTER][used] = replaced.reshape(shape)


def rewrite(run: Run, output: Path, plan: Plan, columns: Columns) -> None:
    """A recording with other columns; plan, events and time stamps are kept, the ramps to rest are not."""
    recording = Recording(output, run.test, plan.storeys, kinds.topics(plan), plan.roles)
    for name, values in run.metadata.items():
        if name not in WRITTEN_ANEW:
            recording.metadata(name, values)
    recording.describe()
    recording.metadata("import", IMPORTED)
    if GROUND in run.attachments:
        recording.attach(GROUND, run.attachments[GROUND], "application/octet-stream")
    for event in run.events:
        at = round(1e9 * event["t"])
        recording.add("event", at, at, [event[row.name] for row in recording.topics["event"]])
    for topic, own in columns.items():
        table = zip(*(own[signal.name].tolist() for signal in recording.topics[topic]), strict=True)
        for at, row in zip(run.log_ns[topic].tolist(), table, strict=True):
            recording.add(topic, at, at, row)
    recording.close(run.metadata.get("summary", {}))
