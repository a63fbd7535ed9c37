"""Every command that a document shows is run and its output compared; what cannot run here is listed and counted."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from docs import console
from docs.console import Block
from rths.__main__ import EXAMPLES, VERBS, parser_for
from tests.helpers import ROOT

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
NAMES = [str(path.relative_to(ROOT)) for path in PAGES]

# what a command of a page does in real time: it has the machine to itself, and is tried again, because a machine that
# is held up for long enough ends a test, as it should
REAL_TIME = re.compile(r"\brths (?:(?:run|serve)(?!.* --virtual)|master|record|doctor)\b")
TRIES = 3
# module that a page needs beside what `make setup` installs, and the target of make that installs it
NEEDS = {
    "docs/how-to/opensees-building.md": ("openseespy", "opensees"),
    "docs/how-to/opensees-server.md": ("openseespy", "opensees"),
    "docs/how-to/opensees-specimen.md": ("openseespy", "opensees"),
    "docs/how-to/fmus.md": ("fmpy", "fmi"),
}

COMMAND = re.compile(
    r"(?:\$ |[A-Z_]+=\S+ )?(?:\S*/)?(?:rths|make|python3?|pip|pytest|git|docker|ssh|scp|for|until)\b(?!:)"
)
# what cannot run here: it fetches, installs, needs another machine, or takes minutes and has tests of its own
UNRUN = {
    "README.md": ["git clone <this repository> rths && cd rths", "make run", "make test"],
    "docs/explanation/real_data.md": [
        "for v in 4-D22 8-D22 4-D22_bondslip 8-D22_bondslip; do",
        "rths import tests/data/fiber_column/column_$v.csv --map examples/real_data/column_${v}_map.toml"
        " -o runs/column_$v.mcap",
        "rths diagnose runs/column_$v.mcap",
    ],
    "docs/how-to/opensees-server.md": [
        "rths serve two_columns --opensees 127.0.0.1:8090 --opensees 127.0.0.1:8091 --intervals 2"
    ],
    "docs/how-to/own-data.md": [
        "rths import cycles.csv --map column_map.toml -o cycles.mcap",
        "rths import earthquake.csv --map column_map.toml -o earthquake.mcap",
        "rths diagnose cycles.mcap",
        "rths diagnose cycles.mcap --validate earthquake.mcap",
    ],
    "docs/how-to/panel.md": [
        "rths panel default --host lab-a.example.net --port 5006",
        "ssh -L 5006:127.0.0.1:5006 lab-a.example.net",
    ],
    "docs/how-to/security.md": [
        "ssh b mkdir -m 700 test/keys",
        "scp keys/authority.pem keys/slave.pem keys/slave.key b:test/keys/",
        "RUST_LOG=zenoh_link_tls=warn,zenoh::net::routing::interceptor=trace rths master test.toml",
    ],
    "docs/how-to/several-dampers.md": [
        "rths slave two_dampers --name roof --connect tcp/192.0.2.1:7447",
        "rths slave two_dampers --name middle --connect tcp/192.0.2.1:7447",
    ],
    "docs/reference/blind.md": [
        "rths blind --cases 300 --jobs 2 -o runs/blind",
        "rths blind --set loggers --cases 90 --seed 17 -o runs/loggers",
        "rths blind --set unlisted_tune --seed 1 --cases 35 --duration 12",
        "python -m validation.blind.learn runs/*/results.json",
    ],
    "docs/reference/blind_trials.md": [
        "rths blind --set loggers --seed 8666 --cases 30 --duration 12",
        "rths blind --set loggers --seed 8777 --cases 45 --duration 12",
        "rths blind --set loggers --seed 8888 --cases 30 --duration 12",
        "rths blind --set loggers --seed 8999 --cases 30 --duration 12",
        "rths blind --set loggers --seed 9111 --cases 45 --duration 12",
        "rths blind --set loggers --seed 9111 --cases 60 --duration 12 --only catalogue",
        "rths blind --set loggers --seed 9222 --cases 60 --duration 12 --only catalogue",
        "rths blind --set loggers --seed 9333 --cases 30 --duration 12 --only catalogue",
        "rths blind --set loggers --seed 9444 --cases 60 --duration 12",
        "rths blind --set loggers --seed 9555 --cases 30 --only clean --duration 12",
        "rths blind --set loggers --seed 9666 --cases 30 --only clean --duration 12",
        "rths blind --set loggers --seed 9668 --cases 30 --only clean --duration 12",
        "rths blind --set loggers --seed 9669 --cases 30 --only catalogue --duration 12",
        "rths blind --set loggers --seed 9670 --cases 30 --only clean --duration 12",
        "rths blind --set loggers --seed 9671 --cases 30 --only catalogue --duration 12",
        "rths blind --set loggers --seed 9672 --cases 24 --only catalogue --duration 12",
        "rths blind --set loggers --seed 9673 --cases 30",
        "rths blind --set loggers --seed 9674 --cases 30 --only catalogue --duration 12",
        "rths blind --set loggers --seed 9675 --cases 16 --only clean --duration 12",
        "rths blind --set loggers --seed 9677 --cases 30",
        "rths blind --set loggers --seed 9678 --cases 16 --only clean --duration 12",
        "rths blind --set loggers --seed 9777 --cases 90 --only catalogue --duration 12",
        "rths blind --set out_of_step --seed 1 --cases 11 --only clean --duration 12",
        "rths blind --set out_of_step --seed 2 --cases 33 --duration 12",
        "rths blind --set out_of_step --seed 3 --cases 44 --duration 12",
        "rths blind --set independent --seed 7333 --cases 30 --duration 12",
        "rths blind --set independent --seed 7444 --cases 18 --duration 12",
        "rths blind --set independent --seed 7555 --cases 24 --duration 20",
        "rths blind --set independent --only pair --seed 7601 --cases 14 --duration 12",
        "rths blind --set independent --seed 7666 --cases 24 --duration 12",
        "rths blind --set independent --only pair --seed 7888 --cases 16 --duration 12",
        "rths blind --set independent --seed 7999 --cases 24 --duration 12",
        "rths blind --set independent --seed 8111 --cases 24 --duration 12",
        "rths blind --set independent --seed 8333 --cases 36 --duration 12",
        "rths blind --set independent --seed 8555 --cases 36 --duration 12",
        "rths blind --set many --seed 5407 --cases 14 --duration 12",
        "rths blind --set judge --seed 9940 --cases 40 --only catalogue,formula,unknown,pair --duration 12",
        "rths blind --cases 240 --set judge --seed 2026 --jobs 2 -o runs/blind",
        "rths blind --set unlisted --seed 77301 --cases 35 --duration 12",
        "rths blind --set unlisted --seed 77302 --cases 35 --duration 12",
        "rths blind --set unlisted --seed 77303 --cases 35 --duration 12",
        "rths blind --set unlisted --seed 77304 --cases 35 --duration 12",
        "rths blind --set unlisted --seed 77305 --cases 35 --duration 12",
        "rths blind --set unlisted --seed 77306 --cases 35 --duration 12",
        "rths blind --set unlisted --seed 77307 --cases 24 --only unknown --duration 12",
        "rths blind --set unlisted --seed 77308 --cases 24 --only unknown --duration 12",
        "rths blind --set unlisted --seed 77309 --cases 30",
        "rths blind --set unlisted --seed 77310 --cases 24 --only unknown --duration 12",
        "rths blind --set unlisted --seed 77311 --cases 32 --only unknown --duration 12",
        "rths blind --set unlisted_tune --seed 1 --cases 35 --duration 12",
        "rths blind --predict --cases 24 --seed 21 --only catalogue,formula,unknown --duration 20",
        "rths blind --predict --set materials --cases 8 --seed 3 --duration 20",
        "rths blind --predict --cases 22 --seed 9118 --only catalogue,formula,unknown --duration 12",
        "rths blind --predict --cases 40 --seed 9333 --only catalogue,formula,unknown --duration 12",
        "rths blind --set tune --seed 5101 --cases 50 --duration 12 --only catalogue,formula,pair,unknown "
        "-o runs/tune",
        "rths blind --set normal --seed 5104 --cases 36 --duration 12 --only catalogue,formula,pair,unknown "
        "-o runs/normal",
        "rths blind --set independent --seed 5105 --cases 30 --duration 12 --only formula,pair -o runs/own",
        "rths blind --set loggers --seed 5102 --cases 36 --duration 12 --only catalogue -o runs/loggers",
        "rths blind --set many --seed 5103 --cases 24 --duration 12 --only many -o runs/many",
        "rths blind --set tune --seed 8301 --cases 24 --duration 12 --only unknown,clean -o runs/unknown",
        "python -m validation.blind.learn runs/*/results.json",
    ],
    "docs/reference/faults.md": [
        "make test",
        "make faults",
        "make matrix",
        "rths faults --schedules 1000 --jobs 2",
        "rths faults --recorded --schedules 100",
        "pip install atheris==3.0.0",
        "python fuzz/decode.py -max_total_time=600 -seed=1",
        "RTHS_SOAK=600 make soak",
        "python -m benchmarks false_trips",
        'for seed in 1 2 3 4 5 6 7 8; do rths run --seed $seed -o runs/quiet-$seed.mcap || echo "stopped: $seed"; done',
        "rths budget runs/quiet-1.mcap --json",
    ],
    "docs/tutorial.md": ["git clone <this repository> rths && cd rths", "make setup"],
}

SOURCES = {"toml", "python", "mermaid", "json"}
OUTPUT = "text"  # of which a line after a prompt is a command all the same


def found(path: Path) -> list[Block]:
    """The blocks of a page."""
    return list(console.blocks(path.read_text(encoding="utf-8")))


def unrun(path: Path) -> list[str]:
    """Commands of a page in blocks that are not run."""
    kept = (block for block in found(path) if block.language not in {"console", *SOURCES})
    lines = (
        line.strip()
        for block in kept
        if not block.directive
        for line in block.text.splitlines()
        if block.language != OUTPUT or line.startswith("$ ")
    )
    return [re.split(r" +# ", line)[0] for line in lines if COMMAND.match(line)]


RUN = [
    name for name, path in zip(NAMES, PAGES, strict=True) if any(b.language == "console" for b in found(path))
]


def in_real_time(name: str) -> bool:
    """Whether a command of a page runs a test in real time."""
    shown = (block for block in found(ROOT / name) if block.language == "console")
    return any(REAL_TIME.search(command.text) for block in shown for command in console.commands(block.text))


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", RUN)
def test_a_page_shows_what_its_commands_print(name: str, tmp_path: Path) -> None:
    module, target = NEEDS.get(name, ("", ""))
    if module and find_spec(module) is None:
        pytest.skip(f"{module} is not installed: make {target}")
    complaints = ["not run"]
    for attempt in range(TRIES if in_real_time(name) else 1):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        complaints = console.play(ROOT / name, folder)
        if not complaints:
            break
    assert complaints == [], "\n\n".join(complaints)


def test_every_command_that_is_not_run_is_listed_here() -> None:
    assert {name: lines for name, path in zip(NAMES, PAGES, strict=True) if (lines := unrun(path))} == UNRUN


def test_a_command_in_a_block_that_is_not_run_is_detected(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "    rths run\n\n```sh\n$ make test  # all\n```\n\n```\nRTHS_SOAK=6 make faults\nrths: no\n```\n\n"
        "```console\n$ rths doctor\n```\n\n```text\nrths run, p99\n$ rths run\n```\n"
    )
    assert unrun(page) == ["rths run", "$ make test", "RTHS_SOAK=6 make faults", "$ rths run"]


@pytest.mark.parametrize("name", NAMES)
def test_a_file_that_a_page_has_written_is_named_in_its_text(name: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    for block in found(ROOT / name):
        if block.directive == "file":
            before = text[: text.index(f"<!-- file: {block.name} -->")]
            assert f"`{block.name}`" in before[-600:], block.name


@pytest.mark.parametrize("verb", VERBS)
def test_the_example_in_a_commands_help_is_accepted_by_the_command(verb: str) -> None:
    program, name, *words = shlex.split(EXAMPLES[verb].partition(" >")[0])
    assert (program, name) == ("rths", verb)
    parser_for(verb).parse_args(words)


@pytest.mark.parametrize("name", ["my_lab.py", "my_test.toml"])
def test_the_laboratory_on_the_page_equals_the_shipped_example(name: str) -> None:
    shown = {block.name: block.text for block in found(ROOT / "docs/how-to/own-laboratory.md")}
    assert shown[name] == (ROOT / "examples" / name).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", NAMES)
def test_a_link_of_a_page_leads_to_a_file_and_a_heading_that_exist(name: str) -> None:
    path = ROOT / name
    for link in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")):
        if re.match(r"https?:", link):
            continue
        file, _, anchor = link.partition("#")
        target = path.parent / file if file else path
        assert target.exists(), link
        assert not anchor or anchor in anchors(target.read_text(encoding="utf-8")), link


def anchors(text: str) -> set[str]:
    """What the headings of a Markdown text are called in links."""
    headings = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_the_site_is_built_without_a_warning_and_needs_no_network(tmp_path: Path) -> None:
    built = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert built.returncode == 0, built.stderr
    pages = list((tmp_path / "site").rglob("*.html"))
    assert len(pages) > len(PAGES) - 1
    for path in pages:
        html = path.read_text(encoding="utf-8")
        loaded = re.findall(r"<(?:script|img|iframe)[^>]* src=\"(\w+:)?//", html)
        loaded += re.findall(r"<link[^>]* href=\"((?:\w+:)?//[^\"]*)", html)
        assert loaded == [], path
    for path in (tmp_path / "site").rglob("*.css"):
        assert "url(http" not in path.read_text(encoding="utf-8"), path
