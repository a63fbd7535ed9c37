"""The records of a report: to JSON and back without loss, their schema as published, and what is refused."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from common.errors import InputError
from diagnosis.report import evidence, read, records, schema, values
from diagnosis.report.fields import Entry, fields, shapes
from tests.rths.diagnosis_report.reports import REPORTS, fresh

CLASSES = [
    item
    for module in (records, evidence, values)
    for item in vars(module).values()
    if isinstance(item, type) and issubclass(item, Entry) and item is not Entry
]


def test_the_published_schema_equals_that_of_the_records() -> None:
    assert schema.PUBLISHED.read_text(encoding="utf-8") == schema.text(), "run: python -m docs.generate"


@pytest.mark.parametrize("entry", CLASSES, ids=lambda entry: entry.__name__)
def test_every_field_of_a_report_has_a_description_and_is_immutable(entry: Any) -> None:
    assert entry.__dataclass_params__.frozen
    assert list(shapes(entry)) == [field.name for field in fields(entry)]
    assert all(field.metadata["text"] for field in fields(entry))


@pytest.mark.parametrize("name", REPORTS)
def test_a_report_is_the_same_after_json(name: str) -> None:
    given = fresh(name)
    found = read.report(given)
    text = json.dumps(found.plain(), allow_nan=False)
    assert read.report(json.loads(text)) == found
    for key in set(given) - {"details"}:  # of the evidence, what is absent is written as empty
        assert found.plain()[key] == given[key]
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator(schema.schema()).validate(json.loads(text))


WRONG: dict[str, tuple[tuple[Any, ...], Any, str]] = {
    "version": (("version",), 3, "version must be one of 1, 2, not 3"),
    "status": (("status",), "fine", "status must be one of no_gap,"),
    "unknown key": (("extra",), 1, "extra is unknown"),
    "key within": (("where", 0, "roof"), 1, "where[0].roof is unknown"),
    "site": (("where", 0, "site"), "roof", "where[0].site cannot be 'roof'"),
    "share": (("where", 0, "share"), 2.0, "where[0].share must lie from 0 to 1, not be 2.0"),
    "text": (("gap", "overall"), "much", "gap.overall must be a number, not 'much'"),
    "not a number": (("gap", "overall"), float("nan"), "gap.overall must be a number, not nan"),
    "truth": (("gap", "overall"), True, "gap.overall must be a number, not True"),
    "one end": (("where", 0, "share_interval"), [0.1], "where[0].share_interval must hold 2 values"),
    "alone": (("equivalent",), [["column.stiffness"]], "equivalent[0] must hold at least 2 values"),
    "no list": (("warnings",), "none", "warnings must be a list"),
    "no object": (("tolerances",), [], "tolerances must be an object"),
    "no entry": (("how_far",), None, "how_far must be an object"),
    "kind": (("details", "candidates", 0, "kind"), "magic", "kind must be one of physics, measurement"),
    "path": (("details", "paths", "sideways"), {}, "details.paths.sideways is unknown"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_report_is_refused_in_one_sentence(kind: str) -> None:
    where, value, words = WRONG[kind]
    report = fresh("explained")
    place: Any = report
    for key in where[:-1]:
        place = place[key]
    place[where[-1]] = value
    with pytest.raises(InputError, match=rf"^a\.json is no .*: .*{re.escape(words)}.*; write one with .*\.$"):
        read.report(report, "a.json")


def test_every_required_key_of_a_report_must_be_present() -> None:
    for key in set(fresh("explained")) - {"details", "verdict"}:
        report = fresh("explained")
        del report[key]
        with pytest.raises(InputError, match=f": {key} is missing;"):
            read.report(report)


def test_a_report_file_is_read_or_refused_in_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(json.dumps(fresh("explained")), encoding="utf-8")
    assert read.read(path) == read.report(fresh("explained"))
    for text in ("{", "[1, 2]", "\xff"):
        path.write_bytes(text.encode("latin-1"))
        with pytest.raises(InputError, match=r"a\.json .*\.$"):
            read.read(path)
    with pytest.raises(InputError, match=r"nowhere\.json cannot be read"):
        read.read(tmp_path / "nowhere.json")
