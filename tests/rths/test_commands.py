"""The commands as a user calls them, in this process: output, files, exit codes and messages."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan.read import load, with_test
from common.recording.reader import read
from common.terminal.cli import plan_path
from rths.__main__ import EXAMPLES, MODULES, VERBS, parser_for
from tests.helpers import ROOT


def test_the_overview_names_every_command(call: Any, capsys: Any) -> None:
    assert call("--help") == 0
    out = capsys.readouterr().out
    assert all(f"  {verb} " in out for verb in VERBS)
    assert call() == 2


@pytest.mark.parametrize("verb", VERBS)
def test_every_help_has_an_example_that_its_parser_accepts(verb: str, call: Any, capsys: Any) -> None:
    assert call(verb, "--help") == 0
    assert f"example: {EXAMPLES[verb]}" in capsys.readouterr().out
    assert parser_for(verb).parse_args(EXAMPLES[verb].partition(" >")[0].split()[2:])


def test_the_registries_of_commands_agree() -> None:
    assert set(EXAMPLES) == set(VERBS)
    assert set(MODULES) <= set(VERBS)


def test_an_unknown_command_is_refused_with_the_nearest_name(call: Any, capsys: Any) -> None:
    assert call("insepct") == 2
    assert capsys.readouterr().err == "rths: unknown command 'insepct': did you mean inspect?\n"


def test_inspect_reports_the_contents_of_a_recording(call: Any, capsys: Any, virtual_recording: Path) -> None:
    assert call("inspect", virtual_recording) == 0
    out = capsys.readouterr().out
    assert "El Centro 1940 NS" in out
    assert "PGA 0.3188 g" in out
    assert ["master", "2000", "2000", "0", "none"] in [line.split() for line in out.splitlines()]
    assert call("inspect", virtual_recording, "--json") == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["tracking"]["actuator"]["delay"] == pytest.approx(0.0002, abs=2e-4)
    table = summary["tracking"]["table"]
    assert table["correlation_delay"] == pytest.approx(0.0189, abs=5e-4)
    assert table["delay"] == pytest.approx(0.0189, abs=2e-4)  # 4 ms and 2·0.7/ω of 15 Hz
    assert table["undetermined"] == ""
    assert summary["tracking"]["table"]["enclosed_area"] > 0.0
    assert 0.0 < summary["error_energy"] < 0.02
    assert "outcome: completed" in out
    low, high = summary["force_path"]["interval"]
    assert low <= 0.0 <= high
    assert summary["force_path"]["delay"] == pytest.approx(0.0, abs=1e-4)
    assert summary["force_path"]["gain"] == pytest.approx(1.0, abs=2e-3)
    assert f"gain {summary['force_path']['gain']:.4f} at" in out


def test_inspect_reports_as_json(call: Any, capsys: Any, virtual_recording: Path) -> None:
    assert call("inspect", virtual_recording, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["topics"]["slave"] == {
        "expected": 2000,
        "recorded": 2000,
        "missing": 0,
        "holes": [],
        "repeated": 0,
    }
    assert found["late_ticks"] == 0
    assert found["peaks"]["slave/damper_force"]["unit"] == "N"


def test_inspect_reports_where_a_cut_off_recording_ends(
    call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(virtual_recording.read_bytes()[:150_000])
    assert call("inspect", cut) == 0
    out = capsys.readouterr().out
    assert "cut off before its end" in out
    recorded = read(cut).ticks("master")
    assert 0 < recorded < 2000
    assert f"recorded until tick {recorded} of 2000" in out


def test_simulate_reports_peaks_and_writes_a_recording(call: Any, capsys: Any, tmp_path: Path) -> None:
    path = tmp_path / "simulation.mcap"
    assert call("simulate", "default", "--duration", "4", "-o", path, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["ticks"] == 2000
    assert found["peak_drift"] == pytest.approx(4.87e-3, rel=0.01)
    assert read(path).ticks("slave") == 2000


def test_simulate_reports_that_the_uncompensated_test_is_unstable(call: Any, capsys: Any) -> None:
    assert call("simulate", "default", "--uncompensated", "--no-amd") == 1
    assert "beyond its limit" in capsys.readouterr().out


def test_a_run_is_compared_with_its_simulation(
    call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path
) -> None:
    noisy = tmp_path / "noisy.mcap"
    assert call("simulate", "default", "--duration", "4", "--noise", "-o", noisy) == 0
    assert call("compare", virtual_recording, noisy, "--tolerance", "0", "--json") == 0
    out = capsys.readouterr().out.strip().splitlines()[-1]
    found = json.loads(out)
    assert all(facts["equal"] for facts in found["signals"].values())
    assert call("compare", virtual_recording, "default", "--tolerance", "0") == 1
    assert "differs by more than the tolerance 0" in capsys.readouterr().out


def test_replay_matches_to_the_last_bit_and_detects_a_changed_measurement(
    call: Any, capsys: Any, virtual_recording: Path, monkeypatch: Any
) -> None:
    assert call("replay", virtual_recording) == 0
    assert "matches to the last bit" in capsys.readouterr().out

    def tampered(path: Path) -> Any:
        run = read(path)
        run.columns["master"]["column_force"][1000] += 1e-6
        return run

    monkeypatch.setattr("common.recording.reader.read", tampered)
    assert call("replay", virtual_recording, "--json") == 1
    found = json.loads(capsys.readouterr().out)
    assert found["signals"]["master/displacement"]["first"] == pytest.approx(1001 * 0.002)
    assert found["signals"]["master/ground_acceleration"]["differing"] == 0


@pytest.mark.parametrize("suffix", ["csv", "parquet", "mat"])
def test_export_and_import_return_the_same_numbers(
    call: Any, virtual_recording: Path, tmp_path: Path, suffix: str
) -> None:
    table, plan, again = tmp_path / f"out.{suffix}", tmp_path / "plan.toml", tmp_path / "again.mcap"
    assert call("export", virtual_recording, "-o", table) == 0
    plan.write_text("[test]\nname = 'mine'\n")
    (tmp_path / "map.toml").write_text(
        'plan = "plan.toml"\ntime = "master_t"\n[signals]\n'
        'damper_stroke = { column = "slave_damper_stroke", scale = 1e3, offset = 1.0 }\n'
        'column_force = { column = "master_column_force" }\ntable_acceleration = { value = 0.5 }\n'
    )
    assert call("import", table, "--map", tmp_path / "map.toml", "-o", again) == 0
    original, returned = read(virtual_recording), read(again)
    assert set(returned.columns["slave"]) == {"seq", "t", "table_acceleration", "damper_stroke"}
    assert set(returned.columns["master"]) == {"seq", "t", "column_force"}
    assert np.allclose(returned.columns["master"]["column_force"], original.columns["master"]["column_force"])
    assert np.allclose(
        returned.columns["slave"]["damper_stroke"], 1e3 * original.columns["slave"]["damper_stroke"] + 1.0
    )
    assert set(returned.columns["slave"]["table_acceleration"].tolist()) == {0.5}
    assert call("inspect", again) == 0


def test_commands_that_write_files_name_them_in_their_json(
    call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path
) -> None:
    assert call("export", virtual_recording, "-o", tmp_path / "a.csv", "--json") == 0
    assert json.loads(capsys.readouterr().out)["ticks"] == 2000
    assert call("plot", virtual_recording, "tracking", "-o", tmp_path, "--json") == 0
    (picture,) = json.loads(capsys.readouterr().out)["pictures"]
    assert Path(picture).stat().st_size > 10_000


def test_import_resamples_to_the_plans_interval(call: Any, tmp_path: Path) -> None:
    (tmp_path / "plan.toml").write_text("[test]\ninterval = 0.001\n")
    (tmp_path / "data.csv").write_text("y\n" + "".join(f"{value}\n" for value in (0.0, 1.0, 4.0)))
    (tmp_path / "map.toml").write_text(
        'plan = "plan.toml"\nrate = 250.0\n[signals]\ndamper_stroke = { column = "y" }\n'
    )
    assert (
        call("import", tmp_path / "data.csv", "--map", tmp_path / "map.toml", "-o", tmp_path / "a.mcap") == 0
    )
    found = read(tmp_path / "a.mcap").columns["slave"]
    assert np.allclose(found["t"], 0.001 * np.arange(9))
    assert np.allclose(found["damper_stroke"], [0, 0.25, 0.5, 0.75, 1.0, 1.75, 2.5, 3.25, 4.0])


BAD_MAPS = {
    "unknown signal": ('plan = "p.toml"\nrate = 1.0\n[signals]\nx = {column="y"}\n', "Unknown signal 'x'"),
    "unknown column": (
        'plan = "p.toml"\nrate = 1.0\n[signals]\ndamper_stroke = {column="yy"}\n',
        "did you mean y",
    ),
    "neither time nor rate": (
        'plan = "p.toml"\n[signals]\ndamper_stroke = {column="y"}\n',
        "give either time",
    ),
    "no signals": ('plan = "p.toml"\nrate = 1.0\n', "a table [signals]"),
    "unknown key": ('plan = "p.toml"\nrat = 1.0\n', "did you mean rate"),
    "no source": (
        'plan = "p.toml"\nrate = 1.0\n[signals]\ndamper_stroke = {scale=1.0}\n',
        "either a column or a value",
    ),
    "time that stands still": (
        'plan = "p.toml"\ntime = "z"\n[signals]\ndamper_stroke = {column="y"}\n',
        "not increase",
    ),
    "missing plan": (
        'plan = "no.toml"\nrate = 1.0\n[signals]\ndamper_stroke = {column="y"}\n',
        "Cannot read the plan",
    ),
}


@pytest.mark.parametrize("text_and_message", BAD_MAPS.values(), ids=BAD_MAPS.keys())
def test_a_wrong_import_map_is_refused_in_one_sentence(
    call: Any, capsys: Any, tmp_path: Path, text_and_message: tuple[str, str]
) -> None:
    text, message = text_and_message
    (tmp_path / "p.toml").write_text("")
    (tmp_path / "data.csv").write_text("y,z\n1,0\n2,0\n")
    (tmp_path / "map.toml").write_text(text)
    assert (
        call("import", tmp_path / "data.csv", "--map", tmp_path / "map.toml", "-o", tmp_path / "a.mcap") == 2
    )
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_plot_draws_the_signals_that_are_recorded(
    call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path
) -> None:
    assert call("plot", virtual_recording, "-o", tmp_path / "pictures", "--format", "svg") == 0
    drawn = sorted(path.name for path in (tmp_path / "pictures").iterdir())
    names = ["histories", "hysteresis", "spectra", "synchronisation", "tracking"]
    assert drawn == [f"{name}.svg" for name in names]  # nothing takes time in virtual time
    text = (tmp_path / "pictures" / "histories.svg").read_text()
    assert "<svg" in text
    assert len(text) > 10_000


WRONG_CALLS: dict[str, tuple[list[str], str]] = {
    "missing plan": (["run", "nowhere.toml", "--virtual"], "Cannot read the plan nowhere.toml"),
    "missing record": (
        ["run", "{tmp}/record.toml", "--virtual", "-o", "{tmp}/a.mcap"],
        "Ground motion 'missing.at2'",
    ),
    "short AT2": (["run", "{tmp}/short.toml", "--virtual", "-o", "{tmp}/a.mcap"], "short.at2"),
    "unknown model": (
        ["run", "{tmp}/model.toml", "--virtual", "-o", "{tmp}/a.mcap"],
        "Unknown specimen model 'liner'",
    ),
    "unwritable place": (
        ["run", "--virtual", "-o", "/proc/a.mcap"],
        "Cannot write /proc/a.mcap",
    ),
    "missing folder": (["run", "--virtual", "-o", "{tmp}/no/a.mcap"], "There is no folder"),
    "folder for a file": (["run", "--virtual", "-o", "{tmp}"], "it is a folder"),
    "missing recording": (["inspect", "{tmp}/a.mcap"], "Cannot read the recording"),
    "no recording": (["inspect", "{tmp}/model.toml"], "not a readable MCAP"),
    "unknown format": (
        ["export", "{recording}", "-o", "{tmp}/a.xyz"],
        "give a file that ends in .csv, .parquet, .mat",
    ),
    "missing data": (
        ["import", "{tmp}/no.csv", "--map", "{tmp}/model.toml", "-o", "{tmp}/a.mcap"],
        "Unknown key",
    ),
    "unstable interval": (["run", "{tmp}/stiff.toml", "--virtual", "-o", "{tmp}/a.mcap"], "interval"),
    "plug-in that is not there": (
        ["run", "{tmp}/rig.toml", "--virtual", "-o", "{tmp}/a.mcap"],
        "There is no file",
    ),
}


@pytest.mark.parametrize("words_and_message", WRONG_CALLS.values(), ids=WRONG_CALLS.keys())
def test_a_mistake_gives_one_sentence_and_exit_code_2(
    words_and_message: tuple[list[str], str], call: Any, capsys: Any, tmp_path: Path, virtual_recording: Path
) -> None:
    words, message = words_and_message
    (tmp_path / "record.toml").write_text("[ground_motion]\nrecord = 'missing.at2'\n")
    (tmp_path / "short.toml").write_text("[ground_motion]\nrecord = 'short.at2'\n")
    (tmp_path / "short.at2").write_text(
        "PEER\nx\nACCELERATION IN UNITS OF G\nNPTS= 9, DT= .02 SEC\n 0.1 0.2 0.3\n"
    )
    (tmp_path / "model.toml").write_text("[column]\nmodel = 'liner'\n")
    (tmp_path / "stiff.toml").write_text("[structure]\nmass = 10.0\n")
    (tmp_path / "rig.toml").write_text("[master.rig]\nclass = 'nothing.py:Lab'\n")
    filled = [
        word.replace("{tmp}", str(tmp_path)).replace("{recording}", str(virtual_recording)) for word in words
    ]
    assert call(*filled) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1, error
    assert "Traceback" not in error
    assert not (tmp_path / "a.mcap").exists()


def test_the_users_own_laboratory_runs(call: Any, capsys: Any, tmp_path: Path) -> None:
    path = tmp_path / "mine.mcap"
    assert len((ROOT / "examples" / "my_lab.py").read_text().splitlines()) < 60
    assert call("run", ROOT / "examples" / "my_test.toml", "--virtual", "--duration", "3", "-o", path) == 0
    assert read(path).ticks("master") == 1500
    assert call("replay", path) == 0
    assert "matches to the last bit" in capsys.readouterr().out


def test_a_reality_leaves_no_trace_in_the_recording(call: Any, tmp_path: Path) -> None:
    secret = tmp_path / "secret_reality.toml"
    secret.write_text("[column]\nstiffness = 13.1e6\n")
    path = tmp_path / "real.mcap"
    assert call("run", "--virtual", "--duration", "4", "--reality", secret, "-o", path) == 0
    real, plan = read(path), with_test(load(plan_path(None)), duration=4.0)
    assert real.metadata["plan"] == {"toml": plan.toml(), "digest": plan.digest()}
    ratio = real.columns["master"]["column_force"] / real.columns["master"]["column_displacement"]
    strong = np.abs(real.columns["master"]["column_displacement"]) > 1e-3
    assert np.median(ratio[strong]) == pytest.approx(13.1e6, rel=0.01)
    content = path.read_bytes() + repr(real.metadata).encode() + repr(real.events).encode()
    assert b"secret_reality" not in content
    assert b"13100000" not in content
    assert b"13.1e6" not in content


def test_a_hidden_rig_that_fails_is_not_named_in_the_recording(
    call: Any, capsys: Any, tmp_path: Path
) -> None:
    (tmp_path / "secret.py").write_text(
        "class SecretLab:\n"
        "    def __init__(self, interval, seed): pass\n"
        "    def arm(self): pass\n"
        "    def read(self): return (0.0,)\n"
        "    def write(self, command): pass\n"
        "    def disarm(self): pass\n"
    )
    (tmp_path / "secret.toml").write_text("[master.rig]\nclass = 'secret.py:SecretLab'\n")
    path = tmp_path / "a.mcap"
    assert call("run", "--virtual", "--duration", "1", "--reality", tmp_path / "secret.toml", "-o", path) == 3
    assert "laboratory A: read() returned 1 numbers, not 2" in capsys.readouterr().err
    run = read(path)
    assert "ecret" not in repr(run.events) + repr(run.metadata)


def test_virtual_run_prints_the_summary_as_json(call: Any, capsys: Any, tmp_path: Path) -> None:
    assert call("run", "--virtual", "--duration", "1", "-o", tmp_path / "a.mcap", "--json") == 0
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert found["topics"]["master"]["recorded"] == 500
    assert found["recorder"]["cause"] == "completed"
