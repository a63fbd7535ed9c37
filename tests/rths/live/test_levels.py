"""The limits that the bars of the panel show."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from common.plan import read as plans
from common.roles import SLAVE
from common.signals import Channels, Signal
from laboratories.kind import usual
from report.facts.laboratories import LaboratoryFacts
from report.live.levels import limits

PLAN = Path(__file__).parents[3] / "rths" / "plans" / "default.toml"


def test_an_own_kind_has_the_limits_of_its_table_in_si_units() -> None:
    plan = plans.load(PLAN)
    device = dataclasses.replace(plan.device, limits={"stroke": "5 mm", "step": 0.1})
    slave = dataclasses.replace(plan.slave, kind="mine.py:Mine")
    plan = dataclasses.replace(plan, device=device, slave=slave)
    signal = Signal("stroke", "m", "stroke")
    channels = Channels(
        target=Signal("stroke_target", "m", "target"),
        command=Signal("stroke_command", "m", "command"),
        measured=(signal, Signal("pull", "N", "pull")),
        position="stroke",
        force="pull",
    )
    lab = LaboratoryFacts(SLAVE, SLAVE, channels, usual(channels))
    assert limits(plan, lab) == {"stroke": 0.005}
