"""A model for OpenSees in another interpreter, which has no other module of this project: one storey, two at most.

`python model.py INTEGRATOR ALGORITHM STEPS REST LABORATORIES PORT …` prints the displacements after every step of the
transient analysis as JSON; without a port springs stand in the laboratories' place, and with one port for two
laboratories one element has both. REST steps of a static analysis without load come before it, and its ground is at
rest for as many of its STEPS.
"""

from __future__ import annotations

import json
import math
import socket
import sys
import time
from importlib import import_module
from typing import Any

STEP = 0.002
INTEGRATORS = {
    "NewmarkExplicit": (0.5,),
    "CentralDifference": (),
    "AlphaOS": (1.0,),
    "Newmark": (0.5, 0.25),
}


def build(ops: Any, laboratories: int, ports: list[int]) -> None:
    """Storeys of 160 t, each with a laboratory or a spring of its stiffness."""
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(1, 0.0)
    ops.fix(1, 1)
    floors = list(range(2, 2 + laboratories))
    for floor in floors:  # each storey stands on the ground: its drift is its displacement
        ops.node(floor, 0.0)
        ops.mass(floor, 160e3 * floor)
        ops.uniaxialMaterial("Elastic", floor, 18.75e6, 200e3)
        ops.element("zeroLength", floor, 1, floor, "-mat", floor, "-dir", 1)
    place(ops, floors, ports)


def hold(ops: Any, steps: int) -> None:
    """A static analysis without load, as of a building whose gravity loads the laboratories do not feel."""
    prepare(ops, "Linear")
    ops.integrator("LoadControl", 1.0 / steps)
    ops.analysis("Static")
    ops.analyze(steps)
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()


def shake(ops: Any, integrator: str, algorithm: str, rest: int) -> None:
    """Prepare the transient analysis of a motion that begins after `rest` steps."""
    motion = [0.0] * rest + [0.3 * math.sin(0.05 * i) for i in range(10_000)]
    ops.timeSeries("Path", 1, "-dt", STEP, "-values", *motion)
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    prepare(ops, algorithm)
    ops.integrator(integrator, *INTEGRATORS[integrator])
    ops.analysis("Transient")


def prepare(ops: Any, algorithm: str) -> None:
    """What every analysis needs but its integrator."""
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.test("NormUnbalance", 1e-6, 10)
    ops.algorithm(algorithm)


def place(ops: Any, floors: list[int], ports: list[int]) -> None:
    """Springs, one element for all laboratories, or one for each."""
    if not ports:
        for floor in floors:
            ops.uniaxialMaterial("Elastic", 10 + floor, 6.25e6)
            ops.element("zeroLength", 10 + floor, 1, floor, "-mat", 10 + floor, "-dir", 1)
        return
    while any(socket.socket().connect_ex(("127.0.0.1", port)) for port in ports):
        time.sleep(0.05)  # an element connects as it is made, and tries once only
    shared = [floors] if len(ports) == 1 else [[floor] for floor in floors]
    for tag, (port, those) in enumerate(zip(ports, shared, strict=True), start=20):
        dofs = [word for _ in those for word in ("-dof", 1)]
        ops.element("genericClient", tag, "-node", *those, *dofs, "-server", port, "127.0.0.1", "-noRayleigh")


def main() -> int:
    """Analyse, and print what came out."""
    integrator, algorithm, steps, rest, laboratories, *ports = sys.argv[1:]
    ops = import_module("openseespy.opensees")
    build(ops, int(laboratories), [int(port) for port in ports])
    if int(rest):
        hold(ops, int(rest))
    shake(ops, integrator, algorithm, int(rest))
    found, began = [], 0.0
    for _ in range(int(steps)):
        if ops.analyze(1, STEP):
            break
        began = began or time.perf_counter()  # the first step waits until the laboratories are armed
        found.append([ops.nodeDisp(floor, 1) for floor in range(2, 2 + int(laboratories))])
    rate = (len(found) - 1) / (time.perf_counter() - began)
    sys.stdout.write("\n" + json.dumps({"version": ops.version(), "rate": rate, "found": found}) + "\n")
    sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
