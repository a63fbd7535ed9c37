"""A process that holds one OpenSees material: `python -m validation.blind.labs.material_server CALLS`.

OpenSees has one domain per process, so each column has a process of its own. It reads deformations (m, eight bytes
each, a count before them) from standard input and answers with the force (N) at the last. OpenSees writes to standard
output when it ends: that goes to standard error.
"""

from __future__ import annotations

import importlib
import json
import os
import struct
import sys

COUNT, VALUE = struct.Struct("<i"), struct.Struct("<d")


def main() -> int:
    """Serve until standard input ends."""
    out = os.dup(1)
    os.dup2(2, 1)
    opensees = importlib.import_module("openseespy.opensees")
    rows = json.loads(sys.argv[1])
    for row in rows:
        opensees.uniaxialMaterial(*row)
    opensees.testUniaxialMaterial(int(rows[-1][1]))
    os.write(out, VALUE.pack(0.0))
    source = sys.stdin.buffer
    while head := source.read(COUNT.size):
        (count,) = COUNT.unpack(head)
        for (deformation,) in VALUE.iter_unpack(source.read(count * VALUE.size)):
            opensees.setStrain(deformation)
        os.write(out, VALUE.pack(opensees.getStress()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
