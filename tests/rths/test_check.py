"""`rths check`: the figures of a plan, mistaken units, and classes that are listed and never run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from common.plan import read as plans
from common.terminal import cli
from loop.nominal import preflight
from report.plan import classes
from rths.perform.run import checks
from tests.common.udp.server import example, served
from tests.helpers import ROOT

SHORT = "[test]\nduration = 4.0\n[control]\namd = false\n"
UNHURRIED = "[preflight]\nlate_share = 1.0\n"  # every answer may be late, as on a loaded machine


def checked(call: Any, capsys: Any, path: Path | str) -> tuple[int, dict[str, Any]]:
    code = call("check", path, "--json")
    return code, json.loads(capsys.readouterr().out)


def test_check_prints_the_figures_of_the_default_plan(call: Any, capsys: Any) -> None:
    code, facts = checked(call, capsys, "default")
    assert (code, facts["ready"], facts["stable"]) == (0, True, True)
    assert (facts["slips"], facts["classes"], facts["refused"]) == ([], [], [])
    (mode,) = facts["structure"]["modes"]
    assert mode["period"] == pytest.approx(0.5027, abs=1e-4)
    assert mode["damping_ratio"] == pytest.approx(0.05, abs=1e-3)
    assert facts["delay"]["critical"] == pytest.approx(0.0329, abs=1e-4)
    assert facts["delay"]["margin"] == pytest.approx(facts["delay"]["critical"] / facts["delay"]["expected"])
    assert facts["peaks"]["damper_stroke"]["peak"] == pytest.approx(0.048, abs=1e-3)
    assert facts["recording"]["bytes"] == pytest.approx(10e6, rel=0.2)


def test_every_peak_of_a_users_kind_has_its_unit(call: Any, capsys: Any) -> None:
    code, facts = checked(call, capsys, ROOT / "examples" / "viscous_damper.toml")
    units = {name: peak["unit"] for name, peak in facts["peaks"].items() if name.startswith("piston")}
    assert code == 0
    assert units == {
        "piston_command": "m",
        "piston_displacement": "m",
        "piston_force": "N",
        "piston_velocity": "m/s",
        "piston_error": "m",
    }


def test_check_computes_the_same_as_pre_flight(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(SHORT)
    plan = plans.load(path)
    assert preflight.findings(plan).checks == preflight.checks(plan) == checks(plan, tmp_path / "a.mcap")[:2]


@pytest.mark.parametrize("name", cli.SHIPPED)
def test_the_shipped_plans_have_no_mistaken_units(name: str, call: Any, capsys: Any) -> None:
    code, facts = checked(call, capsys, name)
    assert (code, facts["slips"]) == (0, [])


@pytest.mark.parametrize(
    ("text", "where", "words"),
    [
        (
            "[structure]\nmass = 160.0\n",
            "[structure]",
            "mass in [structure] (t in place of kg), with which it would be 0.503 s",
        ),
        (
            "[structure]\nstiffness = 25e3\n[column]\nstiffness = 12.5e3\n",
            "[structure]",
            "(kN/m in place of N/m)",
        ),
        (
            "[structure]\nstiffness = 25.0\n[column]\nstiffness = 12.5\n",
            "[structure]",
            "(kN/mm in place of N/m)",
        ),
        ("[structure]\ndamping = 200.0\n", "damping in [structure]", "N·s/m"),
        ("[column]\nstiffness = 12.5e3\n", "stiffness in [column]", "1e+03 times as much"),
        ("[limits]\ndisplacement = 150.0\n", "displacement in [limits]", "0.15 for 150 mm"),
        (
            "[limits]\ncolumn_force = 400.0\n[ground_motion]\nscale = 1.0\n",
            "column_force in [limits]",
            "400e3 for",
        ),
        ("[sensors]\ncolumn_displacement = 5.0\n", "column_displacement in [sensors]", "must be in m"),
        ("[ground_motion]\nscale = 1e-4\n", "scale in [ground_motion]", "0.1 for 10 %"),
        ("[actuator]\ntime_constant = 30.0\n", "time_constant in [actuator]", "must be in s"),
    ],
)
def test_a_mistaken_unit_is_pointed_out(
    text: str, where: str, words: str, call: Any, capsys: Any, tmp_path: Path
) -> None:
    (tmp_path / "p.toml").write_text(SHORT + text)
    _, facts = checked(call, capsys, tmp_path / "p.toml")
    (slip,) = [slip for slip in facts["slips"] if slip["where"] == where]
    assert words in slip["text"]


@pytest.mark.parametrize(
    ("numbers", "words"), [("0.0\n0.3\n-0.2\n", "numbers are in g"), ("0.0\n300\n-200\n", "are in gal")]
)
def test_a_record_in_another_unit_is_pointed_out(
    numbers: str, words: str, call: Any, capsys: Any, tmp_path: Path
) -> None:
    (tmp_path / "site.txt").write_text(numbers * 50)
    (tmp_path / "p.toml").write_text(
        SHORT + '[ground_motion]\nrecord = "site.txt"\ndt = 0.01\nscale = 0.01\n'
    )
    _, facts = checked(call, capsys, tmp_path / "p.toml")
    assert [words in slip["text"] for slip in facts["slips"]] == [True]


def test_a_plan_that_pre_flight_would_refuse_gives_exit_code_1(
    call: Any, capsys: Any, tmp_path: Path
) -> None:
    (tmp_path / "p.toml").write_text("[actuator]\ndelay = 0.2\n")
    code, facts = checked(call, capsys, tmp_path / "p.toml")
    assert (code, facts["ready"], facts["stable"], facts["peaks"]) == (1, False, False, {})
    assert [risk["name"] for risk in facts["refused"]] == ["partition", "peaks"]
    assert call("check", tmp_path / "p.toml") == 1
    text = capsys.readouterr().out
    assert "unstable" in text
    assert "raise" not in text


def test_an_invalid_plan_gives_exit_code_2(call: Any, capsys: Any, tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text("[test]\ninterval = 2\n")
    assert call("check", tmp_path / "p.toml") == 2
    assert "interval in [test] is 2.0, but must be" in capsys.readouterr().err


def test_classes_are_named_with_their_files_and_never_imported(
    call: Any, capsys: Any, tmp_path: Path
) -> None:
    for folder in (tmp_path, tmp_path / "package"):
        folder.mkdir(exist_ok=True)
        (folder / "lab.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\nclass Lab: ...\n")
    (tmp_path / "package" / "__init__.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    (tmp_path / "p.toml").write_text(
        SHORT + '[master.rig]\nclass = "lab.py:Lab"\n[slave.rig]\nclass = "gone\\u001b[2J.py:Lab"\n'
    )
    assert call("check", tmp_path / "p.toml") == 0
    text = capsys.readouterr().out
    assert f"[master.rig] runs the class 'lab.py:Lab' from {tmp_path / 'lab.py'}, with your rights" in text
    assert "only run plans that you trust" in text
    assert "from a file that is not there" in text
    assert "\x1b" not in text
    assert not (tmp_path / "ran").exists()


def test_the_class_of_a_users_kind_is_listed_and_with_classes_only_not_imported(
    call: Any, capsys: Any, tmp_path: Path
) -> None:
    (tmp_path / "own.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\nclass Own: ...\n")
    (tmp_path / "p.toml").write_text(SHORT + '[slave]\nkind = "own.py:Own"\n')
    assert call("check", tmp_path / "p.toml", "--classes") == 0
    said = f"[slave] runs the class 'own.py:Own' from {tmp_path / 'own.py'}, with your rights"
    assert capsys.readouterr().out.startswith(said)
    assert call("check", tmp_path / "p.toml", "--classes", "--json") == 0
    (found,) = json.loads(capsys.readouterr().out)["classes"]
    assert found == {"where": "slave", "name": "own.py:Own", "file": str(tmp_path / "own.py")}
    assert not (tmp_path / "ran").exists()


def test_the_file_of_a_module_is_found_without_importing_its_package(
    monkeypatch: Any, tmp_path: Path
) -> None:
    (tmp_path / "package7").mkdir()
    for name in ("__init__", "lab"):
        (tmp_path / "package7" / f"{name}.py").write_text("raise SystemExit\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert classes.file_of("package7.lab:Lab", tmp_path) == str(tmp_path / "package7" / "lab.py")
    assert classes.file_of("package7.none:Lab", tmp_path) == ""
    assert classes.file_of("none7.lab:Lab", tmp_path) == ""


def test_a_rig_in_another_process_is_checked_for_presence(call: Any, capsys: Any, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    with served(example.Column, example.CHANNELS) as address:
        path.write_text(f'{SHORT}{UNHURRIED}[master.rig]\naddress = "{address}"\n')
        code, facts = checked(call, capsys, path)
        assert call("check", path) == 0
    text = capsys.readouterr().out
    (rig,) = facts["rigs"]
    assert (code, rig["where"], rig["address"], rig["there"]) == (0, "master.rig", address, True)
    assert (rig["exchanges"], rig["lost"], rig["channels"]) == (50, 0, "0xf348fb44")
    assert 0.0 < rig["round_trip_p50"] <= rig["round_trip_p99"]
    assert f"master.rig        {address}, channels 0xf348fb44: 50 of 50 exchanges, round trip p50 " in text
    assert "its rigs are in other processes." in text


def test_check_refuses_a_rig_that_is_absent_or_of_another_kind(
    call: Any, capsys: Any, tmp_path: Path
) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f'{SHORT}[master.rig]\naddress = "udp/9"\n')
    code, facts = checked(call, capsys, path)
    assert (code, facts["ready"], facts["rigs"][0]["there"]) == (1, False, False)
    assert facts["refused"][-1]["name"] == "rig"
    assert facts["refused"][-1]["sentence"].startswith("nothing answers at udp/9: start the rig's program")
    with served(example.Column, example.CHANNELS) as address:
        path.write_text(f'{SHORT}[slave.rig]\naddress = "{address}"\n')
        code, facts = checked(call, capsys, path)
    assert code == 1
    assert "it is the rig of another kind of laboratory" in facts["refused"][-1]["sentence"]


@pytest.mark.parametrize(
    ("rig", "text"),
    [
        ('class = "a.py:B"\naddress = "udp/9100"', "[master.rig] gives a class and an address"),
        ('options = { a = 1 }\naddress = "udp/9100"', "options in [master.rig] are for a class"),
        ('address = "tcp/9100"', "address in [master.rig] is 'tcp/9100', but must be udp/HOST:PORT"),
        ('address = "udp/9100"\nanswer_share = 1.5', "answer_share in [master.rig]"),
    ],
)
def test_keys_of_a_rig_that_do_not_fit_are_refused(
    rig: str, text: str, call: Any, capsys: Any, tmp_path: Path
) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f"{SHORT}[master.rig]\n{rig}\n")
    assert call("check", path) == 2
    assert text in capsys.readouterr().err
