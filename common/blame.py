"""Where in a user's own code an exception came from."""

from __future__ import annotations

import sys
import traceback
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[1]


def source_of(kind: type[object]) -> str:
    """The file in which a class stands, empty where there is none."""
    return getattr(sys.modules.get(kind.__module__), "__file__", None) or ""


def place(error: BaseException, source: str) -> str:
    """File and line of an exception: the innermost line of the file `source`, else the innermost outside this folder.

    Empty where the exception comes from no other code than this folder's.
    """
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if frame.filename == source]
    others = [frame for frame in frames if HOUSE not in Path(frame.filename).parents]
    found = own or others
    return f"{Path(found[-1].filename).name}, line {found[-1].lineno}" if found else ""


def described(error: BaseException, source: str) -> str:
    """An exception in words, with file and line where they are known."""
    text, where = str(error), place(error, source)
    what = f"{type(error).__name__}: {text}" if text else type(error).__name__
    return f"{what} ({where})" if where else what


def whole(error: BaseException) -> str:
    """The traceback as Python writes it."""
    return "".join(traceback.format_exception(error))
