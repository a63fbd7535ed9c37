"""Finds where in a user's own code an exception came from, for sentences about it."""

from __future__ import annotations

import sys
import traceback
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[1]


def source_of(kind: type[object]) -> str:
    """The path of the file that defines a class, empty where it was not loaded from a file."""
    return getattr(sys.modules.get(kind.__module__), "__file__", None) or ""


def place(error: BaseException, source: str) -> str:
    """File name and line of an exception: the innermost frame in the file `source`, else the innermost user frame.

    A user frame is one in a file outside this project's folder. The text is empty if the exception passed through none.
    """
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if frame.filename == source]
    others = [
        frame
        for frame in frames
        if HOUSE not in Path(frame.filename).parents and not frame.filename.startswith("<")
    ]
    found = own or others
    return f"{Path(found[-1].filename).name}, line {found[-1].lineno}" if found else ""


def described(error: BaseException, source: str) -> str:
    """The type and the text of an exception, with file and line where they are known."""
    text, where = str(error), place(error, source)
    what = f"{type(error).__name__}: {text}" if text else type(error).__name__
    return f"{what} ({where})" if where else what


def whole(error: BaseException) -> str:
    """The whole traceback as Python prints it."""
    return "".join(traceback.format_exception(error))
