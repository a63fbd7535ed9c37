"""Several recordings of the same laboratories are diagnosed together; a cause must explain all of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from common.errors import InputError
from diagnosis.findings.certainty.covariances import spread
from diagnosis.findings.certainty.intervals import intervals, refined
from diagnosis.findings.logged.building import verdict_on
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits import fitting, residuals
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.distinct import refuse_copies
from diagnosis.recorded.joined import JoinedPart, joined, refuse_others
from diagnosis.recorded.record import Record
from models.system import System
from tests.diagnosis.cases import Cases, lab_a, lab_b

FRICTION = {"damper.friction": {"force": 3.0, "velocity": 1e-6}}


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Cases:
    """Recordings with known secrets, made on demand."""
    return Cases(tmp_path_factory)


@pytest.fixture(scope="module")
def records(cases: Cases) -> tuple[Record, Record]:
    """Two tests of one clean laboratory, of other lengths and scales."""
    return cases.record(duration=4.0), cases.record(duration=3.0, scale=0.2)


@pytest.mark.parametrize("part_of", [lab_a, lab_b])
def test_each_joined_recording_is_predicted_from_its_own_inputs(
    part_of: Callable[[Record], object], records: tuple[Record, Record]
) -> None:
    pieces = [part_of(record) for record in records]
    part = JoinedPart(pieces)  # type: ignore[arg-type]
    system = System(records[0].plan)
    own = [piece.predict(system) for piece in pieces]  # type: ignore[attr-defined]
    assert np.array_equal(part.predict(system), np.concatenate(own))
    assert part.measured.shape == part.present.shape == (2000 + 1500, part.predict(system).shape[1])


def test_the_first_ticks_of_joined_recordings_may_extend_into_the_second_recording(
    records: tuple[Record, Record],
) -> None:
    part, system = JoinedPart([lab_b(record) for record in records]), System(records[0].plan)
    for ticks in (300, 2000, 2600):
        begun = part.first(ticks)
        assert len(begun.measured) == ticks
        assert np.array_equal(begun.measured, part.measured[:ticks])
        assert np.array_equal(begun.predict(system), part.predict(system)[:ticks])


def test_only_measured_parts_with_the_same_readings_are_joined(records: tuple[Record, Record]) -> None:
    building, mine, other = Building(records[0]), lab_a(records[0]), lab_a(records[1])
    assert joined(building, [Building(records[1])], 4) is building
    assert joined(mine, [lab_b(records[1])], 4) is mine
    odd = joined(mine, [other.first(1003)], 4)
    assert len(odd.measured) == 2000 + 1000  # whole averaged samples


def test_recordings_of_other_laboratories_are_refused(records: tuple[Record, Record]) -> None:
    first, second = records
    refuse_others(first, [second])
    stiffer = replace(second.plan, table=replace(second.plan.table, frequency=9.0))
    with pytest.raises(InputError, match=r"their plans differ in \[table\]"):
        refuse_others(first, [replace(second, plan=stiffer)])


@pytest.mark.long
def test_a_second_recording_narrows_the_confidence_interval(cases: Cases) -> None:
    first, second = (cases.record(FRICTION, duration=4.0, scale=scale) for scale in (0.1, 0.2))
    widths = []
    for others in ([], [lab_b(second)]):
        data = residuals.prepare(joined(lab_b(first), others, 4), first)
        fit = fitting.fit(data, FRICTION)
        verdict = PartVerdict(Search(data, fit, fit, ()), "explained", 1.0, (), ())
        found = intervals(verdict)["damper.friction"]["force"]
        assert found.low < 3.0 < found.high
        widths.append(spread(refined(fit)).half(fit.z.size))
    assert widths[1] < 0.9 * widths[0]


@pytest.mark.slow
def test_a_cause_in_only_one_of_two_recordings_is_not_accepted(cases: Cases) -> None:
    clean, stuck = cases.record(duration=4.0), cases.record(FRICTION, duration=4.0)
    part = joined(lab_b(stuck), [lab_b(clean)], 4)
    part.candidates = tuple(effect for effect in part.candidates if effect.name in FRICTION)
    data = residuals.prepare(part, stuck)
    assert verdict_on(data, Scales(stuck)).outcome != "explained"


def renamed(whole: Record) -> Record:
    """The same recording under another name."""
    return replace(whole, run=replace(whole.run, path=whole.run.path.with_name("copy.mcap")))


def test_a_copy_under_another_name_neither_validates_nor_adds_evidence(
    records: tuple[Record, Record],
) -> None:
    first, second = records
    refuse_copies([first], [second])
    refuse_copies([first, second], [])
    for copy in (
        first,
        renamed(first),
        replace(renamed(first), ticks=1500),
    ):  # whole, and its beginning alone
        with pytest.raises(InputError, match="cannot validate it: give --validate another recording"):
            refuse_copies([first], [second, copy])
        with pytest.raises(InputError, match="give each recording once"):
            refuse_copies([first, copy], [second])


def test_another_measurement_of_the_same_test_is_no_copy(
    cases: Cases, records: tuple[Record, Record]
) -> None:
    again = cases.record(duration=4.0, seed=2)
    name = "table_displacement"
    assert np.allclose(again.signals[name], records[0].signals[name], atol=1e-4)  # noise and parameters alone
    refuse_copies([records[0]], [again])
