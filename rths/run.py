"""`rths run`: the whole test on this machine, real time or virtual, with its summary."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from common import cli
from common.drive import Stopper
from common.errors import InputError, InterlockError, LostError, RthsError
from common.plan import Plan
from common.reality import Reality
from common.realtime import assign, freeze
from common.roles import title
from rths.terminal import Progress

ERRORS = {2: InputError, 3: InterlockError, 4: LostError}
POLL_S = 0.1
UNSAID = ("machine", "bare_loop")  # for the recording


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `run`."""
    cli.plan_arguments(parser, optional=True)
    cli.reality_argument(parser)
    cli.rt_arguments(parser)
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument("--real-time", action="store_true", help="a process each, wall clock (default)")
    clock.add_argument(
        "--virtual", action="store_true", help="one process, virtual clock, as fast as it goes"
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="the recording (default: runs/<test>-<time>.mcap)"
    )
    cli.json_argument(parser, "write the summary as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Run a test; its exit code."""
    from recorder.files import choose_path

    plan = cli.load_plan(args)
    reality = cli.load_reality(args.reality, plan)
    output = choose_path(args.output, plan)
    stopping = Stopper()
    error = (
        in_virtual_time(plan, reality, output, stopping)
        if args.virtual
        else in_real_time(args, plan, reality, output, stopping)
    )
    if output.exists() and output.stat().st_size:
        show(output, args.json)
    if error is not None:
        raise error
    return 0


def in_virtual_time(plan: Plan, reality: Reality, output: Path, stopping: Stopper) -> RthsError | None:
    """The test in this process; the error that ended it."""
    from rths import virtual

    bench = virtual.assemble(plan, reality, output, virtual_report)
    sys.stderr.write(f"{before_the_start(plan)}\n")
    freeze()
    started = time.monotonic()
    error = virtual.run(bench, stopping)
    seconds = time.monotonic() - started
    sys.stderr.write(f"{plan.test.duration:g} s of test in {seconds:.1f} s of computing\n")
    return error


def before_the_start(plan: Plan) -> str:
    """What the nominal models say about the loop that is about to be closed."""
    from rths.partition import assess, sentence

    return f"before the start: {sentence(assess(plan))}"


def virtual_report(kind: str, data: Any) -> None:
    """Events of a test in virtual time, on standard error."""
    if kind == "event":
        cli.text_report(kind, data)


def in_real_time(
    args: argparse.Namespace, plan: Plan, reality: Reality, output: Path, stopping: Stopper
) -> RthsError | None:
    """The test in a process each; the error that ended it."""
    from common.zenoh_link import listenable
    from rths.processes import Processes

    check(reality)
    processes = Processes()
    progress = Progress(plan.test.duration)
    endpoint = listenable()
    warm_up(progress)
    progress.say(before_the_start(plan))
    progress.say(f"{plan.test.name}: {plan.test.duration:g} s, starting master, {crew(plan)} and recorder")
    try:
        start_all(processes, args, plan.roles, endpoint, output)
        first = follow(processes, progress, stopping)
    finally:
        processes.kill()
        progress.end()
    return verdict(processes, first)


def crew(plan: Plan) -> str:
    """The slaves of a test in words."""
    return "slave" if not plan.slaves else f"slaves {', '.join(plan.slaves)}"


def check(reality: Reality) -> None:
    """Raise InputError where a laboratory could not be built, before any process starts."""
    import master.assembly
    import slave.assembly
    from common.links import link_model

    master.assembly.check(reality)
    for role in reality.plan.roles:
        slave.assembly.check(reality.of(role))
        link_model(reality.of(role))


def warm_up(progress: Progress) -> None:
    """Compile the kernels before the processes start, where this machine has not done so yet."""
    from models import cache

    if not cache.warm():
        progress.say("compiling the kernels, once on this machine (about half a minute)")
        from models.warm import compile_all

        compile_all()


def start_all(
    processes: Any, args: argparse.Namespace, roles: Sequence[str], endpoint: str, output: Path
) -> None:
    """Start master, slaves and recorder with the plan's options; `roles` are those of the slaves."""
    words = [str(cli.plan_path(args.plan))]
    for option in ("duration", "scale", "seed"):
        value = getattr(args, option)
        if value is not None:
            words += [f"--{option}", repr(value)]
    secret = ["--reality", str(args.reality)] if args.reality else []
    places = [real_time_words(args.rt, processor) for processor in assign(1 + len(roles))]
    processes.start("master", [*words, *secret, *places[0], "--listen", endpoint])
    for role, place in zip(roles, places[1:], strict=True):
        processes.start(role, [*words, *secret, *place, "--connect", endpoint])
    processes.start("recorder", [*words, "--connect", endpoint, "-o", str(output)])


def real_time_words(mode: str, processor: int | None) -> list[str]:
    """Options of a laboratory's process."""
    place = [] if processor is None else ["--processor", str(processor)]
    return ["--rt", mode, *place]


def follow(processes: Any, progress: Progress, stopping: Stopper) -> dict[str, int]:
    """Show what the processes say until all have ended; the exit codes of those that failed first.

    A wish to stop goes to the master, once; so does the end of another process.
    """
    first: dict[str, int] = {}
    asked = False
    while not processes.all_ended():
        said = processes.said(POLL_S)
        if said is not None and said.data["kind"] == "progress" and said.process == "master":
            progress.show(said.data)
        elif said is not None and said.data["kind"] == "event" and said.data["code"] not in UNSAID:
            progress.say(f"{said.data['lab']}: {said.data['text']}")
        first = first or {name: code for name, code in processes.ended().items() if code}
        if (stopping() or first) and not asked:
            asked = True
            for name in processes.names:
                if name == "master" or (first and name not in first):
                    processes.interrupt(name)
    return first


def verdict(processes: Any, first: dict[str, int]) -> RthsError | None:
    """The error to show: of the processes that failed first, in the order of causes."""
    for code in (2, 1, 3, 4):
        for name, ended in first.items():
            if ended == code:
                text = processes.complaints.get(name, "").removeprefix("rths: ").splitlines()
                return ERRORS.get(code, LostError)(
                    text[-1] if text else f"The {title(name)} stopped before its end."
                )
    for name, code in first.items():
        return LostError(
            f"The {title(name)} was killed (signal {-code}); the recording holds what came until then."
        )
    return None


def show(path: Path, as_json: bool) -> None:
    """Write the summary of a recording."""
    from common.recording.reader import read
    from rths.inspect import write_report
    from rths.summary import summarize

    summary = summarize(read(path))
    if as_json:
        sys.stdout.write(json.dumps(summary) + "\n")
    else:
        write_report(summary)
