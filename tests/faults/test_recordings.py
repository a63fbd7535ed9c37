"""Recordings that are cut off or damaged: F48, F49."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from common.recording.reader import read
from common.recording.recover.recovery import recover
from common.roles import MASTER, RECORDER, SLAVE
from tests.faults.rows import passed
from tests.faults.simulated import Scene

TOPICS = (MASTER, SLAVE, "latency")


@pytest.fixture(scope="module")
def unfinished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A test whose recorder was killed at 2 s."""
    scene = Scene(tmp_path_factory.mktemp("unfinished"))
    scene.at(1000, scene.simulation.world.processes[RECORDER].kill)
    scene.simulation.run()
    return scene.path


def chunks(path: Path) -> list[tuple[int, int]]:
    """Where each chunk begins and ends."""
    found, begin = [], 8
    with path.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True).records:
            if isinstance(record, Chunk):
                found.append((begin, stream.tell()))
            begin = stream.tell()
            if begin >= found[-1][1] and begin >= path.stat().st_size if found else False:
                break
    return found


def gaps(path: Path) -> int:
    """Sequence numbers missing between the first and the last of all topics."""
    run = read(path)
    return sum(int(np.sum(np.diff(run.sequences[topic]) - 1)) for topic in TOPICS)


def test_f48_power_is_cut(unfinished: Path, tmp_path: Path) -> None:
    data, begun = unfinished.read_bytes(), read(unfinished).log_ns[MASTER]
    lost = []
    for share in (0.4, 0.7, 0.999):
        cut, output = tmp_path / f"cut{share}.mcap", tmp_path / f"whole{share}.mcap"
        cut.write_bytes(data[: int(share * len(data))])
        there = [end for _, end in chunks(unfinished) if end <= cut.stat().st_size]
        found = recover(cut, output)
        run = read(output)
        assert run.finished
        assert found.chunks == len(there)
        assert gaps(output) == 0
        behind = [end for _, end in chunks(unfinished)].index(there[-1])
        lost.append(1 if behind + 1 < len(chunks(unfinished)) else 0)
    seconds = (1000 * 0.002) - (read(unfinished).log_ns[MASTER][-1] - begun[0]) * 1e-9
    assert seconds <= 1.0
    passed(
        "F48",
        "power is cut",
        "simulation: the recorder is killed, its file cut at 40, 70 and 99.9 % of its bytes",
        "recovered",
        None,
        None,
        f"rths recover: every whole chunk, no gap in any topic; the killed recorder lost {seconds * 1e3:.0f} ms",
    )


def test_f49_flipped_bits_in_a_recording(unfinished: Path, tmp_path: Path) -> None:
    places = chunks(unfinished)
    data = bytearray(unfinished.read_bytes())
    begin, end = places[len(places) // 2]
    data[(begin + end) // 2] ^= 1
    rotten, output = tmp_path / "rotten.mcap", tmp_path / "out.mcap"
    rotten.write_bytes(data)
    found = recover(rotten, output)
    assert (found.chunks_lost, found.chunks) == (1, len(places) - 1)
    assert [(hole.offset, hole.end) for hole in found.holes] == [(begin, end)]
    missing = sum(found.topics[topic].lost for topic in TOPICS)
    assert gaps(output) == missing > 0
    passed(
        "F49",
        "a bit in the file has flipped",
        "a bit in the middle of a chunk of a simulated test's recording",
        "recovered",
        None,
        None,
        f"rths recover: one of {len(places)} chunks lost, bytes {begin} to {end - 1}; {missing} records named "
        "by topic and number",
    )
