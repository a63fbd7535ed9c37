"""A recording as a data logger with a clock of its own leaves it: a text file and its map, read by `rths import`.

The laboratories are played again under the recorded commands, so that their readings are known between the ticks. The
logger samples them behind its filter, and holds what the controllers computed at the last tick. The file says nothing
about the logger but what its map states.
"""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.plugins import construct, find
from common.recording.reader import read
from common.recording.run import Run
from common.rig import METHODS, command_of
from common.roles import MASTER
from common.signals import TIME, FieldType, Signal
from laboratories import kinds
from models.registry import Array
from validation.blind import lots
from validation.blind.cases.case import Case, levels, reality
from validation.blind.logger.logged import COLOURS, DECIMALS, MAINS, RANGE, converted, rounded
from validation.blind.logger.loggers import AnalogueFilter, Logger, OwnClock

STAMP = "t"  # the column of the time
TOGETHER = 3  # rows, the most that are lost at one place
FEWEST = 10  # rows for one that is lost


def write_down(case: Case, plan: Plan, played: Path, output: Path, logger: Logger, clock: OwnClock) -> None:
    """Import into `output` what a logger with a clock of its own recorded of the test in `played`.

    Raises:
        InputError: a laboratory is none whose readings are known between ticks, or the import fails.
    """
    run = read(played)
    stamps, rows = table(case, plan, run, logger, clock)
    data, names = output.with_suffix(".csv"), (STAMP, *rows)
    np.savetxt(
        data, np.column_stack([stamps, *rows.values()]), "%.10g", ",", header=",".join(names), comments=""
    )
    given = output.with_suffix(".plan.toml")
    given.write_text(plan.toml())
    sheet = output.with_suffix(".map.toml")
    sheet.write_text(stated(plan, rows, clock.filter, given.name))
    call = [sys.executable, "-m", "rths", "import", str(data), "--map", str(sheet), "-o", str(output)]
    ended = subprocess.run(call, check=False, capture_output=True, text=True)
    if ended.returncode:
        raise InputError(f"Case {case.index} cannot be imported: {ended.stderr.strip()}")
    for path in (data, given, sheet):
        path.unlink()


def table(
    case: Case, plan: Plan, run: Run, logger: Logger, clock: OwnClock
) -> tuple[Array, dict[str, Array]]:
    """The rows of a logger: its time stamps (rows,), s, and the values by signal."""
    interval = plan.test.interval
    draw = lots.generator(case.seed, "logger", "clock")
    ticks = min(run.ticks(role) for role in (MASTER, *plan.roles))
    begin = draw.uniform(0.0, 1.0 / clock.rate)
    count = math.floor(((ticks - 1) * interval - begin) * clock.rate)
    stamps: Array = np.arange(count, dtype=np.float64) / clock.rate
    kept = np.ones(count, dtype=bool)
    lost = min(clock.lost, count // FEWEST)  # of a test that a limit ended soon
    while count - np.count_nonzero(kept) < lost:
        place = int(draw.integers(1, count - TOGETHER))
        kept[place : place + int(draw.integers(1, TOGETHER + 1))] = False
    times = begin + stamps / (1.0 + clock.fast)
    tick = np.floor(times / interval + 1e-9).astype(np.int64)
    rows = {
        name: np.asarray(run.columns[topic][name], dtype=np.float64).reshape(-1)[tick]
        for topic, name in computed(run, plan)
    }
    noise, place = levels(case.truths), 0
    for role, kind in kinds.kinds_of(plan).items():
        fine, seen = between_ticks(case, run, role)
        for row in kind.channels.measured:
            generator = lots.generator(case.seed, "logger", role, row.name)
            at = times + place * clock.apart
            values = seen[row.name]
            if clock.filter is not None:
                values = behind(values, clock.filter, fine)
            sampled = np.interp(at, fine * np.arange(values.size), values)
            rows[row.name] = read_by(logger, clock.rate, row, sampled, noise[row.name], generator)
            place += 1
    return stamps[kept], {name: values[kept] for name, values in rows.items()}


def computed(run: Run, plan: Plan) -> list[tuple[str, str]]:
    """Topic and name of the numbers that the controllers computed; of one that two have, the slave's."""
    channels = {role: kind.channels for role, kind in kinds.kinds_of(plan).items()}
    read_ = {name for own in channels.values() for name in own.names}
    found = {
        row.name: topic
        for topic, rows in kinds.topics(plan).items()
        for row in (rows if topic in (MASTER, *plan.roles) else ())
        if row.kind in (FieldType.NUMBER, FieldType.STOREYS) and row.name not in read_ | {TIME.name}
    }
    return [(topic, name) for name, topic in found.items() if name in run.columns[topic]]


def between_ticks(case: Case, run: Run, role: str) -> tuple[float, dict[str, Array]]:
    """A laboratory's readings without noise under the recorded commands: their distance in s, and values by signal."""
    true = reality(case, silent=True).of(role)
    rig = true.master if role == MASTER else true.slave
    if not rig.class_ or true.plan.storeys > 1:
        raise InputError(
            "Loggers with a clock of their own are for plans of one storey whose laboratories are columns or tables."
        )
    where = f"[{role}.rig]"
    interval = true.plan.test.interval
    options = {"interval": interval, "seed": case.seed} | rig.options
    lab = construct(find(rig.class_, true.base, where), options, where, {**METHODS, "between": ()})
    channels = kinds.kind_of(true.plan, role).channels
    rows = [np.array([list(lab.read())])]
    for values in zip(*(run.columns[role][name].tolist() for name in channels.drives), strict=True):
        lab.write(command_of(channels)(*values))
        rows.append(lab.between())
    fine = interval / len(rows[-1])
    return fine, dict(zip(channels.names, np.concatenate(rows).T, strict=True))


def read_by(
    logger: Logger, rate: float, row: Signal, values: Array, level: float, generator: np.random.Generator
) -> Array:
    """Sampled values (rows,) of a channel with hum, noise, of the rms `level`, and steps of the converter."""
    peak = float(np.max(np.abs(values), initial=0.0))
    phase, spread = generator.uniform(0.0, 2.0 * math.pi), generator.uniform(*np.log(RANGE))
    hum = np.sin(2.0 * math.pi * MAINS / rate * np.arange(values.size) + phase)
    sensed = values + logger.hum * peak * hum
    sensed = sensed + level * COLOURS[logger.colour](generator, values.size, rate)
    if logger.bits and peak > 0.0:
        sensed = converted(sensed, float(np.exp(spread)) * peak, logger.bits)
    return rounded(sensed, DECIMALS[row.unit]) if logger.printed else sensed


def behind(values: Array, filter_: AnalogueFilter, fine: float) -> Array:
    """Values (n,), one every `fine` s, behind an analogue filter that starts in its steady state.

    The bilinear transform bends frequencies by a part of (π·f·fine)²/3, less than 10⁻⁴ where anything moves.
    """
    from scipy import signal

    design = {"butterworth": signal.butter, "bessel": lambda *a, **k: signal.bessel(*a, norm="mag", **k)}
    sections = design[filter_.type](filter_.order, filter_.cutoff, fs=1.0 / fine, output="sos")
    sections[0, :3] /= np.prod(sections[:, :3].sum(axis=1) / sections[:, 3:].sum(axis=1))
    passed, _ = signal.sosfilt(sections, values, zi=values[0] * signal.sosfilt_zi(sections))
    return np.asarray(passed)


def stated(plan: Plan, rows: Mapping[str, Array], filter_: AnalogueFilter | None, given: str) -> str:
    """The map of a logger's file, as TOML; `given` is the file of the plan."""
    lines = [f'plan = "{given}"', f'time = "{STAMP}"', "", "[signals]"]
    passed = ""
    if filter_ and filter_.stated:
        passed = (
            f', filter = {{ type = "{filter_.type}", order = {filter_.order}, cutoff = {filter_.cutoff} }}'
        )
    measured = {name for kind in kinds.kinds_of(plan).values() for name in kind.channels.names}
    lines += [f'{name} = {{ column = "{name}"{passed if name in measured else ""} }}' for name in rows]
    return "\n".join(lines) + "\n"
