"""The program inside an FMU of a laboratory: `python -m rths.fmi.served RESOURCES`, started by its shared library.

The folder RESOURCES holds the plan, the reality if there is one, and `laboratory.json` with the role and the folders
from which the paths of classes start.
"""

from __future__ import annotations

import json
import os
import struct
import sys
import tomllib
from pathlib import Path
from typing import BinaryIO

from common.errors import RthsError
from common.plan.read import parse
from common.reality.reality import Reality, as_planned, from_reality
from common.rig import GuardedRig, command_of
from loop import rigs

PLAN, REALITY, ROLE = "plan.toml", "reality.toml", "laboratory.json"
LONGEST = 500  # bytes of an error message: the shared library reads it into 512 bytes


def reality_in(resources: Path) -> tuple[Reality, str]:
    """The reality that an FMU's resources describe, and the role of its laboratory."""
    told = json.loads((resources / ROLE).read_text(encoding="utf-8"))
    plan = parse((resources / PLAN).read_text(encoding="utf-8"), Path(told["plan_folder"]))
    if not (resources / REALITY).is_file():
        return as_planned(plan), told["role"]
    tables = tomllib.loads((resources / REALITY).read_text(encoding="utf-8"))
    return from_reality(tables, plan, Path(told["reality_folder"])), told["role"]


def serve(resources: Path, source: BinaryIO, out: int) -> None:
    """Build the laboratory when its seed arrives, then advance it one interval per command, until the source ends."""
    whole, role = reality_in(resources)
    reality = whole.of(role)
    kind = rigs.hosted(reality, role)
    assert kind is not None  # noqa: S101 - the export refuses a role without a laboratory
    command, size = command_of(kind.channels), 8 * len(kind.channels.drives)
    rig: GuardedRig | None = None
    try:
        while order := source.read(1):
            if order == b"S":
                (seed,) = struct.unpack("<q", source.read(8))
                rig = rigs.build(reality, role, seed=seed)
                rig.arm()
            else:
                assert rig is not None  # noqa: S101 - the seed comes first
                rig.write(command(*struct.unpack(f"<{size // 8}d", source.read(size))))
            values = tuple(rig.read())
            os.write(out, b"\0" + struct.pack(f"<{len(values)}d", *values))
    except RthsError as error:
        text = str(error).encode()[:LONGEST]
        os.write(out, b"\1" + struct.pack("<H", len(text)) + text)
    finally:
        if rig is not None:
            rig.disarm()


def main() -> int:
    """Serve until standard input ends; what is printed goes to standard error."""
    out = os.dup(1)
    os.dup2(2, 1)
    serve(Path(sys.argv[1]), sys.stdin.buffer, out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
