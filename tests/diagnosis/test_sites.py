"""The site of an unknown effect, by the readings that it changes; names at sites that it cannot have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal

from common.recording.imported import ImportedChannel
from diagnosis.findings import where
from diagnosis.findings.certainty.other_causes import other_causes
from diagnosis.findings.sensors.own_reading import gives_energy
from diagnosis.findings.sites import functions, likely
from diagnosis.findings.sites.likely import APART, likely_sites, ranked
from diagnosis.findings.verdict import how_well, judge, misplaced
from diagnosis.fits import fitting, hypothesis, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.residuals import Data
from diagnosis.fits.search import Search
from diagnosis.fits.unexplained import leaves, model_error
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.recorded.record import Record
from laboratories.effects import CATALOGUE, checked, lay
from models.registry import Array
from models.system import System
from tests.diagnosis.cases import Cases, lab_a, lab_b, white

SECONDS = 8.0


def softer(values: Array) -> Array:
    """Values that are smaller the larger they are, by a fifth at most."""
    return values * (1.0 - 0.2 * (values / np.max(np.abs(values))) ** 2)


def predicted(cases: Cases, lab: Callable[[Record], LaboratoryPart]) -> tuple[LaboratoryPart, Data, Array]:
    """A laboratory of a test without effects, its data, and what its readings are predicted to be (ticks, signals)."""
    whole = cases.record(duration=SECONDS)
    part = lab(whole)
    data = residuals.prepare(part, whole)
    return part, data, part.predict(data.system)


def commanded(part: LaboratoryPart, number: int, change: Callable[[Array], Array]) -> LaboratoryPart:
    """The laboratory that received another command than the recorded one, as by an unknown effect of its machine."""
    name = list(part.inputs)[number]
    return part.replaced(inputs=part.inputs | {name: change(part.inputs[name])})


def ripple(values: Array) -> Array:
    """Values with a sine of 9 Hz, as of a pump."""
    return values + 2e-4 * np.sin(2.0 * np.pi * 9.0 * 2e-3 * np.arange(values.size))


def slow_ripple(values: Array) -> Array:
    """Values with a larger sine of 3 Hz."""
    return values + 5e-4 * np.sin(2.0 * np.pi * 3.0 * 2e-3 * np.arange(values.size))


def judged(part: LaboratoryPart, data: Data, truth: Array) -> Fit:
    """The fit without effects of readings that are `truth` (ticks, signals) with noise."""
    part.measured = truth + data.white * white(7, *truth.shape)
    return fitting.fit(data, {})


MACHINES: dict[str, tuple[str, int, Callable[[Array], Array]]] = {
    "an actuator's gain that depends on amplitude": ("actuator", 0, softer),
    "a ripple of an actuator's supply": ("actuator", 0, ripple),
    "a table's gain that depends on amplitude": ("table", 0, softer),
    "a ripple of a table's supply": ("table", 0, ripple),
    "a motor's constant that depends on the command": ("damper", 1, softer),
}


@pytest.mark.parametrize("what", MACHINES)
def test_an_unknown_effect_of_a_machine_changes_the_readings_downstream(cases: Cases, what: str) -> None:
    site, number, change = MACHINES[what]
    whole = cases.record(duration=SECONDS)
    part = (lab_a if site == "actuator" else lab_b)(whole)
    data = residuals.prepare(part, whole)
    fit = judged(part, data, commanded(part, number, change).predict(data.system))
    assert likely_sites(fit) == (site,)


@pytest.mark.parametrize(
    "name", ["sensor.table_displacement", "sensor.table_acceleration", "sensor.damper_force"]
)
def test_an_unknown_error_of_a_reading_changes_that_alone(cases: Cases, name: str) -> None:
    part, data, truth = predicted(cases, lab_b)
    place = part.signals.index(name.removeprefix("sensor."))
    truth[:, place] = softer(truth[:, place])
    fit = judged(part, data, truth)
    assert likely_sites(fit) == (name,)
    assert where.culprits(fit)[0] == name


def test_what_a_quiet_accelerometer_feels_and_no_displacement_would_show_lies_at_the_table(
    cases: Cases,
) -> None:
    part, data, truth = predicted(cases, lab_b)
    acceleration, noise = part.signals.index("table_acceleration"), data.white.copy()
    noise[acceleration] *= 0.05
    fast = np.sin(2.0 * np.pi * 37.0 * 2e-3 * np.arange(len(truth))) * truth[:, 0]
    truth[:, acceleration] += 10.0 * data.sigma[acceleration] * fast / np.std(fast)
    part.measured = truth + noise * white(7, *truth.shape)
    assert where.culprits(fitting.fit(data, {}))[0] == "table"


def test_what_moves_the_ground_under_a_table_is_felt_by_all_but_its_displacement(cases: Cases) -> None:
    whole = cases.record(duration=SECONDS)
    part = lab_b(whole)
    data = residuals.prepare(part, whole)
    felt = commanded(part, 0, ripple).predict(data.system)
    felt[:, part.signals.index("table_displacement")] = part.predict(data.system)[:, 0]
    assert likely_sites(judged(part, data, felt)) == ("table",)


def test_what_the_mass_of_a_damper_carries_along_lies_at_the_damper(cases: Cases) -> None:
    whole = cases.record(duration=SECONDS)
    part = lab_b(whole)
    part = part.replaced(nuisances=part.nuisances[:1])  # its mass would move
    data = residuals.prepare(part, whole)
    heavier = lay(data.system, (("damper.mass", checked(CATALOGUE["damper.mass"], {"factor": 1.2})),))
    assert likely_sites(judged(part, data, part.predict(heavier)))[0] == "damper"


def bent_by(values: Array, share: float) -> Array:
    """A small value of the square of others, which is that share of the largest."""
    return share * np.max(np.abs(values)) * (values / np.max(np.abs(values))) ** 2


def test_a_wire_that_is_not_along_the_stroke_lies_at_its_sensor(cases: Cases) -> None:
    part, data, truth = predicted(cases, lab_b)
    stroke = part.signals.index("damper_stroke")
    truth[:, stroke] += bent_by(truth[:, stroke], 4e-4)
    assert likely_sites(judged(part, data, truth)) == ("sensor.damper_stroke",)


def through_a_belt(force: Array) -> Array:
    """A motor's force (n,) of which an eighth comes through a belt that resonates at 36 Hz."""
    omega = 2.0 * np.pi * 36.0
    belt = signal.cont2discrete(([omega**2], [1.0, 0.2 * omega, omega**2]), 2e-3)
    return np.asarray(force + 0.13 * (signal.lfilter(np.ravel(belt[0]), belt[1], force) - force))


def test_what_follows_linearly_from_a_motor_s_command_lies_at_the_damper(cases: Cases) -> None:
    part, data, _ = predicted(cases, lab_b)
    fit = judged(part, data, commanded(part, 1, through_a_belt).predict(data.system))
    fine = fitting.fit(fit.data.fine, {})
    assert {item.site for item in ranked(fine) if item.cost < APART} == {"damper", "sensor.damper_stroke"}
    assert likely_sites(fine)[0] == "damper"


def test_a_force_that_depends_on_the_stroke_lies_at_the_damper(cases: Cases) -> None:
    part, data, truth = predicted(cases, lab_b)
    stroke = part.signals.index("damper_stroke")
    damper = data.system.plan.damper
    force = damper.stiffness * bent_by(truth[:, stroke], 2e-2)
    omega = 2.0 * np.pi * np.fft.rfftfreq(2 * force.size, 2e-3)
    moving = damper.stiffness + 1j * omega * damper.damping - omega**2 * damper.mass
    truth[:, stroke] += np.fft.irfft(np.fft.rfft(force, 2 * force.size) / moving)[: force.size]
    assert likely_sites(judged(part, data, truth)) == ("damper",)


@pytest.mark.parametrize(
    ("damping", "of_column", "sites"),
    [
        (0.0, False, ("column", "sensor.column_force")),  # the force is the displacement times the stiffness
        (0.0, True, ("column", "sensor.column_force")),
        (5e4, False, ("sensor.column_force",)),
        (5e4, True, ("column",)),
    ],
)
def test_a_scale_that_bends_is_told_from_a_column_that_softens_by_the_column_s_damping(
    damping: float, of_column: bool, sites: tuple[str, ...], cases: Cases
) -> None:
    whole = cases.record(duration=SECONDS)
    part = lab_a(whole)
    data = residuals.prepare(part, whole)
    data = replace(data, system=data.system.moved("column", damping=damping))
    truth = part.predict(data.system)
    elastic = data.system.plan.column.stiffness * truth[:, 0]
    truth[:, 1] += softer(elastic) - elastic if of_column else softer(truth[:, 1]) - truth[:, 1]
    assert likely_sites(judged(part, data, truth)) == sites


def test_a_force_that_depends_on_the_speed_lies_at_the_column(cases: Cases) -> None:
    part, data, truth = predicted(cases, lab_a)
    truth[:, 1] += 1e-2 * np.std(truth[:, 1]) * np.tanh(np.gradient(truth[:, 0], 2e-3) / 5e-3)
    assert likely_sites(judged(part, data, truth)) == ("column",)


def test_a_zero_that_drifts_lies_at_the_load_cell(cases: Cases) -> None:
    part, data, truth = predicted(cases, lab_a)
    truth[:, 1] += 0.5 * data.white[1] * np.sin(np.linspace(0.0, np.pi, len(truth)))
    assert likely_sites(judged(part, data, truth))[0] == "sensor.column_force"


def test_a_column_and_the_load_cell_behind_it_cannot_be_told_apart_by_what_follows_neither(
    cases: Cases,
) -> None:
    part, data, truth = predicted(cases, lab_a)
    truth[:, 1] += 3.0 * data.white[1] * ripple(np.zeros(len(truth))) / 2e-4
    fit = judged(part, data, truth)
    assert likely_sites(fit) == ("column", "sensor.column_force")
    verdict = judge(Search(data, fit, fit, ()))
    assert where.undecided([verdict]) == [
        "What no effect explains may arise at column or at sensor.column_force: these signals cannot tell them apart."
    ]


def test_effects_elsewhere_that_explain_less_than_an_unknown_one_are_not_named(cases: Cases) -> None:
    whole = cases.record(duration=SECONDS)
    part = lab_a(whole)
    data = residuals.prepare(part, whole)
    bare = judged(part, data, commanded(part, 0, softer).predict(data.system))
    limited = {"sensor.column_displacement.gain": {"factor": 0.95}}
    found = Search(data, bare, fitting.fit(data, limited, bare.z), ())
    assert misplaced(found)
    assert not misplaced(
        replace(found, chosen=fitting.fit(data, {"actuator.gain": {"factor": 0.95}}, bare.z))
    )


def test_an_error_of_a_reading_that_leaves_only_noise_does_not_explain_a_gap_of_the_machine(
    cases: Cases,
) -> None:
    part, data, nominal = predicted(cases, lab_a)
    machine = commanded(part, 0, softer).predict(data.system) - nominal
    bare = judged(part, data, nominal + 0.028 * machine)
    soft = {"sensor.column_displacement.saturation": {"limit": 0.05, "sharpness": 2.0}}
    found = Search(data, bare, fitting.fit(data, soft, bare.z), ())
    assert not leaves(found.chosen, model_error(found.chosen))
    assert how_well(found) == "partly"


def test_a_force_of_the_damper_is_misplaced_where_the_gap_is_a_function_of_the_stroke_that_is_read(
    cases: Cases,
) -> None:
    part, data, truth = predicted(cases, lab_b)
    stroke = part.signals.index("damper_stroke")
    truth[:, stroke] += bent_by(truth[:, stroke], 0.1)
    bare = judged(part, data, truth)
    imitation = {"damper.asymmetry": {"share": 0.1}}
    assert misplaced(Search(data, bare, fitting.fit(data, imitation, bare.z), ()))


@pytest.mark.parametrize(("name", "wrong"), [("column.hardening", False), ("actuator.gain", True)])
def test_an_effect_of_a_specimen_is_not_misplaced_where_the_gap_is_a_function_of_its_force(
    cases: Cases, monkeypatch: pytest.MonkeyPatch, name: str, wrong: bool
) -> None:
    part, data, truth = predicted(cases, lab_a)
    truth[:, part.signals.index("column_force")] *= 1.3
    bare = judged(part, data, truth)
    places = ("sensor.column_force", name.partition(".")[0])
    only, own = (SimpleNamespace(site=site, cost=0.0, left=0.0) for site in places)
    monkeypatch.setattr("diagnosis.findings.verdict.likely_sites", lambda _: (only.site,))
    monkeypatch.setattr("diagnosis.findings.verdict.ranked", lambda _: [only, own])
    values = {name: {"share": 0.01} if name == "column.hardening" else {"factor": 1.01}}
    assert misplaced(Search(data, bare, fitting.at(data, values, bare.z), ())) is wrong


def test_a_force_that_follows_from_the_motion_that_was_read_is_none_of_the_specimen_s(cases: Cases) -> None:
    part, data, nominal = predicted(cases, lab_a)
    both = ("column", "sensor.column_force")
    noise = data.white * white(7, *nominal.shape)
    part.measured = commanded(part, 0, ripple).predict(data.system) + noise
    assert likely.follows_motion(part, data.system) == both
    for column in (0, 1):  # an error of the motion's sensor, or of the force alone
        part.measured = nominal + noise
        part.measured[:, column] = softer(part.measured[:, column])
        assert likely.follows_motion(part, data.system) == ()


def test_what_shakes_an_actuator_beside_a_column_that_yields_lies_at_the_actuator(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A signature is of small changes; where the column stands afterwards is none."""
    whole = cases.record(duration=SECONDS)
    most = float(np.max(np.abs(whole.signals["column_displacement"])))
    yields = {"yield_displacement": 0.35 * most, "hardening": 0.02}
    column = replace(whole.plan.column, model="bilinear", parameters=yields)
    plan = replace(whole.plan, column=column)
    part = lab_a(whole)
    part = part.replaced(lab=replace(part.lab, plan=plan))
    data = replace(residuals.prepare(part, whole), system=System(plan))
    bare = judged(part, data, commanded(part, 0, slow_ripple).predict(data.system))
    assert ranked(bare)[0].site == "actuator"
    monkeypatch.setattr(likely, "follows_motion", lambda *_: ())
    assert ranked(bare)[0].site == "column"


def test_a_building_has_no_likely_sites(cases: Cases) -> None:
    whole = cases.record(duration=SECONDS)
    data = residuals.prepare(Building(whole), whole)
    fit = fitting.at(data, {}, np.zeros(len(data.part.nuisances)))
    assert ranked(fit) == []
    assert where.culprits(fit) == ("structure",)


@pytest.mark.parametrize(("law", "gives"), [(2.0, True), (0.0, False), (1.0, False)])
def test_a_column_that_gives_energy_may_be_a_load_cell_with_hysteresis(
    cases: Cases, law: float, gives: bool
) -> None:
    effects = {"column.slip": {"gap": 1e-4, "law": law}}
    whole = cases.record(effects, duration=8.0)
    data = residuals.prepare(lab_a(whole), whole)
    found = judge(Search(data, fitting.fit(data, {}), fitting.fit(data, effects), ()))
    assert found.effects == ("column.slip",)
    assert (found.probability < 0.5) == gives
    assert ["Hysteresis of its load cell" in text for text in other_causes(found.search)] == [True] * gives


def test_a_force_that_a_logger_or_a_sensor_delays_gives_no_energy(cases: Cases) -> None:
    whole = cases.record(duration=SECONDS)
    part = lab_a(whole)
    hardening = {"column.hardening": {"share": 0.2}}
    slow = ImportedChannel(delay=0.01)
    data = residuals.prepare(part, whole)
    behind = replace(data, part=part.replaced(channels=(ImportedChannel(), slow)))
    sensed = replace(data, system=data.system.sensed("column_force", delay=0.01))
    for late in (behind, sensed):
        fit = fitting.at(late, hardening, np.zeros(len(part.nuisances)))
        displacement, force = late.part.predict(hypothesis.lay(late, fit.z, fit.values)).T
        assert np.sum(force[:-1] * np.diff(displacement)) < 0.0
        assert gives_energy(fit) == ""


def test_several_effects_with_which_a_column_gives_energy_are_said_together(cases: Cases) -> None:
    whole = cases.record(duration=SECONDS)
    data = residuals.prepare(lab_a(whole), whole)
    effects = {"column.stiffness": {"factor": 0.9}, "column.slip": {"gap": 1e-4, "law": 2.0}}
    fit = fitting.at(data, effects, np.zeros(len(data.part.nuisances)))
    assert gives_energy(fit) == "column.stiffness and column.slip"


def test_a_sensor_that_is_likelier_than_its_machine_does_not_come_before_another_one(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    part, data, truth = predicted(cases, lab_a)
    fit = judged(part, data, truth)
    sites = ("actuator", "column", "sensor.column_force")
    near = [likely.LikelySite(site, 2.0 * place, 0.5) for place, site in enumerate(sites)]
    monkeypatch.setattr(likely, "ranked", lambda _: near)
    monkeypatch.setattr(functions, "lead", lambda *given: 8.0 if given[3] == "column" else 0.0)
    assert likely_sites(fit) == ("actuator", "sensor.column_force", "column")
