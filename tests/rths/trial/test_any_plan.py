"""The blind trial of any plan: where effects are hidden, the independent laboratories, and the report that counts."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError
from common.plan import read as plans
from common.reality import reality as realities
from common.roles import MASTER
from common.terminal import cli
from diagnosis.report import read
from laboratories.emulated import EmulatedLab
from laboratories.kinds import kind_of
from loop import rigs
from models.system import System
from tests.helpers import ROOT
from tests.rths.trial.test_scoring import answer
from validation.blind.cases.basis import TrialBasis, basis
from validation.blind.cases.case import Case, Laid
from validation.blind.draw import begin, draw
from validation.blind.judge import DiagnosisAnswer
from validation.blind.labs.device_lab import OwnKernelLab
from validation.blind.library import OWN_KERNEL
from validation.blind.oracle import tolerated
from validation.blind.record import RecordedCase, record
from validation.blind.results.scoring import Outcome, judge

DAMPER = str(ROOT / "examples" / "viscous_damper.toml")
CLASS = f"{ROOT / 'examples' / 'viscous_damper.py'}:ViscousDamper"
NAMES = ("two_columns", "two_storeys", "single_site", "two_slaves", "two_dampers", DAMPER)
SOFT = {"factor": 0.9}


@cache
def trial_of(name: str) -> TrialBasis:
    """A trial with short tests of a plan."""
    return basis(plans.load(cli.plan_path(name)), 2.0)


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES, ids=lambda name: Path(name).stem)
def test_effects_are_hidden_in_every_laboratory_and_every_case_can_be_built(name: str) -> None:
    cases = draw(24, 1, "judge", trial=trial_of(name))
    assert {item.role for case in cases for item in case.laid} - {""} == set(trial_of(name).plan.kinds)
    for case in cases:
        plan = plans.from_tables(case.plan, Path())
        truth = realities.from_reality(case.reality(), plan, Path())
        for role in (MASTER, *plan.roles):
            rigs.build(truth.of(role), role)
        assert truth.plan.sensors != plan.sensors


@pytest.mark.long
def test_laboratories_of_one_kind_share_its_effects_by_name() -> None:
    columns, storeys = trial_of("two_columns"), trial_of("two_storeys")
    for index in range(40):
        begun = [begin(index, 3, "judge", trial.library) for trial in (columns, storeys)]
        assert begun[0] == begun[1]
    laid = [item for case in draw(40, 3, "judge", trial=columns) for item in case.laid if item.alone]
    assert {item.role for item in laid} == {MASTER, "slave.east"}
    assert all(columns.library.places[item.name] == (MASTER, "slave.east") for item in laid)


def test_true_parameters_of_two_columns_are_drawn_independently() -> None:
    (case,) = draw(1, 1, "judge", trial=trial_of("two_columns"), only=["clean"])
    own, east = case.truths["column"], case.truths["slave"]["east"]["column"]
    assert own["stiffness"] != east["stiffness"]
    assert all(abs(one["stiffness"] / 12.5e6 - 1.0) <= 0.02 for one in (own, east))
    assert abs(case.truths["slave"]["east"]["actuator"]["delay"] / 0.012 - 1.0) <= 0.02


@pytest.mark.parametrize("name", ["two_dampers", "two_slaves"])
def test_the_oracle_varies_the_parameters_of_the_laboratory_that_it_judges(name: str) -> None:
    (case,) = draw(1, 1, "judge", trial=trial_of(name), only=["clean"])
    for role, kind in trial_of(name).plan.kinds.items():
        assert len(tolerated(case, role)) == {"column": 4, "table": 7}[kind]


@pytest.mark.long
def test_cases_of_a_users_kind_are_drawn_from_its_own_effects_and_tolerances() -> None:
    trial = trial_of(DAMPER)
    assert {"device.leak", "device.air"} < set(trial.library.catalogue)
    assert trial.library.formulas["device.leak"] == (OWN_KERNEL,)
    for case in draw(12, 1, "judge", trial=trial):
        true = case.truths["device"]["parameters"]
        assert abs(true["stiffness"] / 25e6 - 1.0) <= 0.05
        assert abs(true["exponent"] / 0.35 - 1.0) <= 0.02
        noise = case.truths["device"]["noise"]["piston_force"]
        assert 0.5 * 300.0 <= noise <= 3.0 * 300.0


@pytest.mark.long
def test_a_case_of_a_users_kind_is_recorded_with_the_size_of_its_effect(tmp_path: Path) -> None:
    (leak,) = draw(1, 1, "judge", trial=trial_of(DAMPER), only=["formula"], effects=["device.leak"])
    found = record(leak, tmp_path)
    assert not found.stopped
    assert found.sizes[0] > 0.0  # the motion has hardly begun


def readings(lab: Any, command: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    rows = []
    for value in command.tolist():
        rows.append(tuple(lab.read()))
        lab.write((value,))
    return np.array(rows)


def test_a_laboratory_of_a_users_kind_runs_its_own_kernel_unless_it_has_an_effect() -> None:
    plan = plans.load(cli.plan_path(DAMPER))
    silent = {"noise": {"piston_displacement": 0.0, "piston_force": 0.0}}
    command = 0.02 * np.sin(9.0 * np.arange(600) * 0.002)

    def played(name: str = "", /, **parameters: float) -> np.ndarray[Any, Any]:
        effects = [{"name": name, "parameters": parameters}] if name else []
        return readings(OwnKernelLab(0.002, 1, CLASS, silent, effects), command)

    kind = kind_of(plan, "slave")
    system = kind.noisy(System(plan), silent["noise"])
    clean = readings(EmulatedLab(kind, system, 1), command)
    assert np.array_equal(played(), clean)
    for name, parameters, both in (
        ("device.leak", {"share": 0.2}, False),
        ("x.device.ripple", {"amplitude": 1e-3, "frequency": 8.0}, True),
        ("x.device.cam", {"amplitude": 1e-4, "period": 0.02}, True),
        ("x.device.hardening", {"stiffness": 1e9}, False),
        ("sensor.piston_force.saturation", {"limit": 2e5}, False),
        ("sensor.piston_force.lag", {"time_constant": 0.005}, False),
    ):
        change = np.ptp(played(name, **parameters) - clean, axis=0)
        assert change[1] > 500.0, name  # N
        assert (change[0] > 0.0) == both, name
    with pytest.raises(InputError, match=r"Unknown effect 'device\.leek'"):
        played("device.leek", share=0.2)


def judged(plan: str, laid: Laid, reports: Mapping[str, dict[str, Any]]) -> Outcome:
    case = Case(0, "catalogue", trial_of(plan).plan.tables(), {}, 1, (laid,))
    answer = DiagnosisAnswer({name: read.report(one) for name, one in reports.items()}, 1.0)
    return judge(case, RecordedCase(0, "a.mcap", (9.0,), ""), answer)


def test_an_effect_must_be_named_in_its_own_laboratory() -> None:
    laid = Laid("column.stiffness", "column", SOFT, {"factor": 1.0}, role="slave.east", alone=True)
    right = answer("explained", "slave.east.column.stiffness", site="slave.east.column")
    right["which"][0]["parameters"] = {
        "slave.east.column.stiffness": {"factor": {"value": 0.9, "interval": [0.8, 1.0], "unit": ""}}
    }
    outcome = judged("two_columns", laid, {"east": right})
    assert outcome.right
    assert outcome.laboratories == ["slave.east"]
    assert outcome.truth == ["slave.east.column.stiffness"]
    assert [one.error for one in outcome.estimates] == [0.0]
    other = answer("explained", "master.column.stiffness", site="master.column")
    outcome = judged("two_columns", laid, {"east": other})
    assert not outcome.named
    assert outcome.surplus
    assert outcome.why == (
        "reports master.column.stiffness, not slave.east.column.stiffness; "
        "first site is master.column, not slave.east.column"
    )


def test_with_several_slaves_the_report_on_the_one_with_the_effect_counts() -> None:
    found = answer("explained", "damper.friction", site="damper")
    reports = {"roof": answer("no_gap"), "middle": found}
    middle, roof = (
        Laid("damper.friction", "damper", {"force": 3.0}, {"force": 0.0}, role=role, alone=True)
        for role in ("slave.middle", "slave.roof")
    )
    outcome = judged("two_dampers", middle, reports)
    assert outcome.right
    assert outcome.verdict == ["slave.middle.damper.friction"]
    assert judged("two_dampers", roof, reports).status == "no_gap"
    assert not judged("two_dampers", roof, reports).named
    both = answer("explained", "column.stiffness", site="column")
    column = Laid("column.stiffness", "column", SOFT, {"factor": 1.0}, role=MASTER)
    assert judged("two_dampers", column, {"roof": both, "middle": both}).right


def test_the_blind_trial_refuses_a_plan_with_a_users_rig() -> None:
    plan = plans.parse('[master.rig]\nclass = "my_lab.py:Lab"\n', ROOT)
    with pytest.raises(InputError, match="The plan names a rig: remove"):
        basis(plan)
