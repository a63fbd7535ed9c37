"""One OpenSees specimen in a process of its own: it is sent a path of deformations and returns the force at its end."""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import struct
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError, RigError
from common.opensees import server

Array = NDArray[np.float64]

INTERPRETER = (
    "RTHS_OPENSEES_PYTHON"  # environment: an interpreter that has openseespy, where this one has not
)
INSTALL = f"`make opensees` installs OpenSeesPy, or {INTERPRETER} names an interpreter that has it"
ENDED = b"Process 0 Terminating"  # the line that OpenSees writes whenever it ends


class SpecimenProcess:
    """The process; `task` is {"materials": rows} or {"model": file, "options": {…}}, `name` is for messages.

    Raises:
        InputError: OpenSees is not installed, or refuses the materials or the model.
    """

    def __init__(self, name: str, task: Mapping[str, Any]) -> None:
        self._name = name
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        words = [os.environ.get(INTERPRETER) or sys.executable, server.__file__, json.dumps(task)]
        try:
            self._process = subprocess.Popen(
                words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said
            )
        except OSError as error:
            self._said.close()
            raise InputError(f"{words[0]} in {INTERPRETER} cannot be started: {error.strerror}.") from None
        self.close = weakref.finalize(self, _end, self._process, self._said)
        if self._answer() is None:
            self._process.wait()
            said = self._words()
            self.close()
            hint = f": {INSTALL}" if "openseespy" in said else ""
            raise InputError(f"OpenSees cannot be the specimen {name} ({said}){hint}.")

    def force(self, way: Sequence[float] | Array) -> float:
        """The force (N) at the end of a path of deformations (m).

        Raises:
            RigError: OpenSees finds no equilibrium, or its process has ended.
        """
        assert self._process.stdin is not None  # noqa: S101 - it is a pipe
        try:
            self._process.stdin.write(server.COUNT.pack(len(way)) + struct.pack(f"<{len(way)}d", *way))
            self._process.stdin.flush()
            found = self._answer()
        except (BrokenPipeError, ValueError):
            found = None
        if found is None:
            raise RigError(f"OpenSees has ended as the specimen {self._name} ({self._words()})")
        if math.isnan(found):
            raise RigError(
                f"OpenSees finds no equilibrium of {self._name} at {way[-1] * 1e3:.4g} mm: refine the model, or "
                "lower scale in [ground_motion]"
            )
        return found

    def _answer(self) -> float | None:
        assert self._process.stdout is not None  # noqa: S101 - it is a pipe
        answer = self._process.stdout.read(server.VALUE.size)
        return float(server.VALUE.unpack(answer)[0]) if len(answer) == server.VALUE.size else None

    def _words(self) -> str:
        """The last line of the standard error of the process, without the type of the error."""
        if self._said.closed:
            return "its process is closed"
        self._said.seek(0)
        lines = [line for line in self._said.read().splitlines() if line.strip() and ENDED not in line]
        last = lines[-1].decode(errors="replace").strip() if lines else "it said nothing"
        return re.sub(r"^\w+Error: ", "", last)


def _end(process: subprocess.Popen[bytes], said: IO[bytes]) -> None:
    """End the process and close its streams."""
    process.kill()
    for stream in (process.stdin, process.stdout, said):
        if stream is not None and not stream.closed:
            with contextlib.suppress(BrokenPipeError):  # `close` flushes to a process that has ended
                stream.close()
    process.wait()


def absolute(file: str) -> str:
    """The absolute path of a model's file; raises InputError if there is no such file."""
    path = Path(file).expanduser()
    if not path.is_file():
        raise InputError(
            f"There is no OpenSees model {path}: its path starts from the folder of the command."
        )
    return str(path.resolve())
