"""The commands on a test with two slaves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan.plan import Plan
from common.plan.read import from_tables
from common.reality import reality
from common.recording.reader import read
from report.text import tabular
from simulation import virtual


@pytest.fixture(scope="module")
def two() -> Plan:
    slaves = {
        "roof": {},
        "cellar": {"damper": {"mass": 20.0, "force_scale": 10.0}, "control": {"gain": 1.2e4}},
    }
    return from_tables({"test": {"duration": 4.0, "name": "two"}, "slave": slaves}, Path())


@pytest.fixture(scope="module")
def plan_file(two: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plans") / "two.toml"
    path.write_text(two.toml())
    return path


@pytest.fixture(scope="module")
def recording(two: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings") / "two.mcap"
    assert virtual.run(virtual.assemble(two, reality.as_planned(two), path), str) is None
    return path


def test_inspect_shows_every_topic_and_a_latency_table_per_slave(
    call: Any, capsys: Any, recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "report.facts.circumstances.clock_of", lambda run: "real"
    )  # virtual time shows no latency
    assert call("inspect", recording) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    for topic in ("master", "slave.roof", "slave.cellar", "latency.roof", "latency.cellar"):
        assert [topic, "2000", "2000", "0", "none"] in lines
    for name in ("roof", "cellar"):
        assert ["latency", f"{name},", "µs", "p50", "p90", "p99", "p99.9", "max"] in lines
        assert any(line and line[0] == f"table.{name}" for line in lines)
    assert call("inspect", recording, "--json") == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["slaves"] == ["roof", "cellar"]
    assert summary["latency"].keys() == {"roof", "cellar"}
    assert summary["late_ticks"] == 0
    assert summary["peaks"]["slave.cellar/damper_force"]["unit"] == "N"


def test_replay_matches_to_the_last_bit(call: Any, capsys: Any, recording: Path) -> None:
    assert call("replay", recording, "--json") == 0
    signals = json.loads(capsys.readouterr().out)["signals"]
    assert {
        "master/displacement",
        "slave.roof/table_command",
        "master/damper_force_used.cellar",
    } <= signals.keys()
    assert all(match["compared"] >= 1999 for match in signals.values())


def test_replay_finds_one_changed_bit_of_one_slave(call: Any, recording: Path, monkeypatch: Any) -> None:
    from rths.examine import replay

    found = read(recording)
    values = found.columns["master"]["damper_force_used"]
    values[700, 1] = np.nextafter(values[700, 1], np.inf)
    matches = replay.replay_slaves(found, replay.planned(found))
    assert matches["master/damper_force_used.cellar"].differing == 1
    assert matches["master/damper_force_used.roof"].differing == 0


@pytest.mark.long
def test_plot_draws_each_laboratory_under_its_name(
    call: Any, capsys: Any, recording: Path, tmp_path: Path
) -> None:
    assert call("plot", recording, "histories", "hysteresis", "-o", tmp_path) == 0
    names = {path.stem for path in tmp_path.iterdir()}
    assert names == {
        f"{name}-{slave}" for name in ("histories", "hysteresis") for slave in ("roof", "cellar")
    }


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mat"])
def test_export_spreads_the_arrays(suffix: str, call: Any, recording: Path, tmp_path: Path) -> None:
    assert call("export", recording, "-o", tmp_path / f"two{suffix}") == 0
    columns, found = tabular.read(tmp_path / f"two{suffix}"), read(recording)
    for place in (0, 1):
        used = found.columns["master"]["damper_force_used"][:, place]
        assert np.array_equal(columns[f"master_damper_force_used_{place + 1}"], used)
    assert np.array_equal(columns["slave_roof_damper_force"], found.columns["slave.roof"]["damper_force"])


def test_exported_data_can_be_imported_slave_by_slave(
    call: Any, recording: Path, plan_file: Path, tmp_path: Path
) -> None:
    assert call("export", recording, "-o", tmp_path / "two.csv") == 0
    known = tmp_path / "map.toml"
    known.write_text(
        f"plan = '{plan_file}'\ntime = 'master_t'\n[signals]\n"
        "'roof.damper_force' = { column = 'slave_roof_damper_force' }\n"
        "'cellar.damper_stroke' = { column = 'slave_cellar_damper_stroke' }\n"
        "column_force = { column = 'master_column_force' }\n"
    )
    path = tmp_path / "back.mcap"
    assert call("import", tmp_path / "two.csv", "--map", known, "-o", path) == 0
    back, found = read(path), read(recording)
    assert back.roles == ("slave.roof", "slave.cellar")
    assert np.allclose(
        back.columns["slave.roof"]["damper_force"], found.columns["slave.roof"]["damper_force"], rtol=1e-12
    )
    assert back.columns["slave.cellar"].keys() == {"seq", "t", "damper_stroke"}
    assert call("inspect", path) == 0


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("table_target", "'table_target' has one value per slave in this plan, so one column cannot give it"),
        ("rof.damper_force", "Unknown signal 'rof.damper_force'"),
        ("damper_force", "Unknown signal 'damper_force'"),
    ],
)
def test_an_import_that_names_no_slave_is_refused(
    name: str, message: str, call: Any, capsys: Any, plan_file: Path, tmp_path: Path
) -> None:
    known = tmp_path / "map.toml"
    known.write_text(f"plan = '{plan_file}'\nrate = 500.0\n[signals]\n'{name}' = {{ value = 0.0 }}\n")
    assert call("import", tmp_path / "none.csv", "--map", known, "-o", tmp_path / "a.mcap") == 2
    assert message in capsys.readouterr().err


def test_simulate_and_compare_accept_a_plan_with_several_slaves(
    call: Any, capsys: Any, recording: Path, plan_file: Path, tmp_path: Path
) -> None:
    path = tmp_path / "simulated.mcap"
    assert call("simulate", plan_file, "-o", path, "--json") == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["peaks"]["cellar.damper_force"]["unit"] == "N"
    assert summary["beyond_limit"] == ""
    assert call("compare", path, plan_file, "--tolerance", "0") == 0
    capsys.readouterr()
    assert call("compare", recording, plan_file, "--json") == 0
    found = json.loads(capsys.readouterr().out)["signals"]
    assert 0.0 < found["roof.damper_force"]["nrmse"] < 0.02
    assert found["ground_acceleration"]["equal"]
    assert call("simulate", plan_file, "--noise", "-o", path, "--force") == 0
    capsys.readouterr()
    assert call("compare", recording, path, "--tolerance", "0") == 0


def test_a_simulated_reality_equals_the_test_to_the_last_bit(
    two: Plan, call: Any, capsys: Any, plan_file: Path, tmp_path: Path
) -> None:
    truth = tmp_path / "truth.toml"
    truth.write_text(
        "[[effect]]\nname = 'damper.friction'\nforce = 3.0\nslave = 'cellar'\n"
        "[[effect]]\nname = 'link.delay'\ndelay = 0.005\nslave = 'roof'\n"
    )
    played, computed = tmp_path / "played.mcap", tmp_path / "computed.mcap"
    bench = virtual.assemble(two, reality.load(truth, two), played)
    assert virtual.run(bench, str) is None
    assert call("simulate", plan_file, "--reality", truth, "--noise", "-o", computed) == 0
    capsys.readouterr()
    assert call("compare", played, computed, "--tolerance", "0") == 0
    assert call("compare", computed, plan_file, "--tolerance", "0") == 1
    truth.write_text("[slave.roof.rig]\nclass = 'my_lab.py:Lab'\n")
    capsys.readouterr()
    assert call("simulate", plan_file, "--reality", truth) == 2
    assert "[slave.roof.rig] names a plug-in" in capsys.readouterr().err


def test_a_simulation_beyond_a_limit_gives_exit_code_1(call: Any, capsys: Any, plan_file: Path) -> None:
    assert call("simulate", plan_file, "--uncompensated", "--no-amd", "--scale", "2.0", "--json") == 1
    assert "beyond its limit" in json.loads(capsys.readouterr().out)["beyond_limit"]


@pytest.mark.parametrize("part", ["column", "actuator"])
def test_bench_refuses_a_slaves_name_for_a_part_of_the_master(
    part: str, call: Any, capsys: Any, plan_file: Path, tmp_path: Path
) -> None:
    assert call("bench", part, plan_file, "--name", "cellar", "-o", tmp_path / "a.mcap") == 2
    assert capsys.readouterr().err == (
        f"rths: There is no {part} in the laboratory 'cellar' of the plan, but in that of the master: see kind in "
        "[master] and [slave].\n"
    )
    assert not (tmp_path / "a.mcap").exists()


@pytest.mark.parametrize(
    ("table", "place"),
    [("slave.cellar.table.compensator", "slave.cellar.table.compensator"), ("table.compensator",) * 2],
)
@pytest.mark.parametrize("verb", ["run --virtual", "simulate", "bench table --name cellar --compensated"])
def test_an_unknown_compensator_is_named_with_the_table_that_holds_it(
    verb: str, table: str, place: str, call: Any, capsys: Any, tmp_path: Path
) -> None:
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(f"[slave.roof.rig]\n[slave.cellar.rig]\n[{table}]\nkind = 'taylr'\n")
    name, *options = verb.split()
    part = [options.pop(0)] if name == "bench" else []
    assert call(name, *part, wrong, *options, "-o", tmp_path / "a.mcap") == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said == f"rths: Unknown compensator 'taylr' in [{place}]: did you mean taylor?"


@pytest.mark.slow
def test_bench_requires_a_slaves_name_for_its_parts_and_identify_finds_them(
    call: Any, capsys: Any, plan_file: Path, recording: Path, tmp_path: Path
) -> None:
    path = tmp_path / "table.mcap"
    assert call("bench", "damper", plan_file, "-o", path) == 2
    assert "--name (roof, cellar)" in capsys.readouterr().err
    assert call("bench", "damper", plan_file, "--name", "cellar", "-o", path) == 0
    capsys.readouterr()
    assert call("identify", path, "--json") == 0
    found = json.loads(capsys.readouterr().out)["parts"][0]
    assert found["parameters"]["mass"]["value"] == pytest.approx(20.0, rel=0.01)
    assert call("identify", recording, "--json") == 0
    parts = {part["part"]: part for part in json.loads(capsys.readouterr().out)["parts"]}
    assert {"column", "actuator", "damper.roof", "damper.cellar"} <= parts.keys()
    assert parts["damper.cellar"]["parameters"]["mass"]["value"] == pytest.approx(20.0, rel=0.05)


@pytest.mark.long
def test_a_diagnosis_names_the_laboratory_with_the_gap(
    two: Plan, call: Any, capsys: Any, tmp_path: Path
) -> None:
    friction = {"name": "damper.friction", "force": 3.0, "slave": "cellar"}
    truth = reality.from_reality({"effect": [friction]}, two, Path())
    path = tmp_path / "gap.mcap"
    assert virtual.run(virtual.assemble(two, truth, path), str) is None
    assert call("diagnose", path) == 0
    roof, cellar = capsys.readouterr().out.split("\n\n")
    assert "Laboratory roof: There is no gap beyond noise and tolerances" in roof
    assert "Laboratory cellar: The gap of" in cellar
    assert "damper friction: force 3." in cellar or "damper friction: force 2.9" in cellar


def test_a_diagnosis_to_a_file_requires_the_name_of_one_slave_of_the_recording(
    call: Any, capsys: Any, recording: Path, virtual_recording: Path, plan_file: Path, tmp_path: Path
) -> None:
    for words, sentence in (
        ((recording, "--json", tmp_path / "a.json"), "choose it with --name (roof, cellar)"),
        ((recording, "--name", "celar"), "has no slave 'celar': did you mean cellar?"),
        ((virtual_recording, "--name", "roof"), "has no slave 'roof': leave out --name."),
        (
            (virtual_recording, "--plan", plan_file),
            "but the plan is of the slave 'roof' and the slave 'cellar'",
        ),
    ):
        assert call("diagnose", *words) == 2
        err = capsys.readouterr().err
        assert sentence in err
        assert err.count("\n") == 1


def test_a_run_with_two_slaves_in_virtual_time_is_completed(
    call: Any, capsys: Any, plan_file: Path, recording: Path, tmp_path: Path
) -> None:
    assert call("run", plan_file, "--virtual", "-o", tmp_path / "a.mcap") == 0
    assert "latency roof, µs" not in capsys.readouterr().out
    assert call("compare", recording, tmp_path / "a.mcap", "--tolerance", "0") == 0


def test_the_slave_command_requires_the_name_of_a_planned_slave(
    call: Any, capsys: Any, plan_file: Path
) -> None:
    for words, sentence in (
        ((plan_file,), "say which one this is with --name (roof, cellar)"),
        ((plan_file, "--name", "rof"), "The plan names no slave 'rof': did you mean roof?"),
        (("default", "--name", "roof"), "leave out --name roof"),
    ):
        assert call("slave", *words) == 2
        assert sentence in capsys.readouterr().err
