"""Effects that the data cannot tell apart; every name counts once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.findings.certainty.other_causes import loop_of_several, other_causes, specimen_of_several
from diagnosis.findings.sensors.one_motion import one_motion, one_place
from diagnosis.findings.verdict import equivalents, judge, with_effects
from diagnosis.fits import fitting, residuals
from diagnosis.fits import search as searching
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search
from diagnosis.fits.trade import tied
from tests.diagnosis.cases import STRONGEST, Cases, lab_a, lab_b
from tests.diagnosis.specimens import MadeSpecimen, data_of

DATA = data_of(MadeSpecimen())
NOISY = np.random.default_rng(3).standard_normal((DATA.groups, 1))
FRICTION = {"force": 900.0, "presliding": 1e-5, "velocity": 1e-6}


def fit(names: str, apart: float) -> Fit:
    """A fit with effects of these names, whose residuals differ so much from those of the chosen one."""
    moved = NOISY + apart * np.eye(1, DATA.groups).T
    return Fit(DATA, {name: {} for name in names}, np.zeros(0), moved)


def search(*others: Fit) -> Search:
    return Search(DATA, fit("", 9.0), fit("ab", 0.0), others)


def test_an_effect_that_is_equivalent_to_two_counts_for_the_one_that_it_matches_best() -> None:
    assert equivalents(search(fit("cb", 0.2), fit("ac", 0.1), fit("db", 0.1))) == (("b", "c"), ("a", "d"))


def test_two_forms_of_an_effect_count_as_one_name() -> None:
    assert equivalents(search(fit("cb", 0.2), fit("cb", 0.1))) == (("a", "c"),)


def test_an_effect_that_fits_worse_is_not_equivalent() -> None:
    worse = fit("cb", 0.0)
    assert equivalents(search(Fit(DATA, worse.values, worse.z, NOISY + 0.2))) == ()


def doubted(cases: Cases, true: Values) -> Search:
    """The search that names all effects of a laboratory, which leave nothing and are half as probable as others."""
    whole = cases.record(true, duration=STRONGEST)
    data = residuals.prepare(lab_a(whole), whole)
    bare, both = (fitting.fit(data, values) for values in ({}, true))
    found = judge(Search(data, bare, both, ()))
    assert (found.outcome, set(found.effects)) == ("explained", set(true))
    assert 0.4 < found.probability < 0.5
    return found.search


def test_several_values_of_one_loop_may_be_one_other_part_of_it(cases: Cases) -> None:
    true = {"actuator.delay": {"delay": 0.004}, "actuator.time_constant": {"factor": 0.7}}
    found = doubted(cases, true)
    assert "actuator" in next(other_causes(judge(found).search))
    alone = fitting.at(found.data, {"actuator.delay": true["actuator.delay"]}, found.commissioned.z)
    assert loop_of_several(replace(found, chosen=alone)) == ""


def test_laws_of_one_loop_may_be_one_other_part_of_it_as_well(cases: Cases) -> None:
    data = residuals.prepare(lab_b(whole := cases.record()), whole)
    bare = fitting.at(data, {}, np.zeros(len(data.part.nuisances)))
    backlash = data.catalogue["table.backlash"].values({"width": 1e-4})
    values = {"table.backlash": backlash, "table.delay": {"delay": 0.004}}
    assert loop_of_several(Search(data, bare, fitting.at(data, values, bare.z), ())) == "table"
    one = fitting.at(data, {"table.backlash": backlash}, bare.z)
    assert loop_of_several(Search(data, bare, one, ())) == ""


def test_several_values_of_a_damper_are_parts_of_their_own(cases: Cases) -> None:
    data = residuals.prepare(lab_b(whole := cases.record()), whole)
    bare = fitting.at(data, {}, np.zeros(len(data.part.nuisances)))
    values = {"damper.mass": {"factor": 1.1}, "damper.stiffness": {"factor": 1.1}}
    assert loop_of_several(Search(data, bare, fitting.at(data, values, bare.z), ())) == ""


def test_several_effects_of_a_specimen_may_be_one_other_law_of_it(cases: Cases) -> None:
    found = doubted(cases, {"column.stiffness": {"factor": 0.85}, "column.friction": FRICTION})
    assert "column" in next(other_causes(judge(found).search))


@pytest.mark.parametrize(
    "values",
    [
        {"column.friction": FRICTION},
        {"column.stiffness": {"factor": 0.85}},
        {"column.friction": FRICTION, "actuator.delay": {"delay": 0.004}},
    ],
)
def test_one_effect_of_a_specimen_is_one_law(cases: Cases, values: dict[str, dict[str, float]]) -> None:
    data = residuals.prepare(lab_a(whole := cases.record()), whole)
    bare = fitting.at(data, {}, np.zeros(len(data.part.nuisances)))
    assert specimen_of_several(Search(data, bare, fitting.at(data, values, bare.z), ())) == ""


@pytest.mark.parametrize(("share", "one"), [(1.0, True), (-1.0, False), (0.3, False)])
def test_offsets_of_two_readings_may_be_those_of_a_piston_that_stands_elsewhere(
    cases: Cases, share: float, one: bool
) -> None:
    data = residuals.prepare(lab_a(whole := cases.record()), whole)
    offset = 1e-4  # m
    force = share * whole.plan.column.stiffness * offset
    values = {
        "actuator.deadband": {"width": 2e-4},
        "sensor.column_displacement.bias": {"offset": offset},
        "sensor.column_force.bias": {"offset": force},
    }
    bare, fit = (fitting.at(data, given, np.zeros(len(data.part.nuisances))) for given in ({}, values))
    found = Search(data, bare, fit, ())
    assert one_place(found) is one
    assert any("stands elsewhere" in text for text in other_causes(found)) is one
    alone = {name: given for name, given in values.items() if "bias" in name}
    assert one_motion(replace(found, chosen=fitting.at(data, alone, bare.z))) is one


def test_a_compliance_within_a_loop_stands_for_a_gain_and_a_time_constant_that_do_the_same(
    cases: Cases,
) -> None:
    whole = cases.record({"actuator.compliance": {"compliance": 7e-9, "law": 1.0}})
    data = residuals.prepare(lab_a(whole), whole)
    found = searching.search(data, Scales(whole))
    assert (found.chosen.names, found.chosen.values["actuator.compliance"]["law"]) == (
        ("actuator.compliance",),
        1.0,
    )
    assert found.chosen.values["actuator.compliance"]["compliance"] == pytest.approx(7e-9, rel=0.1)
    both = next(item for item in found.alternatives if len(item.names) == 2)
    assert set(both.names) == {"actuator.gain", "actuator.time_constant"}
    assert tied(found.chosen, both)


def test_an_effect_under_a_law_that_fits_worse_is_no_alternative_beside_one_under_a_law_that_is_as_good(
    cases: Cases,
) -> None:
    """A compliance behind a loop is none where one within it cannot be told from a time constant."""
    whole = cases.record({"actuator.time_constant": {"factor": 0.8}})
    data = residuals.prepare(lab_a(whole), whole)
    factor = {"actuator.time_constant": {"factor": 0.8}}
    bare, chosen = (fitting.fit(data, values) for values in ({}, factor))
    other = Fit(data, {"actuator.compliance": {"law": 0.0}}, chosen.z, bare.reduced)
    same = replace(chosen, values={"actuator.compliance": {"law": 1.0}})
    found = with_effects(Search(data, bare, chosen, (same, other)))
    assert found.equivalent == (("actuator.time_constant", "actuator.compliance"),)
    assert found.others == ()
    alone = with_effects(Search(data, bare, chosen, (other,)))
    assert [item.names for item, _ in alone.others] == [("actuator.compliance",)]
