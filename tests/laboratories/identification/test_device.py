"""Parameters of a user's kind of laboratory, identified from the response of its own kernel."""

from __future__ import annotations

import numpy as np
import pytest

from common.errors import InputError
from common.plan import read as plans
from common.plan.plan import Plan
from laboratories.device import Device
from laboratories.identification import device
from laboratories.kinds import kind_of
from models import excitation
from models.excitation import POSITION, Reach
from models.registry import Array
from models.system import System
from tests.helpers import ROOT

TRUE = {"stiffness": 22e6, "coefficient": 250e3, "exponent": 0.4, "delay": 0.010, "time_constant": 0.015}


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plans.load(ROOT / "examples" / "viscous_damper.toml")


@pytest.fixture(scope="module")
def damper(plan: Plan) -> Device:
    kind = kind_of(plan, "slave")
    assert isinstance(kind, Device)
    return kind


@pytest.fixture(scope="module")
def commands(plan: Plan) -> Array:
    pieces = excitation.target(plan.test.interval, Reach(20e-3, 0.5, 3.0))
    return np.ascontiguousarray(
        excitation.programme(pieces, plan.test.interval, ("sine 1", "sine 4")).motion[POSITION]
    )


def measured(kind: Device, plan: Plan, commands: Array) -> Array:
    lab = device.built(kind, plan, TRUE)
    noise = np.random.default_rng(1).normal(size=(commands.size, 2)) * kind.noise(plan)
    return device.response(lab, commands, np.zeros(commands.size), 2) + noise


def test_the_parameters_of_a_viscous_damper_are_found(damper: Device, plan: Plan, commands: Array) -> None:
    found = device.least_squares(
        damper, plan, commands, np.zeros(commands.size), measured(damper, plan, commands)
    )
    for name, value in TRUE.items():
        estimate = found.parameters[name]
        assert estimate.value == pytest.approx(value, rel=5e-3), name
        assert estimate.low < estimate.value < estimate.high
        assert estimate.unit == damper.nominal[name].unit
    assert max(found.nrmse.values()) < 0.01


def test_records_without_information_on_a_device_are_refused(
    damper: Device, plan: Plan, commands: Array
) -> None:
    read = measured(damper, plan, commands)
    zero = np.zeros(commands.size)
    with pytest.raises(InputError, match="command is constant"):
        device.least_squares(damper, plan, zero, zero, read)
    with pytest.raises(InputError, match="piston force is constant"):
        device.least_squares(damper, plan, commands, zero, read * [1.0, 0.0])
    with pytest.raises(InputError, match="at least 20"):
        device.least_squares(damper, plan, commands[:9], zero[:9], read[:9])
    with pytest.raises(InputError, match="do not follow the command"):
        device.least_squares(
            damper, plan, commands[:400], zero[:400], np.random.default_rng(1).normal(size=(400, 2))
        )


def test_the_identified_response_equals_the_kernel_tick_by_tick(
    damper: Device, plan: Plan, commands: Array
) -> None:
    few = commands[700:800]
    found = device.response(damper.build(System(plan)), few, np.zeros(few.size), 2)
    lab, truth = damper.build(System(plan)), np.zeros(2)
    for place, command in enumerate(few[:-1]):
        type(damper).step(lab.parameters, lab.state, truth, float(command), 0.0)
        assert found[place + 1] == pytest.approx(truth, rel=1e-9, abs=1e-12)
