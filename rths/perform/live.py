"""`rths live`: a recording that is being written, or one that is finished, as plots in a browser on this machine."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
import time
import webbrowser

from common.errors import InputError
from common.lab import process
from common.terminal import cli

RATE, RATES = 10.0, (1.0, 30.0)  # Hz; ten updates a second look continuous, and a page draws no more than 30
WINDOW = 10.0  # s; about twenty cycles of a building of 2 Hz
LOWEST = 19  # nice value: the view never takes time from a test


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `live`."""
    cli.recording_argument(parser, ", finished or being written")
    parser.add_argument(
        "--port", type=int, default=0, metavar="N", help="port of the page (default: a free one)"
    )
    parser.add_argument(
        "--no-browser", action="store_true", help="print the page's address without opening it"
    )
    parser.add_argument(
        "--rate",
        type=float,
        default=RATE,
        metavar="HZ",
        help=f"rate of the page's updates (default: {RATE:g})",
    )
    parser.add_argument(
        "--window",
        type=float,
        metavar="S",
        help=f"time that plots reach back (default: {WINDOW:g}; the whole of a finished recording)",
    )
    parser.add_argument("--wait", action="store_true", help="wait for a file that is yet to be written")
    parser.add_argument("--leave", action="store_true", help="end with the test (default: at Ctrl-C)")
    cli.json_argument(parser, "print the page's address as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C."""
    since_ns = time.time_ns() if args.wait else 0
    check(args)
    with contextlib.suppress(OSError):
        os.nice(LOWEST)  # first of all, since a test may run on this machine
    serve(args, since_ns)
    return 0


def check(args: argparse.Namespace) -> None:
    """Raise InputError for options out of range."""
    if not RATES[0] <= args.rate <= RATES[1]:
        raise InputError(f"--rate {args.rate:g} must be from {RATES[0]:g} to {RATES[1]:g} Hz.")
    if args.window is not None and not 1.0 <= args.window <= 3600.0:
        raise InputError(f"--window {args.window:g} must be from 1 to 3600 s.")
    if not 0 <= args.port <= 65535:
        raise InputError(f"--port {args.port} must be from 1 to 65535, or 0 for a free one.")
    if not args.wait and not args.file.is_file():
        raise InputError(f"There is no recording {args.file}: give its path, or --wait to wait for it.")


def serve(args: argparse.Namespace, since_ns: int) -> None:
    """Read the recording and serve its page."""
    from common.host.clock import MonotonicClock
    from common.host.stopping import Stopper
    from common.recording.reader import Tail, length
    from report.live.feed import Feed
    from report.live.server import Server

    stopping = Stopper()
    with Tail(args.file) as tail:
        whole = 0.0 if args.window or since_ns else length(args.file)
        window = args.window or whole or WINDOW
        feed = Feed(tail, window, MonotonicClock(), since_ns=since_ns, whole=whole > 0.0)
        feed.look()
        if feed.failure:
            raise InputError(feed.failure)
        server = Server(feed, args.port, args.rate)
        sys.stdout.write(json.dumps({"url": server.url}) if args.json else f"live view: {server.url}")
        sys.stdout.write("\n")
        sys.stdout.flush()
        if not args.no_browser and shown_somewhere():
            webbrowser.open(server.url)
        server.run(stopping, leave=args.leave)


def shown_somewhere() -> bool:
    """Whether there is a screen and a terminal, so that opening a browser makes sense."""
    screen = sys.platform == "darwin" or "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
    return sys.stdout.isatty() and screen


if __name__ == "__main__":
    sys.exit(process.enter("rths.perform.live", __doc__, add_arguments, run))
