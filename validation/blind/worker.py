"""The process that diagnoses: `python -m validation.blind.worker FOLDER OUT`. It has nothing but the recordings.

For every recording it writes `OUT/<name>.json`: the reports by slave or the error, and the seconds that it took. After
each recording it prints its name on standard output.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import time
import traceback
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from common.errors import InputError, RthsError
from common.terminal import cli
from diagnosis.report.records import Report
from simulation.workers.pool import spread

OTHER = ".other"  # suffix of a recording of the same laboratories, on which the finding is judged
ENDINGS = (".toml", ".npz")  # of the two files that say what was found in a recording
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


def diagnose(path: Path, reference: str, out: Path, found: bool = False) -> str:
    """Diagnose one recording into `out`, and return its name. Where a diagnosis fails, the file has its error.

    With `found` the function also gets the path of a reality file that it is to write.
    """
    function = find(reference)
    started = time.perf_counter()
    try:
        other = path.with_suffix(OTHER)
        more: dict[str, Any] = {"validate": [other]} if other.exists() else {}
        if found:
            more["found"] = out / f"{path.stem}{ENDINGS[0]}"
        given: Report | Mapping[str, Report] = function(path, **more)
        reports = {"": given} if isinstance(given, Report) else given
        answer: dict[str, Any] = {"reports": {name: report.plain() for name, report in reports.items()}}
    except RthsError as error:
        answer = {"error": str(error)}
    except Exception as error:  # one failure must not end the other cases
        traceback.print_exc()
        answer = {"error": f"{type(error).__name__}: {error}"}
    answer["seconds"] = time.perf_counter() - started
    (out / f"{path.stem}.json").write_text(json.dumps(answer), encoding="utf-8")
    return path.stem


def run(args: argparse.Namespace) -> int:
    """Diagnose every recording of a folder."""
    find(args.diagnosis)
    args.out.mkdir(parents=True, exist_ok=True)
    work = partial(diagnose, reference=args.diagnosis, out=args.out, found=args.found)
    for name in spread(work, sorted(args.folder.glob("*.mcap")), args.jobs, args.dask):
        sys.stdout.write(f"{name}\n")
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
