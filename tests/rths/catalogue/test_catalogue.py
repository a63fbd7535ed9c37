"""The catalogue of recordings: its facts on each recording, its renewal, and its answers to queries."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.recording.reader import read
from report.catalogue import query, renewal, store
from report.catalogue.columns import BY_NAME, COLUMNS, DRIFT
from report.facts.summary import summarize
from tests import browser

Call = Callable[..., int]


@pytest.fixture(scope="module")
def folder(virtual_recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an intact recording, one of each defect, notes and a diagnosis report."""
    place = tmp_path_factory.mktemp("catalogue")
    (place / "deep").mkdir()
    shutil.copy(virtual_recording, place / "deep" / "whole.mcap")
    data = virtual_recording.read_bytes()
    (place / "cut.mcap").write_bytes(data[: len(data) // 2])
    middle = len(data) // 3
    (place / "damaged.mcap").write_bytes(data[:middle] + bytes(2000) + data[middle + 2000 :])
    (place / "text.mcap").write_text("no recording")
    (place / "deep" / "whole.mcap.notes.toml").write_text('tags = ["first", "slow"]\nnotes = "50 % of it"\n')
    report = {"status": "no_gap", "verdict": "There is no gap.", "details": {"test": {"file": "whole.mcap"}}}
    (place / "report.json").write_text(json.dumps(report))
    (place / "other.json").write_text("[1, 2]")
    return place


@pytest.fixture
def base(folder: Path) -> Iterator[sqlite3.Connection]:
    """The catalogue of the folder."""
    renewal.renew([folder])
    with store.opened(folder / store.NAME) as opened:
        yield opened


def test_each_recording_has_its_state(base: sqlite3.Connection) -> None:
    states = {facts["file"]: facts["state"] for facts in store.facts_of(base)}
    expected = {"cut.mcap": "cut off", "damaged.mcap": "damaged", "text.mcap": "unreadable"}
    assert states == expected | {os.path.join("deep", "whole.mcap"): "whole"}  # noqa: PTH118 - a name


def test_facts_and_peaks_equal_those_of_inspect(base: sqlite3.Connection, virtual_recording: Path) -> None:
    summary = summarize(read(virtual_recording))
    facts = next(one for one in store.facts_of(base) if one["state"] == "whole")
    assert (facts["test"], facts["outcome"], facts["clock"]) == (summary["test"], "completed", "virtual")
    assert (facts["ticks"], facts["missing"], facts["late"]) == (2000, 0, 0)
    assert (facts["diagnosis"], facts["tags"], facts["notes"]) == ("no_gap", "first slow", "50 % of it")
    assert facts["motion"] == "El Centro 1940 NS"
    peaks = {f"{one.topic}/{one.name}": (one.value, one.unit) for one in store.peaks_of(base, facts["file"])}
    drift = summary["storeys"][0]["drift"]
    assert peaks.pop(f"master/{DRIFT}") == (drift["peak"], drift["unit"])
    assert peaks == {name: (one["peak"], one["unit"]) for name, one in summary["peaks"].items()}


def test_peaks_that_are_not_in_the_metadata_are_taken_from_the_messages(
    base: sqlite3.Connection, folder: Path
) -> None:
    run = read(folder / "cut.mcap")
    largest = store.largest(base, "column_force")
    assert largest["cut.mcap"].value == abs(run.columns["master"]["column_force"]).max()


def test_only_changed_recordings_are_read_again(folder: Path, tmp_path: Path) -> None:
    place = shutil.copytree(folder, tmp_path / "copy")
    (place / store.NAME).unlink(missing_ok=True)
    assert renewal.renew([place]) == (4, 4, 0, 3)
    assert renewal.renew([place]) == (4, 0, 0, 3)
    (place / "cut.mcap").unlink()
    (place / "text.mcap.notes.toml").write_text("tags = 3")
    assert renewal.renew([place]) == (3, 1, 1, 2)
    with store.opened(place / store.NAME) as base:
        (facts,) = store.facts_of(base, "file = 'text.mcap'")
    assert "must hold `notes`" in facts["notes"]


def test_an_interrupted_renewal_does_not_change_the_catalogue(folder: Path, tmp_path: Path) -> None:
    place = shutil.copytree(folder, tmp_path / "copy")
    renewal.renew([place])
    shutil.copy(place / "cut.mcap", place / "more.mcap")

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        renewal.renew([place], interrupted)
    with store.opened(place / store.NAME) as base:
        assert len(store.facts_of(base)) == 4


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("peak drift > 5 mm", []),
        ("peak drift > 1 mm and outcome = COMPLETED", ["whole"]),
        ("peak column_force >= 1 kN and not state = damaged", ["whole", "cut"]),
        ('notes ~ "50 %" or state = unreadable', ["whole", "text"]),
        ("not (state = whole or state = damaged)", ["cut", "text"]),
        ("started > 2020-01-01 and tags ~ slow", ["whole"]),
        ("notes ~ 0_%", []),
        ("duration <= 4 s and size > 1", ["whole", "cut", "damaged"]),
        ("scale != 0.5 and late < 1", ["whole"]),
    ],
)
def test_a_condition_finds_the_matching_recordings(
    base: sqlite3.Connection, text: str, found: list[str]
) -> None:
    condition = query.parsed(text, base)
    names = {Path(facts["file"]).stem for facts in store.facts_of(base, condition.sql, condition.values)}
    assert names == set(found)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("peak drft > 5 mm", "No recording of the catalogue has a signal 'drft': did you mean drift?"),
        ("peak drift > 5 kN", "peak drift is in kN, which does not fit"),
        ("scale > 5 mm", "scale is in mm, which does not fit: give it without a unit."),
        ("scal > 5", "The catalogue has no column 'scal': did you mean scale?"),
        ("scale >", "A value is missing behind scale"),
        ("scale 5", "'5' behind scale is no operator: use one of = != < <= > >= ~."),
        ("scale ~ 5", "scale is a number, in which no text can be sought"),
        ("(scale > 5", "The condition ends where a closing bracket should stand"),
        ("scale > 5) or", "The condition ends before ')': join conditions by 'and' or 'or'."),
        ("scale > 5 and", "The condition ends where a column should stand"),
        ("scale > ;", "scale must be a number, or one with its unit, not ';'."),
        ('test = "a', "The condition cannot be read from"),
    ],
)
def test_wrong_conditions_get_one_sentence(
    call: Call, capsys: Any, folder: Path, base: sqlite3.Connection, text: str, said: str
) -> None:
    assert call("catalog", "find", text, "--in", folder) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@given(st.text(max_size=30), st.sampled_from([one.name for one in COLUMNS if one.unit is None]))
def test_a_text_in_a_condition_is_never_taken_for_sql(text: str, name: str) -> None:
    condition = query.of_text(BY_NAME[name], "~", text)
    memory = sqlite3.connect(":memory:")
    memory.execute(f"CREATE TABLE recordings ({name} TEXT)")
    memory.execute("INSERT INTO recordings VALUES (?)", (f"before {text} behind",))
    where = f"SELECT count(*) FROM recordings WHERE {condition.sql}"
    assert memory.execute(where, condition.values).fetchone() == (1,)
    memory.close()


def test_the_command_catalogues_finds_and_shows_recordings(call: Call, capsys: Any, folder: Path) -> None:
    assert call("catalog", folder, "--json") == 0
    assert json.loads(capsys.readouterr().out)["recordings"] == 4
    assert call("catalog", "find", "peak drift > 1 mm and state = whole", "--in", folder) == 0
    head, row, count = capsys.readouterr().out.splitlines()
    assert head.split()[-3:] == ["state", "peak", "drift"]
    assert row.split()[-3] == "whole"
    assert count == "1 recording"
    assert call("catalog", "show", "whole.mcap", "--in", folder) == 0
    shown = capsys.readouterr().out
    assert "verdict   There is no gap." in shown
    assert "master/column_force" in shown
    assert call("catalog", "show", "nothing.mcap", "--in", folder) == 2
    assert "has no recording named nothing.mcap" in capsys.readouterr().err


def test_notes_are_kept_beside_the_recording(call: Call, capsys: Any, folder: Path, tmp_path: Path) -> None:
    place = shutil.copytree(folder, tmp_path / "copy")
    file = place / "deep" / "whole.mcap"
    assert call("catalog", "note", file, "again", "--tag", "slow", "--tag", "late") == 0
    assert call("catalog", place) == 0
    assert call("catalog", "show", "whole.mcap", "--in", place, "--json") == 0
    shown = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert shown["notes"] == "50 % of it\nagain"
    assert shown["tags"] == "first slow late"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("nowhere",), "There is no folder nowhere"),
        (("find", "late > 1", "--in", "nowhere"), "There is no catalogue"),
        (("find", "late", ">", "1"), "takes one condition in quotes"),
        (("note", "nowhere.mcap", "text"), "There is no recording nowhere.mcap"),
        (("note",), "takes a recording and a text"),
        (("show", "--tag", "a"), "--tag belongs to"),
    ],
)
def test_wrong_arguments_get_one_sentence(call: Call, capsys: Any, words: tuple[str, ...], said: str) -> None:
    assert call("catalog", *words) == 2
    assert said in capsys.readouterr().err


def test_a_file_that_is_not_a_catalogue_is_refused_in_one_sentence(
    call: Call, capsys: Any, tmp_path: Path
) -> None:
    (tmp_path / store.NAME).write_text("something else that is longer than a head of SQLite" * 30)
    assert call("catalog", "show", "--in", tmp_path) == 2
    assert "Cannot use the catalogue" in capsys.readouterr().err


def test_a_folder_that_may_not_be_written_is_named_with_the_remedy(
    call: Call, capsys: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / store.NAME).mkdir()  # which SQLite cannot open, whoever runs the tests
    monkeypatch.setattr("report.catalogue.store.os.access", lambda *_: False)
    assert call("catalog", tmp_path) == 2
    err = capsys.readouterr().err
    assert "you may not write there; name a folder of your own first" in err
    assert "delete it" not in err


@pytest.mark.slow
def test_the_page_of_the_catalogue_sorts_and_filters(call: Call, folder: Path, tmp_path: Path) -> None:
    if browser.chromium() is None:
        pytest.skip("there is no Chromium on this machine")
    path = tmp_path / "tests.html"
    assert call("catalog", folder, "--html", path) == 0
    first = "row => row.cells[0].firstChild.textContent.trim()"
    names = f"() => [...document.querySelectorAll('tbody tr:not([hidden])')].map({first})"
    for width in (1280, 390):
        with browser.open_page(path.as_uri(), width) as page:
            assert page.evaluate("() => document.documentElement.scrollWidth") <= width
            page.evaluate("() => document.querySelector('th button').click()")
            assert page.evaluate(names) == ["cut.mcap", "damaged.mcap", "deep/whole.mcap", "text.mcap"]
            page.evaluate("() => document.querySelector('th button').click()")
            assert page.evaluate(names)[0] == "text.mcap"
            page.evaluate("() => { words.value = 'slow completed'; words.dispatchEvent(new Event('input')) }")
            assert page.evaluate(names) == ["deep/whole.mcap"]
            assert page.evaluate("() => count.textContent") == "1 of 4 recordings"
            assert page.errors == []
