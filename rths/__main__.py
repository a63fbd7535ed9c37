"""`rths VERB …`: distributed real-time hybrid testing from one command line."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path

import common
from common.errors import EXIT_CODES, InputError
from common.terminal import cli
from rths.first_kernel import compilation_said

VERBS = {
    "run": "run the whole test on this machine",
    "serve": "serve laboratories to a model of OpenSees, whose elements they are",
    "master": "run laboratory A of a test on several machines",
    "slave": "run laboratory B of a test on several machines",
    "record": "record a test on several machines",
    "live": "show a test while it runs, or its recording, in a browser",
    "panel": "operate a test from a browser: check, arm, start, stop, reset",
    "start": "begin a test whose armed laboratories wait for it",
    "stop": "stop a running test, in order or at once",
    "hold": "let the earthquake's time of a running test stand still, the specimens held",
    "resume": "let a held test go on",
    "reset": "let laboratories leave their latched safe state",
    "init": "write a plan to begin with, and the skeleton of a rig",
    "check": "describe a plan: periods, delays, peaks, likely slips of units, classes of your own that it would run",
    "simulate": "compute the closed loop of nominal models",
    "predict": "predict the next test from what a diagnosis found, with a band",
    "update": "write a plan with the nominal models that a diagnosis found",
    "campaign": "play tests and diagnose them, each time the one that tells most, until the cause is certain",
    "sweep": "compute many tests of a plan: motions, scales, parameters, compensators, drawn laboratories",
    "fragility": "fit the chance that a limit is passed against the motion's intensity to the table of a sweep",
    "bench": "test one part alone, recorded",
    "identify": "find a part's parameters in a bench recording",
    "inspect": "summarise a recording: completeness, peaks, tracking, latency",
    "report": "make one HTML page of a recording: verdict, pictures, tables, plan",
    "recover": "save the intact part of a damaged recording in a new file",
    "budget": "judge the latency of a recording against a budget",
    "plot": "draw a recording",
    "layout": "make a layout file with which Foxglove and Lichtblick show a recording",
    "replay": "compute a recording's commands again and compare them to the last bit",
    "catalog": "catalogue recordings: list them, find some by what happened in them, note something beside one",
    "compare": "compare two recordings or simulations signal by signal, or several side by side",
    "reproduce": "compute the seed paper's numbers and figures again",
    "benchmark2020": "run the field's public benchmark problem of 2020 with every compensator",
    "diagnose": "find the sim-to-real gap of a recording: where it lies, its cause, how far it closes",
    "blind": "check the diagnosis on cases whose effects it is not told",
    "keys": "make the certificates for a test on a secured link",
    "faults": "simulate tests with random faults, and check the invariants that must hold in all of them",
    "doctor": "check whether this machine will keep the interval",
    "import": "make a recording from data of your own",
    "export": "write a recording as CSV, Parquet or MAT, or a laboratory as an FMU",
    "completion": "write a script that makes the shell complete commands, options and files",
}

FOLDERS = {
    "rths.perform": ("run", "campaign", "serve", "live", "panel", "start", "stop", "hold", "resume", "reset"),
    "rths.prepare": (
        "init",
        "check",
        "simulate",
        "predict",
        "update",
        "sweep",
        "bench",
        "identify",
        "keys",
        "doctor",
    ),
    "rths.examine": (
        "inspect",
        "report",
        "recover",
        "budget",
        "plot",
        "layout",
        "replay",
        "catalog",
        "compare",
        "diagnose",
        "fragility",
        "export",
    ),
    "rths.prove": ("reproduce", "benchmark2020", "blind", "faults"),
    "rths": ("completion",),
}

MODULES = {verb: f"{folder}.{verb}" for folder, verbs in FOLDERS.items() for verb in verbs} | {
    "import": "rths.examine.import_",
    "master": "master.__main__",
    "slave": "slave.__main__",
    "record": "recorder.__main__",
}


def check_home() -> str:
    """A sentence where the `common` that Python found is not the one beside this program, else empty."""
    here, found = Path(__file__).resolve().parent.parent, Path(common.__file__).resolve().parent.parent
    if here == found:
        return ""
    return f"another package named 'common' in {found} hides this program's; start rths from elsewhere."


def parser_for(verb: str) -> argparse.ArgumentParser:
    """The parser of one command."""
    parser = cli.Parser(
        prog=f"rths {verb}",
        description=f"{VERBS[verb][0].upper()}{VERBS[verb][1:]}.",
        epilog=f"example: {EXAMPLES[verb]}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    fill(parser, verb)
    return parser


def fill(parser: argparse.ArgumentParser, verb: str) -> None:
    """Give a parser the arguments of a command, and what runs it as the default `run`."""
    module = importlib.import_module(MODULES[verb])
    module.add_arguments(parser)
    parser.set_defaults(run=module.run)


EXAMPLES = {
    "run": "rths run --duration 10 --scale 0.2",
    "serve": "rths serve single_site --opensees 127.0.0.1:8090",
    "master": "rths master default --listen tcp/0.0.0.0:7447",
    "slave": "rths slave default --connect tcp/192.0.2.1:7447",
    "record": "rths record default --connect tcp/192.0.2.1:7447 -o test.mcap",
    "live": "rths live runs/default-20260101-120000.mcap",
    "panel": "rths panel default --duration 20",
    "start": "rths start --reason ready",
    "stop": "rths stop --emergency",
    "hold": "rths hold --reason cracks",
    "resume": "rths resume",
    "reset": "rths reset --reason inspected",
    "init": "rths init my_test",
    "check": "rths check test.toml",
    "simulate": "rths simulate default --ideal --no-amd",
    "predict": "rths predict default --found found.toml --scale 0.2 --html prediction.html",
    "update": "rths update default --found found.toml -o corrected.toml",
    "campaign": "rths campaign goal.toml -o runs/campaign",
    "sweep": "rths sweep sweep.toml --jobs 2 -o sweep.parquet",
    "fragility": "rths fragility sweep.parquet --quantity peak_drift --limit 20mm --html fragility.html",
    "bench": "rths bench actuator paper -o actuator.mcap",
    "identify": "rths identify actuator.mcap",
    "budget": "rths budget runs/default-20260101-120000.mcap --budget laboratory.toml",
    "inspect": "rths inspect runs/default-20260101-120000.mcap",
    "report": "rths report runs/default-20260101-120000.mcap -o test.html",
    "recover": "rths recover runs/default-20260101-120000.mcap -o whole.mcap",
    "plot": "rths plot runs/default-20260101-120000.mcap -o pictures",
    "layout": "rths layout runs/default-20260101-120000.mcap -o layout.json",
    "replay": "rths replay runs/default-20260101-120000.mcap",
    "catalog": "rths catalog find outcome=tripped --peak drift",
    "compare": "rths compare a.mcap b.mcap --tolerance 0",
    "reproduce": "rths reproduce -o runs/reproduce",
    "benchmark2020": "rths benchmark2020 --plants 5 --only sample,amb",
    "diagnose": "rths diagnose runs/default-20260101-120000.mcap --html gap.html",
    "blind": "rths blind --cases 300 --jobs 2 -o runs/blind",
    "keys": "rths keys keys --plan test.toml --host 192.0.2.1",
    "faults": "rths faults --schedules 100 --jobs 2",
    "doctor": "rths doctor --seconds 20 -o runs",
    "import": "rths import drive.csv --map drive.toml -o drive.mcap",
    "export": "rths export runs/default-20260101-120000.mcap -o test.csv",
    "completion": "rths completion bash > ~/.rths.bash && echo '. ~/.rths.bash' >> ~/.bashrc",
}


def overview() -> str:
    """The text of `rths --help`."""
    width = max(map(len, VERBS))
    rows = "\n".join(f"  {verb:<{width}}  {text}" for verb, text in VERBS.items())
    codes = "\n".join(f"  {code}  {meaning}" for code, meaning in EXIT_CODES.items())
    return (
        "usage: rths VERB [options]\n       rths --version\n\n"
        "Distributed real-time hybrid testing: two laboratories, one structure, 2 ms.\n\n"
        f"{rows}\n\nexit codes:\n{codes}\n\n'rths VERB --help' explains a verb with an example.\n"
    )


def main() -> int:
    """Entry of the console script."""
    return cli.guarded(lambda: command(sys.argv[1:]))


def command(words: Sequence[str]) -> int:
    """Run the command line; its exit code.

    Raises:
        RthsError: the command cannot be run, or failed.
    """
    if words and words[0] == "--version":
        from importlib.metadata import version

        sys.stdout.write(f"rths {version('rths')}\n")
        return 0
    if not words or words[0] in ("-h", "--help"):
        sys.stdout.write(overview())
        return 0 if words else 2
    if complaint := check_home():
        raise InputError(complaint)
    verb = words[0]
    if verb not in VERBS:
        from common.plan.schema import nearest

        raise InputError(f"unknown command '{verb}': {nearest(verb, VERBS)}")
    args = parser_for(verb).parse_intermixed_args(words[1:])
    with compilation_said():
        return int(args.run(args))


if __name__ == "__main__":
    sys.exit(main())
