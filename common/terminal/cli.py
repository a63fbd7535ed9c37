"""What all command lines share: options, reports, errors as one sentence."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from common.errors import InputError, RthsError
from common.reporting import Report
from common.terminal.plain_report import PlainReport, plain, say
from common.terminal.printable import escaping, shown

if TYPE_CHECKING:  # plans and realities import numpy, which a query of the catalogue does without
    from common.plan.plan import Plan
    from common.reality.reality import Reality

SHIPPED = (
    "benchmark2020",
    "default",
    "paper",
    "rc_column",
    "single_site",
    "two_columns",
    "two_dampers",
    "two_slaves",
    "two_storeys",
)
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"


class Parser(argparse.ArgumentParser):
    """A parser that reports a wrong command line in one sentence."""

    def error(self, message: str) -> NoReturn:
        """Print what is wrong and where help is, and exit with code 2."""
        self.exit(2, f"rths: {shown(message)}; see {self.prog} --help.\n")


def plan_arguments(parser: argparse.ArgumentParser, *, optional: bool = False) -> None:
    """PLAN and the options that change it."""
    if optional:
        parser.add_argument(
            "plan", nargs="?", metavar="PLAN", help="TOML file of the test (default: the default test)"
        )
    else:
        parser.add_argument(
            "plan", metavar="PLAN", help=f"TOML file of the test; {', '.join(SHIPPED)} for those that ship"
        )
    parser.add_argument("--duration", type=float, metavar="S", help="length of the test in seconds")
    parser.add_argument("--scale", type=float, metavar="X", help="factor on the ground motion")
    parser.add_argument("--seed", type=int, metavar="N", help="seed of every random draw")


def intervals_argument(parser: argparse.ArgumentParser) -> None:
    """The option by which a building is a client's, for the processes that `rths serve` starts."""
    parser.add_argument(
        "--intervals",
        type=int,
        metavar="N",
        help="the building is that of a client of rths serve, each of whose displacements takes N control intervals",
    )


def opensees_argument(parser: argparse.ArgumentParser, *, required: bool = False) -> None:
    """The option that says where elements of OpenSees are served."""
    parser.add_argument(
        "--opensees",
        action="append",
        default=[],
        required=required,
        metavar="HOST:PORT",
        help="where an element of OpenSees is served: once for all laboratories, or once for each in the plan's order",
    )


def reality_argument(parser: argparse.ArgumentParser) -> None:
    """The option for the file of the reality."""
    parser.add_argument(
        "--reality",
        type=Path,
        metavar="FILE",
        help="what the laboratories really do; nothing of it is recorded",
    )


def connect_argument(parser: argparse.ArgumentParser) -> None:
    """The option for the master's endpoint."""
    parser.add_argument(
        "--connect",
        default=DEFAULT_ENDPOINT,
        metavar="ENDPOINT",
        help=f"where the master listens (default: {DEFAULT_ENDPOINT})",
    )


def rt_arguments(parser: argparse.ArgumentParser) -> None:
    """The option for the real-time mode of a laboratory's process."""
    from common.host import realtime

    parser.add_argument(
        "--rt",
        choices=realtime.MODES,
        default="auto",
        help="real-time priority, locked memory, own processor: what is available (auto), all or no test (on), none "
        "(off)",
    )


def processor_argument(parser: argparse.ArgumentParser) -> None:
    """The option that binds a laboratory's process to a processor."""
    parser.add_argument(
        "--processor", type=int, metavar="N", help="the one processor to run on (default: any)"
    )


def recording_argument(parser: argparse.ArgumentParser, more: str = "", **options: Any) -> None:
    """FILE, the recording that a command reads; `more` is added to its help text."""
    parser.add_argument("file", type=Path, metavar="FILE", help=f"a recording (MCAP){more}", **options)


def output_argument(parser: argparse.ArgumentParser, metavar: str, text: str, **options: Any) -> None:
    """The option for the output of a command."""
    parser.add_argument("-o", "--output", type=Path, metavar=metavar, help=text, **options)


def workers_arguments(parser: argparse.ArgumentParser, jobs: int = 1) -> None:
    """The options that say how work is spread; `jobs` is the number of processes where none is given."""
    parser.add_argument(
        "--jobs",
        type=int,
        default=jobs,
        metavar="N",
        help=f"number of processes; -1 for one per processor (default: {'1' if jobs == 1 else 'one per processor'})",
    )
    parser.add_argument(
        "--dask",
        default="",
        metavar="ADDRESS",
        help="spread the work over the Dask cluster whose scheduler has this address",
    )


def words(text: str) -> list[str]:
    """A comma-separated list as the value of an option."""
    return [word.strip() for word in text.split(",") if word.strip()]


def whole_numbers(text: str) -> list[int]:
    """A comma-separated list of whole numbers from 0 as the value of an option."""
    found = words(text)
    if not found or not all(word.isascii() and word.isdigit() for word in found):
        raise argparse.ArgumentTypeError(f"'{text}' is no list of whole numbers such as 3 or 3,14")
    return [int(word) for word in found]


def json_argument(parser: argparse.ArgumentParser, text: str) -> None:
    """The option for machine-readable output."""
    parser.add_argument("--json", action="store_true", help=text)


def force_argument(parser: argparse.ArgumentParser) -> None:
    """The option without which no file is replaced."""
    parser.add_argument("--force", action="store_true", help="replace output files that exist")


def accept_argument(parser: argparse.ArgumentParser) -> None:
    """The option that accepts a risk by its name; `accepted_risks` reads it."""
    from common.safety import risks

    parser.add_argument(
        "--accept-risk",
        action="append",
        default=[],
        metavar="NAME",
        help=f"run the test although pre-flight finds this risk ({', '.join(risks.NAMES)}); may be repeated, and is "
        "recorded",
    )


def await_start_argument(parser: argparse.ArgumentParser) -> None:
    """The option by which armed laboratories wait for an operator's start."""
    parser.add_argument(
        "--await-start", action="store_true", help="arm the rigs and wait for `rths start` before they move"
    )


def accepted_risks(args: argparse.Namespace) -> tuple[str, ...]:
    """The names of the risks that the command line accepts; raises InputError for an unknown name."""
    from common.safety import risks

    return risks.known(args.accept_risk)


def load_plan(args: argparse.Namespace) -> Plan:
    """The plan of the command line with its options; raises PlanError."""
    from common.plan import read as plans

    return plans.with_test(
        plans.load(plan_path(args.plan)),
        duration=args.duration,
        scale=args.scale,
        seed=args.seed,
        intervals=getattr(args, "intervals", None),
    )


def plan_path(name: str | None) -> Path:
    """The file of a plan that ships, by its name, or the path itself."""
    if name is None or (name in SHIPPED and not Path(name).exists()):
        return Path(__file__).resolve().parents[2] / "rths" / "plans" / f"{name or 'default'}.toml"
    return Path(name)


def load_reality(path: Path | None, plan: Plan) -> Reality:
    """The reality of the command line, as planned where there is none; raises PlanError."""
    from common.reality import reality as realities

    return realities.load(path, plan) if path else realities.as_planned(plan)


def json_report(kind: str, data: Mapping[str, Any]) -> None:
    """Print one JSON object per line on standard output; a test goes on even if its reader has closed the pipe."""
    with contextlib.suppress(OSError):
        sys.stdout.write(json.dumps({"kind": kind, **data}) + "\n")
        sys.stdout.flush()


def text_report(kind: str, data: Mapping[str, Any]) -> None:
    """Print plain lines on standard error."""
    if line := plain(kind, data):
        say(line)


def reporter(as_json: bool, duration: float) -> Report:
    """The report that the command line asks for; `duration` is that of the test, s."""
    return json_report if as_json else PlainReport(duration)


def guarded(main: Callable[[], int]) -> int:
    """Run a command; an RthsError becomes one sentence on standard error and an exit code."""
    try:
        with interruptible(), escaping():
            return answered(main)
    except BrokenPipeError:
        unread()
        return 0
    except KeyboardInterrupt:
        sys.stderr.write("rths: stopped by the user.\n")
        return 3


class Interrupted(KeyboardInterrupt):
    """Raised for Ctrl-C.

    A plain KeyboardInterrupt within `exec` would make Python end by the signal, without the exit code.
    """


def interrupt(*_: object) -> NoReturn:
    """Handle a SIGINT."""
    raise Interrupted


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C raise Interrupted within the context, unless another handler is set."""
    ours = threading.current_thread() is threading.main_thread()
    ours = ours and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if ours:
        signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        if ours and signal.getsignal(signal.SIGINT) is interrupt:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def answered(main: Callable[[], int]) -> int:
    """Run a command and flush its output, so that a closed pipe is noticed here and not at exit.

    Where an error ends the command, its exit code stays even if the reader of the output has closed the pipe.
    """
    try:
        return main()
    except RthsError as error:
        return error.exit_code if error.said else complained(str(error), error.exit_code)
    except BrokenPipeError:
        raise
    except OSError as error:
        if error.filename is None:
            raise
        return complained(f"Cannot use {error.filename}: {error.strerror}.", InputError.exit_code)
    finally:
        drain()


def complained(text: str, code: int) -> int:
    """Print an error after all earlier output; returns its exit code."""
    drain()
    with contextlib.suppress(OSError):  # a terminal that was closed
        sys.stderr.write(f"rths: {shown(text)}\n")
    return code


def drain() -> None:
    """Flush standard output; the rest is discarded where its reader has closed the pipe."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        unread()


def unread() -> None:
    """Discard all further output, because the reader of standard output has closed the pipe."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
