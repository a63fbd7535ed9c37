"""The folder into which a command writes a page and what belongs to it."""

from __future__ import annotations

from pathlib import Path

from common.errors import InputError


def prepared(folder: Path) -> Path:
    """The folder, made, in which `index.html` can be written; raises InputError where it cannot."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "index.html").touch()
    except OSError as error:
        raise InputError(
            f"Cannot write into {folder}: {error.strerror}; give another folder with -o."
        ) from None
    return folder
