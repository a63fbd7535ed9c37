"""`rths panel`: an operator's panel in a browser, from which a test is checked, armed, started and stopped."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import secrets
import sys
import webbrowser
from functools import partial

from common.terminal import cli
from rths.perform.live import WINDOW, shown_somewhere

# Hz, how often the recording is read and the plots are updated; the page asks for states and bars separately, as often
RATE = 4.0
# Nice value of the page's part: a test that wants the processor too gets ten times as much of it, and an order is still
# taken within milliseconds. The thread that sends the orders keeps its ordinary priority.
LOWER = 10
DOCTOR_S = 5.0  # of the check of the machine: long enough to see what happens once in a thousand intervals


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `panel`."""
    cli.plan_arguments(parser, optional=True)
    cli.reality_argument(parser)
    cli.rt_arguments(parser)
    cli.accept_argument(parser)
    parser.add_argument(
        "--beside", action="store_true", help="run tests although another runs on this machine"
    )
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="NAME",
        help="name or address of this machine by which browsers reach the panel; any but this machine's own needs the "
        "token that is printed (default: 127.0.0.1, which only this machine reaches)",
    )
    parser.add_argument(
        "--port", type=int, default=0, metavar="N", help="port of the page (default: a free one)"
    )
    parser.add_argument("--token", action="store_true", help="ask for a token on this machine too")
    parser.add_argument(
        "--no-browser", action="store_true", help="print the page's address without opening it"
    )
    cli.json_argument(parser, "print the page's address as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Serve the panel until Ctrl-C."""
    from common.host.clock import MonotonicClock
    from common.host.stopping import Stopper
    from report.live.server import Server
    from report.panel import guard
    from report.panel.panel import Panel
    from rths.panel.executor import Options, PanelExecutor

    check(args)
    cli.load_plan(args)  # so that a wrong plan is said at once
    token = secrets.token_urlsafe(32) if args.token or not guard.local(args.host) else ""
    stopping = Stopper()
    executor = PanelExecutor(
        Options(
            partial(cli.load_plan, args),
            str(cli.plan_path(args.plan)),
            plan_words(args),
            run_words(args),
            doctor_words(args),
        )
    )
    try:

        def made(port: int) -> Panel:
            place = guard.Guard(args.host, port, token)
            return Panel(executor, lambda: executor.snapshot, place, WINDOW, MonotonicClock())

        server = Server(None, args.port, RATE, host=args.host, panel=made)
        lower()
        announce(args, server.url)
        server.run(stopping, leave=False)
    finally:
        if parting := executor.close():
            sys.stderr.write(f"panel: {parting}\n")
    return 0


def check(args: argparse.Namespace) -> None:
    """Raise InputError for options that cannot be used."""
    from common.errors import InputError
    from report.panel import guard

    guard.checked(args.host)
    cli.accepted_risks(args)
    if not 0 <= args.port <= 65535:
        raise InputError(f"--port {args.port} must be from 1 to 65535, or 0 for a free one.")


def announce(args: argparse.Namespace, url: str) -> None:
    """Say where the page is, and open it."""
    sys.stdout.write((json.dumps({"url": url}) if args.json else f"panel: {url}") + "\n")
    sys.stdout.flush()
    if not args.no_browser and shown_somewhere():
        webbrowser.open(url)


def lower() -> None:
    """Let a test come first, where the priority of one thread can be lowered."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, LOWER)  # of this thread alone: 0 is the calling one


def plan_words(args: argparse.Namespace) -> list[str]:
    """The plan and the options that change it, as another command takes them."""
    words = [str(cli.plan_path(args.plan))]
    for option in ("duration", "scale", "seed"):
        if (value := getattr(args, option)) is not None:
            words += [f"--{option}", repr(value)]
    return words


def run_words(args: argparse.Namespace) -> list[str]:
    """Further options of `rths run`."""
    words = ["--rt", args.rt, *(["--beside"] if args.beside else [])]
    words += ["--reality", str(args.reality)] if args.reality else []
    for name in cli.accepted_risks(args):
        words += ["--accept-risk", name]
    return words


def doctor_words(args: argparse.Namespace) -> list[str]:
    """Options of `rths doctor`."""
    plan = cli.load_plan(args)
    words = ["--seconds", f"{DOCTOR_S:g}", "--interval", repr(plan.test.interval), "--rt", args.rt]
    return [*words, "-o", plan.recording.folder]
