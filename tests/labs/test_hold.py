"""Hold and resumption of a running test, in virtual time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from common.errors import LostError
from common.host.clock import VirtualClock
from common.link.endpoint import Received
from common.plan import read as plans
from common.plan.plan import Plan
from common.plan.read import from_tables
from common.protocol.messages import Answer, Extend, Message, Operator
from common.reality import reality
from common.recording.holds import Hold, before_hold, holds, places
from common.recording.reader import read
from common.recording.run import Run
from common.safety.modes import Mode
from common.signals import OF_STOREYS
from diagnosis.recorded import record as recorded
from report.facts.due import due
from report.facts.summary import summarize
from report.live.standing import Standing
from report.run import verdict
from rths.examine.replay import planned, replay_master, replay_slaves
from simulation import source, virtual
from simulation.virtual import VirtualTest
from tests.helpers import without_recorder

BEGUN, RESUMED = 300, 700  # ticks of the orders
RAMP = 114  # ticks at the default plan's limits: 1.5 times 1.5 m/s over 10 m/s²
ENDLESS = 5_000  # ticks, which no test here has


class Held(NamedTuple):
    """A test that was played with orders, and the answers to them."""

    bench: VirtualTest
    error: Exception | None
    answers: list[Answer]


def ordered(plan: Plan, orders: Mapping[int, str], path: Path | None = None) -> Held:
    """A test whose operator gives orders by tick; an order is numbered by its tick, and repeated one tick later."""
    bench = virtual.assemble(plan, reality.as_planned(plan), path)
    master, answers = bench.master, list[Answer]()
    ticking, sending = master.tick, master.lab.endpoint.send

    def send(message: Message, to: str = "") -> int:
        if isinstance(message, Answer):
            answers.append(message)
        return sending(message, to)

    def tick(number: int) -> None:
        assert number < ENDLESS
        for press in (number, number - 1):
            if press in orders:
                wish = Operator(0, plan.digest(), orders[press], press + 1, "a look at the cracks")
                for loop in bench.loops.values():
                    loop.take(Received(wish, "operator", bench.world.time))
        ticking(number)

    master.tick = tick  # type: ignore[method-assign, assignment]
    master.lab.endpoint.send = send  # type: ignore[method-assign]
    return Held(bench, virtual.run(bench, str), answers)


@pytest.fixture(scope="module")
def plan(default_plan: Plan) -> Plan:
    return plans.with_test(default_plan, duration=2.2)


@pytest.fixture(scope="module")
def held(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Run:
    path = tmp_path_factory.mktemp("held") / "held.mcap"
    assert ordered(plan, {BEGUN: "hold", RESUMED: "resume"}, path).error is None
    return read(path)


@pytest.fixture(scope="module")
def through(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The same test without a hold."""
    path = tmp_path_factory.mktemp("through") / "through.mcap"
    assert ordered(plan, {}, path).error is None
    return read(path)


def test_a_held_test_resumes_where_it_was_held(plan: Plan, held: Run, through: Run) -> None:
    found = holds(held.events, plan.test.interval)
    assert found == (Hold(BEGUN, RAMP, RESUMED),)
    for topic in ("master", "slave", "latency"):
        assert held.sequences[topic].tolist() == list(range(plan.ticks + RESUMED - BEGUN))
    assert (np.diff(held.columns["master"]["t"]) > 0.0).all()
    place = np.array(places(found, held.ticks("master")))
    for name, most in (("displacement", 5e-3), ("column_force", 5e-2), ("actuator_command", 2e-2)):
        values, expected = held.columns["master"][name], through.columns["master"][name]
        assert np.array_equal(values[:BEGUN], expected[:BEGUN]), name
        gap = values - np.interp(place, np.arange(expected.size), expected)
        assert np.abs(gap).max() < most * np.abs(expected).max(), name


def test_during_a_hold_no_motion_is_commanded(held: Run) -> None:
    still = slice(BEGUN + RAMP + 1, RESUMED)
    master, slave = held.columns["master"], held.columns["slave"]
    for columns, names in (
        (master, ("column_target", "table_target", *OF_STOREYS)),
        (slave, ("table_target",)),
    ):
        for name in names:
            assert np.ptp(columns[name][still]) == 0.0, name
    for name in ("damper_command", "table_target_velocity", "table_target_acceleration"):
        assert not master[name][still].any(), name
    assert np.ptp(slave["table_displacement"][RESUMED - 100 : RESUMED]) < 1e-4


def test_the_ramps_of_a_hold_stay_within_the_planned_accelerations(
    plan: Plan, held: Run, through: Run
) -> None:
    for name in ("column_target", "table_target"):
        speed = np.abs(np.diff(through.columns["master"][name])).max() / plan.test.interval
        peaks = [
            np.abs(np.diff(run.columns["master"][name], 2)).max() / plan.test.interval**2
            for run in (held, through)
        ]
        assert peaks[0] <= peaks[1] + 1.5 * speed / (RAMP * plan.test.interval), name


def test_the_recording_of_a_held_test_is_complete_and_states_the_time_of_the_hold(
    plan: Plan, held: Run
) -> None:
    ticks = plan.ticks + RESUMED - BEGUN
    assert held.metadata["summary"]["ticks_expected"] == str(ticks)
    assert set(due(held, plan).values()) == {ticks}
    summary = summarize(held)
    assert all(facts["missing"] == 0 for facts in summary["topics"].values())
    (told,) = summary["holds"]
    assert told["t"] == BEGUN * plan.test.interval
    assert told["earthquake_time"] == pytest.approx((BEGUN + RAMP / 2) * plan.test.interval)
    assert told["duration"] == (RESUMED - BEGUN + RAMP) * plan.test.interval
    said = verdict.sentences(held, summary)
    assert (
        "The test was held at t 0.600 s for 1.028 s with its ramps; the earthquake's time stood still at 0.714 s."
        in said
    )
    codes = [event["code"] for event in held.events if event["lab"] == "master"]
    assert [code for code in codes if code in ("hold", "held", "resume", "resumed")] == [
        "hold",
        "held",
        "resume",
        "resumed",
    ]
    assert codes.count("operator") == 2  # the repetitions did nothing


def test_the_replay_reproduces_a_held_test_to_the_last_bit(held: Run) -> None:
    chosen = planned(held)
    matches = replay_master(held, chosen) | replay_slaves(held, chosen)
    assert "master/actuator_command" in matches
    assert "slave/table_command" in matches
    assert all(match.differing == 0 and match.compared > 0 for match in matches.values())


def test_the_diagnosis_judges_the_ticks_before_the_hold(held: Run) -> None:
    built = recorded.build(held)
    assert built.ticks == BEGUN
    assert built.held == BEGUN * built.plan.test.interval
    assert built.signals["displacement"].shape[0] == BEGUN


def test_a_comparison_ends_at_the_hold_and_states_this(held: Run, through: Run) -> None:
    found = source.recorded(held)
    assert found.ticks.tolist() == list(range(BEGUN))
    assert found.motion.endswith("; held at 0.600 s, and compared up to there")
    cut, stood = before_hold(through)
    assert cut is through
    assert stood is None


def test_a_test_with_several_slaves_may_be_held_several_times(tmp_path: Path) -> None:
    tables = {
        "test": {"name": "tall", "duration": 1.8},
        "structure": {"mass": [1.6e5] * 3, "stiffness": [9e7] * 3, "damping": [4e5] * 3},
        "column": {"stiffness": 45e6},
        "slave": {"roof": {"damper": {"floor": 3}}, "middle": {"damper": {"floor": 2}}},
    }
    plan = from_tables(tables, Path())
    orders = {100: "hold", 120: "resume", 120 + 2 * RAMP: "hold", 600: "resume"}
    played = ordered(plan, orders, tmp_path / "a.mcap")
    assert played.error is None
    run = read(tmp_path / "a.mcap")
    found = holds(run.events, plan.test.interval)
    assert found == (Hold(100, RAMP, 100 + RAMP), Hold(120 + 2 * RAMP, RAMP, 600))
    assert played.bench.master.ticks == plan.ticks + RAMP + 600 - 120 - 2 * RAMP
    chosen = planned(run)
    matches = replay_master(run, chosen) | replay_slaves(run, chosen)
    assert all(match.differing == 0 and match.compared > 0 for match in matches.values())


@pytest.mark.parametrize(
    ("orders", "sentences"),
    [
        ({0: "hold"}, ["The test is not running."]),
        ({50: "resume"}, ["The test is not held."]),
        ({50: "hold", 80: "hold", 90: "resume", 95: "resume"}, ["", "held already", "", "resuming already"]),
        ({50: "hold", 200: "resume", 210: "hold"}, ["", "", "order the hold again in 0.23 s"]),
        ({500: "hold"}, ["nearly over"]),
    ],
)
def test_orders_in_the_wrong_state_are_refused_in_one_sentence(
    orders: dict[int, str], sentences: list[str], default_plan: Plan
) -> None:
    plan = without_recorder(plans.with_test(default_plan, duration=1.6))
    played = ordered(plan, orders)
    assert played.error is None
    assert played.answers[::2] == played.answers[1::2]  # each repetition gets the same answer
    for answer, sentence in zip(played.answers[::2], sentences, strict=True):
        assert bool(answer.accepted) == (not sentence)
        assert sentence in answer.text


def test_a_hold_is_refused_during_too_fast_a_motion_and_the_limit_is_named(
    default_plan: Plan,
) -> None:
    tables = default_plan.tables() | {"limits": {"damper_stroke": 0.1}}
    plan = without_recorder(plans.with_test(from_tables(tables, default_plan.base), duration=3.2))
    played = ordered(plan, {800: "hold"})
    (answer, _) = played.answers
    assert not answer.accepted
    assert "damper_stroke would reach" in answer.text
    assert "its limit is 0.1 m" in answer.text
    assert played.error is None
    assert played.bench.master.ticks == plan.ticks


def test_the_damper_swings_no_farther_than_was_foreseen(default_plan: Plan, tmp_path: Path) -> None:
    plan = plans.with_test(default_plan, duration=2.8)
    assert ordered(plan, {700: "hold", 1500: "resume"}, tmp_path / "a.mcap").error is None
    run = read(tmp_path / "a.mcap")
    (lost,) = [event["values"]["energy_lost"] for event in run.events if event["code"] == "hold"]
    foreseen = np.sqrt(2.0 * lost / (plan.damper.force_scale * plan.damper.stiffness))
    reached = np.abs(run.columns["slave"]["damper_stroke"][700:1500]).max()
    assert 0.2 * foreseen < reached < foreseen  # the sum of the worst cases is not far beyond what happens


def test_the_live_view_says_how_the_test_is_held(held: Run) -> None:
    standing, said = Standing(VirtualClock()), []
    for event in sorted(held.events, key=lambda event: event["t"]):
        standing.event(event)
        if event["code"] in ("hold", "held", "resume", "resumed"):
            said.append(standing.gravest)
    assert said == ["slowing down to a hold", "held", "resuming", "running"]


@pytest.mark.parametrize("word", ["stop", "emergency"])
def test_a_held_test_can_be_stopped(word: str, plan: Plan) -> None:
    played = ordered(without_recorder(plan), {BEGUN: "hold", 600: word})
    assert played.error is not None
    assert played.bench.master.ticks == 601  # the one that was waited for
    mode = Mode.EMERGENCY_STOP if word == "emergency" else Mode.IDLE
    assert played.bench.master.lab.safety.mode is mode


def test_a_slave_that_falls_silent_ends_a_held_test(plan: Plan) -> None:
    bare = without_recorder(plan)
    bench = virtual.assemble(bare, reality.as_planned(bare), None)
    ticking, answering = bench.master.tick, bench.slave.tick

    def tick(number: int) -> None:
        assert number < ENDLESS
        if number == BEGUN:
            wish = Operator(0, bare.digest(), "hold", 1, "")
            bench.master.take(Received(wish, "operator", bench.world.time))
        ticking(number)

    def answer(number: int) -> None:
        if number < 600:
            answering(number)

    bench.master.tick, bench.slave.tick = tick, answer  # type: ignore[method-assign, assignment]
    assert isinstance(virtual.run(bench, str), LostError)


def test_no_message_makes_a_test_longer_than_a_hold_can(plan: Plan) -> None:
    bare = without_recorder(plan)
    bench = virtual.assemble(bare, reality.as_planned(bare), None)
    slave = bench.slave
    virtual.play(bench, pause=lambda: slave.ticks >= 100)
    session = slave.lab.exchange.session
    for ticks, until in ((2**61, bare.ticks), (bare.ticks + 50, bare.ticks + 50), (0, bare.ticks + 50)):
        slave.take(Received(Extend(session, ticks), "master", slave.lab.clock.now()))
        assert slave.lab.until == until


def test_a_test_with_another_programs_building_refuses_a_hold_with_the_reason() -> None:
    from master.building import BuildingStep

    assert BuildingStep.time is None
    assert "another program" in BuildingStep.unheld
