"""The motion of actuator, column, table and damper of the trial's laboratories under an effect."""

from __future__ import annotations

import numpy as np
import pytest

from tests.rths.trial.played_labs import CLEAN, DT, KNOWN_A, TIMES, Trace, effect, near, play, play_a, play_b


def test_forces_resist_motion_and_deformation() -> None:
    x = CLEAN["column_displacement"]
    v = np.gradient(x, DT)
    for name, formula, parameters in (
        ("column.friction", "tanh", {"force": 1000.0}),
        ("column.friction", "dahl", {"force": 1000.0}),
        ("column.friction", "lugre", {"force": 1000.0}),
    ):
        extra = play_a(effect(name, formula, **parameters))["column_force"] - CLEAN["column_force"]
        fast = np.abs(v) > 0.01
        assert np.allclose(extra[fast], np.sign(v[fast]) * 1000.0, rtol=0.03), formula
    extra = play_a(effect("column.viscous", coefficient=5e4))["column_force"] - CLEAN["column_force"]
    assert np.mean(extra * v) > 0.0
    assert np.interp(0.02, *paired(v, extra)) == pytest.approx(1000.0, rel=0.03)
    relaxing = (
        play_a(effect("column.viscous", "maxwell", coefficient=5e4))["column_force"] - CLEAN["column_force"]
    )
    given = relaxing + 0.03 * np.gradient(relaxing, DT)  # f + τ·ḟ = c·v
    assert np.allclose(given[5:-5], 5e4 * v[5:-5], atol=0.02 * np.max(np.abs(5e4 * v)))
    extra = play_a(effect("column.inertia", mass=1000.0))["column_force"] - CLEAN["column_force"]
    assert np.corrcoef(extra[500:], np.gradient(v, DT)[500:])[0, 1] > 0.95
    extra = play_a(effect("column.hardening", share=0.1))["column_force"] - CLEAN["column_force"]
    y = x / 2e-3
    assert np.allclose(extra, 0.6 * 12.5e6 * 2e-3 * (np.sinh(y) - y), atol=0.1)
    extra = play_a(effect("x.column.asymmetry", share=0.1))["column_force"] - CLEAN["column_force"]
    assert np.allclose(extra, 0.1 * 12.5e6 * np.abs(x), atol=0.1)


def paired(by: Trace, values: Trace) -> tuple[Trace, Trace]:
    """Values on the side of growing `by`, sorted, for interpolation."""
    order = np.argsort(by)
    return by[order], values[order]


@pytest.mark.parametrize("formula", KNOWN_A["column.yielding"].formulas)
def test_a_yielding_column_begins_elastic_softens_and_dissipates(formula: str) -> None:
    found = play_a(effect("column.yielding", formula, yield_displacement=1e-3, hardening=0.05))
    x, f = found["column_displacement"], found["column_force"]
    first = np.abs(np.maximum.accumulate(np.abs(x))) < 0.3e-3
    assert np.allclose(f[first], 12.5e6 * x[first], atol=0.01 * 12.5e3 + 5.0)
    assert 0.6 * 12.5e3 < np.max(np.abs(f)) < 1.35 * 12.5e3 * (1.0 + 0.05)
    assert np.trapezoid(f, x) > 0.0
    outside = np.abs(f) - 12.5e6 * (1e-3 + 0.05 * np.maximum(np.abs(x) - 1e-3, 0.0))
    bound = 0.01 if formula != "ramberg_osgood" else 0.25
    assert np.max(outside) < bound * 12.5e3


def test_a_takeda_column_softens_as_it_unloads() -> None:
    ramp = np.concatenate([np.linspace(0.0, 4e-3, 2000), np.linspace(4e-3, 0.0, 2000)])
    found = play_a(effect("column.yielding", "takeda", yield_displacement=1e-3, hardening=0.0), command=ramp)
    x, f = found["column_displacement"][2600:2900], found["column_force"][2600:2900]
    down = f > 100.0
    slope = np.polyfit(x[down], f[down], 1)[0]
    assert slope == pytest.approx(12.5e6 * (1e-3 / np.max(found["column_displacement"])) ** 0.4, rel=0.01)


def test_the_valve_limits_the_speed_and_load_or_play_reduces_the_displacement() -> None:
    for formula in ("smooth", "orifice"):
        slow = play_a(effect("actuator.velocity_limit", formula, velocity=0.015))
        speed = np.max(np.abs(np.diff(slow["column_displacement"]))) / DT
        assert 0.010 < speed < 0.017
    ramp = np.minimum(TIMES, 1.0) * 2e-3
    held = play_a(effect("actuator.compliance", compliance=2e-8), command=ramp)
    assert held["column_displacement"][-1] == pytest.approx(2e-3 / (1.0 + 2e-8 * 12.5e6), rel=1e-6)
    for width in (1e-4, 4e-4):
        loose = play_a(effect("actuator.backlash", width=width), command=ramp)
        assert loose["column_displacement"][-1] == pytest.approx(2e-3 - 0.5 * width, abs=1e-6)
        short = play_a(effect("column.slip", gap=width), command=ramp)
        assert short["column_force"][-1] == pytest.approx(12.5e6 * (2e-3 - 0.5 * width), rel=1e-3)


def test_friction_stops_the_damper_and_reduces_its_stroke() -> None:
    still = np.zeros(TIMES.size)
    held = play_b(
        effect("damper.friction", "lugre", force=5.0), command=still, motor=np.full(TIMES.size, 3.0)
    )
    assert np.max(np.abs(held["damper_stroke"])) < 1e-4
    tugged = play_b(
        effect("damper.friction", "lugre", force=5.0), command=still, motor=np.full(TIMES.size, 7.0)
    )
    assert np.max(tugged["damper_stroke"]) > 0.01
    for formula in ("tanh", "dahl", "lugre"):
        found = play_b(effect("damper.friction", formula, force=5.0))
        assert np.std(found["damper_stroke"]) < np.std(CLEAN["damper_stroke"])


def test_the_dampers_force_moves_the_table_and_equals_mass_times_acceleration() -> None:
    found = play_b(effect("damper.friction", "dahl", force=5.0))
    s = found["damper_stroke"]
    acceleration = np.gradient(np.gradient(s, DT), DT) + found["table_acceleration"]
    assert np.corrcoef(-16.0 * acceleration[10:-10], found["damper_force"][10:-10])[0, 1] > 0.995
    still = np.zeros(2000)
    push = np.full(2000, 20.0)
    found = play_b(effect("table.payload", compliance=1e-5), command=still, motor=push)
    assert found["table_displacement"][100] == pytest.approx(1e-5 * found["damper_force"][100], rel=0.05)
    assert play_b(command=still, motor=push)["damper_force"][1] < 0.0


def test_strokes_stay_within_the_end_stop_and_forces_within_the_limit() -> None:
    for formula in ("hertz", "linear"):
        found = play_b(effect("damper.stroke_stop", formula, stroke=0.015, stiffness=200e3))
        assert np.max(np.abs(found["damper_stroke"])) < 0.021
        assert np.max(np.abs(CLEAN["damper_stroke"])) > 0.021
    still, push = np.zeros(100), np.full(100, 1000.0)
    found = play_b(effect("damper.force_limit", force=40.0), command=still, motor=push)
    assert found["damper_force"][10] == pytest.approx(-40.0, abs=4.0)


def test_a_motor_without_lag_follows_at_once() -> None:
    found = play_b(
        effect("damper.motor_lag", time_constant=-0.05), command=np.zeros(3), motor=np.full(3, 10.0)
    )
    assert found["damper_force"][1] == pytest.approx(-10.0, abs=0.02)


def test_a_slow_valve_makes_the_servo_loop_as_late_as_a_slow_loop() -> None:
    ramp = np.linspace(0.0, 3e-3, 400)
    late = {
        formula: play_a(effect("actuator.time_constant", formula, factor=1.5), command=ramp)[
            "column_displacement"
        ]
        for formula in ("valve", "plain")
    }
    assert np.ptp([values[-1] for values in late.values()]) < 2e-6
    assert np.max(np.abs(late["valve"] - late["plain"])) > 5e-6


def test_a_motor_of_second_order_overshoots_and_is_as_late() -> None:
    ramp = np.linspace(0.0, 60.0, 300)
    late = {
        formula: play_b(
            effect("damper.motor_lag", formula, time_constant=0.02), command=np.zeros(300), motor=ramp
        )["damper_force"]
        for formula in ("second_order", "first_order")
    }
    assert late["second_order"][-1] == pytest.approx(late["first_order"][-1], abs=0.3)
    step = play_b(
        effect("damper.motor_lag", "second_order", time_constant=0.02),
        command=np.zeros(100),
        motor=np.full(100, 10.0),
    )["damper_force"]
    assert 1.01 < np.max(np.abs(step)) / 10.0 < 1.1  # 4.6 % for a ratio of 0.7


@pytest.mark.parametrize("name", ["actuator.delay", "table.delay"])
def test_pades_approximation_delays_as_asked_for(name: str) -> None:
    """Padé's approximation of 8 ms more delays as the ring does; of 2 ms less, too."""
    for more in (0.008, -0.002):
        found = play(effect(name, "", delay=more))
        if name == "actuator.delay":
            exact = play_a(actuator={"delay": 0.014 + more})
        else:
            exact = play_b(table={"delay": 0.004 + more})
        for signal, values in found.items():
            assert near(values, exact[signal], 1e-2 if signal == "table_acceleration" else 2e-3), signal
