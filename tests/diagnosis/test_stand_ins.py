"""Verdicts on effects that stand in for another cause, and on machines whose unknown effect looks like noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from diagnosis.diagnose import doubted, examine
from diagnosis.findings import where
from diagnosis.findings.certainty.costs import farthest
from diagnosis.findings.certainty.other_causes import other_causes
from diagnosis.findings.certainty.trust import less_by_freedom, of_the_plan, share_named
from diagnosis.findings.report import status_of
from diagnosis.findings.sensors.own_reading import machine_alone
from diagnosis.findings.sensors.slow_noise import lone_noise
from diagnosis.findings.verdict import PartVerdict, allowed, artefact, judge, trifling
from diagnosis.fits import fitting, residuals, settling
from diagnosis.fits.fitting import Fit, at_end, without_rest
from diagnosis.fits.hypothesis import TOLERANCES, Values
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search, search
from diagnosis.recorded.record import Record
from diagnosis.report.records import PartOfGap
from diagnosis.signals.noise.model import Source
from models.registry import Array
from report.gap import wording
from tests.diagnosis.cases import STRONGEST, Cases, lab_a, lab_b, moved_by, unknown, white
from tests.diagnosis.test_equivalents import DATA, NOISY

GAP = np.sin(0.2 * np.arange(DATA.groups))[:, None]
MORE, AR1 = (
    3.0,
    np.sqrt(1.0 - 0.95**2),
)  # times a sensor's noise; what makes noise of this correlation one of rms one
SHAKEN = 1e-5  # m, of a table: the noise of its displacement sensor
RESONANCE, WANDER = 0.3, 3e-5  # Hz, of the default damper; m, fifteen times the noise of its stroke's sensor


def fit(residual: Array) -> Fit:
    """A fit with an effect."""
    return Fit(DATA, {"sensor.column_force.bias": {"offset": 3.0}}, np.zeros(0), residual)


def moved(z: float, count: int = 4) -> Fit:
    """A fit with one of several nominal parameters moved by z tolerances."""
    return Fit(DATA, {}, z * np.eye(1, count)[0], NOISY)


def test_the_further_off_a_nominal_parameter_is_the_less_probable_are_the_effects_beside_it() -> None:
    factors = [farthest(moved(z)) for z in (0.0, 1.0, 2.0, 2.5, 3.0)]
    assert factors == sorted(factors, reverse=True)
    assert factors[0] == pytest.approx(1.0)
    assert factors[1] > 0.95  # most laboratories have one
    assert factors[-1] < 0.5


def test_what_effects_may_leave_is_a_small_share_of_a_small_gap() -> None:
    def search(gap: float) -> Search:
        return Search(DATA, fit(NOISY + gap * GAP), fit(NOISY), ())

    small, large = (float(allowed(search(gap))[0]) for gap in (1.0, 1e6))
    assert 0.0 < small < 0.2
    assert small < large == float(allowed(search(1e7))[0])


def test_effects_that_leave_6_percent_of_a_gap_are_as_probable_as_a_stand_in() -> None:
    assert share_named(0.94) == pytest.approx(0.5)
    assert share_named(1.0) == pytest.approx(1.0)
    assert share_named(0.6) < share_named(0.95)


def test_what_a_law_of_many_parameters_explains_says_less_for_it() -> None:
    def probability(**more: float) -> float:
        values = {"damper.friction": {"force": 3.0, "velocity": 1e-6, **more}}
        chosen = Fit(DATA, values, np.zeros(0), NOISY)
        return less_by_freedom(
            0.5, [PartVerdict(Search(DATA, fit(NOISY), chosen, ()), "partly", 0.5, (), ())]
        )

    shapes = {"asymmetry": 0.2, "drop": 0.3, "speed": 0.02, "law": 1.0}
    assert probability() == pytest.approx(0.5, abs=0.03)
    assert 0.3 < probability(**shapes) < probability() - 0.05


@pytest.mark.parametrize(
    ("effects", "only"),
    [
        ({"damper.mass": {"factor": 1.1}}, True),
        ({"actuator.delay": {"delay": 2e-3}, "column.stiffness": {"factor": 1.2}}, True),
        ({"damper.mass": {"factor": 1.1}, "damper.friction": {"force": 3.0}}, False),
    ],
)
def test_what_other_values_of_the_plan_leave_has_another_cause(effects: Values, only: bool) -> None:
    chosen = Fit(DATA, effects, np.zeros(0), NOISY)
    assert of_the_plan(PartVerdict(Search(DATA, chosen, chosen, ()), "partly", 0.5, (), ())) == only


@pytest.mark.parametrize(("factor", "others"), [(1.01, 0), (1.3, 1)])
def test_a_small_error_of_a_load_cell_is_the_law_of_its_specimen(
    cases: Cases, factor: float, others: int
) -> None:
    effects = {"column.hardening": {"share": 0.3}, "sensor.column_force.gain": {"factor": factor}}
    whole = cases.record(effects, duration=8.0)
    data = residuals.prepare(lab_a(whole), whole)
    found = Search(data, fitting.fit(data, {}), fitting.fit(data, effects), ())
    stands = machine_alone(found)
    assert stands.chosen.names == tuple(effects)[: 1 + others]
    assert any(other_causes(stands)) == (
        others == 1
    )  # a law of the specimen and what its load cell makes of it


def test_errors_of_readings_that_leave_a_tenth_of_a_gap_are_not_its_cause() -> None:
    def search(left: float, name: str = "sensor.column_force.bias") -> Search:
        chosen = Fit(DATA, {name: {"offset": 3.0}}, np.zeros(0), NOISY + left * GAP)
        return Search(DATA, fit(NOISY + 10.0 * GAP), chosen, ())

    assert artefact(search(5.0))
    assert not artefact(search(1.0))
    assert not artefact(search(5.0, "column.friction"))


@pytest.mark.parametrize(("factor", "named"), [(1.0003, False), (1.003, True)])
def test_a_factor_that_is_less_than_solutions_differ_by_is_no_cause(factor: float, named: bool) -> None:
    chosen = Fit(DATA, {"table.gain": {"factor": factor}}, np.zeros(0), NOISY)
    assert trifling(Search(DATA, fit(NOISY + 10.0 * GAP), chosen, ())) != named


@pytest.mark.long
@pytest.mark.parametrize(("factor", "outcome"), [(1.005, "unknown"), (1.05, "explained")])
def test_a_gain_of_a_reading_within_tolerances_may_be_its_machine(
    cases: Cases, factor: float, outcome: str
) -> None:
    effect = {"sensor.damper_stroke.gain": {"factor": factor}}
    whole = cases.record(effect)
    bare = bare_fit(whole)
    found = judge(Search(bare.data, bare, settling.settled(fitting.fit(bare.data, effect, bare.z)), ()))
    assert found.outcome == outcome
    if outcome == "unknown":
        assert where.culprits(found.search.chosen) == ("damper", "sensor.damper_stroke")


def wandering(whole: Record, *names: str, wander: float = WANDER) -> Record:
    """The record with slow noise on some readings, as loud beside their own as the `wander` (m) of the stroke."""
    damped = signal.tf2sos(
        [1.0, 0.0, -1.0], np.poly(0.999 * np.exp(2j * np.pi * RESONANCE * 0.002 * np.array([1, -1]))).real
    )
    changed = {}
    for number, name in enumerate(names):
        slow = signal.sosfilt(damped, white(31 + number, whole.ticks))
        scale = wander * whole.labs[1].noise[name] / whole.labs[1].noise["damper_stroke"]
        changed[name] = whole.signals[name] + scale * slow / np.std(slow)
    return replace(whole, signals=whole.signals | changed)


def bare_fit(whole: Record) -> Fit:
    """The slave's laboratory without effects, under the noise that this leaves."""
    return settling.settled(fitting.fit(residuals.prepare(lab_b(whole), whole), {}))


def judged(whole: Record) -> PartVerdict:
    """The verdict on the slave's laboratory where no effect is found."""
    bare = bare_fit(whole)
    return judge(Search(bare.data, bare, bare, ()))


@pytest.mark.slow
def test_two_drifts_that_follow_from_one_motion_are_no_errors_of_two_sensors(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    slow = 6e-5 * whole.time  # m, of a piston whose valve's null drifts
    moved = {"column_displacement": slow, "column_force": whole.plan.column.stiffness * slow}
    apart = {"column_displacement": slow, "column_force": -2.0 * whole.plan.column.stiffness * slow}
    sites, outcomes = [], []
    for more in (moved, apart):
        signals = {name: whole.signals[name] + values for name, values in more.items()}
        read = replace(whole, signals=whole.signals | signals)
        verdict = judge(search(residuals.prepare(lab_a(read), read), Scales(read)))
        outcomes.append(verdict.outcome)
        sites.append({DATA.catalogue[name].site for name in verdict.effects})
    assert outcomes == ["unknown", "explained"]
    assert sites == [set(), {"sensor.column_displacement", "sensor.column_force"}]


def test_loud_slow_noise_of_a_single_reading_may_be_an_unknown_effect(cases: Cases) -> None:
    found = judged(wandering(cases.record(), "damper_stroke"))
    assert (found.outcome, found.doubted) == ("unknown", "damper_stroke")
    assert doubted([found])[0].startswith("What damper_stroke shows")


def test_slow_noise_is_proven_by_rest_alone(cases: Cases) -> None:
    fit = bare_fit(wandering(cases.record(), "damper_stroke"))

    def told(source: Source) -> str:
        noise = tuple(replace(item, source=source) for item in fit.data.noise)
        return lone_noise(replace(fit, data=replace(fit.data, noise=noise)))

    assert told("quiet part") == "damper_stroke"
    assert told("at rest") == ""


def test_slow_noise_that_the_plan_states_is_no_unknown_effect(cases: Cases) -> None:
    whole = cases.record()
    loud = whole.plan.sensors.damper_stroke + WANDER
    plan = replace(whole.plan, sensors=replace(whole.plan.sensors, damper_stroke=loud))
    labs = tuple(replace(lab, plan=plan) for lab in whole.labs)
    for record, name in ((whole, "damper_stroke"), (replace(whole, labs=labs), "")):
        assert lone_noise(bare_fit(wandering(record, "damper_stroke", wander=WANDER))) == name
    fit = bare_fit(wandering(whole, "damper_stroke", wander=WANDER))
    louder = replace(fit.data, planned=fit.data.white / 5.0)  # as all readings are
    assert lone_noise(replace(fit, data=louder)) == ""
    alone = replace(fit.data, planned=fit.data.white / np.array([1.0, 1.0, 1.5, 1.0]))
    assert lone_noise(replace(fit, data=alone)) == "damper_stroke"
    silent = replace(fit.data, white=fit.data.white * np.array([0.0, 1.0, 1.0, 1.0]))
    assert lone_noise(replace(fit, data=replace(silent, planned=fit.data.white))) == ""


@pytest.mark.slow
def test_loud_slow_noise_of_a_single_reading_beside_an_effect_may_be_an_unknown_one(cases: Cases) -> None:
    whole = cases.record({"table.gain": {"factor": 1.1}})

    def verdict(*names: str) -> PartVerdict:
        read = wandering(whole, *names, wander=10.0 * WANDER)
        return judge(search(residuals.prepare(lab_b(read), read), Scales(read)))

    alone, alike = verdict("damper_stroke"), verdict(*whole.labs[1].measured)
    assert (alone.effects, alone.outcome, alone.doubted) == (("table.gain",), "partly", "damper_stroke")
    assert (alike.effects, alike.outcome, alike.doubted) == (("table.gain",), "explained", "")


def behind_logger(whole: Record) -> Record:
    """The record with slow noise of one colour on all readings of the slave's laboratory."""
    lab = whole.labs[1]
    coloured = {
        name: whole.signals[name]
        + MORE * lab.noise[name] * signal.lfilter([AR1], [1.0, -0.95], white(51 + number, whole.ticks))
        for number, name in enumerate(lab.measured)
    }
    return replace(whole, signals=whole.signals | coloured)


@pytest.mark.long
def test_slow_noise_far_louder_than_that_of_all_other_readings_may_be_an_unknown_effect(
    cases: Cases,
) -> None:
    alike = behind_logger(cases.record())
    lab = alike.labs[1]
    found = judged(wandering(alike, "damper_stroke", wander=MORE * WANDER))
    assert (found.outcome, found.doubted) == ("unknown", "damper_stroke")
    assert where.culprits(found.search.chosen) == ("damper", "sensor.damper_stroke")
    levels = [
        item.rms / lab.noise[name] for item, name in zip(found.search.data.noise, lab.measured, strict=True)
    ]
    assert levels == pytest.approx([levels[0]] * len(levels), rel=0.3)  # a logger treats its channels alike
    assert judged(alike).doubted == ""


def moved_table(whole: Record) -> Record:
    """The record of a slave whose table moves slowly beside its command."""
    return moved_by(whole, SHAKEN * signal.lfilter([AR1], [1.0, -0.95], white(43, whole.ticks)))


def rattling(ticks: int) -> Array:
    """A rattle (ticks,) in m in no relation to a table's command."""
    return np.asarray(2e-4 * np.sin(0.4 * np.arange(ticks)) * white(43, ticks))


def kicks(ticks: int) -> Array:
    """Kicks (ticks,) in m of 14 ms, hardly louder at any frequency than the noise of a sensor."""
    times = np.where(np.arange(ticks) % 97 == 0, np.sign(white(43, ticks)), 0.0)
    return np.asarray(3e-5 * np.convolve(times, np.hanning(9))[:ticks])


def test_the_site_of_a_gap_is_sought_beside_the_noise_that_all_readings_have(cases: Cases) -> None:
    bare = bare_fit(moved_table(behind_logger(cases.record())))
    white_noise = fitting.at(sensor_noise.whitened(bare), {}, bare.z)
    assert where.culprits(white_noise) == ("table",)


def test_steps_of_one_reading_do_not_hide_the_colour_that_the_others_have(cases: Cases) -> None:
    whole = behind_logger(cases.record())
    coarse = whole.signals["damper_stroke"] + 20.0 * whole.labs[1].noise["damper_stroke"] * white(
        53, whole.ticks
    )
    creeping = whole.signals["table_displacement"] + 3e-4 * np.abs(np.sin(0.004 * np.arange(whole.ticks)))
    bare = bare_fit(
        replace(whole, signals=whole.signals | {"damper_stroke": coarse, "table_displacement": creeping})
    )
    white_noise = fitting.at(sensor_noise.whitened(bare), {}, bare.z)
    assert where.culprits(white_noise)[0] == "sensor.table_displacement"


def test_loud_slow_noise_of_several_readings_is_noise(cases: Cases) -> None:
    whole = cases.record()
    found = judged(wandering(whole, *whole.labs[1].measured))
    assert (found.outcome, found.doubted) == ("tolerances", "")


@pytest.mark.parametrize("motion", [rattling, kicks])
def test_noise_of_several_readings_that_follows_from_one_motion_is_an_unknown_effect(
    cases: Cases, motion: Callable[[int], Array]
) -> None:
    whole = cases.record()
    found = judged(moved_by(whole, motion(whole.ticks)))
    assert (found.outcome, found.doubted) == ("unknown", "")
    assert where.culprits(found.search.chosen) == ("table",)


@pytest.mark.long
def test_noise_that_follows_from_one_motion_is_an_unknown_effect_beside_one_with_a_name(cases: Cases) -> None:
    effect = {"table.gain": {"factor": 1.1}}
    whole = cases.record(effect)
    bare = bare_fit(moved_by(whole, rattling(whole.ticks)))
    chosen = settling.settled(fitting.fit(bare.data, effect, bare.z))
    found = judge(Search(chosen.data, bare, chosen, ()))
    assert (found.effects, found.outcome) == (("table.gain",), "partly")


def test_a_gap_that_a_nominal_parameter_took_upon_itself_lies_at_its_machine(cases: Cases) -> None:
    whole = cases.record()
    data = residuals.prepare(lab_a(whole), whole)
    noise = white(41, data.groups * data.sigma.size).reshape(data.groups, -1)
    names = [item.name for item in data.part.nuisances]
    for name, site in (("actuator.gain", "actuator"), ("column.stiffness", "column")):
        pinned = Fit(data, {}, TOLERANCES * np.eye(len(names))[names.index(name)], noise)
        assert where.unexplained(unknown(pinned)).site == site


def test_an_effect_that_is_hardly_the_cause_stands_in_for_it() -> None:
    entry = PartOfGap(
        part="laboratory A",
        outcome="partly",
        effects=("actuator.delay",),
        gap=0.1,
        tolerances=0.0,
        named=0.07,
        left=0.03,
        noise=0.01,
        adequate=None,
    )
    assert wording.of_part(entry, likely=True) == "actuator delay explains a part and leaves 3.0 % of 10 %"
    assert (
        wording.of_part(entry, likely=False)
        == "actuator delay may stand in for another cause and leaves 3.0 % of 10 %"
    )
    learned = replace(entry, learned=0.025, left=0.005)  # of what the name leaves, which has none
    assert wording.of_part(learned, likely=True) == wording.of_part(entry, likely=True)


@pytest.mark.long
def test_an_unknown_effect_in_one_part_does_not_hide_the_name_of_another(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = examine(cases.record({"damper.friction": {"force": 3.0}}, duration=STRONGEST))
    strange = [item if item.effects else replace(item, outcome="unknown") for item in found.verdicts]
    assert status_of(replace(found, verdicts=strange)) == "partly_explained"
    assert (
        status_of(replace(found, verdicts=[item for item in strange if not item.effects])) == "unknown_effect"
    )


@pytest.mark.long
def test_an_effect_whose_size_lies_at_the_end_of_its_range_explains_in_part_only(cases: Cases) -> None:
    whole = cases.record({"actuator.gain": {"factor": 0.9}}, duration=8.0)
    found = search(residuals.prepare(lab_a(whole), whole), Scales(whole, 0.0))
    assert found.chosen.names == ("actuator.gain",)
    assert at_end(found.chosen) == ()
    assert judge(found).outcome == "explained"
    size = found.chosen.values["actuator.gain"]["factor"]
    effect = found.data.catalogue["actuator.gain"]
    narrow = replace(effect, parameters=(replace(effect.parameters[0], least=size),))
    data = replace(found.data, catalogue={**found.data.catalogue, "actuator.gain": narrow})
    limited = replace(found, data=data, chosen=replace(found.chosen, data=data))
    assert at_end(limited.chosen) == ("actuator.gain",)
    assert judge(limited).outcome == "partly"


def test_friction_that_turns_round_over_all_speeds_is_a_drag_of_another_law() -> None:
    effect = DATA.catalogue["column.friction"]
    most = next(item.most for item in effect.parameters if item.name == "velocity")

    def rubbing(velocity: float) -> Fit:
        values = effect.values({"force": 900.0, "velocity": velocity})
        return Fit(DATA, {"column.friction": values}, np.zeros(0), NOISY)

    assert at_end(rubbing(1e-3)) == without_rest(rubbing(1e-3)) == ()
    assert at_end(rubbing(0.9 * most)) == without_rest(rubbing(0.9 * most)) == ("column.friction",)
