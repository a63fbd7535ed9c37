"""How large an effect is on its own: what it does to a part that is given the recorded inputs, over the noise.

Both laboratories and the building are played with and without the effect, sensors silent, on the inputs
that the recording holds. Of each signal the rms of the difference is divided by the rms of its true
noise; the largest counts. The size of an effect of the link is measured by the messages that it changed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from common.plan.plan import Plan
from common.recording.reader import Run, Values, read
from common.rig import ColumnCommand, ColumnMeasurement, TableCommand, TableMeasurement
from common.roles import MASTER, SLAVE
from validation.blind.draw import Case, Laid
from validation.blind.library import role_at

FORCE_NOISE = "damper_force"
# a signal that is computed, not read, is compared with the noise of the reading beside it
COMPUTED = {
    "column_target": "column_displacement",
    "table_target": "table_displacement",
    "ground_acceleration": "table_acceleration",
}


def sizes(case: Case, path: Path) -> tuple[float, ...]:
    """Residual to noise of every effect of a case by itself, in their order."""
    if not case.laid:
        return ()
    run = read(path)
    return tuple(size(case, item, run) for item in case.laid)


def size(case: Case, item: Laid, run: Run) -> float:
    """Residual to noise of one effect."""
    if not (run.has("master") and run.has("slave")):
        return float("nan")
    noise = case.truths["sensors"]
    if item.site == "link":
        return max(_ratios(_messages(run), noise), default=0.0)
    play = {MASTER: play_a, SLAVE: play_b}.get(role_at(item.site, Plan()), play_building)
    with_effect, without = play(case, (item,), run), play(case, (), run)
    difference = {name: values - without[name] for name, values in with_effect.items()}
    return max(_ratios(difference, noise), default=0.0)


def _ratios(difference: dict[str, Values], noise: dict[str, Any]) -> list[float]:
    result = []
    for name, values in difference.items():
        level = noise[COMPUTED.get(name, name)]
        if values.size and level > 0.0:
            result.append(float(np.sqrt(np.mean(values**2))) / level)
    return result


def play_a(case: Case, laid: tuple[Laid, ...], run: Run) -> dict[str, Values]:
    """Laboratory A's readings on the recorded commands."""
    from master.assembly import build_rig
    from validation.blind.record import reality

    commands = [ColumnCommand(value) for value in run.columns["master"]["actuator_command"].tolist()]
    return _played(build_rig(reality(case, laid, silent=True)), commands, ColumnMeasurement._fields)


def play_b(case: Case, laid: tuple[Laid, ...], run: Run) -> dict[str, Values]:
    """Laboratory B's readings on the recorded commands."""
    from slave.assembly import build_rig
    from validation.blind.record import reality

    columns = run.columns["slave"]
    pairs = zip(columns["table_command"].tolist(), columns["damper_command"].tolist(), strict=True)
    commands = [TableCommand(*pair) for pair in pairs]
    return _played(build_rig(reality(case, laid, silent=True).of(SLAVE)), commands, TableMeasurement._fields)


def _played(rig: Any, commands: list[Any], names: tuple[str, ...]) -> dict[str, Values]:
    rig.arm()
    readings = []
    for command in commands:
        readings.append(rig.read())
        rig.write(command)
    rig.disarm()
    table = np.array(readings, dtype=np.float64).reshape(len(commands), len(names))
    return {name: table[:, place] for place, name in enumerate(names)}


def play_building(case: Case, laid: tuple[Laid, ...], run: Run) -> dict[str, Values]:
    """What the building wants, on the recorded measurements."""
    from master.assembly import master_step
    from validation.blind.record import reality

    step = master_step(reality(case, laid, silent=True))
    columns = run.columns["master"]
    inputs = zip(
        columns["column_displacement"].tolist(),
        columns["column_force"].tolist(),
        ([force] for force in columns["damper_force_used"].tolist()),
        strict=True,
    )
    outputs = [step(tick, *values) for tick, values in enumerate(inputs)]
    return {
        "column_target": np.array([row.target for row in outputs]),
        "table_target": np.array([row.sent[0][0] for row in outputs]),
        "ground_acceleration": np.array([row.ground_acceleration for row in outputs]),
    }


def _messages(run: Run) -> dict[str, Values]:
    """The messages that arrived minus those that would have arrived in time."""
    master, slave = run.columns["master"], run.columns["slave"]
    ticks = min(run.ticks("master"), run.ticks("slave"))
    on_time = np.concatenate([[0.0], slave["damper_force"][: ticks - 1]]) if ticks else np.zeros(0)
    return {
        FORCE_NOISE: master["damper_force_used"][:ticks] - on_time,
        "table_target": slave["table_target"][:ticks] - master["table_target"][:ticks],
    }
