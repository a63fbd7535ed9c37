from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer

from common.errors import InputError
from common.recording import chunks, index
from common.recording.reader import read
from common.recording.schema import schema_file
from common.recording.writer import Recording
from common.signals import TOPICS, FieldType

VALUES: dict[FieldType, Any] = {
    FieldType.NUMBER: 0.1,
    FieldType.STOREYS: 0.2,
    FieldType.COUNT: 3,
    FieldType.INDEX: -1,
    FieldType.STAMP: 2**60,
    FieldType.FLAG: True,
    FieldType.TEXT: "text",
    FieldType.VALUES: {"a": 1.5},
}


def example(topic: str, seq: int, storeys: int = 1) -> tuple[Any, ...]:
    row = []
    for signal in TOPICS[topic]:
        value = VALUES[signal.kind]
        if signal.kind is FieldType.STOREYS and storeys > 1:
            value = [0.1 * storey for storey in range(storeys)]
        row.append(seq if signal.name == "seq" else value)
    return tuple(row)


def write(path: Path, ticks: int, storeys: int = 1, *, close: bool = True) -> Recording:
    recording = Recording(path, "trial", storeys, TOPICS)
    recording.metadata("plan", {"toml": "x"})
    recording.attach("data", b"123", "application/octet-stream")
    recording.flush()
    for seq in range(ticks):
        for topic in ("master", "slave", "latency"):
            recording.add(topic, seq * 2_000_000, seq * 2_000_000 + 5, example(topic, seq, storeys))
    recording.add("event", 0, 0, example("event", 0))
    if close:
        recording.close({"outcome": "completed"})
    return recording


@pytest.mark.parametrize("storeys", [1, 3])
def test_written_data_are_read_back_unchanged(tmp_path: Path, storeys: int) -> None:
    path = tmp_path / "a.mcap"
    write(path, 100, storeys)
    run = read(path)
    assert run.finished
    assert run.test == "trial"
    for topic in ("master", "slave", "latency"):
        assert run.sequences[topic].tolist() == list(range(100))
        assert run.log_ns[topic].tolist() == [seq * 2_000_000 for seq in range(100)]
        for signal, value in zip(TOPICS[topic], example(topic, 99, storeys), strict=True):
            assert np.array_equal(run.columns[topic][signal.name][99], value), signal.name
            assert run.units[topic][signal.name] == signal.unit
    assert run.events == [
        {"t": 0.1, "lab": "text", "level": "text", "code": "text", "text": "text", "values": {"a": 1.5}}
    ]
    assert run.metadata["plan"] == {"toml": "x"}
    assert run.metadata["summary"] == {"outcome": "completed"}
    assert run.attachments["data"] == b"123"


def test_the_mcap_library_decodes_every_field_with_the_schema_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write(path, 3, storeys=2)
    classes: dict[int, Any] = {}
    with path.open("rb") as stream:
        messages = list(make_reader(stream).iter_messages())
    assert len(messages) == 10
    for schema, channel, message in messages:
        assert schema is not None
        if schema.id not in classes:
            pool = descriptor_pool.DescriptorPool()
            for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                pool.Add(file)
            classes[schema.id] = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
        topic = channel.topic.removeprefix("rths/trial/")
        decoded = classes[schema.id].FromString(message.data)
        for signal, value in zip(TOPICS[topic], example(topic, message.sequence, 2), strict=True):
            got = getattr(decoded, signal.name)
            assert (
                dict(got)
                if signal.kind is FieldType.VALUES
                else list(got)
                if isinstance(value, list)
                else got
            ) == value
        assert channel.message_encoding == schema.encoding == "protobuf"
        assert message.log_time <= message.publish_time


@settings(max_examples=25, deadline=None)
@given(share=st.floats(0.0, 1.0))
def test_a_truncated_file_is_read_up_to_the_cut_or_refused(tmp_path_factory: Any, share: float) -> None:
    path = tmp_path_factory.mktemp("cut") / "a.mcap"
    write(path, 2000)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    try:
        run = read(path)
    except InputError as error:
        assert "\n" not in str(error)
        return
    sequence = run.sequences["master"]
    assert sequence.tolist() == list(range(sequence.size))
    assert not run.finished or sequence.size == 2000
    assert run.finished or share < 1.0


def test_a_recording_that_was_not_closed_holds_all_flushed_samples(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recording = write(path, 50, close=False)
    recording.flush()
    run = read(path)
    assert not run.finished
    assert run.ticks("slave") == 50
    assert run.metadata["plan"] == {"toml": "x"}
    recording.abandon()


def in_chunks(path: Path, chunks: int, ticks: int = 2) -> Recording:
    """An open recording with this many chunks beyond its first, of this many ticks each."""
    recording = write(path, 0, close=False)
    for seq in range(chunks * ticks):
        for topic in ("master", "slave", "latency"):
            recording.add(topic, seq * 2_000_000, seq * 2_000_000 + 5, example(topic, seq))
        if seq % ticks == ticks - 1:
            recording.flush()
    return recording


def test_the_packed_index_equals_the_mcap_librarys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_chunks(tmp_path / "packed.mcap", 200).close({})
    monkeypatch.setattr(index, "LIST", "_none")
    in_chunks(tmp_path / "own.mcap", 200).close({})
    assert (tmp_path / "packed.mcap").read_bytes() == (tmp_path / "own.mcap").read_bytes()


def test_the_mcap_library_finds_a_time_by_the_index(tmp_path: Path) -> None:
    in_chunks(tmp_path / "a.mcap", 200).close({})
    with (tmp_path / "a.mcap").open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count == 200
        found = list(reader.iter_messages(starting_at=100 * 2_000_000, ending_before=103 * 2_000_000))
    assert sorted(message.sequence for _, _, message in found) == [100] * 3 + [101] * 3 + [102] * 3


def test_the_memory_of_a_recording_does_not_grow_with_the_test(tmp_path: Path) -> None:
    recording = in_chunks(tmp_path / "a.mcap", 1)
    chunks = 4_000
    tracemalloc.start()
    try:
        for seq in range(chunks):
            recording.add("slave", seq, seq, example("slave", seq))
            recording.flush()
            if seq == chunks // 2:
                before, _ = tracemalloc.get_traced_memory()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
        recording.abandon()
    assert (after - before) / (chunks // 2) < 64.0  # bytes a chunk; objects would take 700


def test_schemas_and_plan_are_written_before_the_first_sample(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recording = Recording(path, "trial", 1, TOPICS)
    recording.metadata("plan", {"toml": "x"})
    recording.add("event", 0, 0, example("event", 0))
    recording.flush()
    run = read(path)
    assert run.metadata["plan"] == {"toml": "x"}
    assert set(run.columns) == {"master", "slave", "latency"}
    recording.abandon()


def test_a_file_that_is_not_a_recording_is_refused_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "text.mcap").write_text("hello " * 100)
    with pytest.raises(InputError, match="not a readable MCAP"):
        read(tmp_path / "text.mcap")
    with pytest.raises(InputError, match="No such file"):
        read(tmp_path / "missing.mcap")
    with pytest.raises(InputError, match=r"Cannot write the recording .*No such file"):
        Recording(tmp_path / "no" / "a.mcap", "trial", 1, TOPICS)


def test_the_table_of_signals_has_the_specified_fields() -> None:
    contract = {
        "master": "seq t ground_acceleration displacement velocity acceleration absolute_acceleration column_target "
        "actuator_command column_displacement column_force numerical_force damper_force_used damper_force_seq "
        "damper_force_age table_target damper_command",
        "slave": "seq t command_seq table_target damper_command table_command table_displacement table_acceleration "
        "damper_stroke damper_force",
        "latency": "seq wake_lateness compute_time command_one_way slave_time feedback_one_way round_trip "
        "clock_offset clock_offset_bound deadline_missed",
        "event": "t lab level code text values",
    }
    for topic, names in contract.items():
        assert [row.name for row in TOPICS[topic]][: len(names.split())] == names.split()


def test_messages_packed_in_one_call_equal_the_mcap_librarys_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    packed = write(tmp_path / "packed.mcap", 500)
    assert isinstance(vars(packed._writer)[chunks.BUILDER], chunks.PackedChunks)
    monkeypatch.setattr(chunks, "BUILDER", "none")
    write(tmp_path / "plain.mcap", 500)
    assert (tmp_path / "packed.mcap").read_bytes() == (tmp_path / "plain.mcap").read_bytes()


def test_an_events_bytes_do_not_depend_on_the_order_of_its_values(tmp_path: Path) -> None:
    values = dict.fromkeys(("b", "a", "slave.feedbacks.used", "ab"), 1.0)
    for name, table in (("a", values), ("b", dict(reversed(values.items())))):
        recording = Recording(tmp_path / name, "trial", 1, TOPICS)
        recording.add("event", 0, 0, (0.0, "master", "info", "exchange", "a sentence", table))
        recording.close({})
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize(
    ("plan", "roles"), [('[slave]\nkind = "none"', ()), ("[slave]", ("slave",)), ("[", ("slave",))]
)
def test_a_recording_that_names_no_slaves_has_none_where_its_plan_has_none(
    tmp_path: Path, plan: str, roles: tuple[str, ...]
) -> None:
    """As a recording that others write by the contract, whose channels say nothing of slaves."""
    with (tmp_path / "own.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        described = descriptor_pb2.FileDescriptorSet(file=[schema_file("master", TOPICS["master"], 1)])
        schema = writer.register_schema("rths.Master", "protobuf", described.SerializeToString())
        channel = writer.register_channel("rths/trial/master", "protobuf", schema)
        writer.add_message(channel, 0, b"", 0)
        writer.add_metadata("plan", {"toml": plan})
        writer.finish()  # type: ignore[no-untyped-call]
    assert read(tmp_path / "own.mcap").roles == roles
