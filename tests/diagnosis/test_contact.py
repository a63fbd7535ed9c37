"""End stops that are sought on both sides of where the motion ends."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.fits import contact, fitting, residuals
from diagnosis.fits.contact import by_law, touched
from models.registry import Array
from tests.diagnosis.cases import Cases, estimate, lab_b, named


@dataclass(frozen=True)
class Found:
    """A fit with what tells its law."""

    values: dict[str, dict[str, float]]
    reduced: Array


def test_two_starts_that_end_at_the_same_stop_are_told_apart_by_their_law_alone() -> None:
    """Fits hold arrays, which cannot be compared as a whole."""
    place = {"position": 0.03}
    fits: list[Any] = [Found({"stop": {**place, "law": law}}, np.zeros(3)) for law in (0.0, 0.0, 1.0)]
    springs, others = by_law(cast(Any, fits), "stop")
    assert [id(one) for one in springs] == [id(one) for one in fits[:2]]
    assert [id(one) for one in others] == [id(fits[2])]


@pytest.mark.long
def test_a_stop_that_is_met_lightly_is_found(cases: Cases) -> None:
    largest = float(np.abs(cases.record(duration=12.0).signals["damper_stroke"]).max())
    place = round(0.985 * largest, 5)
    report = cases.report({"damper.stroke_stop": {"stroke": place, "stiffness": 600.0}}, duration=12.0)
    assert named(report) == ["damper.stroke_stop"]
    assert report["status"] == "explained"
    assert estimate(report, "damper.stroke_stop", "stroke") == pytest.approx(place, rel=0.02)


def test_without_a_motion_that_was_recorded_there_is_no_stop(cases: Cases) -> None:
    record = cases.record()
    data = residuals.prepare(lab_b(record), record)
    part = data.part.first(data.groups * data.group)
    part.present = np.zeros_like(part.present)
    bare = fitting.at(replace(data, part=part), {}, np.zeros(len(part.nuisances)))
    assert touched(bare.data, bare, data.catalogue["damper.stroke_stop"]) is None


def test_a_stop_that_is_met_lightly_begins_from_all_its_stiffnesses(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = cases.record()
    data = residuals.prepare(lab_b(record), record)
    bare, stop = (
        fitting.at(data, {}, np.zeros(len(data.part.nuisances))),
        data.catalogue["damper.stroke_stop"],
    )
    begun = list[float]()

    def at(*given: Any) -> fitting.Fit:
        begun.append(given[1][stop.name]["stiffness"])
        return fitting.Fit(given[0], given[1], given[2], np.zeros((data.groups, data.sigma.size)))

    monkeypatch.setattr(fitting, "at", at)
    monkeypatch.setattr(fitting, "fit", lambda *given, **_: at(*given[:3]))
    assert touched(data, bare, stop) is not None
    assert stop.contact is not None
    assert set(begun) == set(stop.contact.starts)


def test_the_best_start_of_each_law_goes_on() -> None:
    met = [
        contact.Begun({"damper.stroke_stop": {"stiffness": float(place)} | law}, np.zeros(1), left)
        for place, (law, left) in enumerate([({}, 3.0), ({}, 1.0), ({"law": 1.0}, 9.0), ({"law": 1.0}, 4.0)])
    ]
    assert contact.best_of_laws(met, "damper.stroke_stop") == [met[1], met[3]]


def test_pieces_of_a_test_grow_until_it_is_whole() -> None:
    pieces = contact.lengths(100, 1000)
    assert pieces[0] == 100
    assert all(after == int(1.3 * before) + 1 for before, after in pairwise(pieces))
    assert pieces[-1] < 1000 <= int(1.3 * pieces[-1]) + 1
    assert contact.lengths(1000, 1000) == []
