"""The sentences about the clock and the rigs of a recording, and its response storey by storey."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan.laboratory_tables import LaboratoryTable, RigTable
from common.plan.plan import Plan
from common.plan.read import from_tables
from common.recording.reader import read
from common.recording.run import CLOCK, Run
from report.facts import circumstances, storeys
from report.facts.laboratories import laboratories, plan_of
from report.facts.summary import summarize


def without_the_record(path: Path) -> Run:
    """A recording in the older form that does not state its clock."""
    run = read(path)
    del run.metadata[CLOCK]
    return run


def test_a_run_in_virtual_time_states_this_and_shows_no_latency(
    call: Any, capsys: Any, virtual_recording: Path
) -> None:
    assert call("inspect", virtual_recording) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[2] == (
        "Virtual time in one process, in which computing takes no time and no latency is measured; by the plan both "
        "laboratories are emulated."
    )
    assert not [line for line in out if line.startswith(("latency, µs", "late ticks", "round_trip"))]
    assert call("budget", virtual_recording) == 0
    said = capsys.readouterr().out
    assert said.count("\n") == 1
    assert said.startswith(circumstances.NO_LATENCY)
    assert said.endswith("is within the budget default.\n")
    assert call("plot", virtual_recording, "latency") == 2
    assert "needs latency of a test in real time, and this one ran in virtual time" in capsys.readouterr().err


def test_for_an_old_recording_only_what_its_times_show_is_stated(virtual_recording: Path) -> None:
    run = without_the_record(virtual_recording)
    assert circumstances.clock_of(run) == circumstances.VIRTUAL
    run.columns["latency"]["compute_time"][7] = 4e-5
    assert circumstances.clock_of(run) == circumstances.REAL
    del run.columns["latency"]
    assert circumstances.clock_of(run) == circumstances.UNKNOWN
    assert summarize(run)["circumstances"] == ""


@pytest.mark.parametrize(
    ("rig", "said"),
    [
        ("", "by the plan both laboratories are emulated."),
        ("lab.py:TableLab", "the plan's rigs: master emulated, slave lab.py:TableLab."),
    ],
)
def test_the_sentence_about_the_rigs_follows_from_the_plan_only(
    rig: str, said: str, virtual_recording: Path, short_plan: Plan
) -> None:
    run = read(virtual_recording)
    run.metadata[CLOCK]["kind"] = circumstances.REAL
    plan = replace(short_plan, slave=LaboratoryTable(RigTable(rig)))
    assert circumstances.sentence(run, plan).endswith(said)


def test_each_of_three_storeys_has_its_drift_and_shear() -> None:
    t = np.array([0.0, 0.002, 0.004])
    plan = from_tables(
        {"structure": {"mass": [1e5] * 3, "stiffness": [8e7, 6e7, 4e7], "damping": [1e5] * 3}}, Path()
    )
    floors = np.array([[0.0, 0.0, 0.0], [1e-3, 3e-3, 2e-3], [2e-3, 3e-3, 7e-3]])
    numerical = np.array([[0.0, 0.0, 0.0], [10.0, 20.0, -30.0], [-40.0, 50.0, 60.0]])
    columns = {"t": t, "displacement": floors, "absolute_acceleration": 10.0 * floors}
    columns |= {"numerical_force": numerical, "column_force": np.array([0.0, 5.0, 0.0])}
    run = Run(Path("x"), columns={"master": columns}, metadata={"plan": {"toml": plan.toml()}})
    found = storeys.storeys(run, plan, laboratories(run))
    assert [item["drift"]["peak"] for item in found] == pytest.approx([2e-3, 2e-3, 4e-3])
    assert [item["displacement"]["peak"] for item in found] == pytest.approx([2e-3, 3e-3, 7e-3])
    assert [item["shear"]["peak"] for item in found] == [40.0, 50.0, 60.0]
    assert found[1]["drift"]["t"] == 0.002
    columns["column_force"] = np.array([0.0, 500.0, 0.0])
    assert storeys.storeys(run, plan, laboratories(run))[0]["shear"]["peak"] == 510.0


def test_the_modes_of_a_recording_are_those_of_its_plan(
    call: Any, capsys: Any, virtual_recording: Path
) -> None:
    assert call("inspect", virtual_recording, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["modes"][0]["period"] == pytest.approx(0.5027, abs=1e-4)
    assert found["modes"][0]["damping_ratio"] == pytest.approx(0.05, abs=1e-4)
    assert found["storeys"][0]["drift"] == found["peaks"]["master/displacement"]
    plan = plan_of(read(virtual_recording))
    assert plan is not None
    free = replace(plan, structure=replace(plan.structure, stiffness=(0.0,), damping=(0.0,)))
    assert storeys.modes(free) == [{"period": None, "damping_ratio": None}]
