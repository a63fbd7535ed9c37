"""`rths doctor`: whether this machine will keep the interval, measured."""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

from common.host import realtime
from common.terminal import cli
from common.terminal.telling import Tell
from report.text.progress import Progress

SHORTEST = 3.0  # s; with less, the exchange has too few intervals to show one in a thousand that is late
LONGEST = 3600.0  # s; an hour shows what happens once in a million intervals
PARTS = 3
EXCHANGE, WAKE_UP, DISK = 0.45, 0.4, 0.15  # shares of the time; the disk needs fewest samples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `doctor`."""
    parser.add_argument("--seconds", type=float, default=20.0, metavar="S", help="length of the check (20)")
    parser.add_argument("--interval", type=float, default=0.002, metavar="S", help="control interval (0.002)")
    parser.add_argument(
        "--rt",
        choices=realtime.MODES,
        default="auto",
        help="real-time settings: take what is available (default), fail without all of them, or take none",
    )
    cli.output_argument(parser, "FOLDER", "where recordings will go (default: runs)", default=Path("runs"))
    cli.json_argument(parser, "write the report as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Check this machine; 1 where a check failed."""
    check_bounds(args)
    with Progress("doctor") as progress:
        report = examine(args, progress.tell)
    if args.json:
        sys.stdout.write(json.dumps(report) + "\n")
    else:
        write_report(report)
    return 0 if report["verdict"]["passed"] else 1


def check_bounds(args: argparse.Namespace) -> None:
    """Raise InputError for a time that cannot be used."""
    from common.errors import InputError

    if not SHORTEST <= args.seconds <= LONGEST:
        raise InputError(f"--seconds {args.seconds:g} cannot be used: give {SHORTEST:g} to {LONGEST:g}.")
    if not 1e-4 <= args.interval <= 0.1:
        raise InputError(f"--interval {args.interval:g} s cannot be used: give 0.0001 to 0.1.")


def examine(args: argparse.Namespace, tell: Tell) -> dict[str, Any]:
    """Measure one part after the other, so that none disturbs another, and judge; times in s."""
    from common.host.machine import Watch, facts
    from rths.checkup import children, disk
    from rths.checkup.clock import ClockWatch
    from rths.checkup.rivals import rivals
    from rths.checkup.verdict import checks, notes, verdict

    folder, seconds = disk.nearest(args.output), float(args.seconds)
    watch, clock, others = Watch(), ClockWatch(), rivals()
    interval_ns = round(args.interval * 1e9)
    # With 'on' the check takes the settings that are available, and judges that some are missing.
    mode = "off" if args.rt == "off" else "auto"
    tell("round trip over zenoh", 1, PARTS)
    granted, round_trip = children.exchange(interval_ns, EXCHANGE * seconds, mode)
    tell("wake-up lateness", 2, PARTS)
    place = granted.get("priority", 0), granted.get("processor", -1)
    wake_up = children.wake_ups(interval_ns, WAKE_UP * seconds, *place)
    tell("disk", 3, PARTS)
    report: dict[str, Any] = {
        "seconds": args.seconds,
        "interval": args.interval,
        "rt": args.rt,
        "realtime": granted,
        "wake_up": wake_up,
        "round_trip": round_trip,
        "disk": disk.measure(folder, time.monotonic() + DISK * seconds),
        "clock": clock.values(),
        "machine": watch.values(),
        "facts": facts(),
        "rivals": sorted({*others, *rivals()}),
    }
    found = checks(report)
    report["checks"] = [check._asdict() for check in found]
    report["notes"] = notes(report)
    report["verdict"] = verdict(report, found)._asdict()
    return report


def write_report(report: dict[str, Any]) -> None:
    """The report as text."""
    write_host(report)
    write_latency(report)
    write_checks(report)
    for sentence in report["notes"]:
        sys.stdout.write(f"note: {sentence}\n")
    failed: dict[str, list[str]] = {}
    for check in report["checks"]:
        if not check["passed"]:
            failed.setdefault(check["advice"], []).append(check["name"])
    for advice, names in failed.items():
        sys.stdout.write(f"{', '.join(names)}: {advice}\n")
    sys.stdout.write(report["verdict"]["sentence"] + "\n")


def write_host(report: dict[str, Any]) -> None:
    """Lines on this machine: system, processors, real-time settings and clock."""
    facts, clock = report["facts"], report["clock"]
    words = [facts["system"], *(facts[name] for name in ("preemption", "processor") if name in facts)]
    if "hypervisor" in facts:
        words.append(f"on a hypervisor ({facts['hypervisor']})")
    known = clock.get("synchronised")
    set_right = "" if known is None else ", synchronised" if known else ", not synchronised"
    sys.stdout.write(
        f"machine: {', '.join(words)}\n"
        f"processors: {', '.join(processors(report['machine']))}\n"
        f"real time: {', '.join(shape(report['realtime']))}\n"
        f"clock: {facts.get('clocksource', 'unknown')}, {clock['read_time'] * 1e9:.0f} ns to read, slewed by "
        f"{clock['slew'] * 1e6:+.1f} ppm, wall clock stepped by {clock['wall_step'] * 1e3:+.3f} ms{set_right}\n"
    )


def processors(machine: dict[str, float]) -> list[str]:
    """The number of processors, their load, and the share that the host took."""
    shares = (("busy_share", "busy"), ("stolen_share", "stolen by the host"))
    words = [f"{machine['processors']:.0f}"]
    words += [f"{machine[name] * 100:.1f} % {word}" for name, word in shares if name in machine]
    return words + ([f"load {machine['load']:.2f}"] if "load" in machine else [])


def shape(granted: dict[str, Any]) -> list[str]:
    """The real-time settings that a laboratory's process gets on this machine."""
    processor = granted.get("processor", -1)
    return [
        f"scheduler {granted.get('scheduler', 'unknown')}",
        f"processor {processor}" if processor >= 0 else "any processor",
        "memory locked" if granted.get("memory_locked") else "memory not locked",
    ]


def write_latency(report: dict[str, Any]) -> None:
    """Percentiles of waking up and of the round trip."""
    from report.text.terminal import table

    names = ("p50", "p90", "p99", "p99.9", "max")
    found = report["round_trip"]
    parts = [
        (f"bare loop, {name}", values, f"{values['late']:.0f} of {values['ticks'] + values['late']:.0f}")
        for name, values in report["wake_up"].items()
        if values
    ]
    if found.get("round_trip"):
        late = f"{found['late']} of {found['exchanges']}"
        parts += [("exchange, wake-up", found["wake_lateness"], "")]
        parts += [("exchange, round trip", found["round_trip"], late)]
    rows = [["latency, µs", *names, "late"]]
    rows += [[part, *(f"{values[name] * 1e6:.0f}" for name in names), late] for part, values, late in parts]
    sys.stdout.write("\n")
    table(rows)


def write_checks(report: dict[str, Any]) -> None:
    """A table of the checks: the values found, and those needed."""
    from report.text.terminal import table

    rows = [["check", "found", "needed", ""]]
    rows += [
        [check["name"], check["found"], check["needed"], "ok" if check["passed"] else "failed"]
        for check in report["checks"]
    ]
    sys.stdout.write("\n")
    table(rows)
    sys.stdout.write("\n")
