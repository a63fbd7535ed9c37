"""Faults in tests with other kinds of laboratory than the default test's; the invariants follow from the kinds."""

from __future__ import annotations

from dataclasses import replace

import pytest

from common.link.transport import TICK
from common.protocol import codec
from common.reality.reality import as_planned
from common.safety.modes import Mode
from tests.helpers import with_table, without_recorder
from tests.shapes import plan_of
from validation.faults import hostile
from validation.faults.invariants import judge
from validation.faults.lab import Simulation
from validation.faults.wire import INSIDER


def simulation_of(name: str) -> Simulation:
    plan = without_recorder(plan_of(name, test={"duration": 0.6}))
    plan = with_table(replace(plan, eased=()), "safety", hold_after=3, ramp_after=5, overrun=5)
    return Simulation(plan, as_planned(plan))


@pytest.mark.parametrize("name", ["single_site", "two_columns", "two_slaves"])
def test_without_faults_every_shape_of_test_satisfies_the_invariants(name: str) -> None:
    simulation = simulation_of(name)
    simulation.run()
    assert judge(simulation) == []
    assert {loop.completed for loop in simulation.loops.values()} == {True}


def test_after_a_column_slave_is_killed_the_master_comes_to_rest() -> None:
    simulation = simulation_of("two_columns")
    simulation.world.at(round(0.6e9), simulation.world.processes["slave.east"].kill)
    simulation.run()
    assert judge(simulation) == []
    assert simulation.loops["master"].lab.safety.mode is Mode.SAFE


def test_a_feedback_with_another_number_of_channels_is_rejected() -> None:
    simulation = simulation_of("two_columns")
    plan = simulation.plan
    route = next(
        one
        for one in simulation.wire.directions
        if one.route.role == "slave.east" and one.route.channel == TICK
    )
    key = codec.session_key(1, plan.digest())
    four = hostile.letter(hostile.feedback(1, 100_000, 1e9, channels=4), key, INSIDER)
    simulation.world.at(round(0.6e9), route.put, [four])
    simulation.run()
    assert simulation.endpoints["master"].rejected["fields"] == 1
    assert simulation.loops["master"].completed
