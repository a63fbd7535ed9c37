"""Quantities, names and numbers of a report in words."""

from __future__ import annotations

import re
from typing import Any

import pytest

from diagnosis.findings.which import once
from diagnosis.report.read import report as read
from diagnosis.report.records import Candidate
from laboratories.effects import CATALOGUE
from report.gap import which, wording
from report.gap.terminal import summary
from report.text.formats import (
    axis_unit,
    nats,
    percent,
    percent_interval,
    probability,
    quantity,
    reading,
    signed,
    span,
    times,
)
from tests.rths.diagnosis_report.pieces import bare
from tests.rths.diagnosis_report.reports import fresh


def test_quantities_are_written_in_the_fields_units() -> None:
    assert quantity(0.0012, "m") == "1.20 mm"
    assert quantity(5.3e-6, "m") == "5.30 µm"
    assert quantity(18.75e6, "N/m") == "18.8 MN/m"
    assert quantity(1400.0, "N", [1350.0, 1450.0]) == "1.40 kN (1.35 … 1.45)"
    assert quantity(0.044, "s") == "44.0 ms"
    assert quantity(1.011, "–", [1.009, 1.013]) == "1.0110 (1.0090 … 1.0130)"
    assert quantity(4.7e-9, "m/N") == "4.70 nm/N"
    assert quantity(0.0, "s") == "0 s"
    assert quantity(3.0, "kg", [2.0, None]) == "3.00 kg (from 2.00)"
    assert quantity(None, "m") == "–"
    assert [percent(value) for value in (0.91, 0.034, 0.0012, 0.0, None)] == [
        "91 %",
        "3.4 %",
        "0.12 %",
        "0 %",
        "–",
    ]
    assert [probability(value) for value in (0.999, 0.5, 0.001, None)] == ["> 99 %", "50 %", "< 1 %", "–"]
    assert percent_interval([0.86, 0.95]) == "86 … 95 %"
    assert percent_interval([None, 0.95]) == ""
    assert [times(14.2), times(1.6), times(None)] == ["14×", "1.6×", "–"]
    assert span([2.1, 9.8], "s") == "2.1–9.8 s"


def candidate(*names: str) -> dict[str, Any]:
    values = {
        name: {
            one.name: {"value": 1.0, "interval": None, "unit": one.unit} for one in CATALOGUE[name].parameters
        }
        for name in names
    }
    return {"effects": list(names), "parameters": values, "probability": 0.5, "held_out_score": 0.0}


@pytest.mark.parametrize("others", [(), ("damper.friction",)])
def test_no_word_is_repeated_in_the_name_of_an_effect(others: tuple[str, ...]) -> None:
    explained = bare("explained")
    for name in CATALOGUE:
        report = read(explained | {"which": [candidate(name, *others)]})
        lines = summary(report).splitlines()
        first = next(place for place, line in enumerate(lines) if line.startswith("which"))
        last = next(place for place, line in enumerate(lines) if place > first and not line.startswith(" "))
        said = " ".join(" ".join(lines[first:last]).split())
        assert not re.search(r"\b([a-z]{2,})\W+\1\b", said), said
        assert all(wording.effect(each) in said for each in (name, *others))
        for setting, _value in which.parameters(report.which[0]).rows:
            assert not re.search(r"\b([a-z]{2,})\W+\1\b", setting), setting


def test_meaningless_digits_and_bounds_are_left_out() -> None:
    assert quantity(-1e-15, "s") == "0 s"
    assert quantity(3.0, "N", [None, None]) == "3.00 N"
    assert quantity(3.0, "N", [None, 4.0]) == "3.00 N (up to 4.00)"
    assert times(0.004) == "< 0.1×"
    assert span([0.0, 0.0], "Hz") == ""
    assert nats(134000.0) == "more than 1,000 nats"
    assert reading(-1e-9, "m") == "0.000 mm"
    assert [signed(value, 2) for value in (-0.001, 0.001, -0.02, 0.02)] == ["0.00", "0.00", "−0.02", "+0.02"]
    assert axis_unit("column displacement (m)", 2e-3) == (1e3, "column displacement (mm)")


def test_the_closed_share_of_a_gap_is_shown_as_at_most_100_percent() -> None:
    report = fresh("explained")
    report["how_far"] |= {"closed": 1.01, "closed_interval": [0.93, 1.09]}
    found = read(report)
    assert wording.closed(found) == "100 % (93 … 100 %)"
    assert "closes 100 % of it" in wording.cause(found)
    clean = fresh("no_gap")
    clean["how_far"] |= {"closed": 0.0, "closed_interval": [0.0, 0.0]}
    assert "closed" not in next(
        line for line in summary(read(clean)).split("\n") if line.startswith("how far")
    )


def test_the_law_of_an_effect_comes_first_on_the_terminal_and_is_not_cut_off() -> None:
    shapes = {f"shape_{place}": {"value": 1.0, "interval": [0.5, 1.5], "unit": ""} for place in range(20)}
    law = {"law": {"value": 13.0, "interval": None, "unit": ""}}
    found = candidate("column.yielding") | {"parameters": {"column.yielding": shapes | law}}
    report = read(bare("explained") | {"which": [found]})
    words = " ".join(summary(report).split())
    assert "column yielding: law Bouc and Wen that degrades and pinches, shape 0 1.00" in words


@pytest.mark.parametrize(("score", "words"), [(8.3, "8.3 nats worse"), (-8.3, "8.3 nats better")])
def test_a_score_is_said_to_be_worse_or_better_than_the_verdicts(score: float, words: str) -> None:
    item = Candidate(effects=("damper.gain",), probability=0.1, parameters={}, held_out_score=score)
    assert which.worth(item) == f"{words} than the verdict"


def test_of_candidates_with_the_same_effects_the_first_is_listed() -> None:
    given: dict[str, Any] = {"parameters": {}, "held_out_score": 0.0}
    first, other = ("column.slip", "column.yielding"), ("column.yielding", "column.slip")
    found = [Candidate(effects=names, probability=0.5, **given) for names in (first, first[:1], other)]
    assert once(found) == tuple(found[:2])
