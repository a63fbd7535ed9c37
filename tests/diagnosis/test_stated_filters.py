"""Laboratories behind filters of a logger that an import map states, and from which real ones deviate."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Callable, Collection
from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy import signal

from common.recording.imported import IMPORT, ImportedChannel
from common.recording.logger.low_pass import LoggerFilter
from common.roles import MASTER
from diagnosis.diagnose import diagnose, put_right
from diagnosis.findings.logged import delays, logger
from diagnosis.fits import residuals
from diagnosis.fits.fitting import fit
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import search
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.logger.through import through_logger
from diagnosis.recorded.nuisances import LoggedReadings
from diagnosis.recorded.record import NOT_LATE, Record
from diagnosis.report.records import Report
from diagnosis.signals.noise.level import white_rms
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_a, lab_b, unknown, white

RATE = 500.0  # Hz, of the ticks
BUTTERWORTH = LoggerFilter("butterworth", 4, 100.0)
LOW = LoggerFilter("butterworth", 4, 60.0)
DIGITAL = signal.butter(4, 100.0, fs=RATE, output="sos")


def digital(values: Array) -> Array:
    """Values behind a digital filter that had seen the first one ever before."""
    return np.asarray(signal.sosfilt(DIGITAL, values - values[0]) + values[0])


PASSED: dict[str, tuple[LoggerFilter, Callable[[Array], Array]]] = {
    "digital": (BUTTERWORTH, digital),
    "3 % off": (BUTTERWORTH, lambda x: replace(BUTTERWORTH, cutoff=103.0).filtered(x, 1.0 / RATE)),
}


def behind(whole: Record, stated: LoggerFilter, passed: Callable[[Array], Array]) -> Record:
    """An import of readings that passed a filter which is stated as another one."""
    return logged(whole, {"filter": asdict(stated)}, passed)


def logged(whole: Record, stated: dict[str, object], passed: Callable[[Array], Array]) -> Record:
    """An import of readings that a logger changed, with the same statement on each channel."""
    signals, channels = dict(whole.signals), dict[str, dict[str, object]]()
    for lab in whole.labs:
        for name in lab.measured:
            signals[name] = passed(signals[name])
            channels.setdefault(lab.role if lab.role == MASTER else "slave", {})[name] = stated
    metadata = {IMPORT: {"data": "a.csv", "channels": json.dumps(channels)}}
    return replace(whole, signals=signals, run=replace(whole.run, metadata=whole.run.metadata | metadata))


def report(whole: Record) -> Report:
    """The diagnosis of a record."""
    return diagnose({"slave": whole}, {})["slave"].report


@pytest.mark.long
@pytest.mark.parametrize("name", PASSED)
def test_a_laboratory_behind_a_filter_that_is_not_quite_the_stated_one_has_no_fault(
    name: str, cases: Cases
) -> None:
    found = report(behind(cases.record(), *PASSED[name]))
    assert (found.status, found.where) == ("within_tolerances", ())


@pytest.mark.long
def test_a_fault_is_found_behind_a_digital_filter(cases: Cases) -> None:
    rubbing = cases.record({"column.friction": {"force": 900.0}})
    whole = behind(rubbing, *PASSED["digital"])
    data = residuals.prepare(lab_a(whole).logged(NOT_LATE), whole)
    assert search(data, Scales(whole)).chosen.names == ("column.friction",)


def test_a_stated_filter_may_delay_by_less_and_by_more(cases: Cases) -> None:
    whole = behind(cases.record(), *PASSED["digital"])
    part = lab_a(whole).logged(NOT_LATE)
    found = fit(residuals.prepare(part, whole), {})
    delays = [
        one.tolerance * z for one, z in zip(part.nuisances, found.z, strict=True) if one.name == "delay"
    ]
    # the digital filter delays slow motion by 0.56 ms less, of which the actuator's own delay and lag take a part
    assert all(-5.6e-4 < one < -1e-4 for one in delays)
    assert len(delays) == 2


def test_noise_is_measured_by_the_frequencies_that_passed(cases: Cases) -> None:
    whole = cases.record()
    level = whole.planned_noise["damper_force"]
    passed = behind(whole, LOW, lambda x: LOW.filtered(x + 4.0 * level * white(5, whole.ticks), 1.0 / RATE))
    data = residuals.prepare(lab_b(passed), passed)
    place = data.part.signals.index("damper_force")
    assert data.part.passes[place] == 60.0
    by_ticks = white_rms(data.residual(data.system))[place]
    assert data.white[place] > 0.9 * 4.0 * level > 30.0 * by_ticks
    both = residuals.prepare(JoinedPart([data.part, data.part]), passed)
    assert both.white[place] == pytest.approx(data.white[place], rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize(("rate", "names"), [(300.0, {"damper_stroke"}), (4000.0, set())])
def test_what_straight_lines_between_rows_may_miss_is_no_noise_that_follows_the_motion(
    rate: float, names: set[str], cases: Cases
) -> None:
    whole = logged(cases.record(), {"interpolated": True, "rate": rate}, lambda x: x)
    found = fit(residuals.prepare(lab_b(whole), whole), {})
    assert logger.blurred([unknown(found)]) == names
    assert (
        logger.blurred([unknown(fit(residuals.prepare(lab_b(cases.record()), cases.record()), {}))]) == set()
    )


def test_noise_behind_a_filter_far_below_the_rate_is_measured_on_few_sums(cases: Cases) -> None:
    whole = logged(cases.record(), {"filter": asdict(replace(LOW, cutoff=0.2))}, lambda x: x)
    data = residuals.prepare(lab_b(whole), whole)
    assert np.all(np.isfinite(data.white))
    assert np.all(data.white > 0.0)


def test_a_motion_that_diverges_passes_no_logger(cases: Cases) -> None:
    whole = cases.record()
    lab = lab_b(whole).lab
    readings = np.full((50, len(lab.kind.channels.names)), np.inf)
    stated = [ImportedChannel(LoggerFilter("bessel", 4, 90.0), delay=1e-3)] * readings.shape[1]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert through_logger(readings, lab, whole.systems[lab.role], stated, []) is readings


def later(whole: Record, names: Collection[str], ticks: int = 2) -> Record:
    """The record with readings that come some ticks later."""
    read = {name: whole.signals[name] for name in names}
    late = {name: np.append([values[0]] * ticks, values[:-ticks]) for name, values in read.items()}
    return replace(whole, signals=whole.signals | late)


def test_forces_that_come_later_than_behind_a_stated_filter_are_the_loggers(cases: Cases) -> None:
    whole = behind(cases.record(), BUTTERWORTH, lambda x: BUTTERWORTH.filtered(x, 1.0 / RATE))
    names = ("column_force", "damper_force")
    assert delays.delayed(whole).delayed == {}
    found = put_right(later(whole, names)).delayed
    assert {name for _, name in found} == set(names)
    assert list(found.values()) == pytest.approx([0.004] * 2, rel=0.1)
    assert delays.delayed(later(whole, names[1:])).delayed == {}
    stated = logged(cases.record(), {"filter": asdict(BUTTERWORTH), "delay": 0.001}, lambda x: x)
    assert delays.delayed(later(stated, names)).delayed == {}  # by more than an interval


def test_a_delay_that_one_laboratory_has_is_not_the_loggers(cases: Cases) -> None:
    whole = cases.record({"actuator.delay": {"delay": 0.004}})
    passed = behind(whole, BUTTERWORTH, lambda x: BUTTERWORTH.filtered(x, 1.0 / RATE))
    assert delays.delayed(passed).delayed == {}


@pytest.mark.parametrize(
    "stated", [{"filter": asdict(BUTTERWORTH)}, {"delay": 0.016}], ids=["filter", "delay"]
)
def test_a_logger_may_read_between_ticks_whatever_its_map_states(
    stated: dict[str, object], cases: Cases
) -> None:
    """What is in the row of a tick was read 1.2 ms after it, as the row of the next command shows."""

    def passed(values: Array) -> Array:
        seen = BUTTERWORTH.filtered(values, 1.0 / RATE) if "filter" in stated else shifted(values, 8.0)
        return shifted(seen, -0.6)

    found = put_right(logged(cases.record(), stated, passed))
    assert found.early == pytest.approx(1.2e-3, rel=0.1)
    assert put_right(logged(cases.record(), stated, lambda x: shifted(passed(x), 0.6))).early == 0.0


@pytest.mark.parametrize(("ticks", "found"), [(0.6, 2), (2.0, 0)])
def test_behind_a_stated_delay_readings_may_be_later_by_an_interval(
    ticks: float, found: int, cases: Cases
) -> None:
    whole = logged(cases.record(), {"delay": 0.016}, lambda x: shifted(x, 8.0))
    forces = {name: shifted(whole.signals[name], ticks) for name in ("column_force", "damper_force")}
    late = delays.delayed(replace(whole, signals=whole.signals | forces)).delayed
    assert list(late.values()) == pytest.approx([ticks / RATE] * found, rel=0.2)


def shifted(values: Array, ticks: float) -> Array:
    """Values that come so many ticks later."""
    places = np.arange(values.size, dtype=np.float64)
    return np.asarray(np.interp(places - ticks, places, values))


def test_a_delay_that_is_stated_to_be_none_is_a_statement(cases: Cases) -> None:
    whole = cases.record()
    assert lab_b(logged(whole, {}, lambda x: x)).free
    assert not lab_b(logged(whole, {"delay_stated": True}, lambda x: x)).free


def test_rows_between_ticks_leave_open_when_a_tick_was(cases: Cases) -> None:
    """Between two rows of a logger of 1000 Hz a tick may be anywhere, by 0.29 ms in the standard deviation."""
    between: dict[str, object] = {"delay": 0.016, "interpolated": True, "rate": 1000.0}
    part = lab_b(logged(cases.record(), between, lambda x: x)).logged(NOT_LATE)
    (late,) = (one for one in part.nuisances if isinstance(one, LoggedReadings) and one.parameter == "delay")
    assert (late.tolerance, late.least) == pytest.approx((1e-3 / math.sqrt(12.0), -1e-3))
    assert late.signals == part.lab.kind.channels.names
    in_time: dict[str, object] = {
        "delay": 0.016,
        "rate": 500.0,
    }  # of another device, whose rows stand on ticks
    other = lab_b(logged(cases.record(), in_time, lambda x: x)).logged(NOT_LATE)
    (late,) = (one for one in other.nuisances if isinstance(one, LoggedReadings) and one.parameter == "delay")
    assert (late.tolerance, late.least) == pytest.approx((2e-3 / math.sqrt(12.0), -2e-3))
    steady: dict[str, object] = {
        "average": 6e-3,
        "rate": 1000.0,
    }  # in step with the ticks, as far as anyone knows
    stands = lab_b(logged(cases.record(), steady, lambda x: x)).logged(NOT_LATE)
    (late,) = (
        one for one in stands.nuisances if isinstance(one, LoggedReadings) and one.parameter == "delay"
    )
    assert (late.tolerance, late.least) == pytest.approx((1e-3 / math.sqrt(3.0), -1e-3))
    of_controller: dict[str, object] = {"delay_stated": True, "rate": 500.0}
    on_ticks = lab_b(logged(cases.record(), of_controller, lambda x: x)).logged(NOT_LATE)
    assert [one for one in on_ticks.nuisances if isinstance(one, LoggedReadings)] == [
        one for one in part.nuisances if one.parameter == "gain"
    ]


def test_only_what_is_beyond_the_time_of_a_hold_is_the_loggers() -> None:
    one = LoggedReadings("delay", 5e-4, held=2e-3)
    both = math.hypot(5e-4, 2e-3 / math.sqrt(3.0))
    z = np.array([-1.0, 0.0, 1.0, 2e-3 / both])
    assert [one.late(float(value)) for value in z] == pytest.approx(both * z)
    assert one.late(2e-3 / both + 2.0) == pytest.approx(2e-3 + 2.0 * 5e-4)
    assert LoggedReadings("delay", 5e-4).late(-3.0) == pytest.approx(-1.5e-3)
