"""An OpenSees frame without this program, with a spring as the specimen: `python alone.py FRAME METHOD`.

It reads a task from standard input and prints the displacements of the floors, (steps, floors) m. METHOD is AlphaOS, or
Newton for Newmark's trapezoidal rule with iterations.
"""

from __future__ import annotations

import importlib
import json
import runpy
import sys
from typing import Any

ops: Any = importlib.import_module("openseespy.opensees")

file, method = sys.argv[1:]
task = json.load(sys.stdin)
floors, dof = runpy.run_path(file)["build"](ops)
ops.wipeAnalysis()
below = 900
ops.node(below, *ops.nodeCoord(floors[0]))
ops.fix(below, 1, 1, 1)
for tag, row in enumerate(task["specimen"], 900):
    ops.uniaxialMaterial(row[0], tag, *row[1:])
ops.element("zeroLength", below, below, floors[0], "-mat", 900 + len(task["specimen"]) - 1, "-dir", dof)
ops.timeSeries("Path", 900, "-dt", task["interval"], "-values", *task["ground"])
ops.pattern("UniformExcitation", 900, dof, "-accel", 900)
ops.constraints("Transformation")
ops.numberer("RCM")
ops.system("BandGeneral")
ops.test("NormDispIncr", 1e-10, 50)
if method == "AlphaOS":
    ops.algorithm("Linear", "-initial")
    ops.integrator("AlphaOS", 1.0)
else:
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
ops.analysis("Transient", "-noWarnings")
start = [ops.nodeDisp(node, dof) for node in floors]
found = [[0.0] * len(floors)]
for _ in task["ground"][1:]:
    assert ops.analyze(1, task["interval"]) == 0
    found.append([ops.nodeDisp(node, dof) - zero for node, zero in zip(floors, start, strict=True)])
print(json.dumps(found))
