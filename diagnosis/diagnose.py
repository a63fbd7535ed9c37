"""The diagnosis of a recording: commissioning, where, which, how far."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from common.errors import InputError
from common.plan.kinds import COLUMN
from common.recording.imported import exchange_known
from common.terminal.telling import Tell, untold
from diagnosis.findings import report, where
from diagnosis.findings.certainty.other_causes import small
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.logged import building, delays, filters, logger, means, shapes, start
from diagnosis.findings.sensors import jumps, outliers, readings, staircases, swaying, uneven_noise
from diagnosis.findings.sensors.loud_noise import no_noise
from diagnosis.findings.sensors.noise_levels import lines_rms, noise_rms, sensors_rms
from diagnosis.findings.sensors.readings import SensorFinding
from diagnosis.findings.sensors.staircases import Stairs
from diagnosis.findings.verdict import (
    UNNAMED,
    WITHOUT_GAP,
    PartVerdict,
    seen_in,
)
from diagnosis.fits import residuals
from diagnosis.fits.residuals import Data
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search
from diagnosis.learned.learn import learn
from diagnosis.recorded.divided import BUILDING, driven, parts_of, used
from diagnosis.recorded.ground import Ground
from diagnosis.recorded.joined import joined, laboratory_of, refuse_others
from diagnosis.recorded.link import effects as link_effects
from diagnosis.recorded.link import exchange
from diagnosis.recorded.link.exchange import LinkFinding
from diagnosis.recorded.missing_rows import unjudged
from diagnosis.recorded.parts import LaboratoryPart, Part
from diagnosis.recorded.record import LEAST_TICKS, Record
from models.registry import Array
from models.system import System

# s. A shorter recording is not judged: it holds less than one period of the default building's first mode (2 Hz).
SHORTEST = 0.5
# Correlation of a reading with its prediction below which its sign is doubted. It is that of two sines 135° apart,
# which no delay of a stable test reaches: the compensated loop is unstable long before.
AGAINST = -0.7


def diagnose(
    records: Mapping[str, Record],
    validation: Mapping[str, Sequence[Record]],
    tell: Tell = untold,
    require: float | None = None,
    more: Mapping[str, Sequence[Record]] = MappingProxyType({}),
) -> dict[str, report.Judged]:
    """The reports on a test by role of the slave, without their verdicts in words, each with its findings.

    Each report covers the master and one slave; its closed loop holds the other slaves as they were diagnosed. A test
    without slaves has one report, under the master's role. `require` is the gap that may be left in each part. Effects
    must also explain `more` recordings of the same laboratories, if given; the report shows the first recording.

    Raises:
        InputError: the recording holds nothing that a model of the plan could predict, or one of `more` is not of the
            same laboratories.
    """
    # The matrices are small, so that several BLAS threads would only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        found = {
            role: examine(put_right(record), tell, [*map(put_right, more.get(role, ()))])
            for role, record in records.items()
        }
        systems = {role: item.systems(noisy=False)[role] for role, item in found.items()}
        return {
            role: report.build(
                replace(item, record=among(item.record, systems)),
                [among(start.begun(other), systems) for other in validation.get(role, ())],
                tell,
                require,
            )
            for role, item in found.items()
        }


def put_right(record: Record) -> Record:
    """A record on the clock of its commands, with what its logger did to its readings and its map does not state."""
    timed = logger.clocked(logger.whole(record))
    return start.begun(shapes.shaped(means.averaged(delays.delayed(filters.filtered(timed)))))


def among(record: Record, systems: Mapping[str, System]) -> Record:
    """The record of one slave, with the others as they were found."""
    if record.whole is None:
        return record
    others = {role: system for role, system in systems.items() if role != record.whole.role}
    return replace(record, whole=replace(record.whole, others=others))


class JudgedParts(NamedTuple):
    """The parts of a recording as they were judged, in the order of the test."""

    datas: list[Data]
    verdicts: list[PartVerdict]
    steps: Mapping[str, float]  # from one value of a reading to the next, by signal
    hidden: Mapping[str, Stairs]  # those of these steps that noise hides


def examine(record: Record, tell: Tell = untold, more: Sequence[Record] = ()) -> Diagnosis:
    """Judge every part of a recording, its laboratories in `more` recordings of them as well."""
    refuse_others(record, more)
    if record.ticks < LEAST_TICKS or record.ticks * record.plan.test.interval < SHORTEST:
        return Diagnosis(record)
    parts = parts_of(record)
    if not parts:
        raise InputError(
            "The recording holds no part's input and output together: record at least one of "
            f"{' or '.join(name for lab in record.labs for name in lab.commands)} with a reading of that laboratory, "
            "or column_displacement with column_force."
        )
    rounded, logged = readings.steps(record), record.stated is not None
    found = judge_parts(record, parts, [part for other in more for part in parts_of(other)], rounded, tell)
    held = (
        {} if record.static else readings.held(record, found.steps)
    )  # a curve may stand still where it turns
    noisy = readings.findings(
        record, rms_by_signal(found.verdicts, sensors_rms), rounded, found.steps, logged=logged
    )
    verdicts, noisy = machines_first(record, found.verdicts, noisy)
    loud = rms_by_signal(verdicts, noise_rms)
    sensors = [*noisy, *staircases.findings(found.hidden, record, logged=logged)]
    aside = {*held, *(record.catalogue[item.effect].signal for item in sensors), *logger.blurred(verdicts)}
    verdicts = [with_own_error(verdict, aside) for verdict in verdicts]
    result = Diagnosis(
        record,
        verdicts,
        sensors,
        exchanged(record),
        {} if logged else held,  # a logger's steps repeat samples too
        readings.floors(loud, found.steps, sensors, record),
        rms_by_signal(verdicts, lines_rms),
        remarks(record, more, found.datas, verdicts, held),
        [law for verdict in verdicts if learnable(verdict) for law in learn(verdict.search.chosen)],
    )
    return replace(result, warnings=[*result.warnings, *logger.remarks(result)])


def judge_parts(
    record: Record, parts: Sequence[Part], further: Sequence[Part], rounded: Mapping[str, float], tell: Tell
) -> JudgedParts:
    """Judge each part, with the same part of other recordings among `further`.

    A part that tells the delay of a data logger is judged before those that are judged behind that delay. One whose
    verdict shows steps of a reading that noise hides, beside those `rounded`, is judged again with them.
    """
    steps = readings.resolutions(record, rounded) | logger.interpolated(parts)
    datas, verdicts, hidden = list[Data](), list[PartVerdict](), dict[str, Stairs]()
    late = None if record.stated is None else record.late
    for number, given in enumerate(parts, 1):
        part = given if late is None or not isinstance(given, LaboratoryPart) else given.logged(late)
        tell(part.name, number, len(parts))
        data, verdict = judge_part(part, further, record, steps)
        if anew := staircases.hidden(verdict.search, record):
            hidden, steps = hidden | anew, steps | {name: stairs.step for name, stairs in anew.items()}
            data, verdict = judge_part(part, further, record, steps)
        datas.append(data)
        verdicts.append(verdict)
        late = late and logger.later(late, verdict, record)
    return JudgedParts(datas, verdicts, steps, hidden)


def remarks(
    record: Record,
    more: Sequence[Record],
    datas: Sequence[Data],
    verdicts: Sequence[PartVerdict],
    held: Mapping[str, float],
) -> list[str]:
    """Sentences on what a recording can show, and on what is doubtful in its readings and verdicts."""
    return [
        *of_several(more),
        *of_plan(record),
        *not_recorded(record),
        *unjudged([data.part for data in datas], record),
        *reversed_signs(datas),
        *repeating(held),
        *outliers.told(verdicts),
        *uneven_noise.told(verdicts),
        *(verdict.own.text for verdict in verdicts if verdict.own is not None and verdict.own.text),
        *doubted(verdicts),
        *drifting(verdicts),
        *calibrated(verdicts),
        *where.undecided(verdicts),
    ]


def with_own_error(verdict: PartVerdict, aside: Collection[str]) -> PartVerdict:
    """The verdict on a laboratory without a larger gap, with an error of one reading by itself as an unknown effect.

    Such an error moves nominal parameters a little, so that small gaps of other readings may follow from it. Of
    readings `aside` something else is known.
    """
    part, search = laboratory_of(verdict.search.data.part), verdict.search
    if part is not None and verdict.outcome == "explained":
        return uneven_noise.doubting(verdict, part, aside)
    slight = verdict.outcome == "unknown" and not verdict.effects and small(search)
    if (
        part is None
        or verdict.drifting
        or verdict.calibrated
        or not (slight or verdict.outcome in WITHOUT_GAP)
    ):
        return verdict
    own = (
        outliers.own_error(verdict, part)
        or jumps.own_error(verdict, part)
        or swaying.own_error(verdict, part)
        or uneven_noise.own_error(verdict, part, aside)
    )
    if own is None or (slight and own.ratio < search.left):
        return verdict
    return replace(verdict, outcome="unknown", own=own)


def learnable(verdict: PartVerdict) -> bool:
    """Whether something without a name is left that a law could tell: an error of one reading by itself has none."""
    return verdict.outcome in UNNAMED and verdict.own is None


def rms_by_signal(verdicts: Sequence[PartVerdict], of: Callable[[Search], Array]) -> dict[str, float]:
    """Rms noise of every reading by signal, in each part what `of` says of its search."""
    searches = [item.search for item in verdicts]
    return readings.levels([item.data for item in searches], list(map(of, searches)))


def machines_first(
    record: Record, verdicts: Sequence[PartVerdict], noisy: Sequence[SensorFinding]
) -> tuple[list[PartVerdict], list[SensorFinding]]:
    """The verdicts and the noise found on sensors, without noise that something else makes.

    Noise that a machine's motion or an effect makes is told by the verdict on its part. Noise beside effects that
    follows the motion is left by these, which then explain in part only.
    """
    signal = {item: record.catalogue[item.effect].signal for item in noisy if item.parameter == "rms"}
    usual = {name: item.usual for item, name in signal.items()}
    result, none = [], set[str]()
    for verdict in verdicts:
        if moved := no_noise(verdict, usual, Scales(record)):
            none |= set(verdict.search.data.part.signals)
            result.append(moved)
        else:
            moved, left = uneven_noise.beside_effects(verdict, usual)
            none |= left
            result.append(moved)
    return result, [item for item in noisy if signal.get(item) not in none]


def judge_part(
    part: Part, further: Sequence[Part], record: Record, steps: Mapping[str, float]
) -> tuple[Data, PartVerdict]:
    """Residuals of a part and the verdict on it, which the same part of other recordings decides as well."""
    scales = Scales(record, part.shift() if isinstance(part, Ground) else 0.0)
    data = residuals.prepare(part, record, steps)
    whole = joined(part, further, data.group)
    joint = data if whole is part else residuals.prepare(whole, record, steps)
    return data, seen_in(data, building.verdict_on(joint, scales, building.other_view(part, record, steps)))


def exchanged(record: Record) -> list[LinkFinding]:
    """Effects of the link that the messages' numbers and time stamps show, where both ends were recorded."""
    if not (record.run.has("master") and record.run.has("slave") and exchange_known(record.run)):
        return []
    account = exchange.account(record.run, record.plan.test.interval)
    return link_effects.findings(account, record.plan.test.interval)


def of_several(more: Sequence[Record]) -> list[str]:
    """A sentence where several recordings were searched at once."""
    names = ", ".join(str(other.run.path) for other in more)
    return [f"The laboratories' causes explain this recording and {names}."] if more else []


def of_plan(record: Record) -> list[str]:
    """A sentence where the recording was made under another plan, and one where it is judged up to a hold only."""
    found = []
    if record.other_plan:
        found.append(
            "The plan given has another structure, compensation or control than the recording's own plan: "
            "the response gap includes this difference."
        )
    if record.held is not None:
        found.append(
            f"The test was held at {record.held:.3f} s: what is judged lies before, because from there on forces "
            "were not measured at the rate of the test."
        )
    return found


def doubted(verdicts: Sequence[PartVerdict]) -> list[str]:
    """A sentence for each gap that might also be slow noise of a single sensor."""
    return [
        f"What {verdict.doubted} shows and no effect explains might also be slow noise of its sensor, although no "
        "other sensor of its laboratory has such noise. Readings at rest would tell."
        for verdict in verdicts
        if verdict.doubted
    ]


def drifting(verdicts: Sequence[PartVerdict]) -> list[str]:
    """A sentence for each reading whose zero drifts by less than can be seen."""
    return [
        f"The zero of {signal} drifts by less than can be seen beside its noise, which counts as no gap."
        for verdict in verdicts
        for signal in verdict.drifting
    ]


def calibrated(verdicts: Sequence[PartVerdict]) -> list[str]:
    """A sentence for each reading whose gain is taken for the calibration of its channel."""
    return [
        f"The gain of {signal} is off by no more than the channels of a data logger are as a rule, which counts as no "
        "gap: state its `calibration` in the import map to have it judged."
        for verdict in verdicts
        for signal in verdict.calibrated
    ]


def repeating(held: Mapping[str, float]) -> list[str]:
    """A sentence for each sensor that repeats samples."""
    return [
        f"The sensor {name} repeats {100 * share:.2g} % of its samples exactly, so it misses samples."
        for name, share in held.items()
    ]


def reversed_signs(datas: Sequence[Data]) -> list[str]:
    """A sentence for each reading whose sign is opposite to what the plan's model predicts."""
    result = []
    for data in datas:
        predicted = data.part.predict(data.system)
        for name, there, read, said in zip(
            data.part.signals, data.part.present.T, data.part.measured.T, predicted.T, strict=True
        ):
            if there.sum() < LEAST_TICKS or np.ptp(read[there]) == 0.0 or not np.ptp(said[there]) > 0.0:
                continue
            if np.corrcoef(read[there], said[there])[0, 1] < AGAINST:
                result.append(
                    f"{name} has the opposite sign of what the plan predicts: check its sign and the command's."
                )
    return result


def not_recorded(record: Record) -> list[str]:
    """What cannot be judged for lack of signals, in sentences."""
    result = []
    if record.plan.foreign:
        result.append(
            f"'{record.plan.structure.model}' computed the building, which is not judged: the gap is that of the "
            "laboratories by themselves, each from what it was told."
        )
    for lab in record.labs:
        if lab.kind.name == COLUMN and not driven(record, lab) and record.has(*lab.measured):
            (command,) = lab.commands
            result.append(f"{command} was not recorded, so the actuator cannot be judged.")
    if record.run.has("master") and record.run.has("slave") and not exchange_known(record.run):
        result.append("The recording holds no message numbers or time stamps, so the link cannot be judged.")
    if record.worked_out:
        result.append(
            f"Not recorded, and worked out from the plan's control: {', '.join(record.worked_out)}. Record it to have "
            "the control judged apart from the laboratory."
        )
    unused = [name for name in used(record) if not record.has(name)]
    if record.has(*BUILDING) and unused and not record.plan.foreign:
        result.append(f"The building cannot be judged without {' and '.join(unused)}.")
    missing = [name for lab in record.labs for name in lab.measured if not record.has(name)]
    if missing:
        result.append(
            f"Not recorded: {', '.join(missing)}. Effects that only these signals show cannot be found."
        )
    return result
