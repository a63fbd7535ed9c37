"""The size of a single effect: its change of a part's outputs under the recorded inputs, over the noise.

The laboratory that has the effect, or the building, is simulated with and without it under the recorded inputs,
without noise. The rms of each signal's difference is divided by the rms of its true noise; the largest ratio counts.
The size of an effect of the link is measured by the messages that it changed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from common.plan import read as plans
from common.recording.reader import read
from common.recording.run import Run, Values
from common.rig import command_of
from common.roles import MASTER
from laboratories.effects.sites import LINK
from laboratories.kinds import kind_of, kinds_of
from loop.names import sent_names
from validation.blind.cases.case import Case, Laid, of_role, reality

Differences = list[tuple[Values, float]]  # each with the rms noise to compare with


def sizes(case: Case, path: Path) -> tuple[float, ...]:
    """Residual to noise of every effect of a case by itself, in their order."""
    if not case.laid:
        return ()
    run = read(path)
    return tuple(size(case, item, run) for item in case.laid)


def size(case: Case, item: Laid, run: Run) -> float:
    """Residual to noise of one effect."""
    plan = plans.from_tables(case.plan, Path())
    if not all(map(run.has, (MASTER, *plan.roles))):
        return float("nan")
    if item.site == LINK:
        found = messages(case, run, item.role)
    elif item.role:
        found = of_laboratory(case, item, run)
    else:
        found = of_building(case, item, run)
    ratios = (
        float(np.sqrt(np.mean(values**2))) / level for values, level in found if values.size and level > 0.0
    )
    return max(ratios, default=0.0)


def levels(case: Case, role: str) -> dict[str, float]:
    """True rms noise of the readings of a role's laboratory."""
    kind = kind_of(plans.from_tables(case.plan, Path()), role)
    own = of_role(case.truths, role).get("device", {}).get("noise", {})
    return {name: own.get(name, case.truths["sensors"].get(name, 0.0)) for name in kind.channels.names}


def of_laboratory(case: Case, item: Laid, run: Run) -> Differences:
    """Changes of the readings of the laboratory that has an effect, under the recorded commands."""
    with_effect, without = (play(case, laid, run, item.role) for laid in ((item,), ()))
    noise = levels(case, item.role)
    return [(values - without[name], noise[name]) for name, values in with_effect.items()]


def play(case: Case, laid: tuple[Laid, ...], run: Run, role: str) -> dict[str, Values]:
    """A laboratory's readings under the recorded commands."""
    from loop import rigs

    kind = kind_of(plans.from_tables(case.plan, Path()), role)
    rig = rigs.build(reality(case, laid, silent=True).of(role), role)
    drives = (run.columns[role][name].tolist() for name in kind.channels.drives)
    rig.arm()
    readings = []
    for values in zip(*drives, strict=True):
        readings.append(rig.read())
        rig.write(command_of(kind.channels)(*values))
    rig.disarm()
    table = np.array(readings, dtype=np.float64).reshape(len(readings), len(kind.channels.names))
    return {name: table[:, place] for place, name in enumerate(kind.channels.names)}


def of_building(case: Case, item: Laid, run: Run) -> Differences:
    """Changes of the building's targets by an effect, under the recorded measurements.

    A target is computed and has no noise, so it is compared with the noise of the measured position.
    """
    with_effect, without = (play_building(case, laid, run) for laid in ((item,), ()))
    kinds = kinds_of(plans.from_tables(case.plan, Path()))
    noise = {role: levels(case, role)[kind.channels.position] for role, kind in kinds.items()}
    noise[""] = case.truths["sensors"]["table_acceleration"]
    return [(values - without[role], noise[role]) for role, values in with_effect.items()]


def play_building(case: Case, laid: tuple[Laid, ...], run: Run) -> dict[str, Values]:
    """The building's targets for each role's laboratory, and the ground acceleration (no role)."""
    from validation.blind.cases.computed import building

    plan = plans.from_tables(case.plan, Path())
    kinds, columns = kinds_of(plan), run.columns[MASTER]
    step = building(reality(case, laid, silent=True), laid)
    ticks = run.ticks(MASTER)
    nothing = np.zeros(ticks)
    felt = [nothing, nothing]
    if MASTER in kinds:
        own = kinds[MASTER].channels
        felt = [columns[own.position], columns[own.force]]
    used = [share_of(run, role, kinds[role].channels.used) for role in plan.roles]
    forces = np.stack(used, axis=1) if used else np.zeros((ticks, 0))
    inputs = zip(*(values.tolist() for values in (*felt, forces)), strict=True)
    outputs = [step(tick, *values) for tick, values in enumerate(inputs)]
    found = {"": np.array([row.ground_acceleration for row in outputs])}
    if MASTER in kinds:
        found[MASTER] = np.array([row.target for row in outputs])
    for place, role in enumerate(plan.roles):
        found[role] = np.array([row.sent[place][0] for row in outputs])
    return found


def share_of(run: Run, role: str, name: str) -> Values:
    """The column of a slave among the master's."""
    return run.of(role).columns[MASTER][name]


def messages(case: Case, run: Run, role: str) -> Differences:
    """Values of the messages that were used minus those of messages without delay or loss."""
    plan = plans.from_tables(case.plan, Path())
    channels, noise, slave = kind_of(plan, role).channels, levels(case, role), run.columns[role]
    ticks = min(run.ticks(MASTER), run.ticks(role))
    on_time = np.concatenate([[0.0], slave[channels.force][: ticks - 1]]) if ticks else np.zeros(0)
    target = sent_names(plan)[role][0]
    return [
        (share_of(run, role, channels.used)[:ticks] - on_time, noise[channels.force]),
        (
            slave[channels.target.name][:ticks] - share_of(run, role, target)[:ticks],
            noise[channels.position],
        ),
    ]
