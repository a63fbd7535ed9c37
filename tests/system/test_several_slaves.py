"""Several slaves on one master: real processes, sockets, signals and files."""

from __future__ import annotations

import itertools
import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from common.recording.reader import read
from common.recording.run import Run
from tests.helpers import PATIENT, SLOW_TOWER
from tests.system.started import finish, free_port, start, wait_for_ticks
from tests.system.test_real_time import differing_from_virtual_time

pytestmark = pytest.mark.slow

TEXT = """
[test]
name = "several"
duration = 3.0
[structure]
mass = [160000.0, 160000.0, 160000.0]
stiffness = [126e6, 126e6, 126e6]
damping = [1e6, 1e6, 1e6]
[column]
stiffness = 63e6
"""
IMPATIENT = "[link]\nloss_timeout = 0.5\n[recording]\npatience = 1.0\n"


def plan_file(folder: Path, *names: str, more: str = "") -> Path:
    path = folder / "several.toml"
    slaves = "".join(f"[slave.{name}.damper]\nfloor = {1 + place % 3}\n" for place, name in enumerate(names))
    path.write_text(TEXT + slaves + PATIENT + more)
    return path


@pytest.fixture(scope="module")
def real_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Run]:
    """Three seconds with two slaves in real time: summary and recording."""
    folder = tmp_path_factory.mktemp("two")
    code, out, err = finish(
        start("run", plan_file(folder, "roof", "middle"), "-o", folder / "two.mcap", "--json")
    )
    assert code == 0, err
    return json.loads(out), read(folder / "two.mcap")


def test_every_tick_of_every_slave_is_recorded(real_run: tuple[dict[str, Any], Run]) -> None:
    summary, recording = real_run
    assert recording.finished
    assert summary["recorder"]["cause"] == "completed"
    for topic in ("master", "slave.roof", "slave.middle", "latency.roof", "latency.middle"):
        assert recording.sequences[topic].tolist() == list(range(1500))
        assert summary["topics"][topic]["missing"] == 0
    assert summary["latency"]["middle"]["round_trip"]["p50"] < 2e-3


def test_a_real_test_of_two_slaves_replays_to_the_last_bit(real_run: tuple[dict[str, Any], Run]) -> None:
    code, out, err = finish(start("replay", real_run[1].path))
    assert code == 0, out + err
    assert "slave.middle/table_command" in out


def test_real_time_equals_virtual_time_until_a_message_of_any_slave_is_late(tmp_path: Path) -> None:
    path = tmp_path / "slow.toml"
    path.write_text(
        f"{SLOW_TOWER}[slave.roof.damper]\nfloor = 3\n[slave.middle.damper]\nfloor = 2\n{PATIENT}"
    )
    assert differing_from_virtual_time(path) == []


@pytest.mark.parametrize("count", [4, 8])
def test_tests_with_four_and_eight_slaves_run_in_real_time(count: int, tmp_path: Path) -> None:
    names = [f"lab{place}" for place in range(count)]
    path = tmp_path / "many.mcap"
    code, out, err = finish(
        start("run", plan_file(tmp_path, *names), "--duration", "1", "-o", path, "--json"), 90.0
    )
    assert code == 0, err
    assert {facts["missing"] for facts in json.loads(out)["topics"].values()} == {0}
    assert read(path).columns["master"]["damper_force_used"].shape == (500, count)


Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def by_hand(tmp_path: Path) -> Iterator[Start]:
    """Starts processes of a long test with the slaves roof and middle, as on several machines."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    plan, running = plan_file(tmp_path, "roof", "middle", more=IMPATIENT), []

    def one(module: str, *words: str | Path) -> subprocess.Popen[str]:
        option = "--listen" if module == "master" else "--connect"
        running.append(start(plan, "--duration", "60", option, endpoint, *words, module=module))
        return running[-1]

    yield one
    for process in running:
        process.kill()
        process.communicate()


def test_a_killed_slave_of_two_ends_the_test_with_exit_code_4_and_is_named(
    by_hand: Start, tmp_path: Path
) -> None:
    roof, middle = by_hand("slave", "--name", "roof"), by_hand("slave", "--name", "middle")
    by_hand("recorder", "-o", tmp_path / "a.mcap")
    master = by_hand("master")
    wait_for_ticks(tmp_path / "a.mcap")
    middle.kill()
    code, _, err = finish(master)
    assert code == 4
    assert "The slave 'middle' has been silent for 0.5 s." in err
    code, _, err = finish(roof)
    assert code == 3
    assert "The master stopped the test: The slave 'middle' has been silent for 0.5 s." in err


def test_a_second_slave_under_the_same_name_is_refused_and_the_test_goes_on(
    by_hand: Start, tmp_path: Path
) -> None:
    for name in ("roof", "middle"):
        by_hand("slave", "--name", name)
    by_hand("recorder", "-o", tmp_path / "a.mcap")
    master = by_hand("master")
    wait_for_ticks(tmp_path / "a.mcap")
    code, _, err = finish(by_hand("slave", "--name", "roof"))
    assert code == 2, err
    assert "Another slave 'roof' takes part in this test already: stop one of the two" in err
    assert "Traceback" not in err
    before = read(tmp_path / "a.mcap").ticks("slave.roof")
    wait_for_ticks(tmp_path / "a.mcap", before + 500)
    assert master.poll() is None


def test_one_of_two_slaves_that_wait_under_the_same_name_is_refused(by_hand: Start, tmp_path: Path) -> None:
    same = [by_hand("slave", "--name", "roof") for _ in range(2)]
    by_hand("slave", "--name", "middle")
    by_hand("recorder", "-o", tmp_path / "a.mcap")
    by_hand("master")
    wait_for_ticks(tmp_path / "a.mcap")
    ended = [process for process in itertools.chain(same) if process.poll() is not None]
    assert [process.returncode for process in ended] == [2]
    assert "takes part in this test already" in ended[0].communicate()[1]


def test_a_slave_under_an_unknown_name_gives_exit_code_2(by_hand: Start) -> None:
    code, _, err = finish(by_hand("slave", "--name", "rof"))
    assert code == 2
    assert "The plan names no slave 'rof': did you mean roof?" in err
    code, _, err = finish(by_hand("slave"))
    assert code == 2
    assert "with --name (roof, middle)" in err
