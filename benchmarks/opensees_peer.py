"""The default building in OpenSeesPy, in an interpreter that has it; runs there as a script, without this project.

`ask` starts this file in the interpreter that `RTHS_OPENSEES_PYTHON` names, else in the own one, and hands it a
case as JSON; so everything imported at the top must be of the standard library.
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
REPEATS = 7
PATIENCE_S = 120.0
GROUND, FLOOR, SPRING, LOAD = 1, 2, 1, 1  # tags


class PeerCase(NamedTuple):
    """One storey in an earthquake: kg, N/m, N·s/m, s, and the ground's acceleration (m/s²) at every step."""

    mass: float
    stiffness: float
    damping: float
    interval: float
    acceleration: list[float]
    repeats: int = REPEATS


class PeerAnswer(NamedTuple):
    """What OpenSeesPy gives: its version, displacements (m) after each step, steps per second of each repeat."""

    version: str
    displacement: list[float]
    at_once: list[float]  # all steps by one call of `analyze`
    by_step: list[float]  # one call a step, and the displacement read after it


def ask(case: PeerCase) -> PeerAnswer | str:
    """The answer of the interpreter that has OpenSeesPy, or why there is none."""
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
    """The error in a traceback: its last line, which OpenSees's own last line may follow."""
    lines = [line for line in stderr.splitlines() if "Error" in line]
    return lines[-1].partition(": ")[2] if lines else "it ended without an answer"


def build(ops: Any, case: PeerCase) -> None:
    """The storey as a spring and dashpot between ground and floor, explicit Newmark, at rest."""
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
    ops.system("Diagonal")  # the fastest of its solvers here
    ops.algorithm("Linear")
    ops.integrator("NewmarkExplicit", 0.5)
    ops.analysis("Transient")


def at_once(ops: Any, case: PeerCase) -> None:
    """All steps by one call: the loop runs in C++ and nothing is read."""
    if ops.analyze(len(case.acceleration), case.interval) != 0:
        raise ArithmeticError("OpenSees did not complete the analysis")


def by_step(ops: Any, case: PeerCase) -> list[float]:
    """One call a step and the displacement read after each, as a hybrid test must; displacements, m."""
    found = []
    for _ in case.acceleration:
        ops.analyze(1, case.interval)
        found.append(ops.nodeDisp(FLOOR, 1))
    return found


def rates(ops: Any, case: PeerCase, work: Callable[[Any, PeerCase], object]) -> list[float]:
    """Steps per second of processor time in each repeat; building the model is not counted."""
    found = []
    for _ in range(case.repeats):
        build(ops, case)
        began = time.process_time()
        work(ops, case)
        found.append(len(case.acceleration) / (time.process_time() - began))
    return found


def main() -> int:
    """Answer the case on standard input with one line of JSON."""
    case = PeerCase(**json.load(sys.stdin))
    ops = import_module("openseespy.opensees")
    build(ops, case)
    displacement = by_step(ops, case)
    answer = PeerAnswer(ops.version(), displacement, rates(ops, case, at_once), rates(ops, case, by_step))
    sys.stdout.write("\n" + json.dumps(answer._asdict()) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
