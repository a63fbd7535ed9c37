"""`python -m recorder PLAN --connect tcp/master:7447`: records a test on any machine that reaches the master."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from common.host.clock import MonotonicClock, unix_ns
from common.host.stopping import Stopper
from common.lab import process
from common.lab.laboratory import Setting
from common.lab.preflight import Gate
from common.link.endpoint import Endpoint, FrameEndpoint
from common.terminal import cli

if TYPE_CHECKING:
    from common.plan.plan import Plan
    from recorder.loop import RecorderLoop

WAIT_S = 0.02  # longest wait for a message: a request to stop and the requests every `ASK_NS` wait no longer


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the recorder."""
    cli.plan_arguments(parser)
    cli.intervals_argument(parser)
    cli.connect_argument(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="the recording (default: a name in the plan's folder)",
    )
    cli.force_argument(parser)
    cli.accept_argument(parser)
    cli.json_argument(parser, "report as JSON lines on standard output")


def run(args: argparse.Namespace) -> int:
    """Run the recorder; returns its exit code."""
    from recorder import files

    plan = cli.load_plan(args)
    with files.reserved(args.output, plan, force=args.force) as path:
        return record(args, plan, path)


def record(args: argparse.Namespace, plan: Plan, path: Path) -> int:
    """Record a test into a file; returns the exit code."""
    from loop import substructure
    from recorder import files, space
    from recorder.loop import RecorderLoop
    from recorder.sink import FileSink, ThreadedSink

    stopping = Stopper()
    report = cli.reporter(args.json, plan.test.duration)
    gate = Gate(cli.accepted_risks(args))
    gate.judge([space.check(plan, path.parent)])
    ground = substructure.recorded_ground(plan)
    link = process.join(plan, "recorder", stopping, report, connect=args.connect)
    try:
        recording = files.begin(path, plan, ground, unix_ns(), gate.overruled, clock="real")
        setting = Setting(plan, FrameEndpoint(link, plan.digest()), MonotonicClock(), report)
        loop = RecorderLoop(setting, ThreadedSink(FileSink(recording, setting.clock)))
        try:
            receive(loop, setting.endpoint, stopping)
        finally:
            summary = loop.close()
    finally:
        link.close()
        stopping.ignore()
    report("recording", {"file": str(path), "summary": dict(summary)})
    if loop.error is not None:
        raise process.last_word(loop.error, report)
    return 0


def receive(loop: RecorderLoop, endpoint: Endpoint, stopping: Stopper) -> None:
    """Take messages until the test is over or a stop is requested."""
    while not loop.done:
        if (received := endpoint.receive(WAIT_S)) is not None:
            loop.take(received.message, received.received_ns)
        loop.poll()
        if reason := stopping():
            loop.stop(reason)


if __name__ == "__main__":
    sys.exit(process.enter("recorder", __doc__, add_arguments, run))
