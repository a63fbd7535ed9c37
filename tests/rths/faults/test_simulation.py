"""Whole tests on simulated machines: without faults they equal virtual time, and faults have their effects."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from common.plan.plan import Plan
from common.protocol.codec import Reject
from common.reality.reality import as_planned
from common.recording.reader import read
from common.roles import MASTER, SLAVE
from simulation.world import Drift
from tests.helpers import without_recorder
from validation.faults import invariants
from validation.faults.apply import simulation_of
from validation.faults.invariants import INVARIANTS, SAFETY, InvariantViolation, judge
from validation.faults.lab import Simulation, Surrounding
from validation.faults.rigs import COMPUTED, named
from validation.faults.schedule import KINDS, parse

HOLDING_NOW = tuple(one for one in INVARIANTS if one not in SAFETY)
SOME = {  # values of a fault that shows
    "minimum": 0.02,
    "mean": 0.001,
    "count": 50,
    "by": 0.01,
    "place": 1,
    "run": 8,
    "hold": 0.005,
    "what": 1,
    "offset": 700.0,
    "ppm": -80.0,
}


def play(line: str, recording: Path | None = None) -> Simulation:
    simulation = simulation_of(parse(line), recording)
    simulation.run()
    return simulation


def commands(simulation: Simulation, role: str) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.array(simulation.probes[role].log.commands)


def test_a_simulation_without_faults_equals_virtual_time_to_the_last_bit(
    short_plan: Plan, virtual_recording: Path
) -> None:
    plan = without_recorder(short_plan)
    surrounding = Surrounding(drifts={SLAVE: Drift(3_600 * 10**9, 50_000)})
    simulation = Simulation(plan, as_planned(plan), surrounding)
    simulation.run()
    assert judge(simulation) == []
    found = read(virtual_recording)
    master, slave = commands(simulation, MASTER), commands(simulation, SLAVE)
    assert master[: plan.ticks, 0].tobytes() == found.columns["master"]["actuator_command"].tobytes()
    assert slave[: plan.ticks, 0].tobytes() == found.columns["slave"]["table_command"].tobytes()
    assert slave[: plan.ticks, 1].tobytes() == found.columns["slave"]["damper_command"].tobytes()


def test_the_same_schedule_gives_the_same_bits_and_another_seed_different_ones() -> None:
    line = (
        "duration=1.5 loss@0.3+1:master<>slave(loss=0.1) stall@0.9+0.01:slave "
        "delay@1+0.4:slave>master(minimum=0.001,mean=0.001)"
    )
    first, again, other = (play(f"seed={seed} {line}") for seed in (5, 5, 6))
    assert first.digest() == again.digest() != other.digest()
    assert [direction.ledger.counts for direction in first.wire.directions] == [
        direction.ledger.counts for direction in again.wire.directions
    ]


def test_several_slaves_take_part_in_a_simulation() -> None:
    simulation = play("seed=1 duration=1 slaves=2")
    assert judge(simulation) == []
    assert {role: loop.ticks for role, loop in simulation.loops.items()} == {
        "slave.roof": 500,
        "slave.middle": 500,
        "master": 500,
    }


def test_a_killed_master_is_detected() -> None:
    simulation = play("seed=1 duration=3 kill@1:master")
    slave = simulation.loops[SLAVE].lab
    assert slave.error is not None
    assert "master" in str(slave.error)
    assert any(item.data["level"] == "error" for item in simulation.events[SLAVE])
    assert simulation.probes[MASTER].log.times[-1] < 1_000_000_000 + COMPUTED
    assert not simulation.probes[MASTER].disarmed
    assert len(simulation.probes[SLAVE].disarmed) == 1
    assert judge(simulation, HOLDING_NOW) == []


def test_a_stop_reaches_both_laboratories() -> None:
    simulation = play("seed=1 duration=3 stop@1:master")
    assert simulation.loops[MASTER].lab.exchange.cause.startswith("stopped by the user")
    assert simulation.loops[MASTER].ticks == pytest.approx(simulation.loops[SLAVE].ticks, abs=2)
    assert all(len(probe.disarmed) == 1 for probe in simulation.probes.values())
    assert judge(simulation, HOLDING_NOW) == []


def test_damaged_frames_are_rejected_and_counted() -> None:
    simulation = play("seed=1 duration=2 corrupt@0.5+2:master<>slave(corrupt=0.1)")
    assert judge(simulation, HOLDING_NOW) == []
    for role in (MASTER, SLAVE):
        rejected = simulation.endpoints[role].rejected
        assert rejected[Reject.CHECK.value] > 40
        assert sum(rejected.values()) == rejected[Reject.CHECK.value]


def test_frames_of_strangers_without_the_keys_change_nothing() -> None:
    plain = play("seed=1 duration=1.5")
    disturbed = play(
        "seed=1 duration=1.5 garbage@0.01:master<>slave(count=300) garbage@1:master<>slave(count=300) "
        "forged@1.1:master<>slave(count=300) foreign@1.2:master<>slave(count=300)"
    )
    assert sum(disturbed.endpoints[SLAVE].rejected.values()) > 1000
    assert judge(disturbed) == []
    assert commands(plain, SLAVE).tobytes() == commands(disturbed, SLAVE).tobytes()
    assert commands(plain, MASTER).tobytes() == commands(disturbed, MASTER).tobytes()


def test_replayed_frames_change_nothing() -> None:
    plain, disturbed = (
        play("seed=1 duration=1.5"),
        play("seed=1 duration=1.5 replay@1:master<>slave(count=400)"),
    )
    assert judge(disturbed) == []
    assert disturbed.loops[MASTER].ticks == plain.loops[MASTER].ticks == 750
    assert commands(plain, MASTER).tobytes() == commands(disturbed, MASTER).tobytes()


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_fault_can_be_simulated_without_violating_an_invariant(kind: str) -> None:
    lasts = 0.05 if KINDS[kind].lasts else 0.0
    where = {"route": "master<>slave", "process": SLAVE, "rig": SLAVE}[KINDS[kind].where]
    values = ",".join(f"{name}={SOME.get(name, 0.2)}" for name in KINDS[kind].parameters)
    simulation = play(f"seed=2 duration=0.8 {kind}@0.6+{lasts}:{where}" + (f"({values})" if values else ""))
    assert judge(simulation, HOLDING_NOW) == []


@pytest.mark.parametrize("what", range(8))
def test_a_stranger_with_all_keys_moves_no_rig_beyond_its_limits(what: int) -> None:
    simulation = play(f"seed=2 duration=0.8 insider@0.6:master<>slave(what={what})")
    assert simulation.strangers
    assert judge(simulation, HOLDING_NOW) == []


@pytest.mark.parametrize("fault", ["kill@0.5:master", "kill@0.7:recorder", "outage@0.6+0.02:slave<>recorder"])
def test_a_recording_is_readable_after_any_schedule(fault: str, tmp_path: Path) -> None:
    simulation = play(f"seed=1 duration=1 recorded=1 {fault}", tmp_path / "test.mcap")
    assert judge(simulation, HOLDING_NOW) == []
    found = read(tmp_path / "test.mcap")
    assert found.ticks("master") > 50
    assert found.finished == ("recorder" not in fault or "kill" not in fault)


@pytest.mark.parametrize(
    "fault",
    [
        "outage@1+0.5:master<>slave",
        "outage@1+0.5:master>slave",
        "backlog@1+0.5:slave>master",
        "kill@1:master",
        "kill@1:slave",
        "stall@1+0.5:slave",
        "stall@1+0.5:master",
        "raise@1+1:slave",
        "jump@1+1:master(place=0,by=0.0129)",
        "stop@1:master",
    ],
)
def test_a_laboratory_comes_to_rest_in_time(fault: str) -> None:
    assert judge(play(f"seed=1 duration=2 {fault}")) == []


# -- each invariant sees what it is for -----------------------------------------------------------


def found(simulation: Simulation, invariant: invariants.Invariant) -> list[InvariantViolation]:
    return judge(simulation, (invariant,))


@pytest.fixture
def calm() -> Simulation:
    simulation = play("seed=1 duration=0.4")
    assert judge(simulation) == []
    return simulation


def test_deliberate_violations_are_detected(calm: Simulation) -> None:
    log = calm.probes[SLAVE].log
    log.commands[100] = (float("nan"), 0.0)
    assert len(found(calm, invariants.commands_within_limits)) == 1
    assert len(found(calm, invariants.steps_within_limits)) == 1
    log.commands[100] = (log.commands[99][0] + 0.06, 0.0)
    assert found(calm, invariants.commands_within_limits) == []
    assert len(found(calm, invariants.steps_within_limits)) == 1
    calm.world.processes[MASTER].error = ValueError("no")
    assert len(found(calm, invariants.no_exception)) == 1
    calm.world.processes[MASTER].ended = False
    calm.probes[SLAVE].disarmed.clear()
    assert len(found(calm, invariants.everybody_ends)) == 2


def test_wrong_message_accounts_are_detected(calm: Simulation) -> None:
    calm.endpoints[SLAVE].rejected["check"] += 1
    calm.ports[MASTER].taken["Feedback"] -= 1
    assert len(found(calm, invariants.frames_add_up)) == 2
    calm.wire.between(MASTER, SLAVE)[0].ledger.counts["Command"]["damaged"] += 3
    assert len(found(calm, invariants.frames_add_up)) == 3
    answers = calm.ports[SLAVE].answers
    answers[50] = (50, 20)
    assert len(found(calm, invariants.numbers_never_go_back)) == 1
    answers[100:] = [(tick, 100) for tick in range(100, 200)]
    assert len(found(calm, invariants.numbers_add_up)) == 1


def test_a_latch_that_opens_is_detected(calm: Simulation) -> None:
    modes = calm.probes[MASTER].log.modes
    modes[0] = calm.loops[MASTER].lab.exchange.state  # done
    assert named(modes[0]) == "SAFE"
    assert len(found(calm, invariants.latched_stays)) == 1


def test_a_laboratory_that_runs_on_without_messages_is_detected(calm: Simulation) -> None:
    arrivals = invariants.tick_routes(calm, SLAVE)[0].ledger.arrivals
    del arrivals[50:54]
    assert found(calm, invariants.nobody_runs_unheard) == []
    del arrivals[50:60]
    assert len(found(calm, invariants.nobody_runs_unheard)) == 1
