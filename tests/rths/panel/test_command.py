"""`rths panel` and `rths run --await-start` as a user calls them: sentences, addresses, exit codes."""

from __future__ import annotations

import argparse
import json
import signal
from pathlib import Path
from typing import Any

import pytest

from rths.__main__ import parser_for
from rths.perform import panel


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["panel", "--host", "0.0.0.0"], "--host '0.0.0.0' cannot be used: give the one name or address"),
        (["panel", "--port", "70000"], "--port 70000 must be from 1 to 65535"),
        (["panel", "--accept-risk", "peak"], "There is no risk 'peak' to accept: did you mean peaks?"),
        (
            ["panel", "nothing.toml"],
            "Cannot read the plan nothing.toml: No such file or directory; give the path",
        ),
        (["panel", "--host", "lab.invalid"], "Cannot serve the panel under lab.invalid on port 0: "),
        (["run", "--virtual", "--await-start"], "--await-start is for a test in real time"),
        (["start"], "No test runs on this machine"),
    ],
)
def test_a_mistake_gives_one_sentence(
    words: list[str], sentence: str, call: Any, capsys: Any, monkeypatch: Any, tmp_path: Path
) -> None:
    monkeypatch.setenv("RTHS_RUNNING", str(tmp_path))
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    assert call(*words) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"rths: {sentence}")
    assert err.count("\n") == 1


class Served:
    """Stands for the server: notes its address, and ends at once."""

    urls: list[str]

    def __init__(self, feed: object, port: int, rate: float, *, host: str, panel: Any) -> None:
        assert feed is None
        assert 1.0 < rate <= 10.0
        self.url = panel(port or 5006).guard.url
        Served.urls = [host, self.url]

    def run(self, stopping: object, *, leave: bool) -> None:
        assert stopping
        assert not leave


@pytest.mark.parametrize(
    ("options", "token"),
    [((), False), (("--token",), True), (("--host", "lab.example"), True), (("--host", "localhost"), False)],
)
def test_users_of_other_machines_need_the_printed_token(
    options: tuple[str, ...], token: bool, call: Any, capsys: Any, monkeypatch: Any, tmp_path: Path
) -> None:
    monkeypatch.setenv("RTHS_RUNNING", str(tmp_path))
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    monkeypatch.setattr(panel, "lower", lambda: None)
    monkeypatch.setattr("report.live.server.Server", Served)
    assert call("panel", "--no-browser", "--json", *options) == 0
    host, url = Served.urls
    assert json.loads(capsys.readouterr().out) == {"url": url}
    address, _, given = url.partition("?token=")
    assert address == f"http://{host}:5006/"
    assert (len(given) > 40) is token


def words_of(*words: str) -> argparse.Namespace:
    return parser_for("panel").parse_args(list(words))


def test_the_commands_of_the_panel_get_its_options() -> None:
    args = words_of(
        "paper",
        "--duration",
        "5",
        "--seed",
        "3",
        "--rt",
        "off",
        "--beside",
        "--accept-risk",
        "peaks",
        "--reality",
        "r",
    )
    plan = panel.plan_words(args)
    assert Path(plan[0]).name == "paper.toml"
    assert plan[1:] == ["--duration", "5.0", "--seed", "3"]
    assert parser_for("check").parse_args(plan).seed == 3
    run = parser_for("run").parse_args([*plan, *panel.run_words(args), "--await-start", "--reports"])
    assert (run.duration, run.rt, run.beside, run.accept_risk, run.reality) == (
        5.0,
        "off",
        True,
        ["peaks"],
        Path("r"),
    )
    doctor = parser_for("doctor").parse_args(panel.doctor_words(args))
    assert (doctor.interval, doctor.rt, doctor.output) == (0.002, "off", Path("runs"))
