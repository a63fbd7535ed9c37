"""What must hold before anything moves: risks by name, link and sensors."""

from __future__ import annotations

import argparse
import math
import random
from typing import Any

import pytest

from common.errors import InputError, RigError
from common.host.clock import VirtualClock
from common.lab import preflight
from common.lab.laboratory import Laboratory, Setting
from common.lab.preflight import Gate, PreflightCheck, RefusedError, SensorsAtRest, link_risk, sensor_risk
from common.link.memory_link import MemoryHub
from common.plan.patience import strict
from common.plan.plan import Plan
from common.recording.rows import values_of
from common.rig import ColumnMeasurement, GuardedRig
from common.safety.risks import Risk
from common.signals import TOPICS
from common.terminal import cli
from tests.helpers import with_table

PEAKS, LINK = Risk("peaks", "too high, so lower it"), Risk("link", "too slow, so hurry")
NAMES = ColumnMeasurement._fields
LIMITS = {"column_displacement": 0.03, "column_force": 400e3}
NOISE = {"column_displacement": 5e-6, "column_force": 100.0}


# -- risks and gates ------------------------------------------------------------------------------


def test_a_risk_refuses_the_test_unless_its_name_is_accepted() -> None:
    assert preflight.check([PEAKS, LINK], ["link"]) == ([PEAKS], [LINK])
    assert preflight.check([], []) == ([], [])


def test_a_refusal_is_one_sentence_that_states_how_to_accept_the_risk() -> None:
    with pytest.raises(RefusedError) as error:
        Gate(["link"]).judge(
            [
                PreflightCheck("", PEAKS),
                PreflightCheck("", LINK),
                PreflightCheck("", PEAKS._replace(sentence="again")),
            ]
        )
    assert str(error.value) == (
        "Pre-flight refuses the test: too high, so lower it; again; "
        "to run it all the same, give --accept-risk peaks."
    )
    assert error.value.exit_code == 3
    assert isinstance(error.value, RigError)  # a loop whose rig is refused as it arms stops in order


def test_passed_checks_and_accepted_risks_are_recorded_once() -> None:
    clock = VirtualClock()
    lab = Laboratory("master", Setting(Plan(), MemoryHub().join("master", clock), clock), TOPICS)
    gate = Gate(["peaks"])
    gate.judge([PreflightCheck("link good"), PreflightCheck("", PEAKS)])
    for _ in range(2):
        gate.note(lab)
    assert [tuple(values_of(row)[4:7]) for _, row in lab.outlet._pending] == [
        ("info", "preflight", "pre-flight: link good."),
        ("warning", "accepted_risk", "risk 'peaks' accepted: too high, so lower it."),
    ]


@pytest.mark.parametrize(
    ("word", "hint"), [("peeks", "did you mean peaks?"), ("x", "known here: building, disk, link")]
)
def test_an_unknown_risk_to_accept_is_refused_with_the_nearest_name(word: str, hint: str) -> None:
    parser = argparse.ArgumentParser()
    cli.accept_argument(parser)
    assert cli.accepted_risks(parser.parse_args([])) == ()
    taken = parser.parse_args(["--accept-risk", "link", "--accept-risk", "disk", "--accept-risk", "link"])
    assert cli.accepted_risks(taken) == ("link", "disk")
    with pytest.raises(InputError, match=f"no risk '{word}' to accept: {hint}".replace("?", r"\?")):
        cli.accepted_risks(parser.parse_args(["--accept-risk", word]))


# -- link -----------------------------------------------------------------------------------------


def test_preflight_accepts_no_loss_and_the_plans_share_of_late_messages() -> None:
    plan = Plan()
    quick, late = [0.0003] * 950, [0.0021] * 50
    assert link_risk(quick + late, 0, plan) is None
    assert preflight.link_check(quick + late, 0, plan).text == (
        "Link check: 1000 exchanges, none lost, 50 late, round trip p50 0.30 ms, p99 2.10 ms"
    )
    lost = link_risk(quick, 1, plan)
    slow = link_risk(quick[1:] + late + late[:1], 0, plan)
    assert lost is not None
    assert lost.name == "link"
    assert "of 951 exchanges over the link 1 were lost and 0 took longer" in lost.sentence
    assert slow is not None
    assert "0 were lost and 51 took longer than the interval of 2 ms (5% of them may)" in slow.sentence
    assert "p50 0.30 ms, p99 2.10 ms" in slow.sentence


def test_a_link_without_any_answer_is_a_risk() -> None:
    found = link_risk([], 1000, Plan())
    assert found is not None
    assert "none of 1000 exchanges over the link came back" in found.sentence


# -- sensors --------------------------------------------------------------------------------------


def at_rest(count: int = 50, *, offset: float = 0.0, factor: float = 1.0) -> list[list[float]]:
    draw = random.Random(1)
    return [
        [offset * LIMITS[name] + draw.gauss(0.0, factor * NOISE[name]) for name in NAMES]
        for _ in range(count)
    ]


def frozen(rows: list[list[float]]) -> list[list[float]]:
    return [[row[0], 12.5] for row in rows]


@pytest.mark.parametrize(
    ("readings", "what", "figures"),
    [
        ([[0.0, math.nan]], "column_force of lab A is not finite", "nan"),
        ([[0.0, 400_001.0]], "column_force of lab A is beyond its limit", "400001 of 400000"),
        (frozen(at_rest()), "column_force of lab A is frozen", "50 readings of 12.5, nominal noise 100 rms"),
        (
            at_rest(factor=20.0),
            "column_displacement of lab A is noisier than 10 × its nominal noise",
            "of 5e-06 rms",
        ),
        (at_rest(offset=0.11), "column_displacement of lab A is off zero by more than 10%", "of 0.03"),
    ],
)
def test_a_sensor_channel_that_is_faulty_at_rest_is_named(readings: Any, what: str, figures: str) -> None:
    for hidden in (False, True):
        found = sensor_risk(readings, NAMES, LIMITS, NOISE, hidden=hidden, lab="lab A")
        assert found is not None
        assert found.name == "sensors"
        assert found.sentence.startswith(what)
        assert (figures in found.sentence) is not hidden


def test_correct_sensor_channels_pass_the_check_at_rest() -> None:
    assert sensor_risk(at_rest(), NAMES, LIMITS, NOISE) is None
    assert sensor_risk(at_rest(factor=8.0, offset=0.09), NAMES, LIMITS, NOISE) is None
    assert sensor_risk(frozen(at_rest()), NAMES, LIMITS, {**NOISE, "column_force": 0.0}) is None


class Counting:
    """A rig that counts how often it is read."""

    def __init__(self) -> None:
        self.read_at: list[int] = []
        self.clock = VirtualClock()

    def arm(self) -> None:
        pass

    def read(self) -> tuple[float, float]:
        self.read_at.append(self.clock.now())
        return 1e-9 * len(self.read_at), 1e-9 * len(self.read_at)

    def write(self, command: Any) -> None:
        raise AssertionError

    def disarm(self) -> None:
        pass


class Idle(Counting):
    idle_readings = True


def armed(rig: Counting, gate: Gate, **options: Any) -> None:
    setting = Setting(
        with_table(Plan(), "preflight", readings=5), MemoryHub().join("master", rig.clock), rig.clock
    )
    at_rest = SensorsAtRest(gate, setting, vars(strict(setting.plan).limits), vars(setting.plan.sensors))
    GuardedRig(rig, "lab A", ColumnMeasurement, at_rest=at_rest, **options).arm()


def test_a_rig_that_allows_idle_readings_is_read_once_per_interval_at_rest() -> None:
    rig, gate = Idle(), Gate()
    armed(rig, gate)
    assert rig.read_at == [2_000_000 * place for place in range(1, 6)]
    assert "Sensor check at rest: passed" in gate.passed[0][1]


def test_a_rig_without_idle_readings_is_not_read_at_rest_and_a_hidden_one_gives_no_hint() -> None:
    rig, open_, hidden, idle = Counting(), Gate(), Gate(), Gate()
    armed(rig, open_)
    armed(rig, hidden, hidden=True)
    armed(Idle(), idle)
    assert rig.read_at == []
    assert "Sensor check skipped: class Counting does not set idle_readings = True" in open_.passed[0][1]
    assert hidden.passed == idle.passed


def test_a_twin_is_read_at_rest_in_place_of_its_rig() -> None:
    rig, twin = Idle(), Counting()
    armed(rig, Gate(), twin=lambda: twin)
    assert rig.read_at == []
    assert len(twin.read_at) == 5


def test_a_failed_sensor_check_stops_arming_unless_the_risk_is_accepted() -> None:
    class Off(Idle):
        def read(self) -> tuple[float, float]:
            return 0.02, super().read()[1]

    with pytest.raises(RefusedError, match="column_displacement of lab A is frozen .* --accept-risk sensors"):
        armed(Off(), Gate())
    gate = Gate(["sensors"])
    armed(Off(), gate)
    assert [risk.name for risk in gate.overruled] == ["sensors"]
