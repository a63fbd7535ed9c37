"""`rths catalog`: a catalogue of recordings, made from them alone, and what is asked of it."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from common.errors import InputError
from common.terminal import cli, outputs
from report.text.progress import Progress

if TYPE_CHECKING:
    import sqlite3

    from report.catalogue.columns import Facts

FIND, SHOW, NOTE = "find", "show", "note"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `catalog`."""
    parser.usage = (
        "rths catalog FOLDER [FOLDER …] | find CONDITION | show [NAME] | note FILE [TEXT] [--tag TAG]"
        " [options]"
    )
    parser.add_argument(
        "words",
        nargs="+",
        metavar="FOLDER",
        help="folders whose recordings are catalogued, in catalog.sqlite of the first; or find and a condition such as "
        '"peak drift > 5 mm and outcome = tripped"; or show, alone for all recordings or with the name of one; '
        "or note, a recording, and what is to be noted beside it",
    )
    parser.add_argument(
        "--in",
        dest="folder",
        type=Path,
        default=Path("runs"),
        metavar="FOLDER",
        help="the folder whose catalogue find and show ask (default: runs)",
    )
    parser.add_argument(
        "--tag", action="append", default=[], metavar="TAG", help="with note: a tag; several in turn"
    )
    parser.add_argument(
        "--peak",
        action="append",
        default=[],
        metavar="SIGNAL",
        help="also list the peaks of a signal, such as drift",
    )
    parser.add_argument(
        "--html", type=Path, metavar="OUT", help="write the catalogue as one HTML page that sorts and filters"
    )
    cli.force_argument(parser)
    cli.json_argument(parser, "write the result as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Catalogue folders, or answer a question."""
    verb, *rest = args.words
    if args.tag and verb != NOTE:
        raise InputError("--tag belongs to rths catalog note FILE.")
    if verb == NOTE:
        return note(rest, args)
    if verb == FIND and len(rest) != 1:
        raise InputError('rths catalog find takes one condition in quotes, such as "peak drift > 5 mm".')
    if verb == SHOW and len(rest) > 1:
        raise InputError(f"rths catalog show takes the name of one recording, not {len(rest)}.")
    if verb == SHOW and rest and args.html:
        raise InputError("rths catalog show NAME prints one recording: leave out --html, or the name.")
    if args.html:
        outputs.checked(args.html, args.force)
    if verb not in (FIND, SHOW):
        return catalogue([Path(word) for word in args.words], args)

    from report.catalogue import store

    with store.opened(args.folder / store.NAME) as base:
        if verb == FIND:
            return find(base, rest[0], args)
        return show_one(base, rest[0], args) if rest else show(base, args)


def catalogue(folders: list[Path], args: argparse.Namespace) -> int:
    """Make or renew the catalogue of folders."""
    from report.catalogue import renewal, store

    with Progress("cataloguing") as progress:
        done = renewal.renew(folders, progress.tell)
    place = folders[0] / store.NAME
    if args.html:
        with store.opened(place) as base:
            write_page(base, store.facts_of(base), folders[0], args)
    if args.json:
        sys.stdout.write(json.dumps({"catalogue": str(place), **done._asdict()}) + "\n")
        return 0
    outputs.aside(args.html).write(
        f"{place}: {counted(done.recordings)}, of which {done.read} read anew and {done.lacking} not whole; "
        f"{done.gone} gone since\n"
    )
    return 0


def counted(number: int) -> str:
    """So many recordings."""
    return f"{number} recording{'' if number == 1 else 's'}"


def find(base: sqlite3.Connection, text: str, args: argparse.Namespace) -> int:
    """List the recordings that fit a condition."""
    from report.catalogue import query, store

    condition = query.parsed(text, base)
    found = store.facts_of(base, condition.sql, condition.values)
    write_list(base, found, condition.columns, (*condition.peaks, *args.peak), args)
    if args.html:
        write_page(base, found, args.folder, args, condition.peaks)
    return 0


def show(base: sqlite3.Connection, args: argparse.Namespace) -> int:
    """List all recordings."""
    from report.catalogue import store

    found = store.facts_of(base)
    write_list(base, found, (), args.peak, args)
    if args.html:
        write_page(base, found, args.folder, args)
    return 0


def write_list(
    base: sqlite3.Connection,
    found: Sequence[Facts],
    columns: Sequence[str],
    signals: Sequence[str],
    args: argparse.Namespace,
) -> None:
    """Recordings as a table, or as JSON with all that is known."""
    from report.catalogue import store, text
    from report.text.terminal import table

    stream = outputs.aside(args.html)
    if args.json:
        full = [
            facts | {"peaks": [one._asdict() for one in store.peaks_of(base, facts["file"])]}
            for facts in found
        ]
        stream.write(json.dumps(full) + "\n")
        return
    if found:
        listed = text.listed(base, found, columns, signals)
        table([list(listed.head), *map(list, listed.rows)], stream)
    stream.write(f"{counted(len(found))}\n")


def show_one(base: sqlite3.Connection, name: str, args: argparse.Namespace) -> int:
    """Print all that is known of one recording, by its name or the end of its path."""
    from report.catalogue import store, text
    from report.text.formats import quantity
    from report.text.terminal import table

    fits = store.facts_of(base, "file = ? OR file LIKE ? ESCAPE '\\'", (name, "%/" + store.escaped(name)))
    if len(fits) != 1:
        what = "no recording" if not fits else f"{len(fits)} recordings"
        raise InputError(
            f"The catalogue in {args.folder} has {what} named {name}: `rths catalog show` lists the paths."
        )
    peaks = store.peaks_of(base, fits[0]["file"])
    if args.json:
        sys.stdout.write(json.dumps(fits[0] | {"peaks": [one._asdict() for one in peaks]}) + "\n")
        return 0
    for key, value in text.whole(fits[0]):
        sys.stdout.write(f"{key:<10}{value}\n")
    rows = [["peak", ""], *([f"{one.topic}/{one.name}", quantity(one.value, one.unit)] for one in peaks)]
    sys.stdout.write("\n")
    table(rows)
    return 0


def write_page(
    base: sqlite3.Connection,
    found: Sequence[Facts],
    folder: Path,
    args: argparse.Namespace,
    signals: Sequence[str] = (),
) -> None:
    """Recordings as a page, with the peaks of the drift, of the signals asked for, and of those of the options."""
    from report.catalogue import page
    from report.catalogue.columns import DRIFT

    wanted = tuple(dict.fromkeys((DRIFT, *signals, *args.peak)))
    outputs.write_text(args.html, page.page(base, found, folder.resolve().name, wanted), args.force)


def note(rest: list[str], args: argparse.Namespace) -> int:
    """Add a text and tags to the notes beside a recording."""
    import tomllib

    import tomli_w

    from report.catalogue.columns import notes_of

    if not rest or len(rest) > 2 or not (len(rest) == 2 or args.tag):
        raise InputError("rths catalog note takes a recording and a text in quotes, --tag TAG, or both.")
    path = Path(rest[0])
    if not path.is_file():
        raise InputError(f"There is no recording {path} to note something beside.")
    beside, text = notes_of(path), "".join(rest[1:])
    try:
        found = tomllib.loads(beside.read_text(encoding="utf-8")) if beside.exists() else {}
        lines, tags = [*str(found.get("notes", "")).splitlines(), text], [*found.get("tags", []), *args.tag]
        made = tomli_w.dumps({"tags": list(dict.fromkeys(tags)), "notes": "\n".join(filter(None, lines))})
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"Cannot add to the notes in {beside}: {error}; mend the file first.") from None
    outputs.write_text(beside, made, force=True)
    sys.stdout.write(f"{beside}\n")
    return 0
