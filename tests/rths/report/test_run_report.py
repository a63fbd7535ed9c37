"""`rths report` gives the figures of `rths inspect` in a page that loads nothing, for any recording."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan.read import from_tables
from common.reality import reality
from common.recording.reader import read
from common.recording.run import Run
from common.terminal.telling import untold
from diagnosis.report.read import report as read_report
from report.facts.summary import summarize
from report.gap.page import page as diagnosis_page
from report.page import numeric
from report.pictures import PICTURES
from report.run import drawing, verdict
from report.run.page import page
from report.text.formats import reading
from simulation import virtual
from tests.rths.diagnosis_report.reports import fresh
from tests.rths.report.pages import check_alone, check_in_browser

HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)> & {{ 7 * 7 }}"


@pytest.fixture(scope="module")
def reported(virtual_recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the short test."""
    path = tmp_path_factory.mktemp("reports") / "short.html"
    run = read(virtual_recording)
    path.write_text(page(run, summarize(run), *drawing.draw_all(run, untold)), encoding="utf-8")
    return path


def undrawn(run: Run) -> str:
    """A page without pictures, which are the slow part."""
    return page(run, summarize(run), {}, {})


def test_the_command_writes_a_page_beside_the_recording(
    call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path, monkeypatch: Any
) -> None:
    some = {name: PICTURES[name] for name in ("tracking", "latency")}  # pictures take long
    monkeypatch.setattr(drawing, "PICTURES", some)
    recording = Path(shutil.copy(virtual_recording, tmp_path))
    assert call("report", recording, "--json") == 0
    said = json.loads(capsys.readouterr().out)
    assert said["page"] == str(recording.with_suffix(".html"))
    assert (said["pictures"], list(said["left_out"])) == (["tracking"], ["latency"])
    made = Path(said["page"]).read_text(encoding="utf-8")
    run = read(virtual_recording)
    assert made == page(
        run, summarize(run), *drawing.draw_all(run, untold)
    )  # the same recording, the same bytes
    assert all(sentence in check_alone(made).text for sentence in said["verdict"])
    assert str(tmp_path) not in made


def test_the_report_page_has_the_figures_of_inspect(
    call: Any, capsys: Any, virtual_recording: Path, reported: Path
) -> None:
    assert call("inspect", virtual_recording, "--json") == 0
    summary = json.loads(capsys.readouterr().out)
    text = check_alone(reported.read_text(encoding="utf-8")).text.replace(" ", "")
    for name, facts in summary["peaks"].items():
        assert f"{name}{reading(facts['peak'], facts['unit'])}{facts['t']:.3f}s".replace(" ", "") in text
    for topic, facts in summary["topics"].items():
        assert f"{topic}{summary['ticks_expected']}{facts['recorded']}{facts['missing']}" in text
    for part, facts in summary["tracking"].items():
        assert f"{part}{facts['delay'] * 1e3:.2f}ms{facts['correlation_delay'] * 1e3:.2f}ms" in text
        assert f"{facts['nrmse']:.4f}{facts['peak_error']:.4f}" in text
    force = summary["force_path"]
    assert f"{force['gain']:.4f}{force['frequency']:.2f}Hz" in text
    assert f"plannedspecimen'sby{abs(force['delay']) * 1e3:.2f}ms" in text
    for segment, facts in summary["latency"].items():
        assert segment + "".join(f"{value * 1e6:.0f}" for value in facts.values()) in text
    for name, counts in summary["exchange"].items():
        account = "".join(str(counts[key]) for key in ("sent", "used", "rejected", "lost"))
        assert name.replace("/", ",") + account in text
    assert f"{abs(summary['error_energy']) * 100:.2f}%oftheenergy" in text
    for event in summary["events"]:
        assert event["text"].replace(" ", "") in text


def test_the_report_page_shows_every_picture_with_its_text(reported: Path) -> None:
    made = reported.read_text(encoding="utf-8")
    text = check_alone(made).text
    drawn = [picture for picture in PICTURES.values() if picture.text in text]
    assert len(drawn) == made.count("<img ") >= 4
    for name in re.findall(r'href="#([^"]+)"', made):
        assert made.count(f'<section id="{name}">') == 1
    assert "[ground_motion]" in text  # the plan


@pytest.mark.slow
def test_the_report_page_is_drawn_in_a_browser(reported: Path, tmp_path: Path) -> None:
    check_in_browser(reported, tmp_path)


@pytest.mark.slow
def test_a_diagnosis_page_is_drawn_in_a_browser(tmp_path: Path) -> None:
    path = tmp_path / "gap.html"
    path.write_text(diagnosis_page(read_report(fresh("explained"))), encoding="utf-8")
    check_in_browser(path, tmp_path)


def test_no_text_of_a_recording_becomes_markup(virtual_recording: Path, tmp_path: Path) -> None:
    run = read(virtual_recording)
    run.test = HOSTILE
    run.path = run.path.with_name(f"{HOSTILE.replace('/', '')}.mcap")
    run.events = [event | {"text": HOSTILE, "lab": HOSTILE, "level": HOSTILE} for event in run.events]
    for name in ("summary", "host", "versions", "ground_motion"):
        run.metadata[name] = dict.fromkeys([*run.metadata[name], "more"], HOSTILE)
    run.metadata[HOSTILE] = {HOSTILE: HOSTILE}
    run.metadata["real_time"] = {f"master.{HOSTILE}": HOSTILE}
    run.damage = HOSTILE
    made = undrawn(run)
    found = check_alone(made)
    assert "img" not in found.tags
    assert found.text.count(HOSTILE) > 20
    assert "<script" not in made
    assert "49" not in re.sub(r"\d[\d.,]*\d", "", found.text)


def test_the_page_of_a_recording_that_was_cut_off_states_this_first(
    call: Any, virtual_recording: Path, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.setattr(drawing, "PICTURES", {"tracking": PICTURES["tracking"]})
    data = virtual_recording.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) * 6 // 10])
    assert call("report", cut) == 0
    text = check_alone(cut.with_suffix(".html").read_text(encoding="utf-8")).text
    ticks = read(cut).ticks("master")
    assert 0 < ticks < 2000
    assert text.index("This recording was cut off before its end") < text.index("Verdict")
    assert "rths recover cut.mcap makes a finished recording of it" in text
    assert f"Of the 2000 ticks planned it holds {ticks} of the master" in text
    assert "The recording does not say how the test ended." in text


def test_the_page_of_a_damaged_recording_states_this_first(virtual_recording: Path, tmp_path: Path) -> None:
    data = bytearray(virtual_recording.read_bytes())
    data[data.index(b"\x28\xb5\x2f\xfd", len(data) // 2) + 9] ^= 0xFF  # within a compressed chunk
    (tmp_path / "damaged.mcap").write_bytes(data)
    run = read(tmp_path / "damaged.mcap")
    assert run.damage
    text = check_alone(undrawn(run)).text
    assert text.index(f"This recording is damaged {run.damage}") < text.index("Verdict")
    assert "rths recover damaged.mcap saves the intact data behind it" in text


def test_imported_data_with_few_signals_give_a_page(call: Any, capsys: Any, tmp_path: Path) -> None:
    t = np.arange(500) * 2e-3
    rows = "\n".join(f"{at},{value}" for at, value in zip(t, 0.01 * np.sin(9.0 * t), strict=True))
    (tmp_path / "rig.csv").write_text(f"time,y\n{rows}\n")
    (tmp_path / "plan.toml").write_text("")
    (tmp_path / "map.toml").write_text(
        'plan = "plan.toml"\ntime = "time"\n[signals]\ndamper_stroke = { column = "y" }\n'
    )
    recording = tmp_path / "rig.mcap"
    assert call("import", tmp_path / "rig.csv", "--map", tmp_path / "map.toml", "-o", recording) == 0
    capsys.readouterr()
    assert call("report", recording, "--json", "-o", tmp_path / "rig.html") == 0
    said = json.loads(capsys.readouterr().out)
    assert said["pictures"] == ["histories"]
    assert said["verdict"][0] == "The data were imported, not recorded by a test."
    text = check_alone((tmp_path / "rig.html").read_text(encoding="utf-8")).text
    assert f"hysteresis (needs {PICTURES['hysteresis'].needs})" in text
    assert "rig.csv" in text


def test_every_slave_has_its_own_pictures_and_tables(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(drawing, "PICTURES", {"tracking": PICTURES["tracking"]})
    slaves = {"roof": {}, "cellar": {"control": {"gain": 6e4}}}
    plan = from_tables({"test": {"duration": 2.0, "name": "two"}, "slave": slaves}, tmp_path)
    assert virtual.run(virtual.assemble(plan, reality.as_planned(plan), tmp_path / "two.mcap"), str) is None
    run = read(tmp_path / "two.mcap")
    made = page(run, summarize(run), *drawing.draw_all(run, untold))
    text = check_alone(made).text
    assert made.count("<h3>Slave roof</h3>") == made.count("<h3>Slave cellar</h3>") == 1
    assert 'alt="Tracking of the slave &#39;roof&#39;"' in made
    assert "The table of slave cellar followed its target" in text
    assert "Exchange with the slave 'roof', commands: 1000 sent" in text


def test_margins_are_peaks_relative_to_the_limits_of_the_plan(virtual_recording: Path) -> None:
    run = read(virtual_recording)
    summary = summarize(run)
    found = {item.signal: item for item in verdict.margins(run, summary)}
    assert found["slave/damper_stroke"].share == summary["peaks"]["slave/damper_stroke"]["peak"] / 0.4
    assert found["master/column_force"].limit == 400e3
    assert "master/table_target" not in found  # the slave's own
    assert [item.share for item in found.values()] == sorted(
        (item.share for item in found.values()), reverse=True
    )


def test_the_page_of_a_stopped_test_states_the_cause(virtual_recording: Path) -> None:
    run = read(virtual_recording)
    run.metadata["summary"] |= {
        "outcome": "limit",
        "cause": "column_force is 500, beyond its limit of 400 N.",
    }
    assert verdict.sentences(run, summarize(run))[0] == (
        "The test ended: column_force is 500, beyond its limit of 400 N."
    )
    some = run.sequences["slave"]
    kept = some[(some < 100) | (some > 102)]
    run.columns["slave"] = {name: values[kept] for name, values in run.columns["slave"].items()}
    run = replace(run, sequences=run.sequences | {"slave": kept})
    text = check_alone(undrawn(run)).text
    assert "The test ran for all of its 2000 ticks; the slave lacks 3." in text
    assert "100…102" in text


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["{tmp}/no.mcap"],
            "Cannot read the recording {tmp}/no.mcap: No such file or directory; give the path of a file (MCAP).",
        ),
        (["{tmp}"], "Cannot read the recording {tmp}: Is a directory; give the path of a file (MCAP)."),
        (["{tmp}/text.mcap"], "is not a readable MCAP recording"),
        (["{file}", "-o", "{tmp}"], "Cannot write {tmp}: it is a folder"),
        (["{file}", "-o", "{tmp}/no/a.html"], "There is no folder {tmp}/no for a.html"),
        (["{file}", "-o", "{file}", "--force"], "Cannot write {file}: the command reads it"),
    ],
)
def test_mistakes_give_one_sentence(
    words: list[str], sentence: str, call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path
) -> None:
    (tmp_path / "text.mcap").write_text("no recording")
    before = virtual_recording.read_bytes()
    assert call("report", *(word.format(tmp=tmp_path, file=virtual_recording) for word in words)) == 2
    said = capsys.readouterr().err
    assert said.startswith("rths: ")
    assert said.count("\n") == 1
    assert sentence.format(tmp=tmp_path, file=virtual_recording) in said
    assert virtual_recording.read_bytes() == before


def test_a_file_that_cannot_be_read_or_written_is_reported(
    call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path, monkeypatch: Any
) -> None:
    def refuse(*_words: Any, **_more: Any) -> Any:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(drawing, "PICTURES", {})
    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_text", refuse)
        assert call("report", virtual_recording, "-o", tmp_path / "a.html") == 2
    assert "a.html: Permission denied; give another place." in capsys.readouterr().err
    monkeypatch.setattr(Path, "open", refuse)
    assert call("report", virtual_recording, "-o", tmp_path / "a.html") == 2
    assert "Permission denied" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("column", "right"),
    [
        (["0.313 m/s²", "−1", "–", "2.040 s"], True),
        (["31.686 kN", "1.2e-05", "> 99 %", "14×", "3.10 N (2.90 … 3.30)", "2000"], True),
        (["–", ""], False),
        (["12", "none"], False),
        (["1. damper friction"], False),
        (["2026-11-21 06:46:21 UTC"], False),
    ],
)
def test_columns_of_numbers_are_distinguished_from_texts(column: list[str], right: bool) -> None:
    assert numeric(column) == right
