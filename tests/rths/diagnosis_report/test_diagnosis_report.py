"""The diagnosis report against its schema, on the terminal and as a page, complete and with missing pieces."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import html
import re
from typing import Any, cast

import pytest

from common.errors import InputError
from diagnosis.report.fields import Entry, shapes
from diagnosis.report.read import report as read
from diagnosis.report.records import Candidate, Tolerance
from diagnosis.report.schema import schema
from report.gap import pictures, wording
from report.gap.page import page
from report.gap.terminal import summary
from report.pictures import figure
from tests.rths.diagnosis_report.pieces import Report, bare
from tests.rths.diagnosis_report.reports import REPORTS, fresh
from tests.rths.pictures.axes import check_axes
from tests.rths.report.pages import Balanced, check_alone

SECTIONS = (
    "gap",
    "where",
    "which",
    "how-far",
    "paths",
    "tolerances",
    "equivalent",
    "not-exercised",
    "next",
    "warnings",
    "reading",
)


def text_of(html: str) -> str:
    return " ".join(" ".join(Balanced(html).words).split())


@functools.cache
def page_of(name: str) -> str:
    """The page of one of the reports, drawn once because that takes long."""
    return page(read(fresh(name)))


def validator() -> Any:
    return pytest.importorskip("jsonschema").Draft202012Validator(schema())


@pytest.mark.parametrize("name", REPORTS)
def test_reports_fit_the_schema(name: str) -> None:
    assert [error.message for error in validator().iter_errors(fresh(name))] == []


@pytest.mark.parametrize(
    "change",
    [
        {"version": 3},
        {"status": "fine"},
        {"where": [{"site": "roof"}]},
        {"equivalent": [["column.stiffness"]]},
        {"extra": 1},
        {"which": [{"effects": ["Damper"], "probability": 2.0, "parameters": {}, "held_out_score": 0}]},
        {"details": {"candidates": [{"effects": ["damper.gain"], "kind": "magic", "probability": 1.0}]}},
        {"details": {"paths": {"sideways": {}}}},
    ],
)
def test_the_schema_refuses_a_report_with_a_fault(change: Report) -> None:
    assert not validator().is_valid(fresh("explained") | change)


def test_the_schema_requires_every_specified_key() -> None:
    assert set(bare("no_gap")) == set(schema()["required"])
    assert {"verdict", "details", "parts", "found"} == set(schema()["properties"]) - set(schema()["required"])


@pytest.mark.parametrize("name", REPORTS)
def test_the_terminal_summary_fits_25_lines(name: str) -> None:
    lines = summary(read(fresh(name))).split("\n")
    assert len(lines) <= 25
    assert lines[0].startswith(wording.STATUS[name].upper())
    assert all(len(line) <= 125 for line in lines)


def test_the_terminal_summary_contains_the_main_findings() -> None:
    text = " ".join(summary(read(fresh("explained"))).split())
    for words in (
        "91 % (86 … 95 %)",
        "force 3.10 N (2.90 … 3.30)",
        "the gap falls from 3.4 % to 0.71 % (noise 0.61 %); closed 96 % (94 … 98 %)",
        "actuator.delay ×1.034 (z +1.7)",
        "cannot separate damper friction from table friction",
        "damper stroke stop",
        "3 of 20000 ticks",
    ):
        assert words in text
    assert "column.stiffness" not in text


def test_the_terminal_shows_as_many_warnings_as_go_whole_into_its_lines() -> None:
    short, long = "Few words.", "Many words that end with what to do. " * 9
    report = dataclasses.replace(read(fresh("no_gap")), warnings=(long, short))
    assert " ".join(f"{long} warning {short}".split()) in " ".join(summary(report).split())
    many = summary(dataclasses.replace(report, warnings=(long,) * 20)).split("\n")
    assert len(many) <= 25
    assert re.fullmatch(r" +1\d more in the report", many[-1])
    assert not [line for line in many if line.endswith("…")]
    cut = summary(dataclasses.replace(report, warnings=(long * 20, short, short))).split("\n")
    assert len(cut) == 25
    assert cut[-2].endswith("…")
    assert cut[-1].strip() == "2 more in the report"
    assert "warning" not in summary(dataclasses.replace(report, warnings=()))


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without pictures, which are the slow part."""
    monkeypatch.setattr(pictures, "svg", lambda _canvas: "<svg></svg>")


@pytest.mark.usefixtures("undrawn")
def test_the_force_path_is_shown_on_the_terminal_and_on_the_page() -> None:
    report = fresh("explained")
    assert "force path" not in summary(read(report))
    report["details"]["force_path"] = {
        "delay": 0.002013,
        "interval": [0.00198, 0.002046],
        "gain": 1.00033,
        "frequency": 1.96,
    }
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator(schema()).validate(report)
    words = "The measured force lags behind the planned specimen's by 2.01 ms (95 %: 1.98–2.05); amplitude +0.03 %."
    assert f"force path {words}" in " ".join(summary(read(report)).split())
    assert words in html.unescape(page(read(report)))


@pytest.mark.parametrize("name", REPORTS)
def test_the_diagnosis_page_loads_nothing_from_elsewhere(name: str) -> None:
    html = page_of(name)
    check_alone(html)
    assert re.findall(r'<section id="([^"]+)"', html) == list(SECTIONS)
    assert set(re.findall(r"https?://[^\s\"<]+", html)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }
    assert re.search(r"\bnan\b|\bNone\b", html) is None


def test_the_page_shows_every_picture_of_a_complete_report() -> None:
    html = page_of("explained")
    assert html.count("<figure") == 13
    assert (
        html.index("Physics effects") < html.index("damper.motor_lag") < html.index("Measurement artefacts")
    )
    assert html.index("Measurement artefacts") < html.index("sensor.damper_force.gain")
    for words in (
        "On the bound of its range: factor.",
        "Cannot be separated from table friction.",
        "8.3 nats worse",
    ):
        assert words in html


def test_pages_state_which_parts_are_absent() -> None:
    assert "No part leaves a residual above its noise" in page_of("no_gap")
    poor = text_of(page_of("not_enough_data"))
    for words in (
        "The gap could not be located",
        "No effect is named: the recording holds too few data",
        "How far the gap closes was not determined.",
        "its prediction is not in this report",
        "The paths' delays are not in this report.",
        "No nominal parameter was moved.",
    ):
        assert words in poor
    assert "An effect that the catalogue lacks" in page_of("unknown_effect")
    assert "is not in this report" in page(read(bare("unknown_effect")))
    report = fresh("unknown_effect")
    first = report["details"]["unknown"]
    report["details"]["unknowns"] = [first, {**first, "site": "table", "curve": None}]
    text = text_of(page(read(report)))
    assert "Effects that the catalogue lacks" in text
    assert all(f"At the {site} an effect acts" in text for site in (first["site"], "table"))


def texts_replaced(piece: Any, text: str) -> Any:
    """The piece with every text replaced except the values that the records enumerate."""
    if isinstance(piece, Entry):
        kinds = shapes(cast("Any", type(piece)))
        fields = {name: getattr(piece, name) for name, shape in kinds.items() if shape.kind != "choice"}
        changed = {name: texts_replaced(item, text) for name, item in fields.items()}
        return dataclasses.replace(cast("Any", piece), **changed)
    if isinstance(piece, dict):
        return {key: texts_replaced(value, text) for key, value in piece.items()}
    if isinstance(piece, tuple):
        return tuple(texts_replaced(value, text) for value in piece)
    return text if isinstance(piece, str) else piece


@pytest.mark.parametrize("name", ["explained", "unknown_effect"])
def test_no_text_of_a_report_becomes_markup(name: str) -> None:
    text = "<script>alert(1)</script>\"'><b> $\\frac{$ a & b -- >"
    report = texts_replaced(read(fresh(name)), text)
    report = dataclasses.replace(report, tolerances={text: Tolerance(factor=1.1, z=2.0)})
    html = page(report)
    assert text in re.sub(r"\s+", " ", text_of(html)) or "\n" in text
    assert "<script" not in html
    assert "<b>alert" not in html
    assert summary(report)


def pieces(piece: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths to every key below a report, series of numbers left out."""
    if isinstance(piece, dict):
        return [
            found for key, value in piece.items() for found in ((*path, key), *pieces(value, (*path, key)))
        ]
    if isinstance(piece, list) and piece and isinstance(piece[0], dict):
        return pieces(piece[0], (*path, 0))
    return []


def empty(report: Report, path: tuple[Any, ...]) -> bool:
    """Remove one piece of a report (null, an empty value, or no key); returns whether the schema allows that."""
    place: Any = report
    for key in path[:-1]:
        place = place[key]
    found = place.pop(path[-1])
    for change in ({}, {path[-1]: None}, {path[-1]: type(found)()}):
        place.pop(path[-1], None)
        place |= change
        with contextlib.suppress(InputError):
            read(report)
            return True
    return False


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("name", ["explained", "unknown_effect"])
def test_a_report_with_any_missing_piece_still_gives_a_page(name: str) -> None:
    first = pieces(fresh("explained")) if name != "explained" else []
    for path in pieces(fresh(name)):
        if path[-1] in ("site", "effects") or path in first:
            continue
        report = fresh(name)
        report["details"] = {key: value for key, value in report["details"].items() if key in path[:2]}
        if empty(report, path):
            text_of(page(read(report)))
            assert len(summary(read(report)).split("\n")) <= 25


def test_series_may_contain_gaps_and_differ_in_length() -> None:
    report = fresh("explained")
    part = report["details"]["parts"][0]
    part["windows"]["ratio"][3:9] = [None] * 6
    part["bands"]["noise"] = part["bands"]["noise"][:10]
    part["signals"][0]["nominal"] = part["signals"][0]["nominal"][:50]
    part["signals"][0]["measured"] = [None] * len(part["signals"][0]["t"])
    report["details"]["parts"][1]["amplitudes"]["ratio"] = [None] * 5
    drawn, whole = (text.count("<figure") for text in (page(read(report)), page_of("explained")))
    assert drawn == whole - 1  # the picture of the reading whose samples are all unknown


def test_a_report_in_which_nothing_was_determined_has_a_page() -> None:
    report = read(bare("not_enough_data"))
    text_of(page(report))
    assert "not determined" in summary(report)


def test_names_of_effects_and_sites_are_written_in_words() -> None:
    assert wording.effect("sensor.column_force.gain") == "gain of the column force sensor"
    assert wording.effect("damper.stroke_stop") == "damper stroke stop"
    assert wording.site("sensor.damper_force") == "damper force sensor"
    names = ("sensor.damper_force.gain", "damper.gain")
    given: dict[str, Any] = {"parameters": {}, "probability": 0.5, "held_out_score": 0.0}
    assert wording.kind(Candidate(effects=names[:1], **given)) == "measurement"
    assert wording.kind(Candidate(effects=names, **given)) == "physics"
    assert wording.equivalent(["a.x", "b.y", "c.z"]).startswith(
        "These signals cannot separate a x from b y or c z:"
    )


@pytest.mark.parametrize("status", wording.STATUS)
def test_a_report_without_a_verdict_gets_one_in_words(status: str) -> None:
    report = read(fresh("explained") | {"status": status, "verdict": ""})
    assert wording.verdict(report).endswith(".")
    assert "–" not in wording.verdict(report)


def seen(monkeypatch: Any) -> list[Any]:
    """The canvases of a page, as they are before they are saved."""
    found: list[Any] = []

    def laid_out(canvas: Any) -> str:
        figure.fit_labels(canvas)
        found.append(canvas)
        return "<svg></svg>"

    monkeypatch.setattr(pictures, "svg", laid_out)
    return found


def test_no_label_of_a_picture_is_cut_off_and_no_axis_shows_a_factor(monkeypatch: Any) -> None:
    canvases = seen(monkeypatch)
    report = fresh("explained")
    moved = Tolerance(factor=1.0, z=2.0)
    assert pictures.tolerance_moves([(f"a_long_table.a_rather_long_parameter_{i}", moved) for i in range(3)])
    relation = report["details"]["curves"][0]
    for axis in ("x", "y"):
        relation[axis]["label"] = "stroke, m"
    for key in ("measured", "before", "after"):
        relation[key] = [1e-5 * item for item in relation[key]]
    found = read(report)
    assert pictures.curve(found.details.curves[0])
    assert page(found)
    for canvas in canvases:
        canvas.draw_without_rendering()
        check_axes(canvas, str([axis.get_ylabel() for axis in canvas.axes]))
    assert "µm" in str([axis.get_ylabel() for axis in canvases[1].axes])


@pytest.mark.usefixtures("undrawn")
def test_an_effect_that_is_listed_twice_is_shown_once() -> None:
    report = fresh("explained")
    report["not_exercised"] = ["damper.stroke_stop", "damper.stroke_stop"]
    report["equivalent"] = [["damper.friction", "table.friction"], ["table.friction", "damper.friction"]]
    found = read(report)
    assert wording.sets(found) == [("damper.friction", "table.friction")]
    html = page(found)
    assert html.count("<li>damper stroke stop ") == 1
