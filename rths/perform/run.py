"""`rths run`: the whole test on this machine, real time or virtual, with its summary."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from datetime import date
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from common.errors import InputError, RthsError
from common.host import running
from common.host.realtime import assign, freeze
from common.host.stopping import Stopper
from common.lab.preflight import Gate, PreflightCheck, calibration_checks
from common.plan.plan import Plan
from common.reality.reality import Reality
from common.roles import MASTER, RECORDER
from common.terminal import cli
from common.terminal.outputs import is_stream
from report.text.forwarded import ForwardedProgress
from report.text.progress import Progress as Working
from report.text.terminal import RunProgress
from rths.perform.follow import UNSAID, end_all, follow

if TYPE_CHECKING:
    from rths.perform.live_child import View
    from rths.perform.processes import Processes
    from simulation.virtual import VirtualTest

VirtualTime = Callable[[Plan, Reality, Path, Stopper, Gate], RthsError | None]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `run`."""
    cli.plan_arguments(parser, optional=True)
    test_arguments(parser)


def test_arguments(parser: argparse.ArgumentParser) -> None:
    """What is said of any test on this machine, beside its plan."""
    cli.reality_argument(parser)
    cli.rt_arguments(parser)
    cli.accept_argument(parser)
    cli.await_start_argument(parser)
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument(
        "--real-time", action="store_true", help="a process for each role, on the wall clock (default)"
    )
    clock.add_argument(
        "--virtual", action="store_true", help="one process on a virtual clock, as fast as it can"
    )
    cli.output_argument(parser, "FILE", "the recording (default: runs/<test>-<time>.mcap)")
    cli.force_argument(parser)
    parser.add_argument("--live", action="store_true", help="show the test in a browser page while it runs")
    parser.add_argument(
        "--live-port", type=int, default=0, metavar="N", help="port of that page (default: a free one)"
    )
    parser.add_argument(
        "--beside", action="store_true", help="run although another test runs on this machine"
    )
    parser.add_argument(
        "--reports",
        action="store_true",
        help="write what the processes report as JSON lines on standard error, for a program that runs this command",
    )
    cli.json_argument(parser, "write the summary as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Run a test; its exit code."""
    plan = cli.load_plan(args)
    if plan.served:
        raise InputError(
            "The plan's building is a client's: start it with rths serve, or leave out model in [structure]."
        )
    return carry_out(args, plan, in_virtual_time)


def carry_out(args: argparse.Namespace, plan: Plan, virtually: VirtualTime) -> int:
    """Run a test in real time, or in virtual time `virtually`, and show its summary; its exit code.

    Raises:
        RthsError: what ended it.
    """
    from recorder.files import reserved

    gate = Gate(cli.accepted_risks(args))
    if not 0 <= args.live_port <= 65535:
        raise InputError(f"--live-port {args.live_port} must be from 1 to 65535, or 0 for a free one.")
    if args.live_port and not args.live:
        raise InputError("--live-port is the port of the page of --live: give --live too.")
    if args.live and args.virtual:
        raise InputError(
            "--live shows a test in real time: leave out --virtual, or give its recording to rths live."
        )
    if args.await_start and args.virtual:
        raise InputError("--await-start is for a test in real time: in virtual time there is no operator.")
    reality = cli.load_reality(args.reality, plan)
    stopping = Stopper()
    with reserved(args.output, plan, force=args.force) as output:
        error = (
            virtually(plan, reality, output, stopping, gate)
            if args.virtual
            else in_real_time(args, plan, reality, output, stopping, gate)
        )
        if output.is_file() and output.stat().st_size:
            show(output, args.json)
    if error is not None:
        raise error
    return 0


def in_virtual_time(
    plan: Plan, reality: Reality, output: Path, stopping: Stopper, gate: Gate
) -> RthsError | None:
    """Run the test in this process on the virtual clock; the error that ended it."""
    from simulation import virtual

    lines = before_the_start(plan, output, gate, paced=False)
    with Working("running") as working:
        bench = virtual.assemble(plan, reality, output, partial(virtual_report, working), gate=gate)
        sys.stderr.writelines(f"{line}\n" for line in lines)
        error, seconds = played(bench, stopping, working)
    say_speed(bench, seconds)
    return error


def played(bench: VirtualTest, stopping: Stopper, working: Working) -> tuple[RthsError | None, float]:
    """Play a test in virtual time: the error that ended it, and the seconds that it took."""
    from simulation import virtual

    freeze()
    started = time.monotonic()
    error = virtual.run(bench, stopping, working.tell)
    return error, time.monotonic() - started


def say_speed(bench: VirtualTest, seconds: float) -> None:
    """Say how much of a test was played in some seconds."""
    length = bench.master.ticks * bench.master.lab.plan.test.interval
    sys.stderr.write(f"{length:g} s of test in {seconds:.1f} s of computing\n")


def before_the_start(plan: Plan, output: Path, gate: Gate, *, paced: bool = True) -> list[str]:
    """Make the pre-flight checks that need no laboratory; a line on each that passed or whose risk is accepted.

    Raises:
        RefusedError: a check failed whose risk is not accepted.
        InputError: a model or parameter of the plan cannot be used.
    """
    made = checks(plan, output, paced=paced)
    gate.judge(made)
    lines = (f"risk '{one.risk.name}' is accepted" if one.risk else one.text for one in made)
    return [f"pre-flight: {text}." for text in lines]


def checks(plan: Plan, output: Path, *, paced: bool = True) -> list[PreflightCheck]:
    """The pre-flight checks that need no laboratory: of the plan, of a model beside it, and of the disk.

    Of a model that another program computes its time per step is judged where the test is `paced`, in real time.
    """
    from loop import foreign
    from loop.nominal import preflight
    from recorder import space

    nominal = [] if plan.served else preflight.checks(plan)
    others = [*foreign.checked(plan, paced=paced), *calibration_checks(plan, date.today())]
    return [*nominal, *others, space.check(plan, output.parent)]


def virtual_report(working: Working, kind: str, data: Any) -> None:
    """Write an event of a test in virtual time on standard error; an error is this command's last sentence."""
    if kind == "event" and data["code"] not in UNSAID and data["level"] != "error":
        working.leave(wipe=True)
        cli.text_report(kind, data)


def in_real_time(
    args: argparse.Namespace, plan: Plan, reality: Reality, output: Path, stopping: Stopper, gate: Gate
) -> RthsError | None:
    """Run the test with a process for each role; the error that ended it."""
    from common.link.zenoh_link import listenable
    from rths.perform.ending import Ending, verdict
    from rths.perform.processes import Processes
    from simulation.compilation import NOTICE

    progress = ForwardedProgress() if args.reports else RunProgress(plan.test.duration)
    NOTICE.say = progress.say
    check(reality)
    processes = Processes()
    endpoint = listenable()
    view = None
    ending = Ending(plan)
    try:
        with running.announced(plan, endpoint, recording=output):
            if not args.beside:
                running.alone()
            warm_up()
            for line in before_the_start(plan, output, gate):
                progress.say(line)
            length = f"{plan.test.duration:g} s{' at most' * plan.served}"
            progress.say(f"{plan.test.name}: {length}, starting {crew(plan)}")
            start_all(processes, args, plan.roles, endpoint, output)
            view = shown(output, args.live_port) if args.live else None
            follow(processes, ending, progress, stopping, view)
    finally:
        end_all(processes, ending)
        processes.close()
        progress.end()
        if view is not None:
            view.close()
            if output.is_file() and output.stat().st_size:
                progress.say(f"live view: {view.again} shows it again")
    error = verdict(processes, stopping())
    if isinstance(error, InputError) and not ending.agreed and not is_stream(output):
        output.unlink(missing_ok=True)  # the recorder had begun it, but there was no test
    return error


def shown(output: Path, port: int) -> View:
    """A live view of the recording of a test that is about to start."""
    from rths.perform.live_child import View

    return View(output, port)


def crew(plan: Plan) -> str:
    """The processes of a test in words."""
    if not plan.roles:
        return "master and recorder"
    slaves = f"slave{'s' * (len(plan.slaves) > 1)} {', '.join(plan.slaves)}".rstrip()
    return f"master, {slaves} and recorder"


def check(reality: Reality) -> None:
    """Raise InputError where a laboratory cannot be built or lacks its certificate, before any process starts."""
    import master.assembly
    import slave.assembly
    from loop.links import link_model

    if reality.plan.link.security.folder:
        from common.link import security

        for role in (MASTER, *reality.plan.roles, RECORDER):
            security.identity(reality.plan, role)
    master.assembly.check(reality)
    for role in reality.plan.roles:
        slave.assembly.check(reality.of(role))
        link_model(reality.of(role))


def warm_up() -> None:
    """Compile the kernels before the processes start, where this machine has not done so yet."""
    from models import cache

    if not cache.warm():
        from simulation.warm import compile_all

        compile_all()


def start_all(
    processes: Processes, args: argparse.Namespace, roles: Sequence[str], endpoint: str, output: Path
) -> None:
    """Start master, slaves and recorder with the plan's options; `roles` are those of the slaves."""
    words = [str(cli.plan_path(args.plan))]
    for option in ("duration", "scale", "seed"):
        value = getattr(args, option)
        if value is not None:
            words += [f"--{option}", repr(value)]
    for name in cli.accepted_risks(args):
        words += ["--accept-risk", name]
    served = [word for address in addresses(args) for word in ("--opensees", address)]
    words += ["--intervals", str(args.intervals)] if served else []
    awaiting = ["--await-start"] if args.await_start else []
    secret = ["--reality", str(args.reality)] if args.reality else []
    places = [real_time_words(args.rt, processor) for processor in assign(1 + len(roles))]
    processes.start("master", [*words, *secret, *places[0], *served, *awaiting, "--listen", endpoint])
    for role, place in zip(roles, places[1:], strict=True):
        processes.start(role, [*words, *secret, *place, "--connect", endpoint])
    # --force: this command has reserved the file, which is empty or may be replaced
    processes.start("recorder", [*words, "--connect", endpoint, "-o", str(output), "--force"])


def addresses(args: argparse.Namespace) -> list[str]:
    """Where elements of OpenSees are served, none where the building is the plan's."""
    return list(getattr(args, "opensees", []))


def real_time_words(mode: str, processor: int | None) -> list[str]:
    """Options of a laboratory's process."""
    place = [] if processor is None or mode == "off" else ["--processor", str(processor)]
    return ["--rt", mode, *place]


def show(path: Path, as_json: bool) -> None:
    """Write the summary of a recording."""
    from common.recording.reader import read
    from report.facts.summary import summarize
    from rths.examine.inspect import write_report

    summary = summarize(read(path))
    if as_json:
        sys.stdout.write(json.dumps(summary) + "\n")
    else:
        write_report(summary)
