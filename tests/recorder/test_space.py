"""The expected size of a recording, and the message if the disk has no room for it."""

from __future__ import annotations

from collections import namedtuple
from pathlib import Path
from typing import Any

import pytest

from common.lab.preflight import RefusedError
from common.plan.plan import Plan
from common.plan.read import with_test
from common.recording.reader import read
from common.recording.schema import message_class, message_name, schema_file
from common.signals import TICK_TOPICS, TOPICS, FieldType, default_topics
from recorder import space
from rths.perform.run import run
from tests.helpers import with_table

Usage = namedtuple("Usage", "total used free")

VALUES: dict[FieldType, Any] = {
    FieldType.NUMBER: 0.1,
    FieldType.COUNT: 9_000,
    FieldType.INDEX: 9_000,
    FieldType.STAMP: 2**45,
    FieldType.FLAG: False,
}


def full(monkeypatch: Any, free: int) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda _: Usage(10**9, 10**9 - free, free))


@pytest.mark.parametrize("storeys", [1, 3, 20])
@pytest.mark.parametrize("slaves", [1, 4])
@pytest.mark.parametrize("topic", TICK_TOPICS)
def test_the_size_of_a_message_follows_from_its_fields(topic: str, storeys: int, slaves: int) -> None:
    rows = default_topics([f"slave.{number}" for number in range(slaves)] if slaves > 1 else ["slave"]).get(
        topic, TOPICS[topic]
    )
    kind = message_class(schema_file(topic, rows, storeys), f"rths.{message_name(topic)}")
    values = {}
    for row in rows:
        count = row.count(storeys)
        value = VALUES.get(row.kind, 0.1)
        values[row.name] = value if count == 1 else [value] * count
    exact = len(kind(**values).SerializeToString())
    assert space.payload(rows, storeys) == pytest.approx(exact, abs=2)


def test_twice_the_test_needs_twice_the_room(short_plan: Plan) -> None:
    longer = with_test(short_plan, duration=8.0)
    assert space.need(longer) - space.FIXED == pytest.approx(2.0 * (space.need(short_plan) - space.FIXED))


def risk_of(plan: Plan, folder: Path) -> str:
    found = space.check(plan, folder).risk
    assert found is None or found.name == "disk"
    return found.sentence if found else ""


def test_a_full_disk_is_reported_with_folder_required_and_free_space(
    short_plan: Plan, tmp_path: Path, monkeypatch: Any
) -> None:
    assert risk_of(short_plan, tmp_path) == ""
    full(monkeypatch, 1_500_000)
    sentence = risk_of(short_plan, tmp_path)
    assert f"the folder {tmp_path} has 1.5 MB free, and the recording needs 2.1 MB" in sentence
    assert "\n" not in sentence
    assert risk_of(with_table(short_plan, "preflight", disk_factor=1.0), tmp_path) == ""
    monkeypatch.undo()
    assert "the free space of the folder" in risk_of(short_plan, tmp_path / "no")


def test_a_full_disk_refuses_a_run_in_virtual_time_and_an_accepted_risk_is_recorded(
    tmp_path: Path, monkeypatch: Any
) -> None:
    from rths.__main__ import parser_for

    full(monkeypatch, 1_000)
    path = tmp_path / "a.mcap"
    words = ["--virtual", "--duration", "0.5", "-o", str(path)]
    with pytest.raises(RefusedError, match="MB free"):
        run(parser_for("run").parse_args(words))
    assert not path.exists()
    assert run(parser_for("run").parse_args([*words, "--accept-risk", "disk"])) == 0
    accepted = [event for event in read(path).events if event["code"] == "accepted_risk"]
    assert "risk 'disk' accepted: the folder" in accepted[0]["text"]
