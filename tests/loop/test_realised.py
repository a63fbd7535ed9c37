"""A reality's effects in the real loops and rigs, compared with the compiled closed loop of the same system."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError, PlanError, RthsError
from common.plan.plan import Plan
from common.plan.read import from_tables, parse, with_test
from common.reality import reality
from common.reality.reality import Reality
from common.recording.reader import read
from common.recording.run import Run
from common.roles import MASTER, SLAVE, kind_of
from common.signals import TOPICS
from laboratories.effects import CATALOGUE, lay
from laboratories.effects.sites import holders
from loop import substructure
from loop.closed_loop import MessagesUsed, simulate
from loop.exchange import exchange
from loop.links import link_model
from loop.realised import true_slaves, true_system
from loop.signals import rows
from models.system import System
from simulation import virtual
from tests.laboratories.effects.distinct import DISTINCT


@pytest.fixture(scope="module")
def plan(default_plan: Plan) -> Plan:
    return with_test(default_plan, duration=2.5)


def real(plan: Plan, *effects: dict[str, Any], **tables: Any) -> Reality:
    return reality.from_reality({"effect": list(effects), **tables}, plan, Path())


def used(truth: Reality) -> dict[str, MessagesUsed]:
    """Which messages the test of a reality uses, slave by slave."""
    ticks, interval = truth.plan.ticks, truth.plan.test.interval
    return {role: exchange(ticks, interval, link_model(truth.of(role))) for role in truth.plan.roles}


def assert_equals_the_rollout(plan: Plan, truth: Reality, path: Path) -> Run:
    """Every value of the recording is the closed loop's, to the last bit."""
    error = virtual.run(virtual.assemble(plan, truth, path), lambda: "")
    assert error is None
    recording, system = read(path), true_system(truth)
    motion = substructure.motion(system.plan)
    ground = substructure.ground_rows(system.plan, motion, system.effects.time_shift)
    slaves = true_slaves(truth)
    found = simulate(
        system.plan, ground, effects=system.effects, slaves=slaves, seed=truth.seed, exchange=used(truth)
    )
    assert found.finite
    expected: dict[str, list[Any]] = {topic: [] for topic in ("master", *slaves)}
    for topic, values in rows(system.plan, found):
        expected[topic].append(values)
    for topic, table in expected.items():
        for place, signal in enumerate(TOPICS[kind_of(topic)]):
            column = np.array([values[place] for values in table])
            assert np.array_equal(recording.columns[topic][signal.name], column), f"{topic}/{signal.name}"
    return recording


def effect(name: str, **values: float | str) -> dict[str, Any]:
    return {"name": name, **values}


FALSIFIED = [
    effect(f"sensor.{signal}.{kind}", **{parameter: share * size})
    for signal, size in (("column_force", 3e4), ("table_displacement", 0.02), ("damper_force", 80.0))
    for kind, parameter, share in (
        ("bias", "offset", 1e-3),
        ("drift", "rate", 1e-3),
        ("quantization", "step", 1e-3),
        ("noise", "rms", 1e-3),
    )
]
LOTS = {
    "laboratory A": [
        effect("actuator.velocity_limit", velocity=0.03),
        effect("actuator.backlash", width=6e-5),
        effect("actuator.compliance", compliance=1e-9),
        effect("actuator.deadband", width=5e-5),
        effect("actuator.delay", delay=0.0013),
        effect("actuator.gain", factor=0.97),
        effect("actuator.time_constant", factor=1.06),
    ],
    "specimen": [
        effect("column.stiffness", factor=0.94),
        effect("column.yielding", yield_displacement=0.0015),
        effect("column.degradation", rate=0.08),
        effect("column.pinching", factor=0.15, hardening=0.1),
        effect("column.friction", force=300.0),
        effect("column.viscous", coefficient=1e4),
        effect("column.inertia", mass=50.0),
        effect("column.slip", gap=2e-5),
    ],
    "laboratory B": [
        effect("table.gain", factor=0.97),
        effect("table.delay", delay=0.001),
        effect("table.bandwidth", factor=1.1),
        effect("table.oil_column", frequency=25.0),
        effect("table.payload", compliance=1.5e-6),
        effect("table.backlash", width=1e-4),
        effect("table.friction", acceleration=0.1),
        effect("damper.friction", force=1.0, velocity=0.001),
        effect("damper.viscous", factor=1.6),
        effect("damper.stiffness", factor=0.9),
        effect("damper.mass", factor=0.94),
        effect("damper.motor_lag", time_constant=0.003),
        effect("damper.gain", factor=0.93),
        effect("damper.force_limit", force=35.0),
        effect("damper.stroke_stop", stroke=0.02),
        effect("damper.offset", force=0.5),
    ],
    "readings": [
        *FALSIFIED,
        effect("sensor.column_displacement.lag", time_constant=0.001),
        effect("sensor.damper_stroke.gain", factor=0.97),
    ],
    "building": [
        effect("ground.scale", factor=0.94),
        effect("ground.time_shift", shift=0.0033),
        effect("structure.mass", factor=1.06),
        effect("structure.stiffness", factor=0.94),
        effect("structure.damping", factor=1.1),
        effect("structure.p_delta", stiffness=-5e5),
    ],
}
LOTS["everything"] = [entry for entries in LOTS.values() for entry in entries]
NAMED = {entry["name"] for entry in LOTS["everything"]}
LOTS["everything"] += [  # effects that the lots above do not name, at the strength that is barely visible
    effect(name, **{part.name: part.sizes[0] for part in item.parameters if not part.shape})
    for name, item in CATALOGUE.items()
    if name not in NAMED and not item.signal and item.site != "link"
]


@pytest.mark.parametrize("lot", LOTS)
def test_the_loops_with_effects_equal_the_compiled_rollout(lot: str, plan: Plan, tmp_path: Path) -> None:
    truth = real(plan, *LOTS[lot], seed=11)
    assert truth.seed == 11
    recording = assert_equals_the_rollout(plan, truth, tmp_path / "real.mcap")
    assert recording.ticks("master") == plan.ticks
    assert [true_system(truth), *true_slaves(truth).values()] != [System(plan)] * 2


def test_effects_of_a_reality_apply_to_its_true_parameters(plan: Plan, tmp_path: Path) -> None:
    """Tables of a reality set the true parameters; its effects are laid over those."""
    truth = real(
        plan,
        effect("column.stiffness", factor=0.9),
        column={"stiffness": 13e6},
        structure={"damping": 1.5e5},
        sensors={"column_force": 50.0},
    )
    system = true_system(truth)
    assert system.plan.column.stiffness == pytest.approx(0.9 * 13e6)
    assert_equals_the_rollout(plan, truth, tmp_path / "both.mcap")


def test_without_effects_the_system_equals_the_plan(plan: Plan) -> None:
    assert true_system(reality.as_planned(plan)) == System(plan)
    assert true_system(real(plan)) == System(plan)


def test_effects_on_single_slaves_act_as_in_the_real_loops(tmp_path: Path) -> None:
    slaves = {
        "roof": {"damper": {"mass": 12.0, "floor": 2}, "control": {"gain": 5e4}},
        "cellar": {"damper": {"mass": 20.0, "force_scale": 10.0}, "control": {"gain": 1.2e4}},
    }
    building = {"mass": [1.6e5] * 2, "stiffness": [6e7] * 2, "damping": [4e5] * 2}
    tables = {
        "test": {"duration": 1.0},
        "structure": building,
        "column": {"stiffness": 30e6},
        "slave": slaves,
    }
    plan = from_tables(tables, Path())
    truth = real(
        plan,
        effect("damper.friction", force=3.0) | {"slave": "roof"},
        effect("table.gain", factor=0.95) | {"slave": "cellar"},
        effect("sensor.damper_force.drift", rate=0.5) | {"slave": "cellar"},
        effect("damper.mass", factor=1.1),
        effect("column.stiffness", factor=0.9),
        effect("link.delay", delay=0.005) | {"slave": "cellar"},
    )
    run = assert_equals_the_rollout(plan, truth, tmp_path / "two.mcap")
    command = run.columns["slave.cellar"]["command_seq"]
    assert not np.array_equal(command, run.columns["slave.roof"]["command_seq"])
    assert run.columns["slave.roof"]["damper_force"].any()


def test_effects_apply_in_the_given_order(plan: Plan) -> None:
    truth = real(
        plan,
        effect("actuator.backlash", width=1e-4),
        effect("actuator.gain", factor=0.9),
        effect("actuator.backlash", width=2e-4),
        effect("actuator.gain", factor=0.9),
    )
    found = true_system(truth)
    assert found == lay(System(plan), truth.effects)
    assert found.effects.actuator.backlash == 2e-4
    assert found.plan.actuator.gain == pytest.approx(0.81)


LABORATORY_A = ("actuator.", "column.", "sensor.column_")
LABORATORY_B = ("table.", "damper.", "sensor.table_", "sensor.damper_")


def site_of(name: str) -> str:
    return "master" if name.startswith(LABORATORY_A) else "slave" if name.startswith(LABORATORY_B) else ""


def size(name: str) -> dict[str, float]:
    item = next(item for item in CATALOGUE[name].parameters if not item.shape)
    return {item.name: item.sizes[0]}


@pytest.mark.parametrize("name", DISTINCT)
@pytest.mark.parametrize("lab", ["master", "slave"])
def test_effects_on_a_plug_in_rig_are_refused_with_one_sentence(name: str, lab: str, plan: Plan) -> None:
    assert holders(plan, CATALOGUE[name].site) == ((site_of(name),) if site_of(name) else ())
    rig = {"rig": {"class": "somewhere.else:Lab"}}
    truth = real(plan, effect(name, **size(name)), **{lab: rig})
    if site_of(name) != lab:
        there = {"slave": site_of(name) or MASTER}.get(lab, SLAVE)  # the other laboratory
        assert true_system(truth.of(there)) == lay(System(plan), [(name, size(name))])
        return
    with pytest.raises(InputError) as caught:
        true_system(truth)
    text = str(caught.value)
    assert f"'{name}'" in text
    assert f"[{lab}.rig]" in text
    assert "\n" not in text
    assert text.count(". ") == 0
    assert text.endswith(".")


def test_effects_are_refused_on_a_plug_in_rig_of_the_plan(plan: Plan) -> None:
    tables = plan.tables()
    tables["slave"] = {"rig": {"class": "somewhere.else:Lab"}}
    planned = from_tables(tables, plan.base)
    with pytest.raises(InputError, match=r"'table\.gain' cannot be applied to the plug-in in \[slave\.rig\]"):
        true_system(real(planned, effect("table.gain", factor=0.9)))


def test_an_unnamed_slave_of_the_masters_kind_shares_its_true_parameters_and_not_its_effects() -> None:
    planned = parse('[slave]\nkind = "column"\n', Path())
    found = effect("column.friction", force=900.0, laboratory=SLAVE)
    truth = real(planned, found, column={"stiffness": 13e6})
    master, slave = true_system(truth), true_slaves(truth)[SLAVE]
    assert master.plan.column.stiffness == slave.plan.column.stiffness == 13e6
    assert (master.effects.column.friction, slave.effects.column.friction) == (0.0, 900.0)
    with pytest.raises(
        PlanError, match=r"'column' in \[slave\]: a slave without a name has \[column\] itself"
    ):
        real(planned, slave={"column": {"stiffness": 13e6}})


def test_effects_are_refused_on_a_plug_in_rig_of_a_named_slave() -> None:
    tables = Plan().tables() | {"slave": {"east": {"rig": {"class": "somewhere.else:Lab"}}, "west": {}}}
    planned = from_tables(tables, Path())
    truth = real(planned, effect("table.gain", factor=0.9))
    for one in (truth, truth.of("slave.east")):
        with pytest.raises(InputError, match=r"cannot be applied to the plug-in in \[slave\.east\.rig\]"):
            true_system(one)
    true_slaves(real(planned, effect("table.gain", factor=0.9, slave="west")))


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (effect("colum.friction", force=900.0), ("colum.friction", "did you mean column.friction")),
        (effect("column.friction", force=-1.0), ("force", "-1.0", "at most 1e+07 N")),
        (effect("column.friction"), ("force", "missing")),
        (effect("column.friction", force=900.0, weight=1.0), ("weight", "column.friction")),
        (effect("column.friction", force=math.nan), ("force", "nan")),
    ],
)
def test_an_unknown_effect_is_refused_with_and_without_a_plug_in_rig(
    entry: dict[str, Any], words: tuple[str, ...], plan: Plan
) -> None:
    with pytest.raises(RthsError) as caught:
        true_system(real(plan, entry))
    assert "\n" not in str(caught.value)
    assert all(word in str(caught.value) for word in words)


def test_an_ideal_table_refuses_effects_before_anything_moves(plan: Plan, tmp_path: Path) -> None:
    truth = real(
        plan, effect("table.friction", acceleration=0.1), table={"frequency": math.inf, "delay": 0.0}
    )
    with pytest.raises(InputError, match="ideal table"):
        virtual.assemble(plan, truth, tmp_path / "none.mcap")
