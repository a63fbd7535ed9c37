"""The recorder against slow, full and failing disks, and against lost messages."""

from __future__ import annotations

import errno
import re
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from common.errors import EmergencyStopError, IncompleteError, InputError, InterlockError, LostError
from common.host.clock import MonotonicClock, VirtualClock
from common.lab.outlet import PIECE
from common.link.memory_link import MemoryEndpoint
from common.plan.plan import Plan
from common.protocol.messages import Samples
from common.reality import reality
from common.recording.reader import read
from common.recording.rows import Item, RowPacker
from common.recording.writer import Recording
from common.signals import TOPICS
from recorder.files import reserved
from recorder.sink import FileSink, ThreadedSink
from simulation import virtual
from tests.helpers import with_table


def item(seq: int) -> Item:
    return RowPacker(TOPICS, 1).item("slave", 0, 0, (seq, 0.0, -1, *[0.0] * 10))


def recording(tmp_path: Path) -> Recording:
    found = Recording(tmp_path / "a.mcap", "trial", 1, TOPICS)
    found.add("event", 0, 0, (0.0, "recorder", "info", "begin", "begun", {}))
    found.flush()
    return found


class FullDisk:
    """Stands in for a file on a disk that has room for this many bytes."""

    def __init__(self, path: Path, room: int) -> None:
        self._file = path.open("r+b", buffering=0)
        self._file.seek(0, 2)
        self._room = room

    def write(self, data: bytes) -> int:
        if not self._room:
            raise OSError(errno.ENOSPC, "No space left on device")
        taken = min(len(data), self._room)
        self._room -= taken
        return self._file.write(data[:taken])

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


def test_after_a_full_disk_the_written_samples_are_readable_and_the_failure_is_reported(
    tmp_path: Path,
) -> None:
    clock = VirtualClock()
    file = recording(tmp_path)
    file._stream.close()
    file._spool._stream = file._stream = FullDisk(tmp_path / "a.mcap", 3_000)  # type: ignore[assignment]
    sink = FileSink(file, clock)
    for seq in range(500):
        clock.time += 20_000_000
        sink.put([item(seq)])
    assert "No space left on device" in sink.failure
    sink.close({}, {})
    run = read(tmp_path / "a.mcap")
    count = run.ticks("slave")
    assert 0 < count < 500
    assert run.sequences["slave"].tolist() == list(range(count))
    assert sink.dropped > 0
    assert not run.finished


def test_a_full_disk_stops_the_test_in_order(short_plan: Plan, tmp_path: Path, monkeypatch: Any) -> None:
    flush = Recording.flush
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), tmp_path / "a.mcap")

    def failing(self: Recording) -> None:
        if bench.master.ticks > short_plan.ticks // 4:
            raise OSError(errno.ENOSPC, "No space left on device")
        flush(self)

    monkeypatch.setattr(Recording, "flush", failing)
    error = virtual.run(bench, lambda: "")
    assert isinstance(error, InterlockError)
    assert "recording is lost: the disk cannot be written (No space left on device)" in str(error)
    assert 0 < bench.master.ticks < short_plan.ticks
    assert read(tmp_path / "a.mcap").ticks("master") > 0


def test_a_disk_that_is_full_from_the_start_gives_a_message_without_traceback(short_plan: Plan) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    full = Recording(Path("/dev/full"), "trial", 1, TOPICS)
    with pytest.raises(OSError, match="No space left"):
        full.flush()
    full.abandon()


def test_a_slow_disk_causes_dropped_samples_and_no_delay(tmp_path: Path) -> None:
    gate = threading.Event()
    sink = FileSink(recording(tmp_path), MonotonicClock())
    write = sink.put

    def slow(items: list[Any]) -> None:
        assert gate.wait(60.0)
        write(items)

    sink.put = slow  # type: ignore[method-assign]
    threaded = ThreadedSink(sink, capacity=200)
    for seq in range(300):
        threaded.put([item(seq)])
    assert threaded.dropped >= 99  # what does not fit beside the two hundred that wait
    assert threaded.most_waiting == 200
    assert "too slow" in threaded.failure
    gate.set()
    threaded.close({}, {})
    assert read(tmp_path / "a.mcap").ticks("slave") == 300 - threaded.dropped


class StallingDisk:
    """Stands in for a file on a disk that blocks every write until it is released."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("r+b", buffering=0)
        self._file.seek(0, 2)
        self.stalls = 0
        self.over = False
        self.released = threading.Event()

    def write(self, data: bytes) -> int:
        self.stalls += 1
        self.released.clear()
        while not (self.over or self.released.wait(0.01)):
            pass
        return self._file.write(data)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


def test_a_disk_that_stalls_repeatedly_causes_no_loss(tmp_path: Path) -> None:
    file = recording(tmp_path)
    file._stream.close()
    disk = StallingDisk(tmp_path / "a.mcap")
    file._spool._stream = file._stream = disk  # type: ignore[assignment]
    clock = VirtualClock()
    threaded = ThreadedSink(FileSink(file, clock))
    for seq in range(6_000):
        clock.time += 20_000_000
        threaded.put([item(seq)])  # returns while the disk stalls, or the test would hang
        if seq % 150 == 149:
            disk.released.set()
    disk.over = True
    disk.released.set()
    threaded.close({}, {})
    assert disk.stalls > 0
    assert threaded.failure == ""
    assert threaded.dropped == 0
    assert 0 < threaded.most_waiting <= 6_000
    assert read(tmp_path / "a.mcap").sequences["slave"].tolist() == list(range(6_000))


def test_a_disk_that_hangs_does_not_block_the_recorder_forever(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr("recorder.sink.CLOSE_S", 0.2)
    gate = threading.Event()
    sink = FileSink(recording(tmp_path), MonotonicClock())
    monkeypatch.setattr(sink, "put", lambda _: gate.wait(60.0))
    threaded = ThreadedSink(sink)
    threaded.put([item(0)])
    threaded.close({}, {})
    assert threaded.failure == "the disk has not written the last 1 samples within 0.2 s."
    gate.set()
    threaded._thread.join(10.0)
    assert not threaded._thread.is_alive()
    sink._recording.abandon()


def test_a_recorder_that_lost_its_disk_ends_with_one_sentence(short_plan: Plan, tmp_path: Path) -> None:
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), tmp_path / "a.mcap")
    recorder = bench.recorder
    assert recorder is not None
    assert isinstance(recorder._sink, FileSink)
    recorder._sink.failure = "the disk cannot be written (No space left on device)."
    recorder.close()
    assert isinstance(recorder.error, LostError)
    assert "the disk cannot be written (No space left on device)" in str(recorder.error)


@pytest.mark.parametrize(("first", "last"), [(400, 950), (400, 1_990), (1_300, 1_990)])
def test_a_recorder_that_was_paused_receives_the_missed_samples(
    first: int, last: int, short_plan: Plan, tmp_path: Path
) -> None:
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), tmp_path / "a.mcap")
    recorder = bench.recorder
    assert recorder is not None
    take, poll = recorder.take, recorder.poll

    def held() -> bool:
        return first < bench.master.ticks < last

    def hole_before(message: Any, received_ns: int) -> None:
        """A piece is lost just before the recorder is paused, so that the gap is as old as the pause."""
        if not (
            isinstance(message, Samples)
            and first - 30 < message.first < first
            and not bench.master.ticks > last
        ):
            take(message, received_ns)

    recorder.take = lambda *words: None if held() else hole_before(*words)  # type: ignore[method-assign]
    recorder.poll = lambda: None if held() else poll()  # type: ignore[method-assign]
    assert virtual.run(bench, lambda: "") is None
    run = read(tmp_path / "a.mcap")
    for topic in ("master", "slave", "latency"):
        assert run.sequences[topic].tolist() == list(range(short_plan.ticks))
    stalled = (last - first) * short_plan.test.interval
    assert float(run.metadata["summary"]["recorder_stalled_s"]) == pytest.approx(stalled, abs=0.1)
    assert run.metadata["summary"]["items_lost"] == "0"
    assert not [event for event in run.events if event["code"] == "rows_lost"]


def test_the_missing_end_of_a_stream_is_reported(short_plan: Plan, tmp_path: Path) -> None:
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), tmp_path / "a.mcap")
    recorder = bench.recorder
    assert recorder is not None
    take = recorder.take

    def deaf(message: Any, received_ns: int) -> None:
        """The recorder is paused from tick 1,500 on until both laboratories have left."""
        if bench.master.ticks < 1_500:
            take(message, received_ns)

    recorder.take = deaf  # type: ignore[method-assign]
    error = virtual.run(bench, lambda: "")
    assert isinstance(error, LostError)
    lost = [event["text"] for event in read(tmp_path / "a.mcap").events if event["code"] == "rows_lost"]
    assert lost == [
        f"The end of the stream of the {lab} did not reach the recorder." for lab in ("master", "slave")
    ]


def test_no_missing_end_is_reported_for_a_laboratory_that_took_no_part(
    short_plan: Plan, tmp_path: Path
) -> None:
    plan = replace(short_plan, link=replace(short_plan.link, connect_timeout=2.0))
    bench = virtual.assemble(plan, reality.as_planned(plan), tmp_path / "a.mcap")
    bench.slave.emergency(EmergencyStopError("pressed."))
    assert "latched in its safe state" in str(virtual.run(bench, str))
    assert bench.recorder is not None
    assert bench.recorder.error is None
    assert [one["code"] for one in read(tmp_path / "a.mcap").events] == ["begin", "latched", "refused"]


def test_samples_that_the_link_loses_are_requested_again(
    short_plan: Plan, tmp_path: Path, monkeypatch: Any
) -> None:
    deliver, lost = MemoryEndpoint.send, []

    def leaky(self: MemoryEndpoint, message: Any, to: str = "") -> int:
        if isinstance(message, Samples) and message.first // PIECE % 7 == 3 and message.first not in lost:
            lost.append(message.first)
            return 0
        return deliver(self, message, to)

    monkeypatch.setattr(MemoryEndpoint, "send", leaky)
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), tmp_path / "a.mcap")
    assert virtual.run(bench, lambda: "") is None
    run = read(tmp_path / "a.mcap")
    assert len(lost) > 500 // PIECE
    for topic in ("master", "slave", "latency"):
        assert run.sequences[topic].tolist() == list(range(short_plan.ticks))
    assert run.metadata["summary"]["items_lost"] == "0"


def test_samples_that_cannot_be_sent_again_are_counted_and_reported(
    short_plan: Plan, tmp_path: Path, monkeypatch: Any
) -> None:
    deliver = MemoryEndpoint.send

    def leaky(self: MemoryEndpoint, message: Any, to: str = "") -> int:
        if isinstance(message, Samples) and message.lab == "slave" and 490 <= message.first < 490 + PIECE:
            return 0
        return deliver(self, message, to)

    monkeypatch.setattr(MemoryEndpoint, "send", leaky)
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), tmp_path / "a.mcap")
    error = virtual.run(bench, lambda: "")
    run = read(tmp_path / "a.mcap")
    summary = run.metadata["summary"]
    assert summary["items_lost"] == str(PIECE)
    assert summary["slave_gaps"] == str(PIECE)
    assert run.ticks("slave") == short_plan.ticks - PIECE
    lost = [event for event in run.events if event["code"] == "rows_lost"]
    assert [(event["lab"], event["level"], event["values"]) for event in lost] == [
        ("recorder", "error", {"items": float(PIECE)})
    ]
    assert f"{PIECE} rows and events of the slave are lost" in lost[0]["text"]
    assert isinstance(error, IncompleteError)
    assert error.exit_code == 1


def test_the_default_recording_is_in_the_plans_folder(short_plan: Plan, tmp_path: Path) -> None:
    plan = with_table(short_plan, "recording", folder=str(tmp_path / "new" / "folder"))
    with reserved(None, plan) as path:
        assert path.parent == tmp_path / "new" / "folder"
        assert re.fullmatch(r"default-\d{8}-\d{6}\.mcap", path.name)
    (tmp_path / "file").write_text("")
    nowhere = with_table(short_plan, "recording", folder=str(tmp_path / "file" / "x"))
    with pytest.raises(InputError, match="Cannot create the folder"), reserved(None, nowhere):
        pass


def test_tests_that_begin_in_the_same_second_have_different_files(
    short_plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("recorder.files.time.strftime", lambda _: "20260101-120000")
    plan = with_table(short_plan, "recording", folder=str(tmp_path))
    with reserved(None, plan) as one, reserved(None, plan) as two:
        one.write_bytes(b"recorded")
    assert [one.name, two.name] == ["default-20260101-120000.mcap", "default-20260101-120000-2.mcap"]
    assert list(tmp_path.iterdir()) == [one]  # of what recorded nothing, no empty file is left
