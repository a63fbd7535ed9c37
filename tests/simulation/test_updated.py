"""A plan updated with the models that were found: its keys, findings that it cannot express, best compensator."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan import read as plans
from common.plan.plan import Plan
from common.plan.read import parse
from common.reality.reality import as_planned, from_reality
from common.reality.spread import Spread
from laboratories.effects import CATALOGUE, sites
from loop.of_reality import really
from simulation.prediction import draws
from simulation.prediction.draws import FoundLaboratories
from simulation.updated import nominal, trials
from simulation.updated.trials import Lag
from tests.simulation.test_prediction import short, written

SLOWER: list[dict[str, Any]] = [
    {"name": "actuator.delay", "laboratory": "master", "delay": 0.006},
    {"name": "actuator.time_constant", "laboratory": "master", "factor": 1.2},
    {"name": "column.friction", "laboratory": "master", "force": 400.0},
]


@pytest.fixture
def found(tmp_path: Path) -> FoundLaboratories:
    """The findings on a slower actuator and a softer column with friction."""
    plan = short()
    return draws.load(written(tmp_path, plan, column={"stiffness": 12e6}, effect=SLOWER), plan)


def test_an_updated_plan_contains_the_findings_it_can_express_and_lists_the_others(
    found: FoundLaboratories, tmp_path: Path
) -> None:
    updated = nominal.update(found, short())
    assert updated.plan.column.stiffness == 12e6
    assert updated.plan.actuator.delay == pytest.approx(0.020)
    assert updated.plan.actuator.time_constant == pytest.approx(0.036)
    assert updated.plan.ground_motion == short().ground_motion
    assert len(updated.said) == 3
    assert updated.unsaid == ("column.friction (force = 400) of the master is no parameter of a plan.",)
    text = nominal.toml(updated, "found.toml", tmp_path)
    assert text.startswith("# Nominal models as found: found.toml.\n# Not in this plan: column.friction")
    assert parse(text, tmp_path).actuator == updated.plan.actuator


def findings_with(plan: Plan, name: str, **values: float) -> FoundLaboratories:
    """Findings with one effect of the catalogue."""
    held = sites.holders(plan, CATALOGUE[name].site)
    entry = {"name": name, **values} | ({"laboratory": held[0]} if held else {})
    return FoundLaboratories(from_reality({"effect": [entry]}, plan, Path()), Spread())


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_effect_is_in_the_updated_plan_or_listed_once(name: str) -> None:
    sizes = {one.name: one.sizes[-1] if one.sizes else one.null for one in CATALOGUE[name].parameters}
    plan = short()
    updated = nominal.update(
        findings_with(plan, name, **{key: x for key, x in sizes.items() if np.isfinite(x)}), plan
    )
    assert bool(updated.said) != bool(updated.unsaid)
    assert (updated.plan != plan) == bool(updated.said)
    assert len(updated.unsaid) <= 1
    assert all(name in sentence for sentence in updated.unsaid)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        *(
            ("column.yielding", {"yield_displacement": 1e-3, "hardening": 0.1, "law": law})
            for law in (0.0, 1.0, 3.0)
        ),
        ("column.yielding", {"yield_displacement": 1e-3, "law": 11.0, "uncracked": 1.3, "friction": 0.02}),
        ("column.self_centring", {"displacement": 1e-3}),
        ("column.viscous", {"coefficient": 4e4}),
        ("column.inertia", {"mass": 600.0}),
        ("structure.mass", {"factor": 1.1}),
    ],
)
def test_an_updated_plan_with_an_effect_gives_the_same_test(name: str, values: dict[str, float]) -> None:
    plan = short(1.5, scale=0.3)
    found = findings_with(plan, name, **values)
    updated = nominal.update(found, plan)
    assert not updated.unsaid
    as_found, said, planned = (
        really(truth, noise=False).master["column_force"]
        for truth in (found.truth, as_planned(updated.plan), as_planned(plan))
    )
    np.testing.assert_allclose(said, as_found, rtol=0.0, atol=1e-9 * np.max(np.abs(as_found)))
    assert np.max(np.abs(planned - as_found)) > 1e-3 * np.max(np.abs(as_found))


def test_only_the_first_of_two_laws_of_a_column_is_in_the_updated_plan() -> None:
    plan = short()
    laws = [
        {"name": "column.yielding", "yield_displacement": 1e-3},
        {"name": "column.self_centring", "displacement": 2e-3},
    ]
    updated = nominal.update(FoundLaboratories(from_reality({"effect": laws}, plan, Path()), Spread()), plan)
    assert updated.plan.column.model == "bouc_wen"
    assert "column.yield_displacement: none → 0.001" in updated.said
    assert [sentence.split()[0] for sentence in updated.unsaid] == ["column.self_centring"]


def test_noise_that_differs_from_the_plan_is_in_the_updated_plan(tmp_path: Path) -> None:
    plan = plans.load(Path("rths/plans/default.toml"))
    found = draws.load(written(tmp_path, plan), plan)
    louder = found.spread.noise | {"master": {"column_force": 151.23}}
    updated = nominal.update(FoundLaboratories(found.truth, found.spread.__class__(noise=louder)), plan)
    assert updated.plan.sensors.column_force == 151.0
    assert updated.said == ("sensors.column_force: 100 → 151",)


def test_named_slaves_have_their_own_tables_in_the_updated_plan(tmp_path: Path) -> None:
    plan = plans.load(Path("rths/plans/two_dampers.toml"))
    name = next(iter(plan.slaves))
    heavier = {"name": "damper.mass", "laboratory": f"slave.{name}", "factor": 1.1}
    found = draws.load(written(tmp_path, plan, Spread(), effect=[heavier]), plan)
    updated = nominal.update(found, plan).plan
    masses = {one: lab.damper.mass / plan.slaves[one].damper.mass for one, lab in updated.slaves.items()}
    assert masses.pop(name) == pytest.approx(1.1)
    assert set(masses.values()) == {1.0}


def test_paths_in_an_updated_plan_are_relative_to_its_folder(tmp_path: Path) -> None:
    (tmp_path / "plans").mkdir()
    (tmp_path / "plans" / "motion.txt").write_text("0.0\n1.0\n", encoding="utf-8")
    tables: dict[str, Any] = {
        "ground_motion": {"record": "motion.txt"},
        "master": {"rig": {"class": "lab.py:Column"}, "kind": "column"},
    }
    nominal.relocated(tables, tmp_path / "plans", tmp_path)
    assert tables["ground_motion"]["record"] == "plans/motion.txt"
    assert tables["master"]["rig"]["class"] == "plans/lab.py:Column"
    assert tables["master"]["kind"] == "column"


def test_the_series_of_an_inverse_compensates_the_lag() -> None:
    lag = Lag(0.01, 0.02, 2.0)
    coefficients = list(lag.inverse.values())
    s = 1.0 + 2.0j
    inverse = sum(a * s**order for order, a in enumerate(coefficients))
    assert inverse == pytest.approx((0.02 * s + 1.0) * (2.718281828459045 ** (0.01 * s)) / 2.0, rel=1e-6)


def test_the_advised_compensator_tracks_better_than_the_planned_one(
    found: FoundLaboratories,
) -> None:
    updated = nominal.update(found, short()).plan
    tried = trials.trials(found, updated)
    wanted = updated.preflight.delay_margin
    by_name = {one.name: one for one in tried}
    assert tried[0].serves(wanted)
    assert tried[0].error < 0.5 * by_name["as planned"].error
    assert not by_name["none"].serves(wanted)
    assert not by_name["pi_lead"].serves(wanted)
    before, after = trials.margins(short()), trials.margins(updated)
    assert after.expected > before.expected
