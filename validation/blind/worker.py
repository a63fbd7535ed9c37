"""The process that diagnoses: `python -m validation.blind.worker FOLDER OUT`. It has nothing but the recordings.

For every recording it writes `OUT/<name>.json`: the reports by slave or the error, and the seconds that it took. After
each recording it prints its name on standard output.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, overload

from common.errors import InputError, RthsError
from common.terminal import cli
from diagnosis.report.records import Report
from simulation.workers.pool import spread

RECORDING = ".mcap"
OTHER = ".other"  # suffix of a recording of the same laboratories, on which the finding is judged
ENDINGS = (".toml", ".npz")  # of the two files with the findings in a recording
DIAGNOSIS = "rths.examine.diagnose:diagnose_recording"


def find(reference: str) -> Any:
    """The diagnosing function 'module:function'; it takes a recording's path and returns a `Report` or one by slave."""
    module, _, name = reference.partition(":")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(
            f"There is no diagnosis '{reference}' ({error}): give it as module:function."
        ) from None


class Diagnosed(NamedTuple):
    """The answer of a diagnosis on a recording as JSON values, and the files with its findings by suffix."""

    name: str
    answer: dict[str, Any]
    files: dict[str, bytes]


class Carried(NamedTuple):
    """A recording that travels to a worker without the files of this machine, by suffix; the first one is diagnosed."""

    name: str
    files: dict[str, bytes]


class Recordings(Sequence[Carried]):
    """The recordings of a folder, each of which is read when it is asked for."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = paths

    def __len__(self) -> int:
        return len(self._paths)

    @overload
    def __getitem__(self, place: int) -> Carried: ...
    @overload
    def __getitem__(self, place: slice) -> Sequence[Carried]: ...
    def __getitem__(self, place: int | slice) -> Carried | Sequence[Carried]:
        if isinstance(place, slice):
            return Recordings(self._paths[place])
        path = self._paths[place]
        files = [path, *(other for other in [path.with_suffix(OTHER)] if other.exists())]
        return Carried(path.stem, {one.suffix: one.read_bytes() for one in files})


def diagnose(given: Path | Carried, reference: str, found: bool = False) -> Diagnosed:
    """Diagnose one recording. Where a diagnosis fails, the answer has its error.

    With `found` the function also gets the path of a reality file that it is to write.
    """
    with tempfile.TemporaryDirectory(prefix="rths-diagnosis-") as folder:
        place = Path(folder)
        if isinstance(given, Carried):
            for suffix, content in given.files.items():
                (place / f"{given.name}{suffix}").write_bytes(content)
            given = place / f"{given.name}{RECORDING}"
        reality = place / f"{given.stem}{ENDINGS[0]}"
        answer = answer_of(given, reference, reality if found else None)
        written = [path for path in map(reality.with_suffix, ENDINGS) if path.exists()]
        return Diagnosed(given.stem, answer, {path.suffix: path.read_bytes() for path in written})


def answer_of(path: Path, reference: str, found: Path | None) -> dict[str, Any]:
    """The reports of a diagnosis by slave, or its error, and the seconds that it took."""
    function = find(reference)
    started = time.perf_counter()
    try:
        other = path.with_suffix(OTHER)
        more: dict[str, Any] = {"validate": [other]} if other.exists() else {}
        if found:
            more["found"] = found
        given: Report | Mapping[str, Report] = function(path, **more)
        reports = {"": given} if isinstance(given, Report) else given
        answer: dict[str, Any] = {"reports": {name: report.plain() for name, report in reports.items()}}
    except RthsError as error:
        answer = {"error": str(error)}
    except Exception as error:  # one failure must not end the other cases
        traceback.print_exc()
        answer = {"error": f"{type(error).__name__}: {error}"}
    return answer | {"seconds": time.perf_counter() - started}


def run(args: argparse.Namespace) -> int:
    """Diagnose every recording of a folder."""
    find(args.diagnosis)
    args.out.mkdir(parents=True, exist_ok=True)
    paths = sorted(args.folder.glob(f"*{RECORDING}"))
    work = partial(diagnose, reference=args.diagnosis, found=args.found)
    for one in spread(work, Recordings(paths) if args.dask else paths, args.jobs, args.dask):
        for suffix, content in one.files.items():
            (args.out / f"{one.name}{suffix}").write_bytes(content)
        (args.out / f"{one.name}.json").write_text(json.dumps(one.answer), encoding="utf-8")
        sys.stdout.write(f"{one.name}\n")
        sys.stdout.flush()
    return 0


def main() -> int:
    """Entry of `python -m validation.blind.worker`."""
    parser = argparse.ArgumentParser(
        prog="validation.blind.worker", description="Diagnose every recording of a folder."
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--dask", default="")
    parser.add_argument("--found", action="store_true", help="also write what was found: OUT/<name>.toml")
    parser.add_argument("--diagnosis", default=DIAGNOSIS, metavar="MODULE:FUNCTION")
    args = parser.parse_args()
    return cli.guarded(lambda: run(args))


if __name__ == "__main__":
    sys.exit(main())
