"""The doctor: its verdict on made-up findings, and a short check as a user calls it."""

from __future__ import annotations

import copy
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from common.errors import InputError
from common.protocol import codec
from common.protocol.messages import Command, Feedback
from rths.checkup import children, clock, disk, exchange, rivals, verdict
from tests.helpers import ROOT
from tests.processes import HANG_S

RTHS = [sys.executable, "-m", "rths", "doctor"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
PERCENTILES = {"p50": 5e-5, "p90": 6e-5, "p99": 1e-4, "p99.9": 2e-4, "max": 9e-4}

GOOD: dict[str, Any] = {
    "interval": 0.002,
    "rt": "auto",
    "realtime": {"priority": 49, "processor": 1, "memory_locked": True, "missing": []},
    "wake_up": {name: PERCENTILES | {"ticks": 4000, "late": 0} for name in ("ordinary", "fifo")},
    "round_trip": {"exchanges": 4000, "late": 0, "round_trip": PERCENTILES, "wake_lateness": PERCENTILES},
    "clock": {"resolution": 5e-8, "read_time": 5e-8, "synchronised": True},
    "disk": {"folder": "/runs", "worst_sync": 0.01, "rate": 5e7, "free": 10**11},
    "machine": {"stolen_share": 0.0, "processors": 2.0},
    "facts": {"clocksource": "tsc"},
    "rivals": [],
}


def judged(*change: tuple[str, Any]) -> tuple[verdict.CheckVerdict, list[str]]:
    """The verdict on the good findings with some changed ('part.key' and its value), and which checks failed."""
    report = copy.deepcopy(GOOD)
    for path, value in change:
        *parts, last = path.split("/")
        place = report
        for part in parts:
            place = place[part]
        place[last] = value
    found = verdict.checks(report)
    assert all(check.advice.endswith((".", "")) for check in found)
    return verdict.verdict(report, found), [check.name for check in found if not check.passed]


def test_a_good_machine_passes_every_check() -> None:
    found, failed = judged()
    assert (found.state, found.passed, failed) == ("holds", True, [])
    assert found.sentence == (
        "2 ms will hold here: waking up and the round trip take 0.40 ms in all but one interval of a thousand."
    )


@pytest.mark.parametrize(
    ("change", "state", "failed"),
    [
        (("wake_up/fifo/late", 5), "fails", ["wake-up"]),
        (("wake_up/fifo/p99.9", 1.9e-3), "fails", ["wake-up + round trip"]),
        (("round_trip/late", 4), "fails", ["late exchanges"]),
        (("round_trip", {"error": "The answering process was not heard."}), "fails", ["late exchanges"]),
        (("wake_up/fifo", {}), "fails", ["wake-up"]),
        (("clock/resolution", 4e-3), "fails", ["clock"]),
        (("disk/worst_sync", 1.2), "holds", ["disk, worst sync"]),
        (("disk/rate", 1e5), "holds", ["disk, rate"]),
        (("disk/free", 1000), "holds", ["disk, free"]),
        (("disk", {"folder": "/runs", "error": "Permission denied"}), "holds", ["disk"]),
        (("machine/stolen_share", 0.03), "not judged", ["stolen time"]),
    ],
)
def test_each_check_can_fail_with_one_sentence(
    change: tuple[str, Any], state: str, failed: list[str]
) -> None:
    found, names = judged(change)
    assert (found.state, names) == (state, failed)
    assert not found.passed
    assert found.sentence.count("\n") == 0


def test_a_few_late_exchanges_or_a_missing_priority_pass_with_a_remark() -> None:
    late, _ = judged(("round_trip/late", 3))
    assert (late.state, late.passed) == ("mostly", True)
    assert "3 of 4000 exchanges were late" in late.sentence
    ordinary, _ = judged(("wake_up", {"ordinary": GOOD["wake_up"]["ordinary"]}))
    assert (ordinary.state, ordinary.passed) == ("mostly", True)
    assert "without a real-time priority" in ordinary.sentence


def test_a_missing_privilege_is_a_note_unless_the_mode_requires_it() -> None:
    missing = ("realtime/missing", ["No real-time priority: the limit RLIMIT_RTPRIO is 0; run as root."])
    assert judged(missing)[1] == []
    assert judged(missing, ("rt", "on"))[1] == ["real time"]
    report = copy.deepcopy(GOOD)
    report["realtime"]["missing"] = missing[1]
    report["clock"]["synchronised"] = False
    report["facts"]["governor"] = "powersave"
    report["rivals"] = ["fifo 80 spin (process 7)"]
    report["machine"]["throttled"] = 3.0
    assert len(verdict.notes(report)) == 5
    assert verdict.notes(GOOD) == []


def test_stolen_time_leaves_the_verdict_open() -> None:
    found, _ = judged(("machine/stolen_share", 0.031), ("wake_up/fifo/late", 50))
    assert found.sentence.startswith("2 ms is not judged: the host took 3.1 % of the processors' time")
    assert "was not kept" in found.sentence


def test_messages_have_zeros_in_all_fields_but_the_session() -> None:
    for message in (Command, Feedback):
        filled = exchange.filled(message, session=1)
        assert filled.session == 1
        assert not any(value for name, value in filled._asdict().items() if name != "session")


def test_the_doctors_exchange_messages_can_be_encoded() -> None:
    key = codec.session_key(1, exchange.TEST)
    for message in (exchange.COMMAND, exchange.FEEDBACK):
        assert codec.decode(codec.encode(message, key), key) == message


def test_a_slave_that_fails_ends_the_exchange_with_its_message(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rths.checkup.children.realtime.assign", lambda _count: [None, 10**6])
    _, found = children.exchange(2_000_000, 1.0, "on")
    assert "the exchange did not end" not in found["error"]


def test_percentiles_follow_the_nearest_rank() -> None:
    assert exchange.percentiles([]) == {}
    found = exchange.percentiles(list(range(1000, 0, -1)))
    assert found == {"p50": 500e-9, "p90": 900e-9, "p99": 990e-9, "p99.9": 999e-9, "max": 1000e-9}


def test_the_disk_is_measured_in_the_nearest_existing_folder_and_no_file_remains(tmp_path: Path) -> None:
    assert disk.nearest(tmp_path / "not" / "there") == tmp_path
    found = disk.measure(tmp_path, time.monotonic() + 0.2)
    assert found["syncs"] >= 1
    assert 0.0 < found["median_sync"] <= found["worst_sync"]
    assert found["free"] > 0
    assert list(tmp_path.iterdir()) == []
    assert disk.measure(Path("/proc"), 0.0)["error"]


def test_a_file_with_the_name_of_the_output_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is a file"):
        disk.nearest(tmp_path / "file" / "runs")


def test_an_unreadable_folder_is_judged_by_its_parent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def exists(place: Path) -> bool:
        if place != tmp_path:
            raise PermissionError(13, "Permission denied")
        return True

    monkeypatch.setattr(Path, "exists", exists)
    assert disk.nearest(tmp_path / "secret" / "runs") == tmp_path


def test_the_clock_check_gives_resolution_read_time_and_slew() -> None:
    watch = clock.ClockWatch()
    time.sleep(0.1)
    values = watch.values()
    assert 0.0 < values["resolution"] < 0.1
    assert 0.0 < values["read_time"] < 0.1
    assert abs(values["slew"]) < 0.1


def test_other_programs_with_a_real_time_priority_are_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rivals, "PROC", tmp_path)
    for pid, words, priority in ((10, b"spin\0now\0", 80), (11, b"", 50), (12, b"calm\0", 0)):
        (tmp_path / str(pid)).mkdir()
        (tmp_path / str(pid) / "cmdline").write_bytes(words)
        fields = ["S", *["0"] * 36, str(priority), "1", "0"]
        (tmp_path / str(pid) / "stat").write_text(f"{pid} (a (b) c) {' '.join(fields)}\n")
    assert [rival.split(" ", 1)[1].split(" (")[0].endswith("spin now") for rival in rivals.rivals()] == [True]


@pytest.mark.parametrize("option", [("--seconds", "1"), ("--interval", "0"), ("--seconds", "nan")])
def test_times_that_cannot_be_used_are_refused(option: tuple[str, str]) -> None:
    done = subprocess.run([*RTHS, *option], capture_output=True, text=True, env=ENVIRONMENT, timeout=HANG_S)
    assert done.returncode == 2
    assert "cannot be used" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_short_check_has_all_parts_and_a_verdict(tmp_path: Path) -> None:
    words = [*RTHS, "--seconds", "4", "--json", "-o", str(tmp_path / "runs")]
    done = subprocess.run(words, capture_output=True, text=True, env=ENVIRONMENT, timeout=HANG_S)
    assert done.returncode in (0, 1), done.stderr
    report = json.loads(done.stdout)
    assert {*GOOD, "checks", "notes", "verdict", "seconds"} <= set(report)
    assert report["wake_up"]["ordinary"]["ticks"] > 0
    assert report["round_trip"]["exchanges"] > 0
    assert report["round_trip"]["round_trip"]["p50"] > 0.0
    assert report["disk"]["worst_sync"] > 0.0
    assert report["verdict"]["passed"] is (done.returncode == 0)
    assert all(check["passed"] or check["advice"] for check in report["checks"])
    assert list(tmp_path.iterdir()) == []


def children_of(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


@pytest.mark.skipif(sys.platform != "linux", reason="children are found in /proc")
@pytest.mark.parametrize(("number", "expected"), [(signal.SIGINT, 3), (signal.SIGKILL, -signal.SIGKILL)])
def test_an_interrupted_check_leaves_no_child_process(number: int, expected: int) -> None:
    # a machine that stops for half a minute does not reach the end of the check
    words = [*RTHS, "--rt", "off", "--seconds", "300"]
    doctor = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
    assert doctor.stderr is not None
    assert doctor.stderr.readline().startswith("doctor: round trip")
    while len(left := children_of(doctor.pid)) < 2:
        time.sleep(0.02)
        assert doctor.poll() is None
    time.sleep(0.5)
    doctor.send_signal(number)
    _, complaint = doctor.communicate(timeout=HANG_S)
    assert doctor.returncode == expected
    assert "Traceback" not in complaint
    deadline = time.monotonic() + HANG_S
    while alive := [pid for pid in left if running(pid)]:
        assert time.monotonic() < deadline, alive
        time.sleep(0.05)


def running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False
