"""A process with one OpenSees specimen: `python server.py`, started by `common.opensees.process`.

OpenSees has one domain per process, so each specimen has a process of its own. It may run in another interpreter, and
imports nothing of rths. It reads its task, a line of JSON, then a count and as many deformations (m, eight bytes each)
from standard input and answers with the force (N) at the last, NaN if OpenSees finds no equilibrium. The standard
output of OpenSees is redirected to standard error.
"""

from __future__ import annotations

import importlib
import json
import math
import os
import runpy
import struct
import sys
from collections.abc import Iterable
from typing import Any

COUNT, VALUE = struct.Struct("<i"), struct.Struct("<d")
OWN = 1_000_000  # tag of the pattern and time series of the deformation; a model of a user has lower tags
# of a step without equilibrium, to 1/256 of it: 1 µm, as 0.5 m/s are 0.25 mm in each of the four steps of a tick
HALVINGS = 8
ALGORITHMS = (("Newton",), ("KrylovNewton",), ("NewtonLineSearch",), ("ModifiedNewton", "-initial"))
# m, increment of the last iteration: with a stiffness of 100 kN/mm an error of 1 mN. Newton's method needs about five
# iterations; the others converge linearly and may need some tens.
TOLERANCE, ITERATIONS = 1e-11, 60


class MaterialUnderTest:
    """A uniaxial material: deformation (m) as strain, force (N) as stress; `rows` are calls of `uniaxialMaterial`."""

    def __init__(self, ops: Any, rows: list[list[Any]]) -> None:
        self._ops = ops
        for row in rows:
            ops.uniaxialMaterial(*row)
        ops.testUniaxialMaterial(int(rows[-1][1]))

    def force(self, way: Iterable[float]) -> float:
        """The force (N) at the end of a path of deformations (m)."""
        for deformation in way:
            self._ops.setStrain(deformation)
        return float(self._ops.getStress())


class Model:
    """A model in a file of the user, whose `build(ops, **options)` returns the node and the direction to be moved.

    `build` may apply loads, as an axial force; they must be constant when it returns.

    Raises:
        ValueError: there is no `build`, it returns something else, or it makes no element.
    """

    def __init__(self, ops: Any, file: str, options: dict[str, Any]) -> None:
        self._ops, self._at = ops, 0.0
        self._node, self._dof = self._built(file, options)
        ops.wipeAnalysis()
        ops.timeSeries("Linear", OWN)
        ops.pattern("Plain", OWN, OWN)
        unit = [0.0] * len(ops.nodeDisp(self._node))
        unit[self._dof - 1] = 1.0
        ops.load(self._node, *unit)
        ops.setTime(0.0)  # the time is the load factor of the unit load, hence the force
        ops.constraints("Transformation")
        ops.numberer("RCM")
        ops.system("BandGeneral")
        ops.test("NormDispIncr", TOLERANCE, ITERATIONS, 0)
        ops.algorithm(*ALGORITHMS[0])
        ops.integrator("DisplacementControl", self._node, self._dof, 0.0)
        ops.analysis("Static", "-noWarnings")
        self._zero = float(ops.nodeDisp(self._node, self._dof))

    def _built(self, file: str, options: dict[str, Any]) -> tuple[int, int]:
        """Make the model; node and direction to be moved."""
        build = runpy.run_path(file).get("build")
        if build is None:
            raise ValueError("it has no function build(ops, **options)")
        found = build(self._ops, **options)
        try:
            node, dof = map(int, found)
        except (TypeError, ValueError):
            raise ValueError(f"build returns {found!r}, but must return a node and a direction") from None
        if not self._ops.getEleTags():
            raise ValueError("build makes no element")
        if node not in self._ops.getNodeTags():
            raise ValueError(f"build returns node {node}, which is not in the model")
        count = len(self._ops.nodeDisp(node))
        if not 1 <= dof <= count:
            raise ValueError(f"build returns direction {dof}, but must return one from 1 to {count}")
        return node, dof

    def force(self, way: Iterable[float]) -> float:
        """The force (N) at the end of a path of deformations (m); NaN if no equilibrium is found."""
        for deformation in way:
            if not self._move(deformation, HALVINGS):
                return math.nan
        return float(self._ops.getLoadFactor(OWN))

    def _move(self, to: float, halvings: int) -> bool:
        """Move to a deformation (m); a step without equilibrium is halved up to `halvings` times."""
        if to == self._at:
            return True
        step = self._zero + to - float(self._ops.nodeDisp(self._node, self._dof))
        self._ops.integrator("DisplacementControl", self._node, self._dof, step)
        if any(self._found(algorithm) for algorithm in ALGORITHMS):
            self._at = to
            return True
        return halvings > 0 and all(self._move(part, halvings - 1) for part in (0.5 * (self._at + to), to))

    def _found(self, algorithm: tuple[str, ...]) -> bool:
        self._ops.algorithm(*algorithm)
        return int(self._ops.analyze(1)) == 0


def main() -> int:
    """Serve until standard input ends."""
    out = os.dup(1)
    os.dup2(2, 1)
    source = sys.stdin.buffer
    task = json.loads(source.readline())
    ops: Any = importlib.import_module("openseespy.opensees")
    own = task.get("model")
    specimen = Model(ops, own, task["options"]) if own else MaterialUnderTest(ops, task["materials"])
    os.write(out, VALUE.pack(0.0))
    while head := source.read(COUNT.size):
        (count,) = COUNT.unpack(head)
        way = [value for (value,) in VALUE.iter_unpack(source.read(count * VALUE.size))]
        os.write(out, VALUE.pack(specimen.force(way)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
