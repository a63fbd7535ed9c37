"""Laboratories of other kinds and users' rigs, served as elements of a client."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError
from common.opensees import wire
from common.opensees.wire import MessageCode
from common.plan.plan import Plan
from common.plan.read import parse, with_test
from common.reality.reality import as_planned
from common.roles import SLAVE
from laboratories.table.kind import TABLE
from loop import replay
from master.client.building import ClientBuilding, check_count
from models.system import System
from simulation import virtual
from tests.serve.client import PATIENCE_S, Element, Script, free_port
from tests.serve.serving import ALONE, IDEAL, Ticking, plan_of, serve

STEPS = 300
QUIET = (
    IDEAL + "table_displacement = 0.0\ntable_acceleration = 0.0\ndamper_stroke = 0.0\ndamper_force = 0.0\n"
)
QUIET = QUIET.replace("[safety]\nhold_after = 3\nramp_after = 5\noverrun = 5\nsettle = 0.01\n", "")
RIG = """
class Rig:
    def __init__(self, interval, seed, stiffness):
        self._stiffness, self._place = stiffness, 0.0

    def arm(self):
        pass

    def read(self):
        return self._place, self._stiffness * self._place

    def write(self, command):
        self._place = command.actuator_command

    def disarm(self):
        pass
"""


def swayed(folder: Path, plan: Plan, dofs: int = 1) -> tuple[Any, Any, dict[str, Any]]:
    """Displacements m of each step at 2.3 Hz, the forces (steps, dofs) N answered, and the recorded signals."""
    places = 4e-3 * (1.0 - np.cos(2.0 * np.pi * 2.3 * 0.002 * np.arange(1, STEPS + 1)))
    forces = []

    def script(port: int) -> None:
        client = Element(port, wire.element(dofs))
        for step, place in enumerate(places.tolist(), 1):
            forces.append(client.step([place] * dofs, 0.002 * step))
        client.say(MessageCode.END)
        client.close()

    served = serve(script, folder, plan)
    assert served.error is None
    assert served.client.error is None
    return places, np.array(forces), served.run.columns


def pushes(plan: Plan, places: Any, forces: Any, columns: dict[str, Any]) -> None:
    """A table at a floor follows it, its motor damps its velocity, and its damper's force pushes it."""
    of, sent = columns[SLAVE], columns["master"]
    assert np.array_equal(sent["table_target"][:STEPS], places)
    speed = np.gradient(places, 0.002)
    motor = plan.control.gain / plan.damper.force_scale * speed
    assert sent["damper_command"][3 : STEPS - 1] == pytest.approx(motor[3:-1], abs=2e-3 * np.max(motor))
    drive = np.stack([of["table_command"], of["damper_command"]], axis=1)
    alone = replay.laboratory(TABLE, System(plan), drive)
    assert of["damper_force"] == pytest.approx(alone[:, TABLE.channels.names.index("damper_force")], abs=1e-9)
    # the force used at the displacement of step i was measured an interval before; OpenSees' elements resist
    assert np.array_equal(forces, -plan.damper.force_scale * of["damper_force"][:STEPS])


def test_a_table_with_its_motor_is_served_as_an_element(tmp_path: Path) -> None:
    plan = parse(QUIET + '[master]\nkind = "none"\n', tmp_path)
    places, forces, columns = swayed(tmp_path, plan)
    pushes(plan, places, forces[:, 0], columns)
    assert np.max(np.abs(forces)) > 100.0


def test_a_column_and_a_table_are_served_as_one_element(tmp_path: Path) -> None:
    plan = parse(QUIET, tmp_path)
    places, forces, columns = swayed(tmp_path, plan, 2)
    assert forces[:, 0] == pytest.approx(6.25e6 * places, rel=1e-12)
    pushes(plan, places, forces[:, 1], columns)
    assert np.max(np.abs(forces[:, 1])) > 100.0


def test_a_users_rig_is_served_as_an_element(tmp_path: Path) -> None:
    (tmp_path / "lab.py").write_text(RIG)
    rig = '[master.rig]\nclass = "lab.py:Rig"\noptions = { stiffness = 9e6 }\n'
    places, forces, columns = swayed(tmp_path, parse(IDEAL + ALONE + rig, tmp_path))
    assert forces[:, 0] == pytest.approx(9e6 * 0.5 * places, rel=1e-12)  # the half column's deformation
    assert columns["master"]["column_displacement"][1:STEPS] == pytest.approx(0.5 * places[:-1], rel=1e-12)


def test_a_step_of_one_moving_element_is_a_step_at_rest_of_the_other(tmp_path: Path) -> None:
    """Within a step OpenSees tells all elements their displacements, then asks all for forces, then commits all."""
    moves = [1e-4 * step for step in range(1, 21)]

    def script(first: int, second: int) -> None:
        both = [Element(first), Element(second)]
        for step, place in enumerate([*moves, *moves[-1:] * 5], 1):
            for client, x in zip(both, (place, 0.0), strict=True):
                client.say(MessageCode.TRIAL, [x], 0.002 * step)
            for client, x in zip(both, (place, 0.0), strict=True):
                client.say(MessageCode.FORCE, [x])
                client.answer(1)
            for client, x in zip(both, (place, 0.0), strict=True):
                client.say(MessageCode.COMMIT, [x])
        for client in both:
            client.say(MessageCode.END)
            client.close()

    plan = with_test(parse(IDEAL + '[slave.east]\nkind = "column"\n', tmp_path), intervals=2)
    served = serve(script, tmp_path, plan, elements=2)
    assert served.error is None
    assert served.client.error is None
    of = served.run.columns["master"]
    assert of["client_step"][-1] == len(moves) + 5
    assert of["client_displacement"][1:41:2, 0] == pytest.approx(moves)
    assert not of["client_displacement"][:, 1].any()


def test_a_test_whose_client_is_missing_says_once_what_it_waits_for(tmp_path: Path) -> None:
    """The client starts when it has been told, after more handshake than `connect_timeout` allows a process."""
    plan = plan_of(ALONE + "[link]\nconnect_timeout = 1.0\n")
    number, told, late = free_port(), list[str](), threading.Event()
    building = ClientBuilding(plan, [f"127.0.0.1:{number}"], Ticking())

    def report(kind: str, data: Mapping[str, Any]) -> None:
        if kind == "event" and data["code"] == "await_client":
            told.append(data["text"])
        if "waits for" in data.get("text", ""):
            told.append(data["text"])

    def begins() -> None:
        assert late.wait(PATIENCE_S)
        client = Element(number)
        client.steps(3)
        client.say(MessageCode.END)
        client.close()

    client = Script(begins)
    bench = virtual.assemble(plan, as_planned(plan), tmp_path / "test.mcap", report, building=building)
    look = building.look_after

    def looked() -> None:
        look()
        if bench.world.time > 1.5e9 * plan.link.connect_timeout:
            late.set()

    building.look_after = looked  # type: ignore[method-assign]
    assert virtual.run(bench, str) is None
    client.join(PATIENCE_S)
    assert client.error is None
    assert told == [f"Waits for OpenSees at 127.0.0.1:{number}."]


def test_one_address_for_two_elements_is_refused() -> None:
    with pytest.raises(InputError, match="names an address twice"):
        check_count(["8090", "127.0.0.1:8090"], 2)
