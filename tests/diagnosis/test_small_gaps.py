"""Gaps that are smaller than what two good solutions of one model differ by."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from common.recording.imported import IMPORT, ImportedChannel, ImportedData
from common.recording.logger.low_pass import LoggerFilter
from diagnosis.findings.certainty.other_causes import EITHER, other_causes
from diagnosis.findings.certainty.trust import trusted
from diagnosis.findings.verdict import judge
from diagnosis.fits import fitting, residuals, settling
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search, at_any_size, search
from diagnosis.fits.unexplained import foresees, leaves, model_error
from diagnosis.fits.worth import SEEN
from diagnosis.recorded.parts import FINE_ERROR, MODEL_ERROR, LaboratoryPart
from diagnosis.recorded.record import Delay, Late, Record
from tests.diagnosis.cases import Cases, imported, lab_a, lab_b

TABLE, STROKE = 0, 2  # places of the table's displacement and the damper's stroke among the readings
SIGNS = {"clear": 3.0, "names": 1.0}  # of a verdict on one effect that stands out clearly
WIDTH = 2e-4  # of the stroke's rms, by which its reading lags
FAINT = 3.2e-4  # of the table's, whose reading it changes by a tenth of its noise


def lagging(whole: Record, share: float, place: int = STROKE) -> LaboratoryPart:
    """The slave's laboratory one of whose readings lags by a hysteresis of its transducer."""
    part = lab_b(whole)
    measured, reading = part.measured.copy(), part.measured[:, place]
    measured[:, place] -= (
        share * reading.std() * np.sign(np.gradient(part.predict(whole.systems[part.role])[:, place]))
    )
    return part.replaced(measured=measured, candidates=())  # none of which is its cause


@pytest.mark.long
@pytest.mark.parametrize(("share", "outcome"), [(0.0, "tolerances"), (WIDTH, "unknown")])
def test_a_gap_that_two_good_solutions_may_differ_by_is_seen(
    share: float, outcome: str, cases: Cases
) -> None:
    whole = cases.record({}, duration=8.0)
    data = residuals.prepare(lagging(whole, share), whole)
    usual = settling.settled(fitting.fit(data, {}))
    assert not leaves(usual, model_error(usual))
    found = search(data, Scales(whole))
    assert found.data.erring == (FINE_ERROR if share else MODEL_ERROR)
    assert judge(found).outcome == outcome


@pytest.mark.long
def test_so_small_a_gap_is_not_looked_for_behind_a_filter(cases: Cases) -> None:
    whole = cases.record({}, duration=8.0)
    part = lagging(whole, WIDTH)
    filtered = (ImportedChannel(LoggerFilter("butterworth", 4, 80.0)),) * len(part.channels)
    behind = part.replaced(channels=filtered, logged_by=filtered)
    data = replace(residuals.prepare(part, whole), part=behind)
    assert search(replace(data, part=part), Scales(whole)).data.erring == FINE_ERROR
    assert np.isfinite(data.part.passes).all()
    found = at_any_size(data, Scales(whole))
    assert found[1] is None
    assert found[0].data.erring == MODEL_ERROR


@pytest.mark.parametrize("late", [0.0, 1e-3])
def test_so_small_a_gap_is_not_looked_for_where_readings_were_moved_in_time(
    cases: Cases, late: float
) -> None:
    whole = cases.record({}, duration=8.0)
    part = lagging(whole, WIDTH).logged(Late(motion=Delay(late)))
    assert part.retimed == (late > 0.0)
    assert replace(whole, fast=2e-5).retimed
    data = residuals.prepare(part, whole)
    assert data.fine.erring == (MODEL_ERROR if late else FINE_ERROR)


@pytest.mark.parametrize("rate", [500.0, 1000.0])
def test_so_small_a_gap_is_not_looked_for_behind_a_converter_that_may_take_its_channels_in_turn(
    cases: Cases, rate: float
) -> None:
    whole = imported(cases.record({}, duration=2.0))
    names = {lab.role: lab.measured for lab in whole.labs}
    channels = {role: dict.fromkeys(those, ImportedChannel(rate=rate)) for role, those in names.items()}
    data = ImportedData("measurements.csv", channels=channels)
    run = replace(whole.run, metadata=whole.run.metadata | {IMPORT: data.metadata()})
    record = replace(whole, run=run)
    fine = residuals.prepare(lab_b(record), record).fine
    assert fine.erring == (MODEL_ERROR if rate > 500.0 else FINE_ERROR)


@pytest.mark.long
def test_a_gap_that_the_inputs_foresee_is_seen_below_what_its_energy_tells(cases: Cases) -> None:
    whole = cases.record({}, duration=8.0)
    data = residuals.prepare(lagging(whole, FAINT, TABLE), whole)
    fine = fitting.polished(settling.settled(fitting.fit(data.fine, {})))
    assert not leaves(fine, model_error(fine))
    assert foresees(fine, model_error(fine))
    assert judge(search(data, Scales(whole))).outcome == "unknown"


@pytest.mark.long
def test_the_name_of_so_small_a_gap_is_half_as_probable(cases: Cases) -> None:
    whole = cases.record({"column.friction": {"force": 900.0}}, duration=8.0)
    found = search(residuals.prepare(lab_a(whole), whole), Scales(whole))
    assert judge(found).outcome == "explained"
    faint = replace(found, data=found.data.fine)
    verdict = judge(faint)
    assert verdict.outcome == "partly"
    usual = replace(verdict, search=found)
    probability, otherwise = (
        trusted(SimpleNamespace(verdicts=[item]), [item], SIGNS, 1.0)  # type: ignore[arg-type]
        for item in (verdict, usual)
    )
    assert probability == pytest.approx(EITHER * otherwise)
    assert probability < 0.5
    assert "two good solutions" in next(other_causes(faint))


@pytest.mark.parametrize(("share", "unknown"), [(0.0, False), (0.25, True)])
def test_a_small_gap_that_the_inputs_foresee_is_an_unknown_effect(
    share: float, unknown: bool, cases: Cases
) -> None:
    whole = cases.record({}, duration=8.0)
    part = lab_b(whole)
    measured, stroke = part.measured.copy(), part.measured[:, 2]
    measured[:, 1] += share * residuals.prepare(part, whole).white[1] * stroke / stroke.std()
    bare = settling.settled(fitting.fit(residuals.prepare(part.replaced(measured=measured), whole), {}))
    found = Search(bare.data, bare, bare, ())
    assert found.left < SEEN
    assert (judge(found).outcome == "unknown") == unknown
