"""`rths inspect`: a summary of a recording."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from common.recording.outcome import COMPLETED, CUT_OFF, outcome
from common.terminal import cli
from common.terminal.printable import all_shown
from report.facts.late import said_beside_client
from report.text import holds
from report.text.formats import apart, fixed, milliseconds, modes, reading, storey_rows, tracked
from report.text.progress import Progress
from report.text.terminal import table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `inspect`."""
    cli.recording_argument(parser)
    cli.json_argument(parser, "write the report as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Report on a recording."""
    with Progress("reading"):
        from common.recording.reader import read
        from report.facts.summary import summarize

        summary = summarize(read(args.file))
    if args.json:
        sys.stdout.write(json.dumps(summary) + "\n")
    else:
        write_report(summary)
    return 0


def write_report(summary: dict[str, Any]) -> None:
    """The report as text."""
    summary = all_shown(summary)
    say = sys.stdout.write
    say(f"\n{summary['file']}: test '{summary['test']}'{ending(summary)}\n")
    write_head(summary)
    write_completeness(summary)
    write_peaks(summary["peaks"])
    write_storeys(summary)
    write_tracking(summary["tracking"])
    write_force_paths(summary["force_paths"])
    if summary["error_energy"] is not None:
        say(
            f"hybrid simulation error energy at {summary['error_energy_at']}: "
            f"{summary['error_energy'] * 100.0:+.2f} % of the energy in\n"
        )
    write_latency(summary)
    if summary["patience"]:
        say(f"patience: {summary['patience']}\n")
    for event in summary["events"]:
        if (event["level"] != "info" and event["code"] != "rejected") or event["code"] == "safe":
            say(f"{event['level']} at t {event['t']:.3f} s ({event['lab']}): {event['text']}\n")
    for name, counts in summary["exchange"].items():
        say(
            f"{name.replace('/', ', ')}: {counts['sent']} sent = {counts['used']} used + {counts['rejected']} rejected "
            f"+ {counts['lost']} lost{apart(counts)}\n"
        )
    for lab, counts in summary["rejected"].items():
        reasons = ", ".join(f"{count} by {reason}" for reason, count in counts.items())
        say(f"frames rejected by the {lab}: {reasons} (docs/reference/rejections.md)\n")
    say(f"outcome: {outcome(summary['recorder'])}\n")
    say(
        f"open it: rths plot {summary['file']}, or any MCAP viewer (Foxglove, Lichtblick, PlotJuggler, Rerun)\n"
    )


def write_head(summary: dict[str, Any]) -> None:
    """The first lines: warnings, the circumstances of the test, and the ground motion."""
    say = sys.stdout.write
    for text in summary["warnings"]:
        say(f"WARNING: {text}\n")
    if summary["circumstances"]:
        say(f"{summary['circumstances']}\n")
    motion = summary["ground_motion"]
    if motion:
        say(f"ground motion: {motion['record']}, scaled by {motion['scale']}\n")


def ending(summary: dict[str, Any]) -> str:
    """The state of a recording that is damaged or cut off, with the command that saves it; empty where it is whole."""
    if summary["damage"]:
        return f", damaged {summary['damage']}; rths recover {summary['file']} saves what is whole behind it"
    if not summary["finished"]:
        return f", cut off before its end; rths recover {summary['file']} makes a finished one of it"
    return ""


def stopped(summary: dict[str, Any]) -> str:
    """The tick at which a test ended early or its recording was cut off; empty where neither happened."""
    expected, planned = summary["ticks_expected"], summary["ticks_planned"]
    if not planned or expected >= planned:
        return ""
    if outcome(summary["recorder"]) == CUT_OFF:
        return f"recorded until tick {expected} of {planned}; the rest of the test is not in the file"
    if outcome(summary["recorder"]) == COMPLETED:
        return f"ended by its client at tick {expected}, of {planned} at most"
    return f"stopped at tick {expected} of {planned}"


def write_completeness(summary: dict[str, Any]) -> None:
    """Ticks expected, recorded and missing."""
    if text := stopped(summary):
        sys.stdout.write(f"{text}\n")
    for sentence in holds.sentences(summary["holds"]):
        sys.stdout.write(f"{sentence}\n")
    rows = [["topic", "expected", "recorded", "missing", "holes"]]
    for topic, facts in summary["topics"].items():
        holes = " ".join(f"{first}–{last}" for first, last in facts["holes"]) or "none"
        rows.append([topic, str(facts["expected"]), str(facts["recorded"]), str(facts["missing"]), holes])
    sys.stdout.write("\n")
    table(rows)


def write_peaks(peaks: dict[str, dict[str, Any]]) -> None:
    """Largest magnitudes."""
    rows = [["signal", "peak", "at"]]
    rows += [
        [
            name,
            reading(facts["peak"], facts["unit"]),
            f"{facts['t']:.3f} s" if facts["t"] is not None else "",
        ]
        for name, facts in peaks.items()
    ]
    sys.stdout.write("\n")
    table(rows)


def write_storeys(summary: dict[str, Any]) -> None:
    """Peaks of every storey, and the modes of the plan's building."""
    if not summary["storeys"]:
        return
    sys.stdout.write("\n")
    table(storey_rows(summary["storeys"]))
    if summary["modes"]:
        sys.stdout.write(f"modes of the plan's building, without dampers: {modes(summary['modes'])}\n")


def write_tracking(tracking: dict[str, dict[str, Any]]) -> None:
    """How the transfer systems followed their targets."""
    if not tracking:
        return
    rows = [["tracking", "delay", "by correlation", "amplitude", "at", "NRMSE", "peak error"]]
    rows += [[part, *tracked(facts)] for part, facts in tracking.items()]
    sys.stdout.write("\n")
    table(rows)
    for part, facts in tracking.items():
        if facts["undetermined"]:
            sys.stdout.write(f"The delay of the {part} is not determined: {facts['undetermined']}.\n")


def write_force_paths(paths: dict[str, dict[str, Any]]) -> None:
    """How late the force of each column is, and its gain, beside the plan's specimen at the measured displacement."""
    for name, found in paths.items():
        low, high = found["interval"]
        sys.stdout.write(
            f"force path{f' of the {name}' if len(paths) > 1 else ''}: delay {fixed(found['delay'] * 1e3, 2)} ± "
            f"{milliseconds((high - low) * 0.5)}, gain {found['gain']:.4f} at {found['frequency']:.2f} Hz\n"
        )


def write_latency(summary: dict[str, Any]) -> None:
    """Percentiles of the segments, of named slaves each under its name, and late ticks."""
    tables = summary["latency"] if summary["slaves"] else {"": summary["latency"]}
    for slave, segments in tables.items():
        if not segments:
            continue
        names = list(next(iter(segments.values())))
        rows = [[f"latency {slave}, µs" if slave else "latency, µs", *names]]
        rows += [
            [segment, *(f"{facts[name] * 1e6:.0f}" for name in names)] for segment, facts in segments.items()
        ]
        sys.stdout.write("\n")
        table(rows)
    if summary["late_ticks"] is not None and (summary["latency"] or summary["late_ticks"]):
        sys.stdout.write(
            f"late ticks: {summary['late_ticks']}, missed altogether: {summary['missed_ticks']}\n"
        )
    if text := said_beside_client(summary["beside_client"]):
        sys.stdout.write(f"{text}\n")
