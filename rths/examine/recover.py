"""`rths recover`: a finished recording with everything that is intact in a damaged or cut-off one."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING, TextIO

from common.terminal import cli, outputs
from common.terminal.printable import shown
from report.text.progress import Progress
from report.text.terminal import table

if TYPE_CHECKING:
    from common.recording.account import Missing, Recovery, Topic

SHOWN = 10  # ranges of a topic and holes of the file on the terminal, which fit a screen; JSON has all


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `recover`."""
    cli.recording_argument(parser, ", damaged or cut off")
    cli.output_argument(parser, "OUT.mcap", "the recovered recording (default: FILE-recovered.mcap)")
    cli.force_argument(parser)
    cli.json_argument(parser, "write the account as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Recover a recording; 1 where something of it is lost."""
    output = args.output or args.file.parent / f"{args.file.stem}-recovered.mcap"
    with Progress("recovering"):
        from common.recording.recover.recovery import recover

        found = recover(args.file, output, force=args.force)
    stream = outputs.aside(output)
    if args.json:
        stream.write(json.dumps(found.plain(), allow_nan=False) + "\n")
    else:
        write_account(found, stream)
    return 0 if found.complete else 1


def write_account(found: Recovery, stream: TextIO) -> None:
    """The account as text."""
    say = stream.write
    say(
        f"\n{shown(str(found.path))}: {found.size} bytes"
        + ("" if found.finished else ", without a whole end")
        + "\n"
    )
    say(f"lost: {found.bytes_lost} bytes, {found.chunks_lost} of {found.chunks + found.chunks_lost} chunks\n")
    for hole in found.lossy[:SHOWN]:
        say(f"unreadable: bytes {hole.offset} to {hole.end - 1} ({hole.end - hole.offset})\n")
    if len(found.lossy) > SHOWN:
        say(f"unreadable: {len(found.lossy) - SHOWN} more places, all with --json\n")
    for part in found.parts:
        say(f"lost: {shown(part)}\n")
    if found.undefined:
        say(f"lost: {found.undefined} messages that no schema in the file describes\n")
    rows = [["topic", "recovered", "lost", "sequence numbers lost", "last"]]
    rows += [[name, *cells(topic, found.origin_ns)] for name, topic in found.topics.items()]
    say("\n")
    table(rows, stream)
    say(f"\n{verdict(found)}\nrecovered: {shown(str(found.output))}\n")


def cells(topic: Topic, origin_ns: int) -> list[str]:
    """What a topic's row says."""
    lost = " ".join(span(hole, origin_ns) for hole in topic.missing[:SHOWN]) or "none"
    more = " …" if len(topic.missing) > SHOWN else ""
    last = f"{topic.last[0]} at {seconds(topic.last[1], origin_ns)} s" if topic.last else "–"
    return [str(topic.kept), str(topic.lost), lost + more, last]


def span(hole: Missing, origin_ns: int) -> str:
    """A range of sequence numbers with the times of the messages before and after it."""
    times = "…".join("" if at is None else seconds(at, origin_ns) for at in (hole.after_ns, hole.before_ns))
    return f"{hole.first}–{hole.last} ({times} s)"


def seconds(at_ns: int, origin_ns: int) -> str:
    """A log time from sequence 0 on."""
    return f"{(at_ns - origin_ns) * 1e-9:.3f}"


def verdict(found: Recovery) -> str:
    """The account in a sentence."""
    if found.complete:
        return "Everything that was in the file is recovered."
    if found.finished or not found.lossy or found.lossy[-1].end < found.size:
        return "What is lost is listed above."
    return "The file is cut off at its end: it holds no messages after the last ones above."
