"""The report as a whole: its schema, its sums, its independence of file names, and its repeatability."""

from __future__ import annotations

import json
import math
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from diagnosis.findings import which
from diagnosis.report import read
from diagnosis.report.schema import schema
from report.gap import page
from rths.examine.diagnose import diagnose_file
from tests.diagnosis.cases import STRONGEST, Cases, Effects

KINDS: dict[str, Effects] = {
    "clean": {},
    "one": {"column.friction": {"force": 900.0}},
    "two": {"column.friction": {"force": 900.0}, "damper.friction": {"force": 3.0}},
    "tied": {"column.stiffness": {"factor": 1.1}},
    "link": {"link.delay": {"delay": 0.004}},
    "reading": {"sensor.damper_force.quantization": {"step": 2.0}},
}
SECONDS = {"link": 8.0, "reading": 8.0}


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Cases:
    """Recordings with known secrets, made on demand, no longer than the strongest motion."""
    return Cases(tmp_path_factory, STRONGEST)


def report_of(cases: Cases, kind: str) -> dict[str, Any]:
    """The report on a case of this kind."""
    return cases.report(KINDS[kind], duration=SECONDS.get(kind))


def numbers(value: Any) -> Iterator[float]:
    """All floats within plain values."""
    if isinstance(value, dict):
        for item in value.values():
            yield from numbers(item)
    elif isinstance(value, list):
        for item in value:
            yield from numbers(item)
    elif isinstance(value, float):
        yield value
    else:
        assert value is None or type(value) in (int, str, bool), type(value)


@pytest.mark.long
@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.slow) if kind == "two" else kind for kind in KINDS]
)
def test_a_report_fits_its_schema_adds_up_and_gives_a_page(cases: Cases, kind: str) -> None:
    report = report_of(cases, kind)
    assert report["version"] == 2
    assert all(noise["unit"] for part in report["parts"] for noise in part["noise_model"].values())
    keeps_to_its_schema(report)
    adds_up(report)
    if kind == "two":  # pictures take long, and are those of any report
        shows_on_a_page(report)


def keeps_to_its_schema(report: dict[str, Any]) -> None:
    """Asserts that a report holds plain values without NaN and fits the published schema."""
    jsonschema = pytest.importorskip("jsonschema")
    text = json.dumps(report, allow_nan=False)
    assert json.loads(text) == report
    jsonschema.Draft202012Validator(schema()).validate(json.loads(text))
    assert all(map(math.isfinite, numbers(report)))


def adds_up(report: dict[str, Any]) -> None:
    """Asserts that shares sum to one and that probabilities are sorted and at most one."""
    shares = [entry["share"] for entry in report["where"]]
    assert shares == sorted(shares, reverse=True)
    assert sum(shares) == pytest.approx(1.0 if shares else 0.0)
    sites = [entry["site"] for entry in report["where"]]
    assert len(set(sites)) == len(sites)
    others = [entry["probability"] for entry in report["which"][1:]]
    assert others == sorted(others, reverse=True)
    assert report["which"][0]["probability"] >= max(others, default=0.0)
    assert sum(others) + report["which"][0]["probability"] <= 1.0 + 1e-9
    for entry in report["which"]:
        assert set(entry["effects"]) == set(entry["parameters"])
    assert report["which"][0]["held_out_score"] == 0.0


def shows_on_a_page(report: dict[str, Any]) -> None:
    """Asserts that a report gives one page that loads nothing and is the same every time."""
    text = page.page(read.report(report))
    assert page.page(read.report(json.loads(json.dumps(report)))) == text
    assert text.startswith("<!doctype html>")
    assert text.rstrip().endswith("</html>")
    assert not re.search(r"\bnan\b", re.sub(r"base64,[^\"']*", "", text).lower())
    assert not any(word in text for word in ('src="http', 'href="http', "@import", "<script src"))


@pytest.mark.long
def test_a_report_depends_on_the_recording_and_not_on_the_name_of_its_file(
    cases: Cases, tmp_path: Path
) -> None:
    original, report = cases.file(KINDS["one"]), report_of(cases, "one")
    renamed = tmp_path / "sensor.damper_force.gain-seed-77.mcap"
    shutil.copyfile(original, renamed)
    again = diagnose_file(renamed).plain()
    assert again["details"]["test"].pop("file") == renamed.name
    assert report["details"]["test"]["file"] == original.name
    less = json.loads(json.dumps(report))
    less["details"]["test"].pop("file")
    assert json.dumps(again) == json.dumps(less)  # to the last byte, and the same in a second run
    shown = re.sub(r"base64,[^\"']*", "", page.page(read.report(report))).replace(original.name, "")
    for text in (json.dumps(less), shown):
        assert str(cases.folder) not in text
        assert str(original) not in text
        assert "reality" not in text.lower()
        assert "seed" not in text.lower()


@pytest.mark.long
def test_a_report_does_not_depend_on_earlier_diagnoses(cases: Cases) -> None:
    first = diagnose_file(cases.file(KINDS["reading"], duration=8.0)).plain()
    diagnose_file(cases.file(KINDS["link"], duration=8.0))
    assert diagnose_file(cases.file(KINDS["reading"], duration=8.0)).plain() == first


def test_effects_that_could_not_have_appeared_are_listed_and_not_blamed(cases: Cases) -> None:
    report = report_of(cases, "one")
    assert not set(report["not_exercised"]) & set(report["which"][0]["effects"])
    assert len(set(report["not_exercised"])) == len(report["not_exercised"])


def test_an_alternative_that_explains_nothing_is_not_listed() -> None:
    data = SimpleNamespace(catalogue={})
    rivals = [
        SimpleNamespace(names=(name,), cost=cost, values={}, data=data)
        for name, cost in (("actuator.delay", 99.9), ("actuator.gain", 60.0))
    ]
    bare = SimpleNamespace(cost=100.0)
    verdict = SimpleNamespace(
        effects=("actuator.time_constant",),
        probability=0.9,
        others=[(rival, 0.05) for rival in rivals],
        search=SimpleNamespace(commissioned=bare, chosen=SimpleNamespace(cost=20.0)),
    )
    found = which.alternatives(verdict, ["actuator.time_constant"], {}, 0.9)  # type: ignore[arg-type]
    assert [item.effects for item in found] == [("actuator.gain",)]
