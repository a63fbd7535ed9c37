"""The independent laboratories: clean ones against SciPy, every effect by size, sign and the signals it changes."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from common.errors import InputError
from common.recording.reader import read
from rths.__main__ import main
from tests.helpers import ROOT
from tests.rths.trial.played_labs import (
    CLEAN,
    COLUMN,
    DT,
    KNOWN_A,
    KNOWN_B,
    MOTOR,
    SIGNALS_A,
    SIGNALS_B,
    TABLE,
    TIMES,
    Trace,
    changes,
    effect,
    near,
    play,
    play_a,
    play_b,
    ramped,
)
from validation.blind.labs import (
    FORMULAS,
    PLAIN,
    SIGNALS,
    UNCATALOGUED,
    laying,
)
from validation.blind.labs.column_lab import TrueColumnLab
from validation.blind.labs.table_lab import TrueTableLab
from validation.blind.labs.unlisted import every


def test_a_clean_laboratory_a_equals_the_nominal_model() -> None:
    ticks = 1000

    def rate(t: float, y: Trace) -> list[float]:
        return [(ramped(COLUMN, t - 0.014) - y[0]) / 0.030]

    exact = solve_ivp(
        rate, (0.0, ticks * DT), [0.0], t_eval=TIMES[:ticks], rtol=1e-9, atol=1e-13, max_step=1e-3
    ).y[0]
    assert near(CLEAN["column_displacement"][:ticks], exact)
    assert near(CLEAN["column_force"][:ticks], 12.5e6 * exact)


def test_a_clean_laboratory_b_equals_the_nominal_model() -> None:
    ticks = 1000
    omega, zeta, m, k, c, lag = 2.0 * math.pi * 15.0, 0.7, 16.0, 56.8, 6.0, 0.003

    def rates(t: float, x: Trace, push: float) -> list[float]:
        y, v, s, w, u = x
        acceleration = omega**2 * (ramped(TABLE, t - 0.004) - y) - 2.0 * zeta * omega * v
        return [v, acceleration, w, (u - k * s - c * w) / m - acceleration, (push - u) / lag]

    rows, x = [], np.zeros(5)
    for tick in range(ticks):
        y, v, s, w, u = x
        a = omega**2 * (ramped(TABLE, tick * DT - 0.004) - y) - 2.0 * zeta * omega * v
        rows.append((y, a, s, k * s + c * w - u))
        span = (tick * DT, (tick + 1) * DT)
        x = solve_ivp(
            rates, span, x, args=(MOTOR[tick],), method="DOP853", rtol=1e-9, atol=1e-12, max_step=1e-3
        ).y[:, -1]
    exact = dict(zip(SIGNALS_B, np.array(rows).T, strict=True))
    for name, values in exact.items():
        assert near(CLEAN[name][:ticks], values), name


def test_true_parameters_are_used_by_the_laboratories() -> None:
    soft = play_a(column={"stiffness": 10e6})
    assert near(soft["column_force"], 0.8 * CLEAN["column_force"], 1e-9)
    late = play_a(actuator={"delay": 0.016})
    assert near(late["column_displacement"][1:], CLEAN["column_displacement"][:-1], 1e-9)
    early = play_b(table={"delay": 0.002})
    assert near(early["table_displacement"][:-1], CLEAN["table_displacement"][1:], 1e-9)
    assert not near(play_b(damper={"mass": 20.0})["damper_stroke"], CLEAN["damper_stroke"], 0.05)


def test_the_registries_of_formulas_and_effects_agree() -> None:
    known = {**KNOWN_A, **KNOWN_B}
    assert set(FORMULAS).isdisjoint(PLAIN)
    for name, formulas in FORMULAS.items():
        assert set(formulas) <= set(known[name].formulas), name
    for name in PLAIN:
        assert tuple(known[name].formulas) == ("plain",)
    assert len(UNCATALOGUED) >= 10
    for name, (site, parameters, sizes) in UNCATALOGUED.items():
        assert name.startswith(f"x.{site}.")
        assert parameters == laying.names(known[name].apply)
        assert len(sizes) == len(parameters)
    catalogue = {name for name in known if not name.startswith("x.")}
    assert catalogue == set(FORMULAS) | set(PLAIN)


# strong and very weak parameters by effect, and the signals that it leaves alone on given commands
ALL_A, ALL_B = set(SIGNALS_A), set(SIGNALS_B)
A = {"column_displacement"}
TABLE_ONLY = {"table_displacement", "table_acceleration"}
CASES: dict[str, tuple[dict[str, float], dict[str, float], set[str]]] = {
    "actuator.delay": ({"delay": 0.01}, {"delay": 1e-6}, set()),
    "actuator.time_constant": ({"factor": 1.2}, {"factor": 1.00001}, set()),
    "actuator.gain": ({"factor": 1.1}, {"factor": 1.00001}, set()),
    "actuator.velocity_limit": ({"velocity": 0.015}, {"velocity": 50.0}, set()),
    "actuator.backlash": ({"width": 4e-4}, {"width": 1e-8}, set()),
    "actuator.compliance": ({"compliance": 2e-8}, {"compliance": 1e-13}, set()),
    "actuator.deadband": ({"width": 5e-4}, {"width": 1e-9}, set()),
    "column.stiffness": ({"factor": 1.1}, {"factor": 1.00001}, A),
    "column.yielding": ({"yield_displacement": 8e-4}, {"yield_displacement": 1.0}, A),
    "column.degradation": ({"rate": 0.3}, {"rate": 1e-6}, A),
    "column.pinching": ({"factor": 0.4, "width": 1e-3}, {"factor": 1e-6}, A),
    "column.friction": ({"force": 1000.0}, {"force": 0.01}, A),
    "column.viscous": ({"coefficient": 5e4}, {"coefficient": 0.1}, A),
    "column.inertia": ({"mass": 1000.0}, {"mass": 1e-3}, A),
    "column.slip": ({"gap": 3e-4}, {"gap": 1e-9}, A),
    "table.delay": ({"delay": 0.008}, {"delay": 1e-6}, set()),
    "table.bandwidth": ({"factor": 0.7}, {"factor": 0.99999}, set()),
    "table.damping": ({"factor": 1.3}, {"factor": 1.00001}, set()),
    "table.gain": ({"factor": 1.1}, {"factor": 1.00001}, set()),
    "table.oil_column": ({"frequency": 20.0}, {"frequency": 4000.0, "damping": 0.3}, set()),
    "table.payload": ({"compliance": 1e-5}, {"compliance": 1e-13}, set()),
    "table.backlash": ({"width": 1e-3}, {"width": 1e-9}, set()),
    "table.friction": ({"acceleration": 0.5}, {"acceleration": 1e-6}, set()),
    "damper.friction": ({"force": 5.0}, {"force": 1e-4}, TABLE_ONLY),
    "damper.viscous": ({"factor": 1.5}, {"factor": 1.00001}, TABLE_ONLY),
    "damper.stiffness": ({"factor": 1.5}, {"factor": 1.00001}, TABLE_ONLY),
    "damper.mass": ({"factor": 1.1}, {"factor": 1.00001}, TABLE_ONLY),
    "damper.second_mass": ({"frequency": 3.0}, {"frequency": 300.0, "share": 0.005}, TABLE_ONLY),
    "damper.gain": ({"factor": 1.1}, {"factor": 1.00001}, TABLE_ONLY),
    "damper.motor_lag": ({"time_constant": 0.01}, {"time_constant": 1e-8}, TABLE_ONLY),
    "damper.force_limit": ({"force": 40.0}, {"force": 1e5}, TABLE_ONLY),
    "damper.stroke_stop": ({"stroke": 0.03}, {"stroke": 0.5}, TABLE_ONLY),
    "x.actuator.ripple": (
        {"amplitude": 1e-4, "frequency": 10.0},
        {"amplitude": 1e-9, "frequency": 10.0},
        set(),
    ),
    "x.actuator.droop": ({"loss": 0.3}, {"loss": 1e-6}, set()),
    "x.actuator.valve_hysteresis": ({"width": 4e-4}, {"width": 1e-9}, set()),
    "column.hardening": ({"share": 0.3}, {"share": 1e-6}, A),
    "x.column.asymmetry": ({"share": 0.1}, {"share": 1e-6}, A),
    "x.table.pitch": (
        {"coupling": 0.3, "frequency": 10.0},
        {"coupling": 1e-6, "frequency": 10.0},
        ALL_B - {"table_acceleration"},
    ),
    "x.table.cam": ({"amplitude": 2e-4, "period": 0.02}, {"amplitude": 1e-10, "period": 0.02}, set()),
    "x.damper.cable_drag": ({"coefficient": 15.0}, {"coefficient": 1e-4}, TABLE_ONLY),
    "x.damper.motor_constant": ({"rise": 0.3}, {"rise": 1e-6}, TABLE_ONLY),
    "x.damper.cubic_spring": ({"stiffness": 8e4}, {"stiffness": 0.1}, TABLE_ONLY),
}
KNOWN = {**KNOWN_A, **KNOWN_B}
FORMS = [(name, formula) for name in CASES for formula in KNOWN[name].formulas]


@pytest.mark.parametrize(("name", "formula"), FORMS)
def test_an_effects_formula_changes_its_signals_and_no_others(name: str, formula: str) -> None:
    found = play(effect(name, formula, **CASES[name][0]))
    assert all(np.isfinite(values).all() for values in found.values())
    for signal, change in changes(found).items():
        if signal in CASES[name][2]:
            assert change == 0.0, signal
        else:
            assert 0.0 < change < 4.0, signal  # stops throw the damper about
    assert max(changes(found).values()) > 2e-3


@pytest.mark.parametrize(("name", "formula"), FORMS)
def test_an_effect_of_zero_size_equals_the_clean_laboratory(name: str, formula: str) -> None:
    found = changes(play(effect(name, formula, **CASES[name][1])))
    # platform and loop stay two bodies however small the play: 0.3 % of the acceleration
    assert max(found.values()) < (5e-3 if name == "table.backlash" else 1e-3)


def test_every_effect_on_physics_is_tested() -> None:
    assert set(CASES) == {name for name in KNOWN if "sensor." not in name and name not in every.EFFECTS}


@pytest.mark.parametrize("name", UNCATALOGUED)
@pytest.mark.parametrize("end", [0, 1])
def test_sizes_outside_the_catalogue_change_the_signals_without_divergence(name: str, end: int) -> None:
    _, parameters, sizes = UNCATALOGUED[name]
    found = play(effect(name, "", **dict(zip(parameters, (size[end] for size in sizes), strict=True))))
    assert all(np.isfinite(values).all() for values in found.values())
    noise = dict(zip(SIGNALS, (5e-6, 100.0, 10e-6, 0.01, 2e-6, 0.2), strict=True))
    ratios = [
        float(np.sqrt(np.mean((values - CLEAN[signal]) ** 2))) / noise[signal]
        for signal, values in found.items()
    ]
    assert max(ratios) > (0.2, 2.0)[end]
    assert max(changes(found).values()) < 1.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"effects": [{"name": "column.frction"}]}, r"did you mean column\.friction"),
        ({"effects": [{"name": "damper.friction"}]}, "Unknown effect"),
        ({"effects": [effect("column.friction", "lugree", force=1.0)]}, "did you mean lugre"),
        ({"effects": [effect("column.friction", forse=1.0)]}, "did you mean force"),
        ({"effects": [effect("column.friction")]}, "needs the parameter force"),
        ({"effects": [{"name": "column.friction", "values": {}}]}, "Unknown key 'values'"),
        ({"effects": "column.friction"}, "list of tables"),
        ({"actuator": {"time_constant": 0.0}}, "must be greater than 0 s"),
        ({"column": {"model": "bouc_wen"}}, "is linear"),
    ],
)
def test_meaningless_effects_and_parameters_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        TrueColumnLab(DT, 1, **options)
    with pytest.raises(InputError, match="must be finite"):
        TrueTableLab(DT, 1, table={"frequency": math.inf})


REALITY = """
seed = 11
[master.rig]
class = "{master}"
[[master.rig.options.effects]]
name = "column.friction"
formula = "lugre"
parameters = {{ force = 900, presliding = 1e-5 }}
[slave.rig]
class = "{slave}"
[slave.rig.options]
damper = {{ mass = 16.2 }}
effects = [{{ name = "x.table.pitch", parameters = {{ coupling = 0.1, frequency = 10 }} }}]
"""


@pytest.mark.long
@pytest.mark.parametrize("by_file", [True, False])
def test_a_test_in_virtual_time_runs_with_the_independent_laboratories(
    by_file: bool, monkeypatch: Any, capsys: Any, tmp_path: Path, virtual_recording: Path
) -> None:
    place = f"{ROOT}/validation/blind/labs/{{}}.py" if by_file else "validation.blind.labs.{}"
    reality, path = tmp_path / "reality.toml", tmp_path / "real.mcap"
    reality.write_text(
        REALITY.format(
            master=place.format("column_lab") + ":TrueColumnLab",
            slave=place.format("table_lab") + ":TrueTableLab",
        )
    )
    words = ["run", "--virtual", "--duration", "4", "--reality", str(reality), "-o", str(path), "--json"]
    monkeypatch.setattr(sys, "argv", ["rths", *words])
    assert main() == 0
    assert json.loads(capsys.readouterr().out)["topics"]["slave"]["recorded"] == 2000
    real, nominal = read(path).columns["master"], read(virtual_recording).columns["master"]
    extra = real["column_force"] - 12.5e6 * real["column_displacement"]
    moving = np.abs(np.gradient(real["column_displacement"], DT)) > 0.012
    assert np.median(np.abs(extra[moving])) == pytest.approx(900.0, rel=0.1)
    gap = real["column_displacement"] - nominal["column_displacement"]
    assert 0.002 < np.std(gap) / np.std(nominal["column_displacement"]) < 0.5


@pytest.mark.long
def test_a_test_with_clean_independent_laboratories_has_no_gap(
    monkeypatch: Any, tmp_path: Path, virtual_recording: Path
) -> None:
    reality, path = tmp_path / "reality.toml", tmp_path / "real.mcap"
    reality.write_text(
        '[master.rig]\nclass = "validation.blind.labs.column_lab:TrueColumnLab"\n'
        '[slave.rig]\nclass = "validation.blind.labs.table_lab:TrueTableLab"\n'
    )
    words = ["run", "--virtual", "--duration", "4", "--reality", str(reality), "-o", str(path)]
    monkeypatch.setattr(sys, "argv", ["rths", *words])
    assert main() == 0
    real, nominal = read(path), read(virtual_recording)
    for lab, name, noise in (("master", "column_displacement", 5e-6), ("slave", "table_acceleration", 0.01)):
        difference = real.columns[lab][name] - nominal.columns[lab][name]
        assert np.std(difference) < 3.0 * noise
