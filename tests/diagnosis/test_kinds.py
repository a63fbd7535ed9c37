"""Tests of other kinds of laboratory: the cause is named at the laboratory that hides it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from common.plan.plan import Plan
from common.plan.read import with_test
from common.reality import reality
from common.recording.reader import read
from diagnosis.report.records import Report
from loop import substructure
from loop.of_reality import really
from report.gap import rig, terminal
from rths.examine.diagnose import diagnose_slaves
from rths.prepare.simulate import write
from tests.shapes import plan_of

SECONDS = 6.0
SHAKEN: dict[str, dict[str, Any]] = {"ground_motion": {"scale": 0.2}, "control": {"amd": False}}
SINGLE = plan_of("single_site", **SHAKEN)
TWO = plan_of("two_columns", **SHAKEN)
NO_RIG = plan_of("two_slaves")
OWN = plan_of("viscous_damper")
YIELDING = {"name": "column.yielding", "yield_displacement": 0.002}


def diagnosed(plan: Plan, path: Path, *hidden: dict[str, Any]) -> dict[str, Report]:
    """Reports on a simulated recording of laboratories with hidden effects, by the slave's name."""
    short = with_test(plan, duration=SECONDS)
    truth = reality.from_reality({"effect": list(hidden), "seed": 3}, short, short.base)
    rollout, motion = really(truth, noise=True), substructure.motion(short)
    write(path / "test.mcap", short, rollout, motion, substructure.ground_rows(short, motion))
    (path / "plan.toml").write_text(short.toml())
    recording = read(path / "test.mcap")
    recording.path = short.base / "test.mcap"  # where the plan in it finds the user's file
    return diagnose_slaves(recording)


def boxes(report: Report) -> list[str]:
    """The parts on the diagram of the rig."""
    drawn = rig.rig(report)
    assert drawn is not None
    return [box.name for box in drawn["boxes"]]


def named(report: Report) -> tuple[str, ...]:
    return report.which[0].effects


@pytest.mark.long
@pytest.mark.parametrize(("lab", "said"), [("master", "master"), ("slave.east", "slave 'east'")])
def test_the_yielding_one_of_two_columns_is_named(lab: str, said: str, tmp_path: Path) -> None:
    report = diagnosed(TWO, tmp_path, {**YIELDING, "laboratory": lab})["east"]
    assert report.status == "explained"
    assert named(report) == (f"{lab}.column.yielding",)
    assert [place.site for place in report.where] == [f"{lab}.column"]
    assert f"column yielding at the {said}" in " ".join(terminal.summary(report).split())
    assert {"column_force", "slave.east.column_force"} <= report.gap.signals.keys()
    assert {"master.column.stiffness", "slave.east.actuator.delay"} <= report.tolerances.keys()


@pytest.mark.long
def test_a_test_without_slaves_gives_one_report(tmp_path: Path) -> None:
    reports = diagnosed(SINGLE, tmp_path, {"name": "actuator.delay", "delay": 0.004})
    assert list(reports) == [""]
    assert named(reports[""]) == ("actuator.delay",)
    assert reports[""].gap.signals.keys() == {"column_displacement", "column_force"}
    assert boxes(reports[""]) == ["ground", "structure", "actuator", "column"]


@pytest.mark.long
def test_a_master_without_a_rig_gives_a_report_per_slave(tmp_path: Path) -> None:
    delay, friction = {"name": "actuator.delay", "delay": 0.004}, {"name": "damper.friction", "force": 3.0}
    reports = diagnosed(NO_RIG, tmp_path, delay, friction)
    assert list(reports) == ["columns", "dampers"]
    assert named(reports["columns"]) == ("actuator.delay",)
    assert named(reports["dampers"]) == ("damper.friction",)
    assert "structure.stiffness" in reports["columns"].tolerances
    assert boxes(reports["columns"]) == ["ground", "structure", "link", "actuator", "column"]
    assert boxes(reports["dampers"]) == ["ground", "structure", "link", "table", "damper"]


@pytest.mark.long
def test_a_hidden_effect_of_a_users_device_is_named(tmp_path: Path) -> None:
    report = diagnosed(OWN, tmp_path, {"name": "device.leak", "share": 0.2})[""]
    assert named(report) == ("device.leak",)
    found = report.which[0].parameters["device.leak"]["share"]
    assert found.value == pytest.approx(0.2, abs=0.03)
    assert report.where[0].site == "device"
    assert boxes(report) == ["ground", "structure", "link", "device"]


@pytest.mark.long
def test_a_test_that_is_as_planned_has_no_gap(tmp_path: Path) -> None:
    assert diagnosed(TWO, tmp_path)["east"].status == "no_gap"


@pytest.mark.long
def test_the_diagram_colours_the_part_and_the_reading_of_the_laboratory_that_has_the_gap(
    tmp_path: Path,
) -> None:
    hidden = {"name": "sensor.column_force.delay", "delay": 0.004, "laboratory": "slave.east"}
    report = diagnosed(TWO, tmp_path, hidden)["east"]
    drawn = rig.rig(report)
    assert drawn is not None
    assert [box.name for box in drawn["boxes"]].count("column") == 2
    (coloured,) = (circle for circle in drawn["circles"] if circle.share)
    assert (coloured.sensor.label, coloured.share) == ("force", "100 %")
    assert coloured.sensor.y > rig.LINK[1]  # in the slave's laboratory
