"""Readings beside commands that came through the logger too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from common.recording.imported import IMPORT, NOTHING_STATED, ImportedChannel, ImportedData
from common.recording.logger.low_pass import LoggerFilter
from common.roles import MASTER
from diagnosis.recorded.logger.beside_commands import beside_commands
from diagnosis.recorded.record import Record
from models.registry import Array
from models.system import System
from tests.diagnosis.cases import Cases, imported, lab_a, white

COMMAND = "actuator_command"
BESSEL = ImportedChannel(LoggerFilter("bessel", 4, 40.0), delay=2e-3, resolution=0.1, calibration=0.01)
MEAN = ImportedChannel(average=4e-3)


def test_a_filter_of_both_is_as_none_and_one_of_the_command_makes_readings_early() -> None:
    same, early = beside_commands([replace(BESSEL, delay=3e-3), MEAN], [BESSEL.chain], 1e-3)
    assert replace(same, delay=0.0) == ImportedChannel(resolution=0.1, calibration=0.01)
    assert same.delay == pytest.approx(0.0, abs=1e-12)
    assert replace(early, delay=0.0) == MEAN
    assert early.delay == pytest.approx(-BESSEL.late - 1e-3)
    assert beside_commands([BESSEL], [NOTHING_STATED], 1e-3) == (BESSEL,)
    late = ImportedChannel(delay=5e-3)
    assert beside_commands([late], [late], 1e-3) == (
        NOTHING_STATED,
    )  # numbers, which no filter turned into a delay
    assert beside_commands([BESSEL], [BESSEL, MEAN], 1e-3) == (BESSEL,)
    assert beside_commands([BESSEL], [], 1e-3) == (BESSEL,)


def through(whole: Record) -> tuple[Record, Array]:
    """A log of commands and readings behind one filter, which held commands; and readings that passed it alone."""
    part = lab_a(whole)
    interval, plan = whole.plan.test.interval, System(part.lab.plan)
    stated = dict.fromkeys((COMMAND, *part.signals), BESSEL)
    fine = np.repeat(part.inputs[COMMAND], 20)  # an output holds a number for an interval
    output = BESSEL.through(fine, interval / 20)[::20]
    read = np.stack([BESSEL.through(one, interval) for one in part.predict(plan).T], axis=1)
    data = ImportedData("log.csv", channels={MASTER: stated}).metadata()
    logged = imported(whole)
    logged = replace(logged, run=replace(logged.run, metadata=logged.run.metadata | {IMPORT: data}))
    signals = logged.signals | dict(zip(part.signals, read.T, strict=True)) | {COMMAND: output}
    return replace(logged, signals=signals), read


def test_a_laboratory_whose_command_passed_the_filter_of_its_readings_is_predicted(cases: Cases) -> None:
    logged, read = through(cases.record(duration=8.0))
    part = lab_a(logged)
    assert np.array_equal(part.passes, [40.0, 40.0])  # what the logger's filters pass, also those of commands
    missed = part.predict(System(part.lab.plan)) - read
    assert np.all(np.std(missed, axis=0) < 0.005 * np.std(read, axis=0))
    part.channels = part.logged_by
    late = part.predict(System(part.lab.plan)) - read
    assert np.all(np.std(late, axis=0) > 0.1 * np.std(read, axis=0))


def test_noise_of_a_command_s_channel_moves_nothing(cases: Cases) -> None:
    logged, _ = through(cases.record(duration=8.0))
    noisy = logged.signals[COMMAND] + 2e-5 * white(3, logged.signals[COMMAND].size)
    part, quiet = lab_a(replace(logged, signals=logged.signals | {COMMAND: noisy})), lab_a(logged)
    inside = slice(50, -50)
    heard = float(np.std((part.inputs[COMMAND] - quiet.inputs[COMMAND])[inside]))
    assert heard < 0.75 * 2e-5
    assert np.all(np.asarray(part.blurred) > 0.0)  # what is left of the noise at the motion's frequencies
    assert np.all(np.asarray(quiet.blurred) < 0.01 * np.asarray(part.blurred))
