"""The process that diagnoses: `python -m validation.blind.worker FOLDER OUT`. It knows recordings, nothing else.

For every recording it leaves `OUT/<name>.json`: the reports by slave or the error, and the seconds it took. One line
per recording on standard output says that it is done.
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
from validation.spread import spread

OTHER = ".other"  # suffix of a recording of the same laboratories, on which what was found is judged
DIAGNOSIS = "rths.examine.diagnose:diagnose_recording"


def find(reference: str) -> Any:
    """The diagnosing function 'module:function': the path of a recording in, the `Report` or reports by slave out."""
    module, _, name = reference.partition(":")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(f"There is no diagnosis '{reference}': {error}.") from None


def diagnose(path: Path, reference: str, out: Path) -> str:
    """Diagnose one recording into `out`; its name. A diagnosis that fails leaves its error in the report's place."""
    function = find(reference)
    started = time.perf_counter()
    try:
        other = path.with_suffix(OTHER)
        more = {"validate": [other]} if other.exists() else {}
        found: Report | Mapping[str, Report] = function(path, **more)
        reports = {"": found} if isinstance(found, Report) else found
        answer: dict[str, Any] = {"reports": {name: report.plain() for name, report in reports.items()}}
    except RthsError as error:
        answer = {"error": str(error)}
    except Exception as error:  # one failure must not take the other cases with it
        traceback.print_exc()
        answer = {"error": f"{type(error).__name__}: {error}"}
    answer["seconds"] = time.perf_counter() - started
    (out / f"{path.stem}.json").write_text(json.dumps(answer), encoding="utf-8")
    return path.stem


def run(args: argparse.Namespace) -> int:
    """Diagnose every recording of a folder."""
    find(args.diagnosis)
    args.out.mkdir(parents=True, exist_ok=True)
    work = partial(diagnose, reference=args.diagnosis, out=args.out)
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
    parser.add_argument("--diagnosis", default=DIAGNOSIS, metavar="MODULE:FUNCTION")
    args = parser.parse_args()
    return cli.guarded(lambda: run(args))


if __name__ == "__main__":
    sys.exit(main())
