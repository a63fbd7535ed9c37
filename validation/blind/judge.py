"""Diagnoses by another process, which is given nothing but a folder of recordings."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from common.errors import InputError
from diagnosis.report import read
from diagnosis.report.records import Report
from validation.blind.worker import DIAGNOSIS, ENDINGS, RECORDING, Diagnosed

HOME = Path(__file__).resolve().parents[2]
KEPT = ("PATH", "HOME", "LANG", "LC_ALL", "TMPDIR", "NUMBA_CACHE_DIR", "SYSTEMROOT")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class DiagnosisAnswer(NamedTuple):
    """The reports of a diagnosis on one recording, and how long it took."""

    reports: Mapping[str, Report]  # by the slave's name, empty for the one without; none where it failed
    seconds: float
    error: str = ""


GRACE = 3.0  # s, in which an interrupted process may end its own workers: the longest wait after Ctrl-C
NONE = DiagnosisAnswer({}, float("nan"), "the diagnosis gave no answer")


def diagnose_all(
    folder: Path,
    *,
    jobs: int = 1,
    dask: str = "",
    diagnosis: str = DIAGNOSIS,
    done: Callable[[Diagnosed], None] = lambda _answer: None,
    found: bool = False,
) -> dict[str, DiagnosisAnswer]:
    """Answers by the name of the recording; `done` is called with each answer as soon as it is there.

    With `found` that includes the files with the findings.

    Raises:
        InputError: the process failed.
    """
    with tempfile.TemporaryDirectory(prefix="rths-blind-") as place:
        out = Path(place) / "reports"
        words = [str(folder), str(out), "--jobs", str(jobs), "--diagnosis", diagnosis]
        words += (["--dask", dask] if dask else []) + (["--found"] if found else [])
        _work(words, Path(place), jobs, lambda name: done(_diagnosed(out / f"{name}.json")))
        said = map(_diagnosed, sorted(out.glob("*.json")))
        return {f"{one.name}{RECORDING}": answer(one.answer, one.name) for one in said}


def _work(words: list[str], place: Path, jobs: int, done: Callable[[str], None]) -> None:
    complaints = place / "complaints.txt"
    with complaints.open("w") as stream:
        process = subprocess.Popen(
            [sys.executable, "-m", "validation.blind.worker", *words],
            cwd=place,
            env=environment(jobs),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=stream,
            text=True,
        )
        with process:
            assert process.stdout is not None  # noqa: S101 - it is a pipe
            try:
                for line in process.stdout:
                    done(line.strip())
            except BaseException:
                _end(process)
                raise
    if process.returncode:
        said = complaints.read_text(encoding="utf-8").strip().splitlines() or ["it ended without a message"]
        raise InputError(f"The process that diagnoses failed: {said[-1].removeprefix('rths: ')}")


def _end(process: subprocess.Popen[str]) -> None:
    """End the process and those that it started; after Ctrl-C on a terminal it has had the signal already."""
    for word in (None, signal.SIGINT, signal.SIGKILL):
        if word is not None:
            process.send_signal(word)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(GRACE)
            return


def environment(jobs: int) -> dict[str, str]:
    """Environment of the diagnosing process: where programs are, and nothing that could tell it the truth."""
    kept = {name: os.environ[name] for name in KEPT if name in os.environ}
    threads = dict.fromkeys(THREADS, "1") if jobs != 1 else {}
    return kept | threads | {"PYTHONPATH": str(HOME), "PYTHONHASHSEED": "0"}


def _diagnosed(path: Path) -> Diagnosed:
    """What the process wrote of a recording."""
    files = [one for one in map(path.with_suffix, ENDINGS) if one.exists()]
    data = json.loads(path.read_text(encoding="utf-8"))
    return Diagnosed(path.stem, data, {one.suffix: one.read_bytes() for one in files})


def answer(data: Mapping[str, Any], name: str) -> DiagnosisAnswer:
    """The answer on the recording of this name that JSON holds."""
    where = f"The report on {name}"
    reports = {slave: read.report(said, where) for slave, said in data.get("reports", {}).items()}
    return DiagnosisAnswer(reports, float(data["seconds"]), data.get("error", ""))
