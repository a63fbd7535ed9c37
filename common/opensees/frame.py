"""A process with a building of OpenSees: `python frame.py`, started by `common.foreign`.

OpenSees has one domain per process. The process may run in another interpreter, and imports nothing of rths. It reads
its task, a line of JSON, and answers with the number of floors. Then it reads the forces (N) of the laboratories on the
floors at each step and answers with displacement, velocity and acceleration of the floors at that step, and their
displacement and velocity ahead, for the end of the interval: numbers of eight bytes, relative to the ground.

The integrator is AlphaOS without numerical damping (operator splitting with the trapezoidal rule): the model is
evaluated once a step, at a displacement that is known before the step. That displacement is the one ahead, so a
laboratory is at it when its force is measured. A spring of the laboratory's nominal stiffness stands in the model for
the correction within a step, and a load of the same size takes its force away again, as AlphaOS treats an element.

Source: Nakashima, Kato and Takaoka, Development of real-time pseudo dynamic testing, Earthquake Eng. Struct. Dyn. 21
(1992); Combescure and Pegon, α-Operator splitting time integration technique, Nuclear Eng. Design 174 (1997).
"""

from __future__ import annotations

import importlib
import json
import os
import runpy
import struct
import sys
from typing import Any

COUNT = struct.Struct("<i")
OWN = 1_000_000  # first tag of what is added to the model; a model of a user has lower tags
BETA = 0.25  # of AlphaOS with α = 1


class Frame:
    """A model of the user, whose `build(ops, **options)` returns the nodes of the floors and their direction.

    The nodes stand from the lowest floor up, and the direction is that of the ground motion, from 1. Loads that `build`
    applies must be constant when it returns.

    Raises:
        ValueError: there is no `build`, it returns something else, or it makes no element.
    """

    def __init__(self, ops: Any, task: dict[str, Any]) -> None:
        self._ops, self._interval, self._begun = ops, float(task["interval"]), False
        self.floors, self._dof = self._built(task["model"], task["options"])
        ops.wipeAnalysis()
        self._stiffness = [float(k) for k in task["stiffness"]] + [0.0] * len(self.floors)
        for storey, node in enumerate(self.floors):
            self._brace(storey, node)
        self._shake(task["ground"])
        self._analyse()
        self._zero = [float(ops.nodeDisp(node, self._dof)) for node in self.floors]
        self._ahead = [0.0] * len(self.floors)  # displacements for the end of the interval, m

    def _built(self, file: str, options: dict[str, Any]) -> tuple[list[int], int]:
        """Make the model; the nodes of its floors and their direction."""
        build = runpy.run_path(file).get("build")
        if build is None:
            raise ValueError("it has no function build(ops, **options)")
        found = build(self._ops, **options)
        try:
            nodes, dof = found
            floors, dof = [int(node) for node in nodes], int(dof)
        except (TypeError, ValueError):
            raise ValueError(f"build returns {found!r}, but must return nodes and a direction") from None
        if not self._ops.getEleTags():
            raise ValueError("build makes no element")
        known = self._ops.getNodeTags()
        for node in floors:
            if node not in known:
                raise ValueError(f"build returns node {node}, which is not in the model")
            if not 1 <= dof <= (count := len(self._ops.nodeDisp(node))):
                raise ValueError(f"build returns direction {dof}, but must return one from 1 to {count}")
        return floors, dof

    def _brace(self, storey: int, node: int) -> None:
        """Put the spring of the laboratories of a storey between its floors, or between floor and ground."""
        if not self._stiffness[storey]:
            return
        ops, tag, below = self._ops, OWN + storey, self.floors[storey - 1]
        if storey == 0:
            below = OWN
            ops.node(below, *ops.nodeCoord(node))
            ops.fix(below, *[1] * len(ops.nodeDisp(node)))
        ops.uniaxialMaterial("Elastic", tag, self._stiffness[storey])
        ops.element("zeroLength", tag, below, node, "-mat", tag, "-dir", self._dof)

    def _shake(self, ground: list[float]) -> None:
        """Apply the ground acceleration (m/s²) at every step, and a load for every floor, which `step` sets."""
        ops, ours = self._ops, OWN + 1
        ops.timeSeries("Path", OWN, "-dt", self._interval, "-values", *ground)
        ops.pattern("UniformExcitation", OWN, self._dof, "-accel", OWN)
        ops.timeSeries("Constant", ours)
        ops.pattern("Plain", ours, ours)
        for tag, node in enumerate(self.floors, OWN):
            unit = [0.0] * len(ops.nodeDisp(node))
            unit[self._dof - 1] = 1.0
            ops.load(node, *unit)
            ops.parameter(tag, "loadPattern", ours, "loadAtNode", node, self._dof)
            ops.updateParameter(tag, 0.0)

    def _analyse(self) -> None:
        ops = self._ops
        ops.setTime(0.0)
        ops.constraints("Transformation")
        ops.numberer("RCM")
        ops.system("BandGeneral")
        ops.algorithm(
            "Linear", "-initial", "-factorOnce"
        )  # the method takes the initial stiffness throughout
        ops.integrator("AlphaOS", 1.0)
        ops.analysis("Transient", "-noWarnings")

    def step(self, forces: tuple[float, ...]) -> list[float]:
        """Displacement, velocity, acceleration, and displacement and velocity ahead, of every floor.

        `forces` (N) act on the floors at this step. The first step is that at rest, which takes none.

        Raises:
            RuntimeError: OpenSees finds no equilibrium.
        """
        ops, h, dof = self._ops, self._interval, self._dof
        if self._begun:
            self._load(forces)
            if ops.analyze(1, h) != 0:
                raise RuntimeError(f"OpenSees finds no equilibrium at {ops.getTime() + h:g} s")
        self._begun = True
        x = [ops.nodeDisp(node, dof) - zero for node, zero in zip(self.floors, self._zero, strict=True)]
        v = [ops.nodeVel(node, dof) for node in self.floors]
        a = [ops.nodeAccel(node, dof) for node in self.floors]
        rows = zip(x, v, a, strict=True)
        self._ahead = [xi + h * vi + (0.5 - BETA) * h**2 * ai for xi, vi, ai in rows]
        return [*x, *v, *a, *self._ahead, *(vi + h * ai for vi, ai in zip(v, a, strict=True))]

    def _load(self, forces: tuple[float, ...]) -> None:
        """Load the floors with forces (N) and with what takes the springs' forces away."""
        below, carried = 0.0, []
        for x, k in zip(self._ahead, self._stiffness, strict=False):
            carried.append(k * (x - below))
            below = x
        upper = [*carried[1:], 0.0]
        for i, (force, here, above) in enumerate(zip(forces, carried, upper, strict=True)):
            self._ops.updateParameter(OWN + i, force + here - above)


def main() -> int:
    """Serve until standard input ends."""
    out = os.dup(1)
    os.dup2(2, 1)
    source = sys.stdin.buffer
    task = json.loads(source.readline())
    frame = Frame(importlib.import_module("openseespy.opensees"), task)
    n = len(frame.floors)
    forces, motion = struct.Struct(f"<{n}d"), struct.Struct(f"<{5 * n}d")
    os.write(out, COUNT.pack(n))
    while data := source.read(forces.size):
        os.write(out, motion.pack(*frame.step(forces.unpack(data))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
