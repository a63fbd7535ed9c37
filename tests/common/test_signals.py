"""The signals of every topic follow from the channels of the laboratories."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from common import signals
from common.errors import InputError
from common.recording.reader import read
from common.recording.writer import Recording
from common.signals import COLUMN_CHANNELS, TABLE_CHANNELS, Signal


def names(laboratories: dict[str, signals.Channels], topic: str) -> list[str]:
    return [row.name for row in signals.topics(laboratories)[topic]]


def test_a_slaves_signal_that_the_master_also_has_gets_the_prefix_sent() -> None:
    found = names({"master": COLUMN_CHANNELS, "slave": COLUMN_CHANNELS}, "master")
    assert found[-7:] == [
        "column_force_used",
        "column_force_seq",
        "column_force_age",
        "sent_column_target",
        "column_target_velocity",
        "column_target_acceleration",
        "column_target_jerk",
    ]


def test_a_master_without_a_laboratory_has_the_signals_of_the_building_and_of_its_commands() -> None:
    laboratories = {"slave.a": TABLE_CHANNELS, "slave.b": COLUMN_CHANNELS, "slave.c": TABLE_CHANNELS}
    table = signals.topics(laboratories)
    assert "master_ramp" not in table
    each = signals.shared(table["master"])
    assert each["table_target"] == each["damper_force_age"] == ("slave.a", "slave.c")
    assert each["column_target"] == ("slave.b",)
    assert not {"column_displacement", "actuator_command"} & each.keys()


def test_a_test_without_slaves_has_the_masters_topics() -> None:
    assert list(signals.topics({"master": COLUMN_CHANNELS})) == ["master", "master_ramp", "event"]


def test_two_signals_of_one_name_are_refused() -> None:
    mine = replace(
        COLUMN_CHANNELS, measured=(*COLUMN_CHANNELS.measured, Signal("velocity", "m/s", "its own"))
    )
    with pytest.raises(InputError, match="master would have 2 signals called 'velocity'"):
        signals.topics({"master": mine})


def test_a_recording_states_the_meaning_of_its_signals_and_splits_them_by_slave(tmp_path: Path) -> None:
    laboratories = {"slave.a": TABLE_CHANNELS, "slave.b": COLUMN_CHANNELS, "slave.c": TABLE_CHANNELS}
    table, path = signals.topics(laboratories), tmp_path / "a.mcap"
    recording = Recording(path, "trial", 1, table, list(laboratories))
    recording.describe()
    places = {role: float(place) for place, role in enumerate(laboratories)}
    row = [[int(places[role]) for role in one.slaves] if one.slaves else 0 for one in table["master"]]
    recording.add(
        "master", 0, 0, [item[0] if isinstance(item, list) and len(item) == 1 else item for item in row]
    )
    for role, channels in laboratories.items():
        recording.add(role, 0, 0, [0] * len(table[role]))
        assert channels.command.name in names(laboratories, role)
    recording.close({})
    found = read(path)
    assert found.texts["slave.b"]["column_force"] == "restoring force of the specimen measured"
    assert found.units["slave.b"]["actuator_command"] == "m"
    assert found.of("slave.c").columns["master"]["damper_force_used"] == [2.0]
    column = found.of("slave.b").columns["master"]
    assert column["column_force_used"] == [1.0]
    assert "table_target" not in column


def test_a_recording_without_stated_meanings_gets_those_of_the_shipped_kinds(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recording = Recording(path, "trial", 1, signals.TOPICS)
    recording.add("slave", 0, 0, [0] * len(signals.TOPICS["slave"]))
    recording.close({})
    assert read(path).texts["slave"]["damper_stroke"] == "stroke of the damper measured"
