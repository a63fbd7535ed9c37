"""Commands that a log leaves out, or has as the master sent them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from common.recording.imported import ImportedChannel, ImportedData
from common.recording.logger.low_pass import LoggerFilter
from common.recording.reader import read
from common.roles import SLAVE
from diagnosis.diagnose import not_recorded
from diagnosis.recorded import commands, record
from diagnosis.recorded.record import Record
from diagnosis.signals.mask import Mask
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_a

EFFORT, COMMAND, TARGET = "damper_command", "table_command", "table_target"
NUMBERS = ImportedData("log.csv")  # of which nothing is stated


def without(whole: Record, *names: str) -> tuple[dict[str, Array], dict[str, Mask]]:
    """The signals of a record and where they are present, without some."""
    kept = whole.signals.keys() - set(names)
    return {name: whole.signals[name] for name in kept}, {name: whole.present[name] for name in kept}


@pytest.mark.parametrize("left_out", [("velocity",), ()])
def test_the_commands_that_a_log_leaves_out_are_those_of_the_plans_control(
    left_out: tuple[str, ...], cases: Cases
) -> None:
    whole = cases.record()
    signals, present = without(whole, EFFORT, COMMAND, *left_out)
    assert commands.completed(signals, present, whole.labs, 0.002, {}) == (EFFORT, COMMAND)
    assert np.array_equal(signals[COMMAND], whole.signals[COMMAND])
    true = whole.signals[EFFORT]
    assert np.std(signals[EFFORT] - true) < 1e-3 * np.std(true)
    assert present[EFFORT].all()


def test_the_report_says_what_was_worked_out(cases: Cases) -> None:
    run = read(cases.file())
    for topic in ("master", "slave"):
        run.columns[topic].pop(EFFORT, None)
    (said,) = [one for one in not_recorded(record.build(run)) if EFFORT in one]
    assert said.startswith("Not recorded, and worked out from the plan's control: damper_command.")


def test_a_command_is_on_its_way_as_long_as_the_numbers_of_messages_say(cases: Cases) -> None:
    whole = cases.record()
    signals, present = without(whole, EFFORT)
    numbers: Array = 7000.0 + np.arange(whole.ticks, dtype=np.float64)
    numbers[500:503] = numbers[499]
    signals["command_seq"] = numbers
    commands.completed(signals, present, whole.labs, 0.002, {})
    assert np.array_equal(signals[EFFORT][500:503], [signals[EFFORT][499]] * 3)
    assert signals[EFFORT][503] == pytest.approx(whole.signals[EFFORT][503], rel=1e-2)


def test_nothing_is_worked_out_of_what_was_recorded_or_cannot_be_known(cases: Cases) -> None:
    whole = cases.record()
    signals, present = without(whole)
    assert commands.completed(signals, present, whole.labs, 0.002, {}) == ()
    signals, present = without(whole, EFFORT, COMMAND, TARGET, "displacement")
    assert commands.completed(signals, present, whole.labs, 0.002, {}) == ()


@pytest.mark.parametrize("numbered", [True, False])
def test_numbers_that_were_sent_are_taken_for_those_that_were_received(numbered: bool, cases: Cases) -> None:
    whole, late = cases.record(), 6
    signals, _ = without(whole, *([] if numbered else ["command_seq"]))
    for name in (TARGET, EFFORT):
        signals[name] = np.append(whole.signals[name][late:], [whole.signals[name][-1]] * late)
    if numbered:
        signals["command_seq"] = np.clip(np.arange(whole.ticks) - float(late), 0.0, None)
    commands.received(signals, whole.labs, NUMBERS)
    for name in (TARGET, EFFORT):
        assert np.array_equal(signals[name][late:], whole.signals[name][late:])


def test_a_force_that_is_worked_out_is_on_its_way_as_long_as_the_targets_are(cases: Cases) -> None:
    whole, late = cases.record(), 6
    signals, present = without(whole, EFFORT)
    signals[TARGET] = np.append(whole.signals[TARGET][late:], [whole.signals[TARGET][-1]] * late)
    ways = commands.received(signals, whole.labs, NUMBERS)
    commands.completed(signals, present, whole.labs, 0.002, ways)
    expected, _ = without(whole, EFFORT)
    commands.completed(expected, dict(present), whole.labs, 0.002, {})
    assert np.array_equal(signals[EFFORT][late:], expected[EFFORT][:-late])


def test_numbers_that_were_received_stay_as_they_are(cases: Cases) -> None:
    whole = cases.record({"table.delay": {"delay": 0.012}})
    signals, _ = without(whole)
    commands.received(signals, whole.labs, NUMBERS)
    assert all(np.array_equal(signals[name], whole.signals[name]) for name in signals)


def test_a_command_behind_a_filter_does_not_tell_how_old_targets_were(cases: Cases) -> None:
    whole = cases.record()
    voltage = ImportedChannel(LoggerFilter("butterworth", 4, 129.0))
    signals, _ = without(whole)
    signals[COMMAND] = voltage.through(
        signals[COMMAND], 0.002, 1e-3
    )  # about two ticks late, as a held output is
    before = dict(signals)
    stated = ImportedData("log.csv", channels={SLAVE: {COMMAND: voltage}})
    assert commands.received(signals, whole.labs, stated) == {}
    assert all(np.array_equal(signals[name], before[name]) for name in signals)
    assert commands.received(signals, whole.labs, NUMBERS) != {}


def test_the_drift_of_the_building_stands_for_a_target_that_was_not_recorded(cases: Cases) -> None:
    whole = cases.record()
    own = lab_a(whole)
    (command,) = own.wanted
    signals, _ = without(whole, "column_target")
    (values,) = lab_a(replace(whole, signals=signals)).wanted.values()
    assert command == "actuator_command"
    assert np.std(values - own.wanted[command]) < 1e-2 * np.std(values)
