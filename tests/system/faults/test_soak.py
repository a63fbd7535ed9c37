"""Fault rows F41 and F56: a long test with a fault every ten seconds that it survives.

It lasts 50 s, or as many seconds as RTHS_SOAK says (7200 at most).
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from common.lab.outlet import kept_seconds
from common.recording.run import Run
from tests.faults.rows import passed
from tests.helpers import JUMPS
from tests.system.faults.bench import INTERVAL, Bench, Place, undisturbed
from tests.system.faults.network import PORT, Network, inside, network
from tests.system.faults.reactions import exchanged, later

pytestmark = pytest.mark.soak

SECONDS = float(os.environ.get("RTHS_SOAK", "50"))
SLOT, LASTS = 10.0, 6.0  # s: a fault begins in every slot, and is over some time before the next
HOGS = 4
LATE = 0.002  # s
# a shared machine pauses in ten minutes for longer than a watchdog waits; what must hold in a soak is the rest
SHARED = "hold_after = 100\nramp_after = 200\noverrun = 200"
PATIENCE = "[recording]\npatience = 5.0\n"  # s: how long a laboratory's stream is kept follows from it
SETTLED = 2.0  # s after which a laboratory that keeps no more than before has settled
GROWTH = 1_000_000  # bytes that a process may grow from then to the end, however long that is
INDEX = 1_000  # bytes a second beside that: the recorder's index of its chunks takes 700
ROLES = ("master", "slave", "recorder")


class Soak:
    """The test, and what befalls it."""

    def __init__(self, bench: Bench, machines: Network) -> None:
        self.bench = bench
        self._machines = machines
        self._inside = inside(machines.master)
        self.dropped = 0
        self.slots: list[tuple[str, float, float]] = []  # name, begin and end in test time, s

    def quiet(self) -> None:
        """Nothing happens."""
        time.sleep(LASTS)

    def recorder_stopped(self) -> None:
        """The recorder is held up."""
        self.bench.recorder.signal(signal.SIGSTOP)
        time.sleep(LASTS / 2)
        self.bench.recorder.signal(signal.SIGCONT)

    def loss(self) -> None:
        """Of all datagrams 1 in 200 is lost."""
        self._machines.drop(self._machines.master, "meta l4proto udp numgen random mod 1000 < 5")
        time.sleep(LASTS)
        self.dropped += self._machines.keep(self._machines.master)

    def garbage(self) -> None:
        """Strangers send datagrams to the port."""
        words = ("-m", "tests.system.faults.hostile", str(PORT), "5000")
        subprocess.run([*self._inside, sys.executable, *words], check=True, timeout=LASTS + 60.0)

    def hogs(self) -> None:
        """Processes that compute as much as they can."""
        busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(HOGS)]
        try:
            time.sleep(LASTS)
        finally:
            for process in busy:
                process.kill()
                process.wait()

    def run(self) -> None:
        """All faults once, then as chance has it, until the test is over."""
        faults: list[Callable[[], None]] = [
            self.quiet,
            self.loss,
            self.recorder_stopped,
            self.garbage,
            self.hogs,
        ]
        chance = random.Random(1)
        for number in range(int(SECONDS // SLOT)):
            self.bench.until(number * SLOT + 1.0)
            fault = faults[number] if number < len(faults) else chance.choice(faults)
            begin = self.bench.now()
            fault()
            self.slots.append((fault.__name__, begin, self.bench.now()))

    def late(self, run: Run, name: str) -> NDArray[np.bool_]:
        """Which of the ticks under a fault began late."""
        latency = run.columns["latency"]
        t, late = latency["seq"] * INTERVAL, latency["wake_lateness"] > LATE
        under = [late[(t >= begin) & (t < end)] for fault, begin, end in self.slots if fault == name]
        return np.concatenate(under)


class Watch:
    """Memory and open files of the processes, once a second.

    Memory is what a process has taken for itself: of the files it maps, a rig's log among them, the pages that it has
    touched count as resident too, and are none of its own.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self.memory: dict[str, list[tuple[float, int]]] = {role: [] for role in ROLES}
        self.files: dict[str, list[int]] = {role: [] for role in ROLES}

    def __enter__(self) -> Watch:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join(10.0)

    def _watch(self) -> None:
        while not self._over.wait(1.0):
            for role in ROLES:
                number = getattr(self._bench, role).pid
                with contextlib.suppress(OSError, StopIteration):  # it has ended
                    own = anonymous(number)
                    self.files[role].append(len(os.listdir(f"/proc/{number}/fd")))  # noqa: PTH208
                    self.memory[role].append((self._bench.now(), own))

    @property
    def full(self) -> float:
        """Test time after which a laboratory keeps no more of what the recorder might ask for again, s."""
        return kept_seconds(self._bench.plan) + SETTLED

    def growth(self, role: str) -> float:
        """Bytes by which a process has grown since it was full, of the line through what was seen."""
        seen = np.array([(t, size) for t, size in self.memory[role] if self.full < t < SECONDS - 1.0])
        slope = np.polyfit(seen[:, 0], seen[:, 1], 1)[0]
        return float(slope * (seen[-1, 0] - seen[0, 0]))


def anonymous(number: int) -> int:
    """Resident bytes of a process that are of no file; raises StopIteration where it has ended."""
    lines = Path(f"/proc/{number}/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("RssAnon:"))


@pytest.fixture(scope="module")
def machines() -> Iterator[Network]:
    with network() as found:
        yield found


def test_f56_a_soak_with_a_fault_every_ten_seconds(machines: Network, tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        endpoint = f"udp/127.0.0.1:{PORT}"
        into = dict.fromkeys(ROLES, inside(machines.master))
        place = Place(endpoint, {"slave": endpoint, "recorder": endpoint}, into)
        with Bench(
            folder, place, duration=SECONDS, stay=False, safety=SHARED, more=JUMPS + PATIENCE
        ).start_all() as bench:
            soak = Soak(bench, machines)
            with Watch(bench) as watch:
                soak.run()
                bench.ticked()
            run = bench.finish()
        account(run, soak)
        hogs(run, soak)
        growth = {role: watch.growth(role) for role in ROLES}
        print("growth", growth, {role: (watch.files[role][3], watch.files[role][-3]) for role in ROLES})
        print(soak.slots, soak.dropped)
        assert max(growth.values()) < GROWTH + INDEX * (SECONDS - watch.full), growth
        for role in ROLES:
            assert watch.files[role][-3] <= watch.files[role][3], watch.files[role]
        text = ", ".join(f"{role} {size / 1e3:+.0f} kB" for role, size in growth.items())
        how = f"{SECONDS:g} s, a fault every {SLOT:g} s"
        evidence = f"every message accounted for, {bench.plan.ticks} ticks recorded; memory {text}"
        passed("F56", "soak", how, "running", None, 0.0, evidence)

    undisturbed(scenario, tmp_path)


def account(run: Run, soak: Soak) -> None:
    """Everything that was sent was used, rejected or lost, and no more was lost than the kernel dropped."""
    master, slave = exchanged(run, "master"), exchanged(run, "slave")
    ways = (
        (master["slave.commands_sent"], slave["commands.used"], slave["commands.rejected"]),
        (slave["feedbacks_sent"], master["slave.feedbacks.used"], master["slave.feedbacks.rejected"]),
    )
    print(ways, soak.dropped)
    for sent, used, rejected in ways:
        lost = sent - used - rejected
        assert sent >= soak.bench.plan.ticks - 100
        assert 0 <= lost <= soak.dropped, ways
    for topic in ("master", "slave", "latency"):
        assert run.sequences[topic].tolist() == list(range(soak.bench.plan.ticks))


def hogs(run: Run, soak: Soak) -> None:
    """Under load no more ticks begin late than without, but for one in a thousand."""
    late, quiet = soak.late(run, "hogs"), soak.late(run, "quiet")
    later(late, quiet, "hogs")
    evidence = f"ticks over 2 ms late: {late.mean() * 100:.2f} %, without hogs {quiet.mean() * 100:.2f} %"
    passed("F41", "four busy processes", "FIFO priority", "running", None, 0.0, evidence)
