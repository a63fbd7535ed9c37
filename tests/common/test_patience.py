"""Limits of a test whose laboratories are all emulated follow from the plan and are strict with a rig."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from common.errors import PlanError
from common.host.bare_loop import BareLoop
from common.host.realtime import NOTHING
from common.lab import lacking
from common.plan import patience
from common.plan import read as plans
from common.plan.kinds import COLUMN, TABLE
from common.plan.plan import OVERRUN, Plan
from common.plan.read import from_tables, parse, with_test
from common.reality import reality
from common.terminal import cli

RIGS = {
    "the master's": '[master.rig]\nclass = "lab.py:Lab"\n',
    "the slave's": '[slave.rig]\nclass = "lab.py:Lab"\n',
    "that of one of several slaves": '[slave.roof.rig]\n[slave.middle.rig]\nclass = "lab.py:Lab"\n',
}
HERE = Path()


@pytest.mark.parametrize("name", cli.SHIPPED)
def test_shipped_plans_tolerate_pauses_and_are_strict_with_a_rig(name: str) -> None:
    shipped = plans.load(cli.plan_path(name))
    assert {OVERRUN, "safety.ramp_after", "safety.hold_after"} <= set(shipped.eased)
    interval, safety = shipped.test.interval, shipped.safety
    assert min(safety.overrun, safety.ramp_after) * interval >= 10 * 0.05  # pauses of 50 ms
    assert shipped.link.loss_timeout > (safety.overrun + safety.ramp_after) * interval
    assert patience.strict(shipped).safety == Plan().safety
    assert patience.strict(shipped).preflight.lost == 0
    assert patience.strict(shipped).limits.damper_stroke == Plan().limits.damper_stroke


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("default", {TABLE}),
        ("two_dampers", {TABLE}),
        ("single_site", set()),
        ("two_columns", {COLUMN}),
        ("two_storeys", {COLUMN}),
        ("two_slaves", {COLUMN, TABLE}),
    ],
)
def test_limits_are_larger_for_the_kinds_that_slaves_host(name: str, kinds: set[str]) -> None:
    eased = [figure for figure in plans.load(cli.plan_path(name)).eased if figure.startswith("limits.")]
    assert eased == [
        f"limits.{limit}" for kind, limits in patience.OF_KIND.items() if kind in kinds for limit in limits
    ]


def test_the_message_says_that_limits_of_a_users_kind_are_not_checked() -> None:
    said = patience.sentence(parse('[slave]\nkind = "lab.py:Lab"\n', HERE))
    assert "Limits of a kind of your own on the rates of its command are not checked." in said
    assert "actuator" not in said
    assert "kind of your own" not in patience.sentence(parse("", HERE))


@pytest.mark.parametrize("whose", RIGS)
def test_with_a_rig_of_the_user_every_limit_is_strict(whose: str) -> None:
    planned = parse(RIGS[whose], HERE)
    assert planned.eased == ()
    assert (planned.safety, planned.limits, planned.link) == (Plan().safety, Plan().limits, Plan().link)
    assert not planned.makes_good


def test_a_reality_changes_no_limit(tmp_path: Path) -> None:
    planned = parse("", HERE)
    hidden = reality.from_reality({"master": {"rig": {"class": "lab.py:Lab"}}}, planned, tmp_path)
    assert hidden.plan.safety == planned.safety
    assert hidden.plan.limits == planned.limits


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("[safety]\noverrun = 5", "safety.overrun", 5),
        ("[safety]\noverrun = 7000", "safety.overrun", 7000),
        ("[safety]\nmessage_age = 0.1", "safety.message_age", 0.1),
        ("[safety]\nramp_after = 5", "safety.hold_after", 3),
        ("[link]\nloss_timeout = 1.0", "link.loss_timeout", 1.0),
        ("[preflight]\nlost = 0", "preflight.lost", 0),
        ("[limits]\ntable_step = 0.01", "limits.table_step", 0.01),
        ("[limits]\ndamper_stroke = 0.4", "limits.damper_stroke", 0.4),
    ],
)
def test_a_limit_that_the_plan_gives_is_used_as_given(text: str, name: str, value: float) -> None:
    planned = parse(text, HERE)
    assert patience.figure(planned, name) == value
    assert name not in planned.eased
    assert planned.eased  # the others are patient all the same


def test_late_ticks_are_made_up_unless_the_plan_gives_overrun() -> None:
    assert parse("", HERE).makes_good
    assert not parse("[safety]\noverrun = 5", HERE).makes_good
    assert not Plan().makes_good


@pytest.mark.parametrize("interval", [1e-4, 0.002, 0.1])
def test_limits_that_are_counted_in_intervals_follow_the_interval(interval: float) -> None:
    planned = parse(f"[test]\ninterval = {interval}", HERE)
    assert planned.safety.overrun == math.ceil(patience.PATIENCE / interval - 1e-9)
    assert Plan().safety.hold_after <= planned.safety.hold_after < planned.safety.ramp_after


def test_a_given_hold_after_above_the_strict_ramp_after_is_refused() -> None:
    with pytest.raises(PlanError, match="hold_after in .safety. is 10"):
        parse("[safety]\nhold_after = 10", HERE)


def test_every_process_and_the_recorded_plan_give_the_same_limits() -> None:
    planned = parse("[test]\nduration = 4.0\n[preflight]\nexchanges = 500\n", HERE)
    again = parse(planned.toml(), HERE)
    assert (again, again.eased, again.digest()) == (planned, planned.eased, planned.digest())
    assert with_test(planned, seed=planned.test.seed).digest() == planned.digest()
    assert planned.with_ticks(20).eased == planned.eased
    assert planned.digest() != patience.strict(planned).digest()
    written = planned.written()
    written["master"]["rig"]["class"] = "lab.py:Lab"
    assert from_tables(written, HERE).safety == Plan().safety


def test_the_message_names_every_limit_with_its_strict_value() -> None:
    planned = parse("", HERE)
    said = patience.sentence(planned)
    assert "overrun 1000 (5)" in said
    assert "late_share 1 (0.05)" in said
    assert all(name.partition(".")[2] in said for name in planned.eased)


def test_a_test_without_a_rig_does_not_report_what_the_machine_lacks() -> None:
    assert lacking.lacks(parse("", HERE), NOTHING._replace(missing=("No real-time priority.",))) == []


def test_a_test_with_a_rig_reports_what_the_machine_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {"ticks": 470.0, "late": 30.0, "max": 0.019}
    monkeypatch.setattr(BareLoop, "start", lambda *_: None)
    monkeypatch.setattr(BareLoop, "stop", lambda _: found)
    monkeypatch.setattr(lacking, "MEASURED_S", 0.0)
    planned = parse(RIGS["the slave's"] + "[safety]\nramp_after = 50\n", HERE)
    priority, lateness, lax = lacking.lacks(planned, NOTHING._replace(missing=("No real-time priority.",)))
    assert priority == "No real-time priority."
    assert (
        "30 of 500 by a whole interval of 2 ms or more, the worst by 19.0 ms; at 10 ms (overrun" in lateness
    )
    assert "ramp_after in [safety] is set to 50, less strict than 5" in lax
    found["late"] = 0.0
    assert len(lacking.lacks(planned, NOTHING)) == 1
