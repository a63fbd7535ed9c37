"""Messages per second of the recording, beside the bare MCAP writer."""

from __future__ import annotations

import statistics
import tempfile
from pathlib import Path

from mcap.writer import CompressionType, Writer

from benchmarks.result import Figure, rate_figure, rates
from common.recording.writer import CHUNK_SIZE, Recording
from common.signals import TOPICS, Kind

COUNT = 20_000
NEEDED = 1_500  # per second of a default test


def run() -> list[Figure]:
    """Messages of the master's topic, flushed as often as in a test."""
    values = [0.1 if row.kind in (Kind.NUMBER, Kind.STOREYS) else 1 for row in TOPICS["master"]]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"

        def recorded() -> int:
            recording = Recording(path, "trial", 1, TOPICS)
            for seq in range(COUNT):
                recording.add("master", seq, seq, [seq, *values[1:]])
                if seq % 150 == 0:
                    recording.flush()
            recording.close({})
            return COUNT

        def bare() -> int:
            with path.open("wb") as stream:
                writer = Writer(stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)
                writer.start()
                channel = writer.register_channel("a", "", 0)
                for seq in range(COUNT):
                    writer.add_message(channel, log_time=seq, data=b"x" * 130, publish_time=seq, sequence=seq)
                writer.finish()  # type: ignore[no-untyped-call]
            return COUNT

        beside = statistics.median(rates(bare, repeats=5))
        found = rates(recorded, repeats=5)
    words = "bare MCAP writer with ready-made bytes"
    return [rate_figure("recording", "messages/s", found, least=20 * NEEDED, peer=words, beside=beside)]
