"""The shape of a filter that readings of a logger passed, which its import map does not state."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from scipy.interpolate import CubicSpline

from common.recording.imported import IMPORT, NOTHING_STATED, ImportedChannel
from common.recording.logger.low_pass import LoggerFilter
from common.roles import MASTER
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.logged import filters, logger, means, shapes
from diagnosis.fits import fitting, residuals, settling, worth
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.recorded.record import NOT_LATE, Delay, Late, Record
from loop import replay
from models.registry import Array
from models.system import System
from tests.diagnosis.cases import UNKNOWN_TO_A_LOGGER, Cases, lab_a, lab_b, white

STEPS = 20  # of an interval, in which the laboratories move here
INTERVAL = 0.002  # s
RATE = STEPS / INTERVAL  # Hz
SECONDS = 6.0
NOISE = 2e-3  # of a reading's rms
Passed = Callable[[Array], Array]


def sections(rows: Array) -> Passed:
    """A digital filter of second-order sections that had seen the first value ever before, with a gain of one."""
    gain = float(np.prod(rows[:, :3].sum(axis=1) / rows[:, 3:].sum(axis=1)))
    return lambda x: np.asarray(signal.sosfilt(rows, x - x[0], axis=0) / gain + x[0])


def weighted(*weights: Array) -> Passed:
    """Filters of finite length, one after another."""
    return lambda x: (
        x[0] + np.asarray(signal.lfilter(np.ravel(signal_chain(*weights)), [1.0], x - x[0], axis=0))
    )


def signal_chain(first: Array, *others: Array) -> Array:
    """The weights of filters of finite length that follow one another."""
    for other in others:
        first = np.convolve(first, other)
    return first


BOX = np.convolve(np.full(2 * STEPS, 0.5 / STEPS), [0.5, 0.5])  # a mean over two intervals
SHARP = signal.firwin(16 * STEPS + 1, 200.0, fs=RATE)  # a converter's own
SHARP_LATE = 8 * INTERVAL  # s
ELLIPTIC = sections(signal.ellip(6, 0.1, 60.0, 70.0, fs=RATE, output="sos"))
RIPPLING = sections(signal.cheby1(4, 0.5, 100.0, fs=RATE, output="sos"))
BUTTERWORTH = sections(signal.butter(4, 120.0, fs=RATE, output="sos"))


def finely(part: LaboratoryPart) -> Array:
    """What the laboratory of the plan reads, (ticks · STEPS, channels), in steps of an interval."""
    none = np.zeros(len(part.measured))
    command, effort = (*(part.inputs[name] for name in part.devices), none)[:2]
    before = np.append(0.0, command[:-1])
    shares = np.arange(1, STEPS + 1) / STEPS
    ramps = (before[:, None] + (command - before)[:, None] * shares).ravel()
    plan = part.lab.plan
    fine = replace(plan, test=replace(plan.test, interval=INTERVAL / STEPS))
    return replay.motion(
        part.lab.kind, System(fine).unread, np.column_stack([ramps, np.repeat(effort, STEPS)])
    )


def logged(
    whole: Record,
    passed: Passed,
    early: float = 0.0,
    stated: Mapping[str, float] | None = None,
    factor: float = 1.0,
) -> Record:
    """An import of the laboratories of the plan behind a logger's filter, with the same statement on each channel.

    The logger takes a delay of `early` s off. The table has `factor` times the planned
    frequency and damping.
    """
    signals = {name: values for name, values in whole.signals.items() if name not in UNKNOWN_TO_A_LOGGER}
    channels: dict[str, dict[str, Mapping[str, float]]] = {}
    taken = round(early * RATE)
    for number, part in enumerate((lab_a(whole), lab_b(whole))):
        plan = part.lab.plan
        frequency, damping = factor * plan.table.frequency, factor * plan.table.damping_ratio
        table = replace(plan.table, frequency=frequency, damping_ratio=damping)
        fine = finely(part.replaced(lab=replace(part.lab, plan=replace(plan, table=table))))
        read = np.concatenate([passed(fine)[taken:], fine[len(fine) - taken :]])[::STEPS]
        noise = NOISE * np.std(read, axis=0) * white(40 + number, *read.shape)
        signals |= dict(zip(part.signals, (read + noise).T, strict=True))
        role = MASTER if part.role == MASTER else "slave"
        channels[role] = dict.fromkeys(part.lab.kind.channels.names, stated or {})
    metadata = {IMPORT: {"data": "a.csv", "channels": json.dumps(channels if stated else {})}}
    return replace(whole, signals=signals, run=replace(whole.run, metadata=whole.run.metadata | metadata))


def channels_of(found: Record) -> set[ImportedChannel]:
    """What the readings of a record passed."""
    return set(found.passed.values())


def gapless(found: Record) -> bool:
    """Whether nothing is left of any reading of a record behind what was found."""
    fits = [
        fitting.fit(residuals.prepare(lab.logged(found.late), found), {})
        for lab in (lab_a(found), lab_b(found))
    ]
    return not any(worth.is_gap(settling.settled(fit)) for fit in fits)


@pytest.fixture(scope="module")
def whole(cases: Cases) -> Record:
    """A recording of the laboratories of the plan."""
    return cases.record(seed=0, duration=SECONDS)


@pytest.mark.long
@pytest.mark.parametrize(
    ("passed", "kinds", "late"),
    [
        pytest.param(ELLIPTIC, {"elliptic", "chebyshev"}, 8.2e-3, id="elliptic"),
        pytest.param(RIPPLING, {"elliptic", "chebyshev"}, 4.3e-3, id="chebyshev"),
        pytest.param(BUTTERWORTH, {"butterworth"}, 3.47e-3, id="butterworth"),
    ],
)
def test_the_filter_of_a_logger_is_told_by_all_frequencies(
    passed: Passed, kinds: set[str], late: float, whole: Record
) -> None:
    record = logged(whole, passed)
    found = shapes.shaped(filters.filtered(record))
    (channel,) = channels_of(found)
    assert channel.filter is not None
    assert channel.filter.type in kinds
    assert channel.late == pytest.approx(late, rel=0.08)
    assert gapless(found)
    (said,) = logger.passed(Diagnosis(found))
    assert channel.filter.type.title() in said
    assert list(found.passed) == sorted(found.passed)  # of a set in any order, whose names are printed


@pytest.mark.long
def test_means_of_means_are_told_from_one_mean(whole: Record) -> None:
    found = shapes.shaped(filters.filtered(logged(whole, weighted(BOX, BOX, BOX))))
    (channel,) = channels_of(found)
    assert channel.average == pytest.approx(4e-3, rel=0.05)
    assert channel.means == 3
    (said,) = means.remarks(Diagnosis(found))
    assert "`average` with `means = 3`" in said


@pytest.mark.long
def test_a_stated_delay_may_be_that_of_a_filter_without_another_trace(whole: Record) -> None:
    record = logged(whole, weighted(SHARP), stated={"delay": SHARP_LATE})
    found = shapes.shaped(means.averaged(record))
    assert channels_of(found) == {replace(NOTHING_STATED, smooth=True)}
    assert gapless(found)


@pytest.mark.long
def test_a_converter_may_take_off_the_delay_of_its_filter(whole: Record) -> None:
    record = logged(whole, weighted(SHARP), early=SHARP_LATE)
    found = shapes.shaped(filters.filtered(record))
    assert channels_of(found) == {replace(NOTHING_STATED, smooth=True)}
    assert found.late == NOT_LATE
    assert gapless(found)
    (said,) = shapes.remarks(Diagnosis(found))
    assert "damper_force" in said
    assert "show nothing of what machines do between the ticks" in said


def test_readings_at_the_ticks_passed_nothing(whole: Record) -> None:
    found = shapes.shaped(filters.filtered(logged(whole, lambda x: x)))
    assert (found.passed, found.late) == ({}, NOT_LATE)
    assert shapes.remarks(Diagnosis(found)) == []


@pytest.mark.long
def test_a_slow_table_is_no_filter_of_the_logger(cases: Cases) -> None:
    """Neither by itself nor beside a laboratory without a fault, although a filter would do as much to its motion."""
    slow = cases.record({"table.bandwidth": {"factor": 0.8}}, seed=0, duration=SECONDS)
    metadata = {IMPORT: {"data": "a.csv", "channels": "{}"}}
    record = replace(slow, run=replace(slow.run, metadata=slow.run.metadata | metadata))
    alone = replace(record, labs=tuple(lab for lab in record.labs if lab.role != MASTER))
    for one in (record, alone):
        assert shapes.shaped(filters.filtered(one)).passed == {}


@pytest.mark.long
def test_a_stated_delay_beside_a_table_at_fault_is_a_delay(whole: Record) -> None:
    """A filter that is late by as much would tell a part of what the table does."""
    late = round(3e-3 * RATE)
    record = logged(
        whole,
        lambda x: np.concatenate([np.repeat(x[:1], late, axis=0), x[:-late]]),
        stated={"delay": 3e-3},
        factor=0.8,
    )
    alone = replace(record, labs=tuple(lab for lab in record.labs if lab.role != MASTER))
    for one in (record, alone):
        assert not any(found.filter or found.average for found in channels_of(shapes.shaped(one)))


@pytest.mark.long
def test_all_readings_passed_what_some_of_them_did_where_that_is_likelier(whole: Record) -> None:
    record = logged(whole, RIPPLING)
    found = shapes.shaped(replace(record, late=Late(motion=Delay(4.3e-3))))  # nothing is known of forces
    assert len(found.passed) == 6
    assert len(channels_of(found)) == 1


@pytest.mark.parametrize(
    "given", [BUTTERWORTH, sections(signal.butter(4, 120.0, fs=1.0 / INTERVAL, output="sos"))]
)
def test_a_stated_filter_may_have_been_given_the_ticks_alone(given: Passed, whole: Record) -> None:
    at_ticks = given is not BUTTERWORTH
    record = logged(whole, (lambda x: np.repeat(given(x[::STEPS]), STEPS, axis=0)) if at_ticks else given)
    stated = {"filter": {"type": "butterworth", "order": 4, "cutoff": 120.0}}
    channels = {
        lab.role if lab.role == MASTER else "slave": dict.fromkeys(lab.kind.channels.names, stated)
        for lab in record.labs
    }
    metadata = {IMPORT: {"data": "a.csv", "channels": json.dumps(channels)}}
    record = replace(record, run=replace(record.run, metadata=record.run.metadata | metadata))
    found = shapes.shaped(record)
    assert bool(found.at_ticks) == at_ticks
    assert bool(shapes.remarks(Diagnosis(found))) == at_ticks


CHANNELS = {
    "filter": (ImportedChannel(LoggerFilter("butterworth", 4, 120.0)), BUTTERWORTH, 0),
    "means": (ImportedChannel(average=4e-3, means=3), weighted(BOX, BOX, BOX), 0),
    "smooth": (ImportedChannel(delay=SHARP_LATE, smooth=True), weighted(SHARP), 0),
    "delay": (ImportedChannel(delay=3.3e-3), lambda x: x, 33),
}


@pytest.mark.parametrize("name", CHANNELS)
def test_what_lies_between_the_ticks_is_foreseen_behind_a_channel(name: str, whole: Record) -> None:
    """Commands that change by chance leave a twentieth of what a model at the ticks misses."""
    channel, passed, late = CHANNELS[name]
    part = lab_b(whole)
    slow = signal.butter(4, 100.0, fs=1.0 / INTERVAL, output="sos")
    inputs = {
        device: np.std(values) * 0.1 * signal.sosfilt(slow, white(7, values.size))
        for device, values in part.inputs.items()
    }
    part = part.replaced(inputs=inputs, channels=(channel,) * len(part.channels))
    fine = passed(finely(part))
    shown = np.concatenate([np.repeat(fine[:1], late, axis=0), fine])[: len(fine) : STEPS]
    system = whole.systems[part.role]
    found = part.predict(system)
    plain = np.stack([channel.through(row, INTERVAL) for row in finely(part)[::STEPS].T], axis=1)
    left, missed = ((np.std((one - shown)[100:-20], axis=0)) for one in (found, plain))
    places = [part.lab.kind.channels.names.index(name) for name in ("table_acceleration", "damper_force")]
    assert np.all(left[places] < 0.05 * missed[places])


@pytest.mark.parametrize("lag", [0.0, 1e-3, 3e-3])
@pytest.mark.parametrize("rate", [450.0, 600.0, 1024.0])
def test_what_rows_between_the_ticks_make_of_a_reading_is_foreseen(
    rate: float, lag: float, whole: Record
) -> None:
    """A cubic spline through rows of a logger's own was taken for the values at the ticks."""
    part = lab_b(whole)
    plan = replace(part.lab.plan, damper=replace(part.lab.plan.damper, motor_time_constant=lag))
    channel = ImportedChannel(interpolated=True, rate=rate, first=0.7e-3)
    part = part.replaced(lab=replace(part.lab, plan=plan), channels=(channel,) * len(part.channels))
    fine = finely(part)
    rows = channel.samples(len(part.measured), INTERVAL)
    seen = np.stack([np.interp(rows * STEPS, np.arange(len(fine)), one) for one in fine.T], axis=1)
    shown = CubicSpline(rows, seen)(np.arange(len(part.measured)))
    left, missed = (
        np.std((one - shown)[100:-100], axis=0) for one in (part.predict(System(plan)), fine[::STEPS])
    )
    places = [part.lab.kind.channels.names.index(name) for name in ("table_acceleration", "damper_force")]
    # a motor without lag steps, and a row near a step may have either value
    assert np.all(left[places] < [0.1, 0.1 if lag > 0.0 else 0.4] * missed[places])
