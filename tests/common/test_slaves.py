"""Several slaves in plan, reality, routes and recording."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common import roles, signals
from common.errors import InputError, PlanError
from common.lab.outlet import next_of, pack_nexts
from common.link import transport
from common.link.transport import Route, heard, said
from common.plan import read as plans
from common.plan.plan import Plan, ideal
from common.plan.read import MOST_SLAVES, from_tables, parse, with_test
from common.reality import reality
from common.recording.reader import read
from common.recording.writer import Recording
from common.signals import default_topics
from common.terminal import cli
from loop.links import seed_of

TWO = "[slave.roof.damper]\nmass = 20.0\n[slave.cellar.control]\ngain = 1.0\n"


def two() -> Plan:
    return parse(TWO, Path())


def test_a_single_slave_has_no_name(default_plan: Plan) -> None:
    assert default_plan.roles == ("slave",)
    assert default_plan.slaves == {}
    assert default_plan.of("slave") is default_plan


def test_named_slaves_keep_the_order_of_the_file_and_their_own_keys_override_common_ones() -> None:
    found = parse(TWO + "[damper]\ndamping = 7.0\n[table]\ndelay = 0.001\n", Path())
    assert found.roles == ("slave.roof", "slave.cellar")
    roof, cellar = found.of("slave.roof"), found.of("slave.cellar")
    assert (roof.damper.mass, roof.damper.damping, roof.table.delay) == (20.0, 7.0, 0.001)
    assert (cellar.damper.mass, cellar.damper.damping, cellar.control.gain) == (16.0, 7.0, 1.0)
    assert roof.slaves == {}
    assert roof.of("slave") is roof


def test_a_slave_with_another_model_has_none_of_the_parameters_of_the_common_one() -> None:
    text = (
        "[column]\nmodel = 'bilinear'\nyield_displacement = 0.01\nhardening = 0.1\ncolumns_per_storey = 6\n"
        "[slave.a]\nkind = 'column'\n[slave.a.compensator]\nkind = 'ats'\nlead = 0.036\n"
        "[slave.b]\nkind = 'column'\n[slave.b.column]\nmodel = 'linear'\n[slave.b.compensator]\nlead = 0.01\n"
    )
    found = parse(text, Path())
    assert found.of("slave.a").compensator.parameters == {"lead": 0.036}
    assert found.of("slave.a").column.parameters == {"yield_displacement": 0.01, "hardening": 0.1}
    assert found.of("slave.b").column.parameters == {}
    assert found.of("slave.b").column.columns_per_storey == 6
    common = found.compensator.parameters
    assert found.of("slave.b").compensator.parameters == common | {"lead": 0.01}


def test_a_slaves_own_compensator_replaces_the_common_one_with_all_its_parameters() -> None:
    text = "[table.compensator]\nkind = 'taylor'\nlead = 0.01\n[slave.a.table.compensator]\nkind = 'none'\n[slave.b]\n"
    found = parse(text, Path())
    assert found.of("slave.a").table.compensator.parameters == {}
    assert found.of("slave.b").table.compensator.parameters == {"lead": 0.01}


WRONG = {
    "a rig beside names": (
        "[slave.rig]\n[slave.roof.rig]\n",
        r"\[slave\] holds a rig beside the slaves roof: give that rig to a named slave",
    ),
    "unknown part": (
        "[slave.roof.dampr]\nmass = 1.0\n",
        r"Unknown key 'dampr' in \[slave.roof\]: did you mean damper",
    ),
    "unknown key": (
        "[slave.roof.damper]\nmas = 1.0\n",
        r"Unknown key 'mas' in \[slave.roof.damper\]: did you mean mass",
    ),
    "wrong type": (
        "[slave.roof.damper]\nmass = 'a'\n",
        r"mass in \[slave.roof.damper\] must be a number in kg, or one with its unit, not 'a'",
    ),
    "out of range": (
        "[slave.roof.table]\ndelay = -1.0\n",
        r"delay in \[slave.roof.table\] is -1.0, but must be",
    ),
    "a kind without a name beside tables": (
        '[slave]\nkind = "column"\n[slave.column]\nstorey = 1\n',
        r"write the kind in \[slave.NAME\], and \[slave.NAME.column\]",
    ),
    "a kind for all": ('[slave]\nkind = "table"\n[slave.a.rig]\n', r"write the kind in \[slave.NAME\]\."),
    "no table": ("[slave.roof]\ndamper = 3\n", r"\[slave.roof.damper\] must be a table, not 3"),
    "no slave": ("[slave]\nroof = 3\n", r"roof in \[slave\] is 3: give \[slave.rig\]"),
    "floor that is not there": (
        "[slave.roof.damper]\nfloor = 2\n",
        r"floor in \[slave.roof.damper\] is 2, but the structure has 1",
    ),
    "a name with a capital": ("[slave.Roof.rig]\n", r"The slave's name 'Roof' in \[slave.Roof\] must begin"),
    "a name with a dot": ("[slave.'a.b'.rig]\n", r"The slave's name 'a.b'"),
    "too many": (
        "".join(f"[slave.s{place}]\n" for place in range(MOST_SLAVES + 1)),
        "names 17 slaves, but there may be at most 16",
    ),
}


@pytest.mark.parametrize("text_and_message", WRONG.values(), ids=WRONG.keys())
def test_wrong_slaves_are_refused_in_one_sentence(text_and_message: tuple[str, str]) -> None:
    text, message = text_and_message
    with pytest.raises(PlanError, match=message) as error:
        parse(text, Path(), "my.toml")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "name", "message"),
    [
        (TWO, "", r"names its slaves: say which one this is with --name \(roof, cellar\)"),
        (TWO, "rof", "names no slave 'rof': did you mean roof"),
        ("", "roof", "one slave without a name: leave out --name roof"),
    ],
)
def test_a_slave_that_the_plan_does_not_have_is_refused(text: str, name: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse(text, Path()).slave_role(name)


NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,8}", fullmatch=True).filter(lambda name: name != "rig")
OWN = st.fixed_dictionaries(
    {},
    optional={
        "damper": st.fixed_dictionaries(
            {}, optional={"mass": st.floats(0.1, 1e4), "floor": st.integers(1, 3)}
        ),
        "table": st.fixed_dictionaries(
            {},
            optional={
                "frequency": st.one_of(st.just(math.inf), st.floats(0.1, 1e3)),
                "compensator": st.just({"kind": "taylor", "lead": 0.01}),
            },
        ),
        "control": st.fixed_dictionaries({}, optional={"amd": st.booleans(), "gain": st.floats(0.0, 1e6)}),
        "rig": st.just({"class": "lab.py:Lab", "options": {"a": 1.0}}),
    },
)


@given(slaves=st.dictionaries(NAMES, OWN, min_size=1, max_size=MOST_SLAVES), mass=st.floats(0.1, 1e4))
def test_a_plan_with_slaves_is_the_same_after_being_written_and_read(
    slaves: dict[str, Any], mass: float
) -> None:
    structure = {"mass": [1e5] * 3, "stiffness": [1e6] * 3, "damping": [0.0] * 3}
    original = from_tables({"structure": structure, "damper": {"mass": mass}, "slave": slaves}, Path())
    returned = parse(original.toml(), Path())
    assert returned == original
    assert list(returned.slaves) == list(slaves)
    assert returned.digest() == original.digest()
    assert with_test(original, seed=5).slaves == original.slaves
    for name, own in slaves.items():
        expected = own.get("damper", {}).get("mass", mass)
        assert returned.of(roles.slave_role(name)).damper.mass == expected


def test_the_digest_depends_on_the_order_of_slaves() -> None:
    tables = two().tables()
    turned = tables | {"slave": dict(reversed(tables["slave"].items()))}
    assert from_tables(turned, Path()).digest() != two().digest()


def test_the_ideal_plan_and_common_tables_reach_every_slave() -> None:
    perfect = ideal(two())
    assert all(math.isinf(perfect.of(role).table.frequency) for role in perfect.roles)
    assert perfect.of("slave.roof").damper.mass == 20.0


def test_the_shipped_plan_has_two_dampers_on_two_floors() -> None:
    found = plans.load(cli.plan_path("two_dampers"))
    assert found.roles == ("slave.roof", "slave.middle")
    assert [found.of(role).damper.floor for role in found.roles] == [3, 2]
    assert found.of("slave.middle").table.frequency == 20.0


# -- reality ----------------------------------------------------------------------------------------


def reality_of(text: str, planned: Plan, tmp_path: Path) -> reality.Reality:
    path = tmp_path / "reality.toml"
    path.write_text(text)
    return reality.load(path, planned)


def test_a_reality_replaces_one_laboratory_and_changes_the_parameters_of_all_or_one(tmp_path: Path) -> None:
    text = (
        "seed = 3\n[damper]\nmass = 17.0\n[slave.roof.damper]\ndamping = 9.0\n"
        "[slave.cellar.rig]\nclass = 'lab.py:Lab'\n"
        "[[effect]]\nname = 'table.delay'\ndelay = 0.001\nslave = 'roof'\n"
        "[[effect]]\nname = 'damper.friction'\nforce = 1.0\n"
    )
    found = reality_of(text, two(), tmp_path)
    roof, cellar = found.of("slave.roof"), found.of("slave.cellar")
    assert (roof.plan.damper.mass, roof.plan.damper.damping) == (17.0, 9.0)
    assert (cellar.plan.damper.mass, cellar.plan.damper.damping) == (17.0, 6.0)
    assert roof.slave.class_ == ""
    assert cellar.slave.class_ == f"{tmp_path.resolve()}/lab.py:Lab"
    assert found.hidden == {"slave.cellar"}
    assert [name for name, _ in roof.effects] == ["table.delay", "damper.friction"]
    assert [name for name, _ in cellar.effects] == ["damper.friction"]
    assert (roof.role, roof.place, cellar.role, cellar.place) == ("slave.roof", 0, "slave.cellar", 1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[slave.rof.rig]\n", "names no slave 'rof': did you mean roof"),
        ("[slave.roof]\ncontrol = {}\n", r"Unknown key 'control' in \[slave.roof\]"),
        ("[slave]\nroof = 3\n", r"\[slave.roof\] must be a table, not 3"),
        (
            "[[effect]]\nname = 'table.delay'\nslave = 'rof'\n",
            "is 'rof', which the plan does not name: did you mean",
        ),
        ("[[effect]]\nname = 'table.delay'\nslave = 3\n", "is 3, which the plan does not name"),
    ],
)
def test_a_reality_of_other_slaves_is_refused(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=message):
        reality_of(text, two(), tmp_path)


def test_links_of_several_slaves_have_different_seeds(tmp_path: Path) -> None:
    real = reality_of("seed = 3\n", two(), tmp_path)
    seeds = [seed_of(real.of(role)) for role in two().roles]
    assert seeds[0] == 3
    assert len(set(seeds)) == 2


# -- routes -----------------------------------------------------------------------------------------


def test_the_routes_of_a_single_slave_have_no_address() -> None:
    every = [*said("master", ("slave",)), *heard("slave", ("slave",)), *heard("recorder", ("slave",))]
    assert {route.to for route in every} == {""}


@given(count=st.integers(1, MOST_SLAVES))
def test_every_received_route_has_a_sender_and_no_slave_receives_anothers_messages(count: int) -> None:
    slaves = tuple(f"slave.s{place}" for place in range(count))
    all_roles = ("master", "recorder", "operator", "observer", *slaves)
    spoken = {route for role in all_roles for route in said(role, slaves)}
    for role in all_roles:
        assert set(heard(role, slaves)) <= spoken
    for slave in slaves:
        own = heard(slave, slaves)
        assert {route.role for route in own} == {"master", "recorder", "operator"}
        assert {route.to for route in own} == {"", slave}
        assert Route("master", transport.TICK) not in own


def test_the_recorder_reports_its_progress_to_each_laboratory() -> None:
    packed = pack_nexts({"master": 5, "slave.roof": 7})
    assert [next_of(packed, lab) for lab in ("master", "slave.roof", "slave.other")] == [5, 7, 0]
    for damaged in (b"\xc1", b"\x01", b"\x81\xa6master\xa1x"):  # no msgpack, no table, a text for a number
        assert next_of(damaged, "master") == 0


# -- recording --------------------------------------------------------------------------------------


def test_a_recording_has_a_topic_per_slave_and_an_array_per_command(tmp_path: Path) -> None:
    slaves, path = two().roles, tmp_path / "a.mcap"
    table = default_topics(slaves)
    labs = ["master", "slave.roof", "slave.cellar", "latency.roof", "latency.cellar"]
    assert list(table) == [*labs, "master_ramp", "slave_ramp.roof", "slave_ramp.cellar", "event"]
    recording = Recording(path, "trial", 1, table, slaves)
    kinds = {signals.FieldType.INDEX: [1, 2]}
    values = [kinds.get(row.kind, [1.0, 2.0]) if row.slaves else 0 for row in table["master"]]
    recording.add("master", 0, 0, values)
    recording.close({})
    found = read(path)
    assert found.roles == slaves
    for place, role in enumerate(slaves):
        view = found.of(role)
        assert view.roles == ("slave",)
        assert np.array_equal(view.columns["master"]["table_target"], [place + 1.0])
        assert np.array_equal(view.columns["master"]["damper_force_seq"], [place + 1])
    with pytest.raises(InputError, match="has no slave 'x'; it has slave 'roof', slave 'cellar'"):
        found.of("slave.x")


def test_a_recording_without_a_tick_has_empty_columns_for_every_slave(tmp_path: Path) -> None:
    slaves, path = two().roles, tmp_path / "a.mcap"
    recording = Recording(path, "trial", 1, default_topics(slaves), slaves)
    recording.add("event", 0, 0, (0.0, "recorder", "info", "begin", "begun", {}))
    recording.close({})
    found = read(path)
    assert found.roles == slaves
    assert all(column.size == 0 for column in found.of("slave.roof").columns.get("master", {}).values())


def test_the_schema_of_one_slave_has_no_arrays(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recording = Recording(path, "trial", 1, default_topics())
    recording.add("master", 0, 0, [0 for _ in signals.TOPICS["master"]])
    recording.close({})
    found = read(path)
    assert found.of("slave") is found
    assert all(column.ndim == 1 for column in found.columns["master"].values())
