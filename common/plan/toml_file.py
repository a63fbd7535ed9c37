"""Reads a user's TOML file into plain values; its errors are one sentence each."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from common.errors import PlanError


def text_of(path: Path, kind: str) -> str:
    """The text of a file; `kind` names what it should hold, such as "plan". Raises PlanError if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise PlanError(f"Cannot read the {kind} {path}: {reason}; give the path of a TOML file.") from None


def tables_in(text: str, name: str) -> dict[str, Any]:
    """The tables of a TOML text; `name` stands in errors. Raises PlanError where the text is not TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise PlanError(f"{name} is not valid TOML: {error}.") from None
    except RecursionError:
        raise PlanError(f"{name} cannot be used: its values are nested too deeply.") from None


def load_tables(path: Path, kind: str) -> dict[str, Any]:
    """The tables of a TOML file; raises PlanError as `text_of` and `tables_in`."""
    return tables_in(text_of(path, kind), f"The {kind} {path}")
