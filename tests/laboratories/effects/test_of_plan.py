"""The effects that the test of a plan can have, and the laboratories to which a reality applies them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from common.errors import InputError, PlanError
from common.plan.plan import Plan
from common.plan.read import from_tables
from common.reality.reality import Reality, from_reality
from laboratories import effects
from laboratories.effects.sites import of_plan
from loop.realised import true_slaves, true_system

OWN = '''
from common.signals import Signal
from laboratories.device import Device, Fault, Nominal
from laboratories.kind import Channels


class Spring(Device):
    """A spring with a crack."""

    name, says = "spring", "test bench with a spring"
    channels = Channels(
        Signal("spring_target", "m", "deformation wanted"),
        Signal("spring_command", "m", "command written"),
        (Signal("spring_displacement", "m", "deformation read"), Signal("spring_force", "N", "force read")),
        "spring_displacement",
        "spring_force",
    )
    nominal = {"stiffness": Nominal(2e6, "N/m", "of the spring")}
    faults = {"crack": Fault("a crack", "share", "", 0.0, 0.0, 0.9, (0.02, 0.1, 0.3))}
    rms = {"spring_force": 5.0}

    @staticmethod
    def step(parameters, state, truth, command, effort):
        truth[0] = command
        truth[1] = parameters[1] * (1.0 - parameters[2]) * command
'''
TWO = from_tables({"slave": {"kind": "column"}, "structure": {}}, Path())
NAMED = from_tables({"slave": {"north": {"kind": "column"}, "roof": {}}}, Path())
SINGLE = from_tables({"slave": {"kind": "none"}, "control": {"amd": False}}, Path())


def real(plan: Plan, *given: dict[str, Any], **tables: Any) -> Reality:
    return from_reality({"effect": list(given), **tables}, plan, Path())


@pytest.fixture
def own(tmp_path: Path) -> Plan:
    (tmp_path / "spring.py").write_text(OWN)
    return from_tables({"slave": {"kind": "spring.py:Spring"}}, tmp_path)


def test_the_default_test_has_all_shipped_effects() -> None:
    assert list(effects.of_plan(Plan())) == list(effects.CATALOGUE)


def test_a_test_has_only_the_effects_of_its_kinds() -> None:
    assert not any(site in ("table", "damper") for site in of_plan(TWO))
    assert "link" not in of_plan(SINGLE)
    assert {item.site for item in effects.of_plan(SINGLE).values()} == set(of_plan(SINGLE))


def test_a_users_kind_adds_its_own_effects_and_those_of_its_readings(own: Plan) -> None:
    found = effects.of_plan(own)
    assert {"device.crack", "sensor.spring_force.gain", "actuator.delay", "link.loss"} <= found.keys()
    assert "table.delay" not in found
    assert found["sensor.spring_force.noise"].parameters[0].sizes[0] == pytest.approx(3.5)


def test_an_effect_on_a_users_device_changes_it(own: Plan) -> None:
    slave = true_slaves(real(own, {"name": "device.crack", "share": 0.2}))["slave"]
    assert slave.effects.device == {"crack": 0.2}


@pytest.mark.parametrize(
    ("given", "master", "slave"),
    [({}, 0.8, 0.8), ({"laboratory": "master"}, 0.8, 1.0), ({"laboratory": "slave"}, 1.0, 0.8)],
)
def test_an_effect_applies_to_every_laboratory_with_its_site_or_to_the_named_one(
    given: dict[str, str], master: float, slave: float
) -> None:
    truth = real(TWO, {"name": "actuator.gain", "factor": 0.8, **given})
    assert true_system(truth).plan.actuator.gain == master * TWO.actuator.gain
    assert true_slaves(truth)["slave"].plan.actuator.gain == slave * TWO.actuator.gain


def test_only_the_named_slave_gets_an_effect_that_names_it() -> None:
    truth = real(NAMED, {"name": "column.stiffness", "factor": 0.5, "slave": "north"})
    assert true_system(truth).plan.column == NAMED.column
    north, roof = true_slaves(truth).values()
    assert north.plan.column.stiffness == 0.5 * NAMED.column.stiffness
    assert roof.plan.column == NAMED.column


@pytest.mark.parametrize(
    ("plan", "given", "words"),
    [
        (TWO, {"name": "table.gain", "factor": 0.9}, "'table.gain' acts on the table, which the plan's test"),
        (SINGLE, {"name": "link.delay", "delay": 0.1}, "'link.delay' acts on the link"),
        (NAMED, {"name": "table.gain", "factor": 0.9, "slave": "north"}, "does not belong to one slave"),
        (
            NAMED,
            {"name": "table.gain", "factor": 0.9, "laboratory": "master"},
            "does not belong to the master",
        ),
        (
            NAMED,
            {"name": "table.gain", "factor": 0.9, "laboratory": "slave.norht"},
            "did you mean slave.north",
        ),
        (
            NAMED,
            {"name": "table.gain", "laboratory": "slave.roof", "slave": "roof"},
            "both slave and laboratory",
        ),
    ],
)
def test_an_effect_at_a_site_that_the_plan_lacks_is_refused(
    plan: Plan, given: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words) as caught:
        true_system(real(plan, given))
    assert caught.value.exit_code == 2


def test_a_reality_may_give_a_slave_only_the_tables_of_its_kind() -> None:
    truth = real(NAMED, slave={"north": {"actuator": {"delay": 0.011}, "column": {"stiffness": 1.0e7}}})
    assert truth.plan.of("slave.north").actuator.delay == 0.011
    assert truth.plan.of("slave.north").column.stiffness == 1.0e7
    assert truth.plan.column == NAMED.column
    with pytest.raises(PlanError, match="Unknown key 'table'"):
        real(NAMED, slave={"north": {"table": {"delay": 0.011}}})
    with pytest.raises(PlanError, match="Unknown key 'compensator'"):
        real(NAMED, slave={"north": {"compensator": {"kind": "none"}}})


def test_a_reality_sets_the_true_parameters_of_a_device(own: Plan) -> None:
    truth = real(own, device={"parameters": {"stiffness": 1.9e6}})
    assert truth.plan.device.parameters == {"stiffness": 1.9e6}
    with pytest.raises(PlanError, match=r"scale in \[device\] is chosen by the plan"):
        real(own, device={"scale": 2.0})
