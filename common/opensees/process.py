"""One OpenSees specimen in a process of its own: it is sent a path of deformations and returns the force at its end."""

from __future__ import annotations

import math
import os
import struct
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError, RigError
from common.opensees import server
from common.piped import EndedError, PipedProgram

Array = NDArray[np.float64]

INTERPRETER = (
    "RTHS_OPENSEES_PYTHON"  # environment: an interpreter that has openseespy, where this one has not
)
INSTALL = f"`make opensees` installs OpenSeesPy, or {INTERPRETER} names an interpreter that has it"
ENDED = b"Process 0 Terminating"  # the line that OpenSees writes whenever it ends

# what a specimen lacks where its force is no number, and what its user may do: of a model, and of a material
UNSOLVED = ("no equilibrium of", "refine the model, or lower scale in [ground_motion]")
UNDEFINED = ("no force of", "correct its row in materials")


class SpecimenProcess:
    """The process; `task` is {"materials": rows} or {"model": file, "options": {…}}, `name` is for messages.

    Raises:
        InputError: OpenSees is not installed, or refuses the materials or the model.
    """

    def __init__(self, name: str, task: Mapping[str, Any]) -> None:
        self._name = name
        self._lacks, self._remedy = UNSOLVED if task.get("model") else UNDEFINED
        self._program = started(server.__file__, task)
        self.close = self._program.close
        try:
            self._answer()
        except EndedError as error:
            self.close()
            raise InputError(f"OpenSees cannot be the specimen {name} ({error}){hint(str(error))}.") from None

    def force(self, way: Sequence[float] | Array) -> float:
        """The force (N) at the end of a path of deformations (m).

        Raises:
            RigError: OpenSees finds no equilibrium, or its process has ended.
        """
        try:
            self._program.send(server.COUNT.pack(len(way)) + struct.pack(f"<{len(way)}d", *way))
            found = self._answer()
        except EndedError as error:
            raise RigError(f"OpenSees has ended as the specimen {self._name} ({error}).") from None
        if math.isnan(found):
            raise RigError(
                f"OpenSees finds {self._lacks} {self._name} at {way[-1] * 1e3:.4g} mm: {self._remedy}."
            )
        return found

    def _answer(self) -> float:
        return float(server.VALUE.unpack(self._program.answer(server.VALUE.size) or b"")[0])


def started(file: str, task: Mapping[str, Any]) -> PipedProgram:
    """The program in a Python file, in the interpreter that has OpenSees; raises InputError where there is none."""
    words = [os.environ.get(INTERPRETER) or sys.executable, file]
    try:
        return PipedProgram(words, task, ENDED)
    except OSError as error:
        raise InputError(f"{words[0]} in {INTERPRETER} cannot be started: {error.strerror}.") from None


def hint(said: str) -> str:
    """How to install OpenSees, where its absence is why a program ended."""
    return f": {INSTALL}" if "openseespy" in said else ""


def absolute(file: str) -> str:
    """The absolute path of a model's file; raises InputError if there is no such file."""
    path = Path(file).expanduser()
    if not path.is_file():
        raise InputError(f"There is no OpenSees model {path}: give the path of its file.")
    return str(path.resolve())
