"""`rths diagnose` as a user calls it: files, exit codes, messages; and realities with effects."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InterlockError
from common.recording.reader import read
from common.recording.run import PEAKS
from diagnosis.fits.residuals import withheld_ticks
from diagnosis.recorded import record
from diagnosis.report.schema import schema
from tests.diagnosis.cases import STRONGEST, Cases, play, short
from tests.helpers import with_table

FRICTION = {"damper.friction": {"force": 3.0}}


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Cases:
    """Recordings with known hidden effects, made on demand."""
    return Cases(tmp_path_factory)


def checked(path: Path) -> dict[str, Any]:
    """The report in a file, valid under the schema."""
    jsonschema = pytest.importorskip("jsonschema")
    report: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema()).validate(report)
    return report


def sentence(capsys: Any, message: str) -> None:
    """Asserts that the message is one sentence on standard error."""
    out, error = capsys.readouterr()
    assert out == ""
    assert message in error
    assert error.startswith("rths: ")
    assert error.count("\n") == 1, error
    assert "Traceback" not in error


def test_diagnose_writes_report_page_and_summary(
    call: Any, capsys: Any, cases: Cases, tmp_path: Path
) -> None:
    out, html = tmp_path / "gap.json", tmp_path / "gap.html"
    path = cases.file(FRICTION, duration=STRONGEST)
    reality = tmp_path / "found.toml"
    assert call("diagnose", path, "--json", out, "--html", html, "--found", reality) == 0
    text, error = capsys.readouterr()
    assert all(line.startswith("diagnosing: ") for line in error.splitlines())
    assert "damper friction" in text
    report = checked(out)
    assert report["which"][0]["effects"] == ["damper.friction"]
    assert report["details"]["test"]["file"] == path.name
    assert report["found"] == str(reality)
    written = tomllib.loads(reality.read_text(encoding="utf-8"))
    assert written["found"]["recording"] == path.name
    stated = report["which"][0]["parameters"]["damper.friction"]["force"]
    assert stated["value"] == written["effect"][0]["force"]  # to the last bit
    assert stated["interval"][0] <= stated["value"] <= stated["interval"][1]
    corrected = tmp_path / "corrected.mcap"
    assert call("simulate", "default", "--duration", STRONGEST, "--reality", reality, "-o", corrected) == 0
    capsys.readouterr()
    assert left(path, corrected) == report["how_far"]["after"]  # to the last bit
    assert call("simulate", "rc_column", "--duration", 1, "--reality", reality) == 2
    sentence(capsys, "it was found with other nominal models than this plan's")
    assert "damper" in report["verdict"]
    page = html.read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    assert not re.findall(r"(?:src|href)=[\"'](?!#|data:)", page)  # nothing is loaded from elsewhere
    assert str(path.parent) not in page


def test_a_report_on_standard_output_is_that_of_a_file(
    call: Any, capsys: Any, cases: Cases, tmp_path: Path
) -> None:
    out, path = tmp_path / "gap.json", cases.file(duration=2.0)
    assert call("diagnose", path, "--json", out, "--found", tmp_path / "found.toml") == 0
    capsys.readouterr()
    assert call("diagnose", path, "--json", "-") == 0
    assert json.loads(capsys.readouterr().out) == checked(out) | {"found": None}


def left(measured: Path, simulated: Path) -> float:
    """The gap of the response between two recordings, on the time that no fit used."""
    one, other = (record.build(read(path)) for path in (measured, simulated))
    held, gaps = withheld_ticks(one.ticks, one.plan.test.interval), []
    for name in one.responses:
        there, shown = one.signals[name][held], other.signals[name][held]
        gaps.append(float(np.sqrt(np.mean((there - shown) ** 2))) / float(np.sqrt(np.mean(there**2))))
    return float(np.sqrt(np.mean(np.square(gaps))))


@pytest.mark.slow
def test_the_gap_can_be_measured_against_the_ideal_test(call: Any, cases: Cases, tmp_path: Path) -> None:
    out, plain = tmp_path / "a.json", tmp_path / "b.json"
    assert call("diagnose", cases.file(duration=8.0), "--ideal", "--json", out) == 0
    assert call("diagnose", cases.file(duration=8.0), "--json", plain) == 0
    assert (
        checked(out)["gap"]["overall"] > checked(plain)["gap"]["overall"]
    )  # the transfer systems are not ideal


MISTAKES = {
    "no such file": (["{tmp}/none.mcap"], "Cannot read the recording"),
    "a folder": (["{tmp}"], "Cannot read the recording"),
    "no MCAP": (["{tmp}/text.mcap"], "not a readable MCAP recording"),
    "empty file": (["{tmp}/empty.mcap"], "not a readable MCAP recording"),
    "no such plan": (["{file}", "--plan", "nowhere.toml"], "Cannot read the plan nowhere.toml"),
    "no such other": (["{file}", "--validate", "{tmp}/none.mcap"], "Cannot read the recording"),
    "a copy for validation": (
        ["{file}", "--validate", "{tmp}/copy.mcap"],
        "cannot validate it: give --validate",
    ),
    "a recording twice": (["{file}", "{tmp}/copy.mcap"], "copy.mcap holds the same readings as"),
    "unwritable report": (["{file}", "--json", "{tmp}/no/a.json"], "There is no folder"),
    "unwritable page": (["{file}", "--html", "{tmp}/no/a.html"], "There is no folder"),
    "one file for both": (
        ["{file}", "--json", "{tmp}/a", "--html", "{tmp}/a"],
        "--html, --json and --found name one file twice",
    ),
    "a head alone": (["{tmp}/head.mcap"], "holds no topic"),
}
TO_FOLDER = {"report": "--json", "page": "--html"}


@pytest.mark.parametrize("kind", MISTAKES)
def test_a_mistake_gives_one_sentence(
    call: Any, capsys: Any, cases: Cases, tmp_path: Path, kind: str
) -> None:
    path = cases.file(duration=2.0)
    (tmp_path / "text.mcap").write_text("no recording at all\n")
    (tmp_path / "empty.mcap").write_bytes(b"")
    (tmp_path / "copy.mcap").write_bytes(path.read_bytes())
    (tmp_path / "head.mcap").write_bytes(path.read_bytes()[:2000])
    words, message = MISTAKES[kind]
    filled = [word.replace("{tmp}", str(tmp_path)).replace("{file}", str(path)) for word in words]
    assert call("diagnose", *filled) == 2
    sentence(capsys, message)


@pytest.mark.parametrize("option", TO_FOLDER.values(), ids=TO_FOLDER)
def test_an_output_folder_that_cannot_be_written_is_reported(
    call: Any, capsys: Any, cases: Cases, tmp_path: Path, option: str
) -> None:
    assert call("diagnose", cases.file(duration=2.0), option, tmp_path) == 2
    sentence(capsys, "Cannot write")


def test_a_recording_of_a_few_ticks_is_not_enough(
    call: Any, capsys: Any, cases: Cases, tmp_path: Path
) -> None:
    for duration in (0.08, 0.04):
        out = tmp_path / f"{duration}.json"
        path = cases.file(duration=duration)
        assert call("diagnose", path, "--json", out, "--html", out.with_suffix(".html")) == 0
        report = checked(out)
        assert report["status"] == "not_enough_data"
        assert report["which"][0]["effects"] == []
        assert report["which"][0]["probability"] is None
    assert "not enough data" in capsys.readouterr().out.lower()


@pytest.mark.slow
def test_a_recording_that_was_cut_off_is_diagnosed(call: Any, cases: Cases, tmp_path: Path) -> None:
    content = cases.file(FRICTION, duration=10.0).read_bytes()
    cut, out = tmp_path / "cut.mcap", tmp_path / "cut.json"
    cut.write_bytes(content[: 2 * len(content) // 3])
    assert call("diagnose", cut, "--json", out) == 0
    report = checked(out)
    assert report["which"][0]["effects"] == ["damper.friction"]
    assert report["details"]["test"]["outcome"] == "cut off"
    assert 1500 < report["details"]["test"]["ticks"] < 5000


@pytest.mark.slow
def test_a_test_that_a_limit_stopped_is_diagnosed(call: Any, tmp_path: Path) -> None:
    path, out = tmp_path / "a.mcap", tmp_path / "a.json"
    base = with_table(short(10.0), "limits", damper_stroke=0.03)
    entry = {"name": "damper.viscous", "factor": 1.5}
    assert isinstance(play(base, {"effect": [entry]}, path), InterlockError)
    assert call("diagnose", path, "--json", out) == 0
    report = checked(out)
    assert report["details"]["test"]["ticks"] < 5000
    assert report["which"][0]["effects"] == ["damper.viscous"]


@pytest.mark.slow
def test_a_recording_with_several_storeys_is_diagnosed(call: Any, tmp_path: Path) -> None:
    path, out = tmp_path / "a.mcap", tmp_path / "a.json"
    base = with_table(
        short(6.0), "structure", mass=[80e3, 80e3], stiffness=[37.5e6, 50e6], damping=[2e5, 2e5]
    )
    assert play(base, {"effect": [{"name": "column.friction", "force": 900.0}]}, path) is None
    assert call("diagnose", path, "--json", out) == 0
    assert checked(out)["which"][0]["effects"] == ["column.friction"]


BENCHES = {
    "column": ("static", "column.friction", "force = 900.0"),
    "actuator": ("sine", "actuator.delay", "delay = 0.006"),
    "table": ("step", "table.gain", "factor = 0.93"),
    "damper": ("sweep", "damper.friction", "force = 3.0"),
}


@pytest.mark.parametrize(
    ("part", "clean"),
    [("actuator", True), ("table", False), pytest.param("damper", False, marks=pytest.mark.slow)],
    ids=["actuator, clean", "table with an effect", "damper with an effect"],
)
def test_a_bench_test_of_one_part_is_diagnosed(
    call: Any, capsys: Any, tmp_path: Path, part: str, clean: bool
) -> None:
    piece, effect, parameter = BENCHES[part]
    path, out, secret = tmp_path / "bench.mcap", tmp_path / "a.json", tmp_path / "r.toml"
    secret.write_text(f"[[effect]]\nname = '{effect}'\n{parameter}\n")
    words = [] if clean else ["--reality", secret]
    assert call("bench", part, "default", "--only", piece, "-o", path, *words) == 0
    assert call("diagnose", path, "--json", out) == 0
    report = checked(out)
    sets = [set(names) for names in report["equivalent"]]
    found = report["which"][0]["effects"]
    assert len(found) == (0 if clean else 1)
    assert clean or found == [effect] or any({found[0], effect} <= names for names in sets)
    assert any("Not recorded" in text for text in report["warnings"])
    capsys.readouterr()


@pytest.mark.slow
def test_the_gap_of_a_bench_test_closes_to_the_noise_floor(call: Any, tmp_path: Path) -> None:
    path, out, secret = tmp_path / "bench.mcap", tmp_path / "a.json", tmp_path / "r.toml"
    secret.write_text("[[effect]]\nname = 'table.gain'\nfactor = 0.93\n")
    assert call("bench", "table", "default", "-o", path, "--reality", secret) == 0
    assert call("diagnose", path, "--json", out) == 0
    far = checked(out)["how_far"]
    assert far["after"] == pytest.approx(far["noise_floor"], rel=0.05)


@pytest.mark.slow
def test_missing_channels_are_reported(call: Any, capsys: Any, cases: Cases, tmp_path: Path) -> None:
    table, again = tmp_path / "out.csv", tmp_path / "again.mcap"
    assert call("export", cases.file(FRICTION, duration=8.0), "-o", table) == 0
    names = ("table_command", "damper_command", "table_acceleration", "damper_stroke", "damper_force")
    (tmp_path / "plan.toml").write_text("[test]\nname = 'mine'\n")
    (tmp_path / "map.toml").write_text(
        'plan = "plan.toml"\ntime = "slave_t"\n[signals]\n'
        + "".join(f'{name} = {{ column = "slave_{name}" }}\n' for name in names)
    )
    assert call("import", table, "--map", tmp_path / "map.toml", "-o", again) == 0
    assert call("diagnose", again, "--json", tmp_path / "a.json") == 0
    report = checked(tmp_path / "a.json")
    assert report["which"][0]["effects"] == ["damper.friction"]
    assert any("table_displacement" in text for text in report["warnings"])
    (tmp_path / "map.toml").write_text(
        'plan = "plan.toml"\ntime = "slave_t"\n[signals]\ndamper_force = { column = "slave_damper_force" }\n'
    )
    capsys.readouterr()
    assert call("import", table, "--map", tmp_path / "map.toml", "-o", tmp_path / "b.mcap") == 0
    capsys.readouterr()
    assert call("diagnose", tmp_path / "b.mcap") == 2
    sentence(capsys, "no part's input and output together")


REALITIES = {
    "unknown effect": ("[[effect]]\nname = 'column.frition'\nforce = 9.0\n", "did you mean column.friction"),
    "unknown parameter": ("[[effect]]\nname = 'column.friction'\nforces = 9.0\n", "did you mean force"),
    "missing parameter": (
        "[[effect]]\nname = 'column.friction'\n",
        "force of effect 'column.friction' is missing",
    ),
    "out of bounds": ("[[effect]]\nname = 'column.friction'\nforce = -1.0\n", "must be"),
    "no number": ("[[effect]]\nname = 'column.friction'\nforce = 'much'\n", "must be a number"),
    "no name": ("[[effect]]\nforce = 9.0\n", "give a name of the catalogue"),
    "no table": ("effect = 3\n", "[[effect]] tables"),
    "one table": ("[effect]\nname = 'column.friction'\nforce = 9.0\n", "[[effect]] tables"),
    "over a rig": (
        "[master.rig]\nclass = 'lab.py:Lab'\n[[effect]]\nname = 'column.friction'\nforce = 9.0\n",
        "cannot be applied to the plug-in in [master.rig]",
    ),
    "over a sensor of a rig": (
        "[slave.rig]\nclass = 'lab.py:Lab'\n[[effect]]\nname = 'sensor.damper_force.gain'\nfactor = 1.1\n",
        "cannot be applied to the plug-in in [slave.rig]",
    ),
    "over a link": (
        "[link]\nclass = 'lab.py:Link'\n[[effect]]\nname = 'link.delay'\ndelay = 0.004\n",
        "cannot be applied to the plug-in in [link]",
    ),
}


@pytest.mark.parametrize("kind", REALITIES)
def test_a_wrong_reality_is_refused_in_one_sentence(
    call: Any, capsys: Any, tmp_path: Path, kind: str
) -> None:
    text, message = REALITIES[kind]
    (tmp_path / "r.toml").write_text(text)
    (tmp_path / "lab.py").write_text("class Lab: ...\nclass Link: ...\n")
    out = tmp_path / "a.mcap"
    words = ("--virtual", "--duration", "2", "--reality", tmp_path / "r.toml", "-o", out)
    assert call("run", *words) == 2
    sentence(capsys, message)
    assert not out.exists()


def test_an_effect_appears_in_a_recording_only_through_its_signals(cases: Cases) -> None:
    effects = {"column.friction": {"force": 913.0}, "link.delay": {"delay": 0.004}}
    real, clean = read(cases.file(effects, seed=0, duration=4.0)), read(cases.file(seed=0, duration=4.0))
    for name, facts in clean.metadata.items():
        if name not in ("host", PEAKS):  # which say when it was recorded, and what the signals show as well
            told = {key: value for key, value in real.metadata[name].items() if key != "deadline_misses"}
            assert told == {key: value for key, value in facts.items() if key != "deadline_misses"}, name
    assert set(real.metadata) == set(clean.metadata)
    assert real.attachments == clean.attachments
    events = [[{**event, "t": 0} for event in run.events] for run in (real, clean)]
    seen = [
        [event for event in told if event["code"] != "exchange"] for told in events
    ]  # that counts signals
    assert seen[0] == seen[1]
    assert set(real.columns["master"]) == set(clean.columns["master"])
    content = cases.file(effects, seed=0, duration=4.0).read_bytes()
    assert not any(word in content for word in (b"column.friction", b"link.delay", b"ImpairedLink", b"913.0"))
    changed = real.columns["master"]["column_force"] - clean.columns["master"]["column_force"]
    assert np.max(np.abs(changed)) > 500.0


@pytest.mark.long
def test_a_plan_that_is_given_keeps_the_motion_of_another_recording(
    call: Any, cases: Cases, tmp_path: Path
) -> None:
    """Under the motion of the first recording half of the other one would be a gap."""
    first, other = (
        cases.file(FRICTION, duration=STRONGEST),
        cases.file(FRICTION, duration=STRONGEST, scale=0.05),
    )
    out = tmp_path / "report.json"
    assert call("diagnose", first, "--plan", "default", "--validate", other, "--json", out) == 0
    gap = checked(out)["how_far"]
    assert gap["judged_on"] == "other recordings"
    assert gap["closed"] > 0.9
