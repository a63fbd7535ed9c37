"""Several recordings are compared side by side in tables, on a page, and as histories for other programs."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyarrow import parquet

from common.plan.plan import Plan
from common.plan.read import with_test
from common.reality.reality import as_planned
from common.recording.reader import read
from report.several import choice, runs
from report.several import page as several_page
from report.text.terminal import TitledTable
from simulation import virtual
from tests.rths.report.pages import check_in_browser


@pytest.fixture(scope="module")
def three(virtual_recording: Path, short_plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Three recordings: the short test at two scales, and a shorter one."""
    folder = tmp_path_factory.mktemp("three")
    found = [virtual_recording]
    for name, scale, duration in (("strong", 0.2, 2.0), ("brief", 0.1, 1.0)):
        plan = with_test(short_plan, scale=scale, duration=duration)
        path = folder / f"{name}.mcap"
        assert virtual.run(virtual.assemble(plan, as_planned(plan), path), str) is None
        found.append(path)
    return found


def test_the_compared_figures_equal_those_of_each_recording(
    call: Any, capsys: Any, three: list[Path]
) -> None:
    assert call("compare", *three, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert [one["recording"] for one in found] == ["short", "strong", "brief"]
    for path, one in zip(three, found, strict=True):
        columns = read(path).columns["master"]
        assert one["peaks"]["column_force"] == np.abs(columns["column_force"]).max()
        assert one["peaks"]["drift"] == np.abs(columns["displacement"]).max()
    assert found[0]["nrmse"]["drift"] == 0.0
    assert found[1]["nrmse"]["drift"] == pytest.approx(1.0, abs=0.02)  # twice the motion
    assert found[2]["nrmse"]["drift"] < 0.02  # the same motion but for the sensors' noise
    assert found[1]["plan"]["ground_motion.scale"] == "0.2"


def test_tables_have_the_units_and_keys_asked_for(call: Any, capsys: Any, three: list[Path]) -> None:
    assert call("compare", *three, "--signals", "drift:mm,column_force:kN") == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["recording", "outcome", "motion", "scale", "drift", "column_force"] in lines
    drift = np.abs(read(three[0]).columns["master"]["displacement"]).max() * 1e3
    assert next(line for line in lines if line[:1] == ["short"])[-4:-2] == [f"{drift:.4g}", "mm"]
    assert ["ground_motion.scale", "default", "0.2", "default"] in lines


def test_histories_are_written_for_other_programs(call: Any, three: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "all.parquet"
    assert call("compare", *three, "--signals", "column_force:kN", "-o", out) == 0
    table = parquet.read_table(out)
    assert table.schema.field("column_force").metadata == {b"unit": b"kN"}
    names, force = table["recording"].to_pylist(), table["column_force"].to_numpy()
    expected = read(three[1]).columns["master"]["column_force"]
    assert force[[name == "strong" for name in names]] == pytest.approx(expected / 1e3, rel=1e-12)


@pytest.mark.slow
def test_the_page_fits_screens_phones_and_paper(call: Any, three: list[Path], tmp_path: Path) -> None:
    page = tmp_path / "all.html"
    assert call("compare", *three, "--html", page) == 0
    check_in_browser(page, tmp_path)


CHOOSE = """() => {
  document.querySelector('#choice summary').click();
  const rows = [...document.querySelectorAll('.choices div')];
  rows.find(one => one.textContent.startsWith(' ground acceleration')).querySelector('input').focus();
}"""
SHOWN = "() => [...document.querySelectorAll('#chosen svg')].map(one => one.getAttribute('aria-label'))"
PEAKS = """() => [...document.querySelectorAll('#legend tbody tr')]
  .map(one => [...one.cells].map(cell => cell.textContent))"""


@pytest.mark.slow
def test_signals_and_units_are_chosen_on_the_page_with_the_keyboard(
    call: Any, three: list[Path], tmp_path: Path
) -> None:
    browser = pytest.importorskip("tests.browser", reason="the playwright package is not installed")
    if browser.chromium() is None:
        pytest.skip("there is no Chromium on this machine")
    out = tmp_path / "all.html"
    assert call("compare", *three, "--signals", "drift:mm", "--html", out) == 0
    with browser.open_page(out.resolve().as_uri(), 390) as page:
        (drift,) = page.evaluate(SHOWN)
        assert drift.startswith("drift of all recordings in mm, from ")
        page.evaluate(CHOOSE)
        for key in (" ", "Tab", "g"):  # check the box, go to its unit, and choose g
            page._page.keyboard.press(key)
        page.wait(
            "document.querySelectorAll('#chosen svg')[1]?.getAttribute('aria-label').includes(' in g, ')"
        )
        assert [text.split(" of ")[0] for text in page.evaluate(SHOWN)] == ["drift", "ground acceleration"]
        rows = page.evaluate(PEAKS)
        whole, _, inner = page.evaluate("() => [document.documentElement.scrollWidth, 0, window.innerWidth]")
        assert page.errors == []
        assert whole <= inner
        assert page.evaluate("() => document.getElementById('words').textContent") == (
            "--signals drift:mm,ground_acceleration:g"
        )
    for path, (name, *cells) in zip(three, rows, strict=True):
        of = read(path).columns["master"]
        assert name == path.stem
        assert float(cells[0]) == pytest.approx(1e3 * np.abs(of["displacement"]).max(), rel=1e-3)
        assert float(cells[1]) == pytest.approx(np.abs(of["ground_acceleration"]).max() / 9.80665, rel=1e-3)


def test_the_thinned_histories_of_a_page_keep_every_peak() -> None:
    time = np.arange(1000) * 0.002
    values = np.sin(7.0 * time)
    values[437] = 3.0
    found = choice.extremes(time, values, float(time[-1]), 40)
    assert found.shape == (40, 2)
    assert np.nanmax(found) == 3.0
    assert np.nanargmax(found[:, 1]) == int(437 / 999 * 40)
    assert np.nanmin(found) == values.min()


def test_signals_that_a_recording_lacks_leave_their_columns_empty() -> None:
    values = np.array([0.5, np.nan, -1.0, np.nan])
    found = choice.extremes(np.arange(4.0), values, 8.0, 8)
    assert np.flatnonzero(np.isfinite(found[:, 0])).tolist() == [0, 2]
    whole = np.frombuffer(base64.b64decode(choice.packed(found, 1.0)), "<i2").reshape(8, 2)
    assert whole[2].tolist() == [-choice.FULL, -choice.FULL]
    assert whole[1].tolist() == [choice.NONE, choice.NONE]


def test_the_size_of_a_pages_histories_is_bounded_for_any_number_of_them(three: list[Path]) -> None:
    found = runs.several(three)[:1] * runs.MOST
    offered = choice.offered(found, runs.chosen(found, []))
    held = sum(len(one) for signal in offered["signals"] for one in signal["histories"])
    assert choice.BUDGET < held < 4 / 3 * choice.BUDGET * 1.01
    assert len(offered["signals"][0]["histories"]) == runs.MOST
    alone = choice.offered(found[:1], runs.chosen(found, []))
    assert alone["columns"] == choice.COLUMNS
    assert next(one for one in alone["signals"] if one["name"] == "drift")["units"] == {
        "m": 1.0,
        "cm": 1e-2,
        "mm": 1e-3,
        "µm": 1e-6,
        "in": 0.0254,
    }


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--signals", "drft"), "No recording has a signal 'drft': did you mean drift?"),
        (("--signals", "drift:kN"), "--signals drift is in kN, which does not fit"),
        (("-o", "all.mat"), "Cannot write all.mat: give a file that ends in .csv or .parquet."),
        (("--tolerance", "0.1"), "--tolerance is of two recordings"),
        (("--html", "a.csv", "-o", "a.csv"), "--html and -o name one file"),
        (("nowhere.mcap",), "Cannot read the recording nowhere.mcap"),
    ],
)
def test_wrong_arguments_get_one_sentence(
    call: Any, capsys: Any, three: list[Path], words: tuple[str, ...], said: str
) -> None:
    assert call("compare", *three, *words) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert said in error


def test_a_repeated_recording_and_more_than_fifty_are_refused(
    call: Any, capsys: Any, three: list[Path]
) -> None:
    assert call("compare", *three, three[0]) == 2
    assert "given twice" in capsys.readouterr().err
    assert call("compare", *(f"{number}.mcap" for number in range(runs.MOST + 1))) == 2
    assert "at most 50" in capsys.readouterr().err


def test_files_of_the_same_name_are_distinguished_by_their_folders() -> None:
    assert runs.labelled([Path("a/x.mcap"), Path("b/x.mcap")]) == ["a/x", "b/x"]
    assert runs.labelled([Path("a/x.mcap"), Path("b/y.mcap")]) == ["x", "y"]


def test_rows_of_a_split_table_repeat_their_names() -> None:
    head = ["recording", "system", *"abcdefg"]
    rows = [
        [recording, system, *"1234567"] for recording in ("one", "two") for system in ("actuator", "table")
    ]
    first, second = several_page.split(TitledTable("Tracking", head, rows))
    assert first.head == head[:7]
    assert second.head == ["recording", "system", "f", "g"]
    assert second.rows[1] == ["one", "table", "6", "7"]
    assert (first.title, second.title) == ("Tracking", "")
