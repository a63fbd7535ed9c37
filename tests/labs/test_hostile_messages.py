"""Valid messages at the wrong moment, as only a hostile sender sends them."""

from __future__ import annotations

import pytest

from common.link.endpoint import Received
from common.plan.plan import PROTOCOL_VERSION, Plan
from common.protocol.exchange import State
from common.protocol.messages import Arm, Register
from common.reality import reality
from simulation import virtual


@pytest.mark.parametrize("state", [State.ARMED, State.SCHEDULED, State.RUNNING, State.STOPPING])
def test_a_running_slave_ignores_an_arm_message_for_another_instance(short_plan: Plan, state: State) -> None:
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), None)
    bench.slave.take(Received(Register(5, PROTOCOL_VERSION, short_plan.digest())))
    bench.slave.lab.exchange.state = state
    bench.slave.take(Received(Arm(5, 99)))
    assert bench.slave.lab.exchange.state is state
    assert bench.slave.lab.exchange.session == 5
    assert bench.slave.lab.error is None
