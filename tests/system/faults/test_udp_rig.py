"""A rig in another process, in real time: its process is killed, and the master's."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from common.errors import LostError
from common.recording.reader import read
from common.udp.packets import RigState
from common.udp.peer import Peer
from common.udp.rig import Terms, echoes
from tests.helpers import ROOT
from tests.processes import HANG_S, environment
from tests.system.faults.bench import INTERVAL, DisturbedError, undisturbed

pytestmark = pytest.mark.faults


@contextlib.contextmanager
def running(folder: Path) -> Iterator[tuple[subprocess.Popen[str], subprocess.Popen[bytes], int]]:
    """A test whose ticks have begun, its rig's process, and the port of that."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    text = (ROOT / "examples" / "udp_rig.toml").read_text().replace("9100", str(port))
    text = text.replace("duration = 10.0", f"duration = 30.0\ninterval = {INTERVAL}")
    (folder / "p.toml").write_text(text)
    server: list[str | Path] = [
        sys.executable,
        ROOT / "examples" / "udp_rig.py",
        "--listen",
        f"127.0.0.1:{port}",
    ]
    words: list[str | Path] = [
        sys.executable,
        "-m",
        "rths",
        "run",
        folder / "p.toml",
        "-o",
        folder / "p.mcap",
        "--beside",
        "--accept-risk",
        "rig",
    ]
    with (
        subprocess.Popen(server) as rig,
        (folder / "said").open("w") as said,
        subprocess.Popen(words, cwd=ROOT, env=environment(), stdout=said, stderr=said, text=True) as test,
    ):
        try:
            wait_for(folder / "said", "drift")
            time.sleep(0.5)
            yield test, rig, port
        finally:
            test.terminate()
            test.wait(60.0)
            rig.kill()


def wait_for(path: Path, word: str) -> None:
    """Until a file has a word."""
    end = time.monotonic() + HANG_S
    while word not in path.read_text():
        assert time.monotonic() < end, path.read_text()
        time.sleep(0.05)


def test_a_killed_rig_ends_the_test_with_one_sentence_and_both_laboratories_come_to_rest(
    tmp_path: Path,
) -> None:
    def scenario(folder: Path) -> None:
        with running(folder) as (test, rig, _):
            rig.kill()
            code = test.wait(30.0)
        said = (folder / "said").read_text()
        if code == LostError.exit_code:
            raise DisturbedError(f"a laboratory was held up first: {said}")
        assert code == 3
        assert "for 5 intervals in a row no valid answer was there" in said
        modes = [event for event in read(folder / "p.mcap").events if event["code"] == "mode"]
        last = {event["lab"]: event["text"] for event in modes}
        assert all("→ safe" in text for text in last.values()), last

    undisturbed(scenario, tmp_path)


def test_a_rig_whose_master_is_killed_stops_on_its_own(tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with running(folder) as (test, _, port):
            listed = subprocess.run(
                ["ps", "--ppid", str(test.pid), "-o", "pid=,args="], capture_output=True, text=True
            )
            (master,) = (line.split()[0] for line in listed.stdout.splitlines() if " -m master " in line)
            os.kill(int(master), signal.SIGKILL)
            time.sleep(
                10 * INTERVAL + 0.1
            )  # the silence that the packets named, and the example's own look at it
            terms = Terms(f"udp/{port}", "[rig]", INTERVAL, 0, 0.1, 1.0, 1.0, 5, paced=True)
            answer = echoes(Peer(terms.address, terms.where), terms, 7, 0).answer
            assert answer is not None
            assert (answer.state, answer.text) == (
                RigState.STOPPED,
                f"no packet for {10e3 * INTERVAL:.0f} ms",
            )
            assert test.wait(60.0) == 4

    undisturbed(scenario, tmp_path)
