"""A delay on the wire, in one direction, between two processes whose clocks are a second apart."""

from __future__ import annotations

import contextlib
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from queue import SimpleQueue

import numpy as np
import pytest

from common.link.zenoh_link import listenable
from common.recording.reader import read
from tests.helpers import patient
from tests.processes import HANG_S, environment, tied

pytestmark = pytest.mark.slow

PLANTED = 0.003
SECONDS, SINCE = 8, 4.0  # s of test, and from when on the delay is there
CLOSE = 0.2e-3  # s
ATTEMPTS = 4
REACH_S = 60.0
APART = ["unshare", "--time", "--monotonic", "1"]


class DelayingRelay:
    """Hands bytes on between a dialler and a listener; `way` is slower by `PLANTED` from a moment on."""

    def __init__(self, to: int, way: str) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._server.getsockname()[1]
        self.slow_from = float("inf")
        self._to, self._way = to, way
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with self._server:
            dialler, _ = self._server.accept()
        listener = self._reach()
        for way, source, sink in (("there", listener, dialler), ("back", dialler, listener)):
            for end in (source, sink):
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            queue: SimpleQueue[tuple[float, bytes]] = SimpleQueue()
            threading.Thread(target=self._take, args=(way, source, queue), daemon=True).start()
            threading.Thread(target=self._give, args=(queue, sink), daemon=True).start()

    def _reach(self) -> socket.socket:
        """The listener, which may not be there yet."""
        deadline = time.monotonic() + REACH_S
        while True:
            try:
                return socket.create_connection(("127.0.0.1", self._to))
            except ConnectionRefusedError:
                if time.monotonic() > deadline:
                    raise
            time.sleep(0.05)

    def _take(self, way: str, source: socket.socket, queue: SimpleQueue[tuple[float, bytes]]) -> None:
        while True:
            try:
                data = source.recv(65536)
            except OSError:
                data = b""
            now = time.monotonic()
            slow = PLANTED if way == self._way and now >= self.slow_from else 0.0
            queue.put((now + slow, data))
            if not data:
                return

    def _give(self, queue: SimpleQueue[tuple[float, bytes]], sink: socket.socket) -> None:
        with sink, contextlib.suppress(OSError):
            while True:
                due, data = queue.get()
                if not data:
                    return
                time.sleep(max(due - time.monotonic(), 0.0))
                sink.sendall(data)


def start(*words: str | Path, before: list[str] | None = None) -> subprocess.Popen[str]:
    return subprocess.Popen(
        tied(*(before or []), sys.executable, "-m", "rths", *words),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
    )


@pytest.fixture
def time_namespaces() -> None:
    if (
        shutil.which("unshare") is None
        or subprocess.run([*APART, "true"], capture_output=True, timeout=HANG_S).returncode
    ):
        pytest.skip("time namespaces are not allowed here")


@pytest.mark.usefixtures("time_namespaces")
@pytest.mark.parametrize(
    ("way", "segment", "other"),
    [("there", "command_one_way", "feedback_one_way"), ("back", "feedback_one_way", "command_one_way")],
)
def test_a_delay_in_one_direction_appears_in_that_segment(
    tmp_path: Path, way: str, segment: str, other: str
) -> None:
    for attempt in range(ATTEMPTS):
        place = tmp_path / str(attempt)
        place.mkdir()
        middle = medians(place, way, (segment, other, "clock_offset"))
        more = {name: after - before for name, (before, after) in middle.items()}
        if (
            abs(more[other]) < CLOSE and abs(more[segment] - PLANTED) < CLOSE
        ):  # else the machine's load has changed
            break
    assert middle["clock_offset"][0] == pytest.approx(1.0, abs=CLOSE)
    assert more[segment] == pytest.approx(PLANTED, abs=CLOSE)
    assert more[other] == pytest.approx(0.0, abs=CLOSE)


def medians(folder: Path, way: str, names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Medians of latencies (s) in a test before and after one way of the link becomes slower."""
    listen, path = listenable(), folder / "delayed.mcap"
    words = (str(patient(folder)), "--duration", str(SECONDS))
    master = start("master", *words, "--listen", listen, "--json")
    relay = DelayingRelay(int(listen.rpartition(":")[2]), way)
    recorder = start("record", *words, "--connect", listen, "-o", path)
    slave = start("slave", *words, "--connect", f"tcp/127.0.0.1:{relay.port}", before=APART)
    processes = (master, slave, recorder)
    try:
        assert master.stdout is not None
        for line in master.stdout:
            if '"running"' in line or '"progress"' in line:
                relay.slow_from = time.monotonic() + SINCE
                break
        errors = [process.communicate(timeout=HANG_S)[1] for process in processes]
    finally:
        for process in processes:
            process.kill()
            process.communicate()
    assert [process.returncode for process in processes] == [0, 0, 0], errors
    latency = read(path).columns["latency"]
    t = latency["seq"] * 0.002
    before, after = (t > 1.0) & (t < SINCE - 0.5), t > SINCE + 0.5
    return {
        name: (float(np.nanmedian(latency[name][before])), float(np.nanmedian(latency[name][after])))
        for name in names
    }
