"""`rths plot`: pictures of a recording."""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from common.errors import InputError
from common.roles import name_of, title
from common.terminal import cli, outputs
from common.terminal.printable import shown

if TYPE_CHECKING:
    from common.recording.run import Run
    from report.pictures import Picture

FORMATS = ("png", "svg", "pdf")
OTHER_FORMATS = {".jpg", ".jpeg", ".gif", ".eps", ".ps", ".tif", ".tiff", ".bmp", ".webp"}
WIDTHS = ("single", "double")


class PictureTarget(NamedTuple):
    """The files of the pictures: each under its name in a folder, or a single one in a file."""

    folder: Path
    format: str
    stem: str = ""  # of the file
    force: bool = False  # to replace files that exist

    def path(self, name: str, role: str) -> Path:
        """The file of a picture that concerns a slave."""
        return self.folder / f"{labelled(self.stem or name, role)}.{self.format}"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `plot`."""
    from report.pictures import PICTURES

    cli.recording_argument(parser)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="pictures to draw (default: all that there are signals for)"
    )
    cli.output_argument(
        parser,
        "PLACE",
        "a folder (default: beside the recording), or for a single picture a file, whose ending gives the format",
    )
    cli.force_argument(parser)
    parser.add_argument("--format", choices=FORMATS, help="format of the pictures (default: png)")
    parser.add_argument(
        "--width", choices=WIDTHS, default="single", help="columns of a page (default: single, 85 mm)"
    )
    cli.json_argument(parser, "name the pictures, and those left out, as JSON on standard output")
    rows = [described(picture.name, picture.text) for picture in PICTURES.values()]
    parser.add_argument_group("pictures", "\n".join(rows))


def described(name: str, text: str) -> str:
    """A picture's rows in the help."""
    return textwrap.fill(text, 78, initial_indent=f"{name:<18}", subsequent_indent=" " * 20)


def run(args: argparse.Namespace) -> int:
    """Draw the named pictures, or all for which the recording has signals."""
    from common.recording.reader import read
    from report.facts.laboratories import views

    chosen = choose(args.names)
    recording = read(args.file)
    place = place_of(args)
    with outputs.folder(place.folder, force=True):
        for picture in chosen:
            for role in views(recording):
                outputs.checked(place.path(picture.name, role), args.force, [args.file])
        made, left_out = draw_all(recording, chosen, place, args.width)
        complain(args, made, left_out)
    result = {"pictures": made, "left_out": left_out}
    sys.stdout.write(json.dumps(result) if args.json else "\n".join(map(shown, made)))
    sys.stdout.write("\n")
    return 0


def draw_all(
    recording: Run, chosen: list[Picture], place: PictureTarget, width: str
) -> tuple[list[str], dict[str, str]]:
    """Files of the pictures that were drawn, and the signals that the others lack."""
    from report.facts.laboratories import views
    from report.pictures import needs
    from report.text.progress import Progress

    made: list[str] = []
    left_out: dict[str, str] = {}
    with Progress("drawing") as progress:
        for number, picture in enumerate(chosen):
            progress.tell(picture.name, number, len(chosen))
            drawn = {
                str(path)
                for role in views(recording)
                if save(
                    recording, role, picture, path := place.path(picture.name, role), width, force=place.force
                )
            }
            made += sorted(drawn)
            if not drawn:
                left_out[picture.name] = needs(recording, picture)
    return made, left_out


def choose(names: list[str]) -> list[Picture]:
    """The pictures of these names, each once; all where none is named."""
    from common.plan.schema import nearest
    from report.pictures import PICTURES

    for name in names:
        if name not in PICTURES:
            hint, known = nearest(name, PICTURES), ", ".join(PICTURES)
            hint = hint if known in hint or hint.startswith("known") else f"{hint} Known here: {known}."
            raise InputError(f"There is no picture '{name}': {hint}")
    return [PICTURES[name] for name in dict.fromkeys(names or PICTURES)]


def complain(args: argparse.Namespace, made: list[str], left_out: dict[str, str]) -> None:
    """Raise InputError where nothing was drawn, or a picture that was named could not be."""
    if args.names and left_out:
        missing = "; ".join(f"'{name}' needs {needs}" for name, needs in left_out.items())
        raise InputError(f"{args.file} lacks signals: {missing} (see rths inspect {args.file}).")
    if not made:
        raise InputError(f"{args.file} has no signals for any picture: see rths inspect {args.file}.")


def place_of(args: argparse.Namespace) -> PictureTarget:
    """The target that the command line names.

    Raises:
        InputError: several pictures for one file, an unknown format, or another format than --format.
    """
    path: Path = args.output or args.file.with_suffix("")
    ending = path.suffix.lower()
    folder = args.output is None or is_folder(path)
    if folder or ending.removeprefix(".") not in FORMATS:
        if ending in OTHER_FORMATS and not folder:
            raise InputError(f"Cannot write {path}: give a file that ends in .{', .'.join(FORMATS)}.")
        return PictureTarget(path, args.format or FORMATS[0], force=args.force)
    if len(set(args.names)) != 1:
        raise InputError(f"{path} is one file: name the one picture to draw in it, or give a folder.")
    if args.format not in (None, ending[1:]):
        raise InputError(
            f"{path} is no {args.format} file: leave out --format, or let the file's name end in .{args.format}."
        )
    return PictureTarget(path.parent, ending[1:], path.stem, args.force)


def is_folder(path: Path) -> bool:
    """Whether a path is a folder; False for a name that no file can have."""
    try:
        return path.is_dir()
    except OSError:
        return False


def labelled(name: str, role: str) -> str:
    """The picture's file, with the slave's name where it has one."""
    return f"{name}-{name_of(role)}" if name_of(role) else name


def draw(recording: Run, role: str, picture: Picture, width: str = "single") -> Any | None:
    """The figure with the signals of a slave and its caption; None where the recording lacks its signals."""
    from report.facts.laboratories import views
    from report.pictures import figure, layout

    canvas = figure.figure(*(picture.double if width == "double" else picture.size))
    if not picture.on(views(recording)[role], canvas):
        return None
    layout.caption(canvas, caption(recording, role))
    return canvas


def save(
    recording: Run, role: str, picture: Picture, path: Path, width: str = "single", *, force: bool = False
) -> bool:
    """Draw one picture into a file; False where the recording lacks its signals."""
    from report.pictures import figure

    canvas = draw(recording, role, picture, width)
    if canvas is None:
        return False
    with outputs.writing(path, force) as temporary:
        figure.save(canvas, temporary)
    return True


def caption(recording: Run, role: str) -> str:
    """The test, and the slave where it has a name; on a second line the ground motion and its scale."""
    motion = recording.metadata.get("ground_motion", {})
    test = shown(f"{recording.test}, {title(role)}" if name_of(role) else recording.test)
    record, scale = motion.get("record"), motion.get("scale")
    return f"{test}\n{shown(record)}, × {shown(scale)}" if record and scale else test
