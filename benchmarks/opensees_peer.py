"""The default building in OpenSeesPy.

`ask` runs this file as a script in the interpreter that `RTHS_OPENSEES_PYTHON` names, else in the present one, and
passes it a case as JSON. That interpreter need not have rths: this file imports only the standard library at the top.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

PYTHON = "RTHS_OPENSEES_PYTHON"
REPEATS = 7  # as in benchmarks/closed_loop.py
PATIENCE_S = 120.0  # the case takes less than 1 s, importing OpenSees a few seconds on an idle machine
GROUND, FLOOR, SPRING, LOAD = 1, 2, 1, 1  # tags


class PeerCase(NamedTuple):
    """One storey in an earthquake: kg, N/m, N·s/m, s, and the ground acceleration (m/s²) at every step."""

    mass: float
    stiffness: float
    damping: float
    interval: float
    acceleration: list[float]
    repeats: int = REPEATS


class PeerAnswer(NamedTuple):
    """The result of OpenSeesPy: its version, displacements (m) after each step, steps per second of each repeat."""

    version: str
    displacement: list[float]
    at_once: list[float]  # all steps by one call of `analyze`
    by_step: list[float]  # one call of `analyze` per step, and the displacement read after it


def ask(case: PeerCase) -> PeerAnswer | str:
    """The answer of the interpreter that has OpenSeesPy, or a text that says why there is none."""
    command = [os.environ.get(PYTHON) or sys.executable, str(Path(__file__).resolve())]
    try:
        done = subprocess.run(
            command,
            input=json.dumps(case._asdict()),
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
    except OSError as error:
        return f"{PYTHON} cannot be run: {error.strerror}"
    except subprocess.TimeoutExpired:
        return f"no answer within {PATIENCE_S:g} s"
    answers = [line for line in done.stdout.splitlines() if line.startswith("{")]  # OpenSees prints there too
    if not answers:
        return reason(done.stderr)
    return PeerAnswer(**json.loads(answers[-1]))


def reason(stderr: str) -> str:
    """The last error line of a traceback; OpenSees may print a line of its own after it."""
    lines = [line for line in stderr.splitlines() if "Error" in line]
    return lines[-1].partition(": ")[2] if lines else "it ended without an answer"


def build(ops: Any, case: PeerCase) -> None:
    """Build the storey at rest: a spring and a dashpot between ground and floor, with Newmark's explicit method."""
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(GROUND, 0.0)
    ops.node(FLOOR, 0.0)
    ops.fix(GROUND, 1)
    ops.mass(FLOOR, case.mass)
    ops.uniaxialMaterial("Elastic", SPRING, case.stiffness, case.damping)
    ops.element("zeroLength", SPRING, GROUND, FLOOR, "-mat", SPRING, "-dir", 1)
    ops.timeSeries("Path", LOAD, "-dt", case.interval, "-values", *case.acceleration)
    ops.pattern("UniformExcitation", LOAD, 1, "-accel", LOAD)
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("Diagonal")  # the fastest solver of OpenSees for a diagonal matrix
    ops.algorithm("Linear")
    ops.integrator("NewmarkExplicit", 0.5)
    ops.analysis("Transient")


def at_once(ops: Any, case: PeerCase) -> None:
    """All steps in one call: the loop runs in C++ and no result is read."""
    if ops.analyze(len(case.acceleration), case.interval) != 0:
        raise ArithmeticError("OpenSees did not complete the analysis")


def by_step(ops: Any, case: PeerCase) -> list[float]:
    """One call per step, with the displacement (m) read after each, as a hybrid test needs it."""
    found = []
    for _ in case.acceleration:
        ops.analyze(1, case.interval)
        found.append(ops.nodeDisp(FLOOR, 1))
    return found


def rates(ops: Any, case: PeerCase, work: Callable[[Any, PeerCase], object]) -> list[float]:
    """Steps per second of processor time of each repeat, without the time to build the model."""
    found = []
    for _ in range(case.repeats):
        build(ops, case)
        began = time.process_time()
        work(ops, case)
        found.append(len(case.acceleration) / (time.process_time() - began))
    return found


def main() -> int:
    """Compute the case on standard input and write the answer as one line of JSON."""
    case = PeerCase(**json.load(sys.stdin))
    ops = import_module("openseespy.opensees")
    build(ops, case)
    displacement = by_step(ops, case)
    answer = PeerAnswer(ops.version(), displacement, rates(ops, case, at_once), rates(ops, case, by_step))
    sys.stdout.write("\n" + json.dumps(answer._asdict()) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
