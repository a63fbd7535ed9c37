"""Filters and delays of a data logger that its import map does not state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple, cast

import numpy as np
import pytest
from scipy import signal

from common.recording.imported import IMPORT, NOTHING_STATED, ImportedChannel, ImportedData
from common.recording.logger.low_pass import LoggerFilter
from common.roles import MASTER
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.logged import filters, logger
from diagnosis.fits import fitting, residuals, settling, worth
from diagnosis.recorded.building import logged_building
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.record import NOT_LATE, Record
from diagnosis.signals import low_pass
from diagnosis.signals.strength import BEYOND
from models.registry import Array
from tests.diagnosis.cases import STRONGEST, Cases, imported, lab_a, lab_b, white

INTERVAL = 0.002  # s
BESSEL = LoggerFilter("bessel", 4, 40.0)
LATE = ImportedChannel(BESSEL).late
DIGITAL = signal.butter(4, 100.0, fs=500.0)
DIGITAL_LATE = 2.613 / (2.0 * 500.0 * np.tan(np.pi * 100.0 / 500.0))  # s, by which it delays slow motion
TICKS = INTERVAL * np.arange(8000)  # s
SWING = np.sin(2.0 * np.pi * 2.0 * TICKS) + 0.3 * np.sin(2.0 * np.pi * 5.3 * TICKS)  # a force of a building
FORCES = {("master", "column_force"), ("slave", "damper_force")}


def behind_bessel(values: Array) -> Array:
    """A reading behind an analogue filter."""
    return BESSEL.filtered(values, INTERVAL)


def behind_digital(values: Array) -> Array:
    """A reading behind a digital filter."""
    return np.asarray(signal.lfilter(*DIGITAL, values - values[0]) + values[0])


def late(found: Record) -> list[float]:
    """By how much channels of a record are late, as far as filters and delays that were found say, s."""
    every = {
        *(one.about for one in found.late),
        *(one.late for one in found.passed.values()),
    }
    return sorted(every - {0.0})


@pytest.mark.parametrize("channel", [ImportedChannel(BESSEL), ImportedChannel(delay=3.3 * INTERVAL)])
def test_a_frequency_response_is_that_of_a_channel_on_ticks(channel: ImportedChannel) -> None:
    frequency, ticks = 7.0, INTERVAL * np.arange(4000)
    (response,) = channel.response(np.array([frequency]))
    passed = channel.through(np.sin(2.0 * np.pi * frequency * ticks), INTERVAL)
    wanted = np.abs(response) * np.sin(2.0 * np.pi * frequency * ticks + np.angle(response))
    assert passed[1000:] == pytest.approx(wanted[1000:], abs=2e-5)


@pytest.mark.long
def test_a_filter_of_the_forces_alone_is_found_and_leaves_no_gap(cases: Cases) -> None:
    found = filters.filtered(imported(cases.record(), behind_bessel, "N"))
    assert set(found.passed) == FORCES
    assert late(found) == pytest.approx([LATE], rel=0.03)
    for lab in (lab_a(found), lab_b(found)):
        fit = fitting.fit(residuals.prepare(lab.logged(found.late), found), {})
        assert not worth.is_gap(settling.settled(fit))
    said = logger.passed(Diagnosis(found))
    assert said[0].startswith("column_force and damper_force passed a low-pass filter")


@pytest.mark.long
def test_a_filter_of_all_channels_is_one(cases: Cases) -> None:
    found = filters.filtered(imported(cases.record(), behind_digital))
    assert len(set(found.passed.values())) <= 1
    assert late(found) == pytest.approx([DIGITAL_LATE], abs=3e-4)


@pytest.mark.long
@pytest.mark.parametrize("order", [4, 5])
def test_a_filter_with_a_ripple_is_found_as_late_as_it_is(cases: Cases, order: int) -> None:
    rippling = LoggerFilter("chebyshev", order, 90.0, 0.3)
    found = filters.filtered(imported(cases.record(), lambda x: rippling.filtered(x, INTERVAL)))
    assert len(set(found.passed.values())) <= 1
    assert late(found) == pytest.approx([ImportedChannel(rippling).late], rel=0.05)


def test_forces_and_other_readings_pass_one_filter_where_each_may() -> None:
    read = SWING + 0.02 * white(61, SWING.size)
    laboratories = [
        filters.AlikeReadings(role, ("a",), demanded(np.interp(TICKS - LATE, TICKS, read), SWING))
        for role in ("master", "slave")
    ]
    near, far = (ImportedChannel(delay=factor * LATE) for factor in (1.02, 0.5))
    true, other = filters.Common(ImportedChannel(delay=LATE), (laboratories[0],)), (laboratories[1],)
    agreed = filters.alike(true, filters.Common(near, other))
    assert agreed[0].channel == agreed[1].channel
    apart = filters.alike(true, filters.Common(far, other))
    assert apart[0].channel == apart[1].channel == true.channel  # which is likelier for both
    assert filters.alike(true, filters.Common()) == (true, filters.Common())


class Wanted(NamedTuple):
    """Stands for spectra of a force that is likeliest behind one delay."""

    late: float  # in units of LATE
    sure: float  # by how much less surprising it is so than without a delay
    missed: float = 0.0  # by its nominal model


def surprise(of: Wanted, channel: ImportedChannel) -> float:
    """That of a delay, which grows with the square of what it is off."""
    return of.sure * (channel.late / LATE / of.late - 1.0) ** 2


def together(of: Sequence[Wanted]) -> float:
    """The delay, s, that all of them find least surprising."""
    weights = [max(one.sure, 1e-9) / one.late for one in of]
    return LATE * sum(weights) / sum(weight / one.late for weight, one in zip(weights, of, strict=True))


def readings(*wanted: Wanted) -> list[filters.AlikeReadings]:
    """Those of laboratories, one each."""
    return [filters.AlikeReadings("", (), cast(low_pass.ReadSpectra, one)) for one in wanted]


@pytest.fixture
def weighed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Likelihoods of what is wanted in place of those of spectra."""
    stands = SimpleNamespace(
        surprise=surprise,
        roughly=lambda *of: low_pass.Said(together(of), 0.0, sum(one.sure for one in of)),
        likeliest=lambda late, beyond, *of: ImportedChannel(delay=together(of)),
        missed=lambda of, _: of.missed,
        surprise_unknown=lambda _: np.inf,
    )
    monkeypatch.setattr(filters, "low_pass", stands)


@pytest.mark.usefixtures("weighed")
@pytest.mark.parametrize(("sure", "said"), [(2000.0, 1.0), (100.0, 0.85)], ids=["most", "few"])
def test_readings_together_decide_on_one_delay(sure: float, said: float) -> None:
    """Forces lose 3 % of what they gain by the delay of the others, which is little beside what these gain."""
    forces, others = readings(Wanted(0.85, 600.0), Wanted(1.0, sure))
    own = filters.Common(ImportedChannel(delay=0.85 * LATE), (forces,))
    theirs = filters.Common(ImportedChannel(delay=LATE), (others,))
    found = filters.alike(own, theirs)
    assert [one.channel.delay for one in found] == pytest.approx([said * LATE] * 2)


@pytest.mark.parametrize(("other", "early"), [(-0.6, True), (-2.0, True), (-0.3, False), (1.0, False)])
def test_one_laboratory_tells_that_all_are_early_where_the_others_are_likelier_so(
    other: float, early: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def surprise(of: Wanted, channel: ImportedChannel) -> float:
        return of.sure * ((channel.delay / LATE - of.late) / of.late) ** 2

    monkeypatch.setattr(low_pass, "surprise", surprise)
    found = filters.before_time(readings(Wanted(-1.0, 300.0), Wanted(other, 5.0)), 2.0 * LATE)
    assert found == pytest.approx(LATE if early else 0.0, rel=0.1)
    assert filters.before_time(readings(Wanted(-1.0, 300.0)), 2.0 * LATE) == 0.0


@pytest.mark.usefixtures("weighed")
@pytest.mark.parametrize(("other", "agreed"), [(1.04, True), (1.4, False)])
def test_one_delay_of_all_is_taken_where_none_loses_by_it(other: float, agreed: bool) -> None:
    one, two = readings(Wanted(1.0, 2000.0), Wanted(other, 2000.0))
    found = filters.of_all([one._replace(role="master"), two._replace(role="slave")])
    assert (found is not None) == agreed
    if found is not None:
        assert LATE < found.delay < other * LATE
    assert filters.of_all([one, two]) is None  # of one laboratory that follows from its fault as well


@pytest.mark.usefixtures("weighed")
@pytest.mark.parametrize(
    ("other", "said"), [(Wanted(0.1, 200.0, missed=0.06), 1.0), (Wanted(0.1, 200.0), 0.0)]
)
def test_other_readings_are_as_late_as_forces_unless_one_that_fits_speaks_against_it(
    other: Wanted, said: float
) -> None:
    forces = filters.Common(ImportedChannel(delay=LATE), tuple(readings(Wanted(1.0, 100.0))))
    found = filters.followed(forces, filters.Common(), readings(Wanted(1.02, 100.0), other))
    assert found.channel.late == pytest.approx(said * LATE)
    alone = filters.followed(forces, filters.Common(), readings(other._replace(sure=0.0)))
    assert alone == filters.Common()  # no laboratory says the same


@pytest.mark.usefixtures("weighed")
@pytest.mark.parametrize(("missed", "there"), [(0.06, True), (0.04, False)], ids=["effect", "fits"])
def test_a_laboratory_that_its_model_misses_says_nothing_against_a_filter_of_all(
    missed: float, there: bool
) -> None:
    labs = readings(Wanted(1.0, 100.0), Wanted(0.1, 200.0, missed=missed))
    found = filters.passed(labs, ImportedChannel(delay=LATE))
    assert (found.channel.delay == LATE) == there
    assert len(found.by) == (2 if there else 0)
    assert filters.passed([], ImportedChannel(delay=LATE)) == filters.Common()


@pytest.mark.usefixtures("weighed")
@pytest.mark.parametrize(
    ("master", "sure", "said"),
    [(Wanted(1.0, 50.0), 100.0, 1.0), (Wanted(1.3, 5000.0), 100.0, 1.3), (Wanted(1.3, 5000.0), 500.0, 1.3)],
    ids=["apart", "agree", "against all"],
)
def test_the_building_decides_where_a_laboratory_allows_its_delay(
    master: Wanted, sure: float, said: float
) -> None:
    *laboratories, building = readings(master, Wanted(1.3, 5000.0), Wanted(1.0, sure))
    found = filters.of_forces(laboratories, [building])
    assert found.channel.late == pytest.approx(said * LATE)


def test_rows_that_are_missing_make_no_filter(cases: Cases) -> None:
    record = imported(cases.record())
    gap = (5.0, 5.25)
    inside = (record.time > gap[0]) & (record.time < gap[1])
    places = np.flatnonzero(~inside)
    signals = {
        name: np.interp(record.time, record.time[places], values[places])
        for name, values in record.signals.items()
        if values.ndim == 1
    }
    stated = replace(record.mapped or ImportedData(""), gaps=(gap,)).metadata()
    run = replace(record.run, metadata=record.run.metadata | {IMPORT: stated})
    present = {name: there & ~inside for name, there in record.present.items()}
    gapped = replace(record, signals=record.signals | signals, present=present, run=run)
    assert gapped.gapped
    found = filters.filtered(gapped)
    assert (found.passed, found.late) == ({}, NOT_LATE)


@pytest.mark.long
def test_a_laboratory_with_an_effect_does_not_hide_a_filter(cases: Cases) -> None:
    rubbing = cases.record({"column.friction": {"force": 900.0}})
    found = late(filters.filtered(imported(rubbing, behind_bessel)))
    assert (min(found), max(found)) == pytest.approx((LATE, LATE), rel=0.05)


@pytest.mark.long
def test_readings_that_are_late_alike_have_no_filter(cases: Cases) -> None:
    found = filters.filtered(imported(cases.record(), lambda x: np.r_[x[:1], x[:1], x[:-2]]))
    assert found.passed == {}
    assert [one.about for one in found.late] == pytest.approx([2 * INTERVAL, 2 * INTERVAL], abs=3e-4)


@pytest.mark.parametrize("effects", [{}, {"actuator.delay": {"delay": 0.006}}])
def test_what_delays_one_laboratory_is_no_filter(cases: Cases, effects: dict[str, dict[str, float]]) -> None:
    found = filters.filtered(imported(cases.record(effects)))
    assert (found.passed, found.late) == ({}, NOT_LATE)
    assert filters.filtered(cases.record(effects)).late == NOT_LATE


def behind(whole: Record, seed: int) -> Record:
    """An import whose force of the master's laboratory alone passed a filter, with noise before it."""
    noise = np.random.default_rng(seed).standard_normal(whole.ticks)
    force = behind_bessel(whole.signals["column_force"] + 30.0 * noise)
    signals = imported(whole).signals | {name: whole.signals[name] for name in ("damper_force_used",)}
    return replace(imported(whole), signals=signals | {"column_force": force})


def test_the_building_tells_the_filter_of_a_force_alone(cases: Cases) -> None:
    found = filters.filtered(behind(cases.record(duration=STRONGEST), 31))
    assert list(found.passed) == [(MASTER, "column_force")]
    assert found.passed[MASTER, "column_force"].filter.cutoff == pytest.approx(BESSEL.cutoff, rel=0.03)  # type: ignore[union-attr]
    view = logged_building.logged(Building(found))
    assert view is not None
    assert view.behind
    assert not worth.is_gap(settling.settled(fitting.fit(residuals.prepare(view, found), {})))


@pytest.mark.parametrize(("noise", "several"), [(0.0, False), (5.0, True)])
def test_forces_with_noise_that_the_motion_lacks_are_not_those_used(
    cases: Cases, noise: float, several: bool
) -> None:
    whole = cases.record()
    used = whole.signals["damper_force_used"]
    noisy = used + noise * white(32, used.size)
    record = replace(imported(whole), signals=whole.signals | {"damper_force_used": noisy})
    names = {one.names for one in filters.of_building(record, parts_of(record))}
    assert names == {("column_force", "damper_force_used"), *([] if several else [("column_force",)])}


@pytest.mark.parametrize(
    ("forces", "others", "said"),
    [
        (3e-3, 0.0, "All readings of forces"),
        (0.0, 3e-3, "All readings but forces"),
        (4e-3, 3e-3, "All readings"),
    ],
)
def test_readings_that_are_late_alike_are_said(cases: Cases, forces: float, others: float, said: str) -> None:
    record = cases.record()
    delays = {
        name: (forces if record.unit(name) == "N" else others, 1.0)
        for lab in record.labs
        for name in lab.measured
    }
    found = cast(Diagnosis, SimpleNamespace(record=record, logger=delays))
    (sentence,) = logger.timed(found)
    assert sentence.startswith(f"{said} come 3 ms late")


def demanded(read: Array, used: Array, *, noisy: bool = True) -> low_pass.ReadSpectra:
    """Spectra of a force (ticks,) that a logger read, and of the one that a building's motion demands."""
    slopes = 0.01 * used[:, None, None]
    return low_pass.spectra(read[:, None], used[:, None], slopes, INTERVAL, 250.0, noisy=noisy)


@pytest.mark.parametrize("noisy", [True, False])
def test_noise_that_only_the_master_read_is_no_filter(noisy: bool) -> None:
    smooth = signal.lfilter([np.sqrt(1.0 - 0.9**2)], [1.0, -0.9], white(51, SWING.size))
    said = low_pass.roughly(
        demanded(SWING + 0.02 * smooth, SWING + 0.006 * white(52, SWING.size), noisy=noisy)
    )
    assert (
        said.gain < BEYOND
    ) == noisy  # if the master had read what the logger did, a filter must have passed it


def test_friction_in_the_joints_of_a_building_is_no_filter_of_its_forces() -> None:
    rate = np.gradient(SWING)
    used = SWING + 0.4 * np.tanh(5.0 * rate / np.std(rate)) + 0.006 * white(52, SWING.size)
    spectra = demanded(SWING + 0.02 * white(53, SWING.size), used)
    assert low_pass.roughly(spectra).gain > BEYOND  # what is late looks like it
    building = filters.AlikeReadings(MASTER, ("column_force",), spectra)
    assert filters.of_forces([], [building]).channel == NOTHING_STATED


@pytest.mark.parametrize("damped", [True, False])
def test_a_building_that_is_damped_otherwise_is_no_delay_of_its_forces(damped: bool) -> None:
    rate, late = np.gradient(SWING, INTERVAL), np.interp(TICKS - LATE, TICKS, SWING)
    noise = 0.02 * white(54, SWING.size)
    read = SWING - LATE * rate if damped else late
    # of a mass and a damping, a tolerance each
    slopes = np.stack([0.01 * SWING, 5e-4 * rate], axis=1)[:, None]
    spectra = low_pass.spectra((read + noise)[:, None], SWING[:, None], slopes, INTERVAL, 250.0, noisy=True)
    building = filters.AlikeReadings(MASTER, ("column_force",), spectra)
    laboratory = filters.AlikeReadings(MASTER, ("column_force",), demanded(late + noise, SWING))
    found = filters.of_forces([laboratory], [building]).channel
    assert low_pass.roughly(spectra).gain > BEYOND
    assert found.late == pytest.approx(0.0 if damped else LATE, rel=0.1)
