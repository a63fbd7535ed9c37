"""Tests with rigs in other processes give the same bits as with rigs in this process, and come to rest."""

from __future__ import annotations

import contextlib
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.lab.preflight import Gate
from common.plan.laboratory_tables import LaboratoryTable, RigTable
from common.plan.patience import strict
from common.plan.plan import Plan
from common.plan.read import load, parse
from common.reality.reality import as_planned, from_reality
from common.recording.reader import read
from common.recording.run import Run
from common.roles import MASTER
from common.safety.modes import Mode
from common.udp import probe
from common.udp import rig as udp
from common.udp.packets import Asked
from common.udp.rig import Terms
from laboratories import kinds
from laboratories.emulated import EmulatedLab
from laboratories.sensors import noise
from loop.realised import true_system
from simulation import virtual
from tests.common.udp.server import example, scripted, served, words
from tests.helpers import ROOT, with_table
from tests.shapes import plan_of


def played(plan: Plan, path: Path) -> tuple[virtual.VirtualTest, Run, Exception | None]:
    bench = virtual.assemble(plan, as_planned(plan), path)
    error = virtual.run(bench, str)
    return bench, read(path), error


@contextlib.contextmanager
def apart(plan: Plan) -> Iterator[Plan]:
    """The plan with each of its emulated laboratories in a server of its own."""
    reality = as_planned(plan)
    with contextlib.ExitStack() as stack:
        for role in plan.kinds:
            own, kind = reality.of(role), kinds.kind_of(plan, role)
            at = noise.LAB_A if role == MASTER else noise.LAB_B + own.place
            seed, system = noise.lab_seed(reality.seed, at), true_system(own)

            def build(_interval: float, given: int, kind=kind, system=system, seed=seed) -> EmulatedLab:  # type: ignore[no-untyped-def]
                assert given == seed
                return EmulatedLab(kind, system, given)

            rig = RigTable(address=stack.enter_context(served(build, words(kind.channels))))
            lab = plan.slaves.get(role.partition(".")[2])
            if lab is not None:
                plan = replace(plan, slaves=plan.slaves | {role.partition(".")[2]: replace(lab, rig=rig)})
            elif role == MASTER:
                plan = replace(plan, master=LaboratoryTable(rig, plan.master.kind))
            else:
                plan = replace(plan, slave=LaboratoryTable(rig, plan.slave.kind))
        yield plan


def same(one: Run, other: Run) -> None:
    for topic in ("master", *one.roles):
        for name, values in one.columns[topic].items():
            assert np.array_equal(values, other.columns[topic][name]), f"{topic}/{name}"


def own_kind() -> Plan:
    plan = load(ROOT / "examples" / "viscous_damper.toml")
    return plan.with_ticks(300)


@pytest.mark.parametrize("shape", ["swapped", "two_columns", "own"])
def test_laboratories_of_every_kind_in_other_processes_give_the_same_bits(shape: str, tmp_path: Path) -> None:
    plan = (
        own_kind() if shape == "own" else plan_of(shape, test={"duration": 0.6}, ground_motion={"scale": 2.0})
    )
    _, inside, error = played(plan, tmp_path / "inside.mcap")
    assert error is None
    with apart(plan) as remote:
        assert not remote.emulated
        bench, outside, error = played(remote, tmp_path / "outside.mcap")
    assert error is None
    same(inside, outside)
    assert {loop.lab.safety.mode for loop in bench.loops.values()} == {Mode.IDLE}
    told = [event for event in outside.events if event["code"] == "rig_exchange"]
    assert len(told) == len(plan.kinds)
    assert all(event["values"]["missed"] == 0.0 for event in told)


COLUMN = f"{ROOT}/examples/udp_rig.py:Column"


def example_plan() -> Plan:
    return load(ROOT / "examples" / "udp_rig.toml").with_ticks(300)


def in_process(path: Path) -> Run:
    plan = example_plan()
    rig = {"class": COLUMN}
    reality = from_reality({"master": {"rig": rig}}, plan, ROOT)
    bench = virtual.assemble(plan, reality, path)
    assert virtual.run(bench, str) is None
    return read(path)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example in C, compiled."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler on this machine")
    program = tmp_path_factory.mktemp("c") / "udp_rig"
    source = ROOT / "examples" / "udp_rig.c"
    words = [compiler, "-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off"]
    subprocess.run([*words, "-o", program, source, "-lm"], check=True)
    return program


def test_the_example_rig_in_c_gives_the_same_bits_as_the_one_in_python(
    compiled: Path, tmp_path: Path
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    program = subprocess.Popen([compiled, "127.0.0.1", str(port)])
    try:
        time.sleep(0.2)
        rig = RigTable(address=f"udp/{port}")
        plan = replace(example_plan(), master=LaboratoryTable(rig))
        _, found, error = played(plan, tmp_path / "c.mcap")
    finally:
        program.kill()
        program.wait()
    assert error is None
    same(in_process(tmp_path / "python.mcap"), found)


def test_if_a_rig_falls_silent_the_test_holds_and_then_comes_to_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(udp, "FREE_NS", 100_000_000)

    def answers(kind: int, count: int, _packet: bytes, answer: bytes) -> list[bytes]:
        return [] if kind == Asked.COMMAND and 100 <= count < 110 else [answer]

    with scripted(answers) as address:
        plan = replace(example_plan(), master=LaboratoryTable(RigTable(address=address)))
        plan = with_table(plan, "safety", hold_after=2, ramp_after=4)
        bench, found, error = played(plan, tmp_path / "a.mcap")
    assert str(error).startswith(
        f"laboratory A ({address}): for 4 intervals in a row no valid answer was there"
    )
    modes = [event["text"] for event in found.events if event["code"] == "mode" and event["lab"] == MASTER]
    assert [text.partition(" (")[0] for text in modes[-3:]] == [
        "running → holding",
        "holding → ramping",
        "ramping → safe",
    ]
    assert {loop.lab.safety.mode for loop in bench.loops.values()} == {Mode.SAFE}
    (told,) = (event for event in found.events if event["code"] == "rig_exchange")
    assert told["values"]["missed"] >= 4.0


def test_if_a_rig_answers_again_in_time_the_test_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(udp, "FREE_NS", 100_000_000)
    modes: list[int] = []

    def answers(kind: int, count: int, packet: bytes, answer: bytes) -> list[bytes]:
        modes.append(int.from_bytes(packet[40:42], "little"))
        return [] if kind == Asked.COMMAND and 100 <= count < 103 else [answer]

    with scripted(answers) as address:
        plan = replace(example_plan(), master=LaboratoryTable(RigTable(address=address)))
        plan = with_table(plan, "safety", hold_after=2, ramp_after=5)
        _, found, error = played(plan, tmp_path / "a.mcap")
    assert error is None
    held = [event["text"] for event in found.events if "holding" in event["text"]]
    assert [text.partition(" (")[0] for text in held] == ["running → holding", "holding → running"]
    spoken = list(dict.fromkeys(modes))  # to the rig: an echo has none
    assert spoken == [0, 1, 3, 4, 5]


def test_the_examples_column_equals_the_served_one(tmp_path: Path) -> None:
    with served(example.Column, example.CHANNELS) as address:
        plan = replace(example_plan(), master=LaboratoryTable(RigTable(address=address)))
        _, found, error = played(plan, tmp_path / "a.mcap")
    assert error is None
    same(in_process(tmp_path / "b.mcap"), found)


def test_a_recording_contains_nothing_about_a_rig_from_a_reality(tmp_path: Path) -> None:
    gate = Gate()
    plan = parse("[test]\nduration = 0.2\n", tmp_path)
    with served(example.Column, example.CHANNELS) as address:
        reality = from_reality({"master": {"rig": {"address": address}}}, plan, tmp_path)
        bench = virtual.assemble(plan, reality, tmp_path / "a.mcap", gate=gate)
        assert virtual.run(bench, str) is None
    assert address not in (tmp_path / "a.mcap").read_bytes().decode("latin-1")
    assert not [event for event in read(tmp_path / "a.mcap").events if event["code"] == "rig_exchange"]


@pytest.mark.parametrize("late", [False, True])
def test_a_rig_that_answers_too_slowly_for_real_time_is_refused_by_name(late: bool) -> None:
    plan = parse("", Path())
    terms = Terms("udp/9100", "[master.rig]", 0.002, 1, 0.5e-3, 1.0, 0.02, 5, paced=True)
    trips = [2e-4] * 40 + [1e-3 if late else 3e-4] * 10
    risk = probe.slow(terms, trips, 0, strict(plan))
    assert (risk is not None) is late
    lost = probe.slow(terms._replace(paced=False), trips, 3, strict(plan))
    assert lost is not None
    assert "of 53 exchanges with the rig at udp/9100 3 were lost and 0 took longer" in lost.sentence
