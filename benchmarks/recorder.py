"""Messages per second into a recording: of the writer alone, and of the recorder's process in a burst over zenoh."""

from __future__ import annotations

import itertools
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mcap.writer import CompressionType, Writer

from benchmarks.result import BenchmarkFigure, rate_figure, rates
from common.host.clock import MonotonicClock
from common.lab.laboratory import Laboratory, Setting
from common.link.endpoint import FrameEndpoint
from common.link.zenoh_link import ZenohLink, listenable
from common.plan.plan import PROTOCOL_VERSION, Plan
from common.protocol.messages import Register, Resend
from common.recording.reader import read
from common.recording.run import Run
from common.recording.writer import CHUNK_SIZE, Recording
from common.signals import TICK_TOPICS, TOPICS, FieldType

ROOT = Path(__file__).resolve().parent.parent
COUNT = 20_000  # messages of a repeat: about 0.2 s, long against the resolution of the clock
REPEATS = 5  # odd, so that the median is a measured value
NEEDED = 1_500  # messages/s of a default test: three topics at 500 ticks per second
TARGET = 20 * NEEDED  # messages/s: more than twice those of the fastest plan of rths (4096 ticks per second)
BURSTS = tuple(times * NEEDED for times in (1, 20, 40, 60, 80, 120))  # messages/s
BURST_S, QUICK_BURST_S = 3.0, 0.3  # the recorder syncs its file once a second: three syncs
SLOT_S = 0.002  # a laboratory sends its samples once per tick
SESSION = 1
REPEAT_S = 0.1  # between repeated messages, as in the handshake (REPEAT_NS)
PATIENCE_S = 30.0  # for the recorder to join; it starts in about 2 s on an idle machine
END_S = 20.0  # for the recorder to end; messages that it has not written by then count as missing
POOL = 1_000  # different samples of a topic, of noise; a chunk (64 kB) holds about 500, so that it cannot be compressed

FLUSHED = 150  # messages between two flushes: those of 0.1 s of a default test
SAMPLE = b"x" * 130  # bytes: the length of an encoded sample of the master
FILLING = {FieldType.FLAG: True}

Values = list[list[Any]]


# -- the writer alone ---------------------------------------------------------------------------------


def values_of(topic: str) -> list[Any]:
    """A sample of a topic."""
    return [0.1 if row.kind in (FieldType.NUMBER, FieldType.STOREYS) else 1 for row in TOPICS[topic]]


def recorded(path: Path, count: int) -> int:
    """Write `count` samples of the master, flushed as often as in a test; returns `count`."""
    values = values_of("master")
    recording = Recording(path, "trial", 1, TOPICS)
    for seq in range(count):
        recording.add("master", seq, seq, [seq, *values[1:]])
        if seq % FLUSHED == 0:
            recording.flush()
    recording.close({})
    return count


def bare(path: Path, count: int) -> int:
    """Write `count` encoded messages with the MCAP writer alone; returns `count`."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)
        writer.start()
        channel = writer.register_channel("a", "", 0)
        for seq in range(count):
            writer.add_message(channel, log_time=seq, data=SAMPLE, publish_time=seq, sequence=seq)
        writer.finish()  # type: ignore[no-untyped-call]
    return count


# -- the process in a burst ---------------------------------------------------------------------------


class Burst(NamedTuple):
    """The result of a burst: messages per second sent and written, and how many are missing."""

    asked: float  # messages/s
    offered: float  # messages/s that the laboratories sent
    written: float  # messages/s from the first sample to the finished file
    messages: int
    missing: int  # messages that are not in the file
    doubled: int  # messages that are in the file more than once, or out of order
    reported: int  # missing messages according to the summary of the recording, -1 without one
    sent_again: int  # pieces that the recorder requested again
    behind: float  # s from the last sample sent to the end of the recorder's process

    @property
    def whole(self) -> bool:
        """Whether the file holds every message exactly once, in order."""
        return self.missing == 0 and self.doubled == 0


class Laboratories:
    """The streams of both laboratories to the recorder, each over its own link as in a test."""

    def __init__(self, plan: Plan, endpoint: str) -> None:
        self._digest = plan.digest()
        self._links = [
            ZenohLink("master", plan.test.name, listen=endpoint),
            ZenohLink("slave", plan.test.name, connect=endpoint, patience=PATIENCE_S),
        ]
        self.labs = [
            Laboratory(name, Setting(plan, FrameEndpoint(link, self._digest), MonotonicClock()), TOPICS)
            for name, link in zip(("master", "slave"), self._links, strict=True)
        ]
        for lab in self.labs:
            lab.enter(SESSION)
        self._pools = {topic: pool(topic) for topic in TICK_TOPICS}
        self.sent_again = 0

    def close(self) -> None:
        """Leave the links."""
        for link in reversed(self._links):
            link.close()

    def join(self, recorder: subprocess.Popen[bytes]) -> None:
        """Wait until the recorder takes part in the session; raises TimeoutError if it does not."""
        master, slave = self.labs
        deadline = time.monotonic() + PATIENCE_S
        while any(lab.recorder is None or lab.recorder.session != SESSION for lab in (master, slave)):
            if recorder.poll() is not None or time.monotonic() > deadline:
                raise TimeoutError("the recorder did not join the burst")
            master.endpoint.send(Register(SESSION, PROTOCOL_VERSION, self._digest))
            self.listen()
            time.sleep(REPEAT_S)

    def listen(self) -> None:
        """Receive the recorder's messages and resend the pieces that it requests."""
        for lab in self.labs:
            while (received := lab.endpoint.receive()) is not None:
                if isinstance(received.message, Resend) and received.message.lab == lab.name:
                    self.sent_again += len(lab.outlet.again(received.message))
                lab.listen_to_recorder(received.message)

    def send(self, rate: float, ticks: int) -> float:
        """Send the samples of `ticks` ticks at `rate` messages/s; returns the seconds it took."""
        began, sent = time.monotonic(), 0
        while sent < ticks:
            due = min(ticks, 1 + int((time.monotonic() - began) * rate / len(TICK_TOPICS)))
            for tick in range(sent, due):
                self._sample(tick)
            sent = due
            for lab in self.labs:
                lab.send_samples(everything=sent == ticks)
            self.listen()
            time.sleep(SLOT_S)
        return time.monotonic() - began

    def _sample(self, tick: int) -> None:
        master, slave = self.labs
        for lab, topic in ((master, "master"), (master, "latency"), (slave, "slave")):
            lab.outlet.add(topic, (tick, tick, tick, *self._pools[topic][tick % POOL]))

    def finish(self, recorder: subprocess.Popen[bytes]) -> float:
        """Send the lengths of the streams until the recorder has ended, at most for `END_S`; returns the s it took."""
        began = time.monotonic()
        for turn in itertools.count():
            if recorder.poll() is not None or time.monotonic() - began > END_S:
                break
            if turn % round(REPEAT_S / SLOT_S) == 0:
                for lab in self.labs:
                    lab.endpoint.send(lab.outlet.finished())
            self.listen()
            time.sleep(SLOT_S)
        return time.monotonic() - began


def pool(topic: str) -> Values:
    """`POOL` samples of a topic without their tick number."""
    draws = np.random.default_rng(1).normal(size=(POOL, len(TOPICS[topic]))).tolist()
    kept = (FieldType.NUMBER, FieldType.STOREYS)
    return [
        [
            draw if row.kind in kept else FILLING.get(row.kind, 1)
            for row, draw in zip(TOPICS[topic][1:], line[1:], strict=True)
        ]
        for line in draws
    ]


def burst(rate: float, seconds: float, folder: Path) -> Burst:
    """Send a burst to a recorder process, read its file and count the messages."""
    ticks = max(1, round(rate * seconds / len(TICK_TOPICS)))
    plan, endpoint, path = Plan().with_ticks(ticks), listenable(), folder / "burst.mcap"
    (folder / "plan.toml").write_text(plan.toml(), encoding="utf-8")
    labs = Laboratories(plan, endpoint)
    words = [str(folder / "plan.toml"), "--connect", endpoint, "-o", str(path)]
    recorder = subprocess.Popen(
        [sys.executable, "-m", "recorder", *words], cwd=ROOT, stderr=subprocess.DEVNULL
    )
    try:
        labs.join(recorder)
        spent = labs.send(rate, ticks)
        behind = labs.finish(recorder)
    finally:
        recorder.kill()
        recorder.wait()
        labs.close()
    messages, run = ticks * len(TICK_TOPICS), read(path)
    return Burst(
        rate,
        messages / spent,
        messages / (spent + behind),
        messages,
        *account(run, ticks),
        reported(run),
        labs.sent_again,
        behind,
    )


def account(run: Run, ticks: int) -> tuple[int, int]:
    """The number of messages missing in a recording, and of those that are there twice or out of order."""
    missing = doubled = 0
    for topic in TICK_TOPICS:
        found = run.sequences.get(topic, np.zeros(0, dtype=np.int64))
        missing += ticks - np.intersect1d(found, np.arange(ticks)).size
        doubled += int(np.count_nonzero(np.diff(found) <= 0))
    return missing, doubled


def reported(run: Run) -> int:
    """The number of missing items in the summary of the recording, -1 if it has none because it was cut off."""
    summary = run.metadata.get("summary")
    return int(summary["items_lost"]) + int(summary["items_dropped"]) if summary else -1


def bursts(rates_per_s: Sequence[float], seconds: float) -> list[Burst]:
    """Bursts of rising rate, up to the first that loses messages."""
    found: list[Burst] = []
    with tempfile.TemporaryDirectory() as folder:
        for rate in rates_per_s:
            found.append(burst(rate, seconds, Path(folder)))
            if not found[-1].whole:
                break
    return found


# -- figures ------------------------------------------------------------------------------------------


def figures(found: list[Burst]) -> list[BenchmarkFigure]:
    """The fastest bursts without loss, with all bursts as points of a curve, and the share that the next one lost."""
    whole = [each for each in found if each.whole]
    most = max((each.offered for each in whole), default=0.0)
    easy = max((each.offered for each in whole if each.sent_again == 0), default=0.0)
    process = "recorder process over zenoh"
    complete = rate_figure(f"{process}, every message once", "messages/s", [most], least=TARGET)
    results = [
        complete._replace(points=[each._asdict() for each in found]),
        rate_figure(f"{process}, nothing sent again", "messages/s", [easy]),
    ]
    if lossy := [each for each in found if not each.whole]:
        share = lossy[0].missing / lossy[0].messages
        results.append(
            BenchmarkFigure(f"lost at {lossy[0].offered:,.0f} messages/s", "of them", share, share)
        )
    return results


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """Measure the writer, the MCAP writer alone, and the recorder's process in bursts."""
    count, repeats = (100, 1) if quick else (COUNT, REPEATS)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        beside = statistics.median(rates(lambda: bare(path, count), repeats))
        found = rates(lambda: recorded(path, count), repeats)
    words = "bare MCAP writer with ready-made bytes"
    alone = rate_figure("recording", "messages/s", found, least=TARGET, peer=words, beside=beside)
    whole = bursts(BURSTS[:1], QUICK_BURST_S) if quick else bursts(BURSTS, BURST_S)
    return [alone, *figures(whole)]
