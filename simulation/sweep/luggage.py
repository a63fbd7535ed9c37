"""The files of this machine that the tests of a sweep need, sent with every task.

The records of motion, the files of kinds of laboratory of the user's, and the laws beside a reality are taken along as
bytes. The worker lays them into a temporary folder named after their content, once.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from common.errors import InputError
from common.plan.toml_file import load_tables
from models.ground_motion.motions import MOTIONS
from simulation.sweep.definition import Sweep

DEEP = Path("a/b/c/d/e/f/g/h")  # so that a path of the plan may go up eight folders


class Luggage(NamedTuple):
    """A sweep and the files that it needs, by their path on the worker."""

    sweep: Sweep
    reality: Mapping[str, Any]  # tables of the reality, empty for none
    files: Mapping[str, bytes]

    @property
    def digest(self) -> str:
        """Sixteen hex digits of the files."""
        found = hashlib.blake2b(digest_size=8)
        for name in sorted(self.files):
            found.update(f"{name}\0{len(self.files[name])}\0".encode())
            found.update(self.files[name])
        return found.hexdigest()


def packed(sweep: Sweep) -> Luggage:
    """The luggage of a sweep; raises InputError where a file that it names cannot be read."""
    reality, files = {}, dict(records(sweep))
    for reference in sweep.plan.kinds.values():
        files |= taken(reference.rpartition(":")[0], ".py", "plan", sweep.plan.base)
    if sweep.head.reality:
        path = sweep.base / sweep.head.reality
        reality = load_tables(path, "reality")
        learned = reality.get("learned", [])
        for one in learned if isinstance(learned, list) else []:
            files |= taken(str(one.get("file", "")), "", "reality", path.parent)
    return Luggage(sweep, reality, files)


def records(sweep: Sweep) -> Iterator[tuple[str, bytes]]:
    """The records of motion that are files, by their place in the sweep."""
    for place, one in enumerate(sweep.motions):
        name = str(one.ground_motion["record"])
        if name not in MOTIONS:
            yield from taken(name, "", f"motion/{place}", one.base).items()


def taken(name: str, suffix: str, room: str, base: Path) -> dict[str, bytes]:
    """A file of the user's that is named relative to a folder; nothing where it is an absolute path or is not there."""
    path = base / name
    if not name or not name.endswith(suffix) or Path(name).is_absolute() or not path.is_file():
        return {}
    return {os.path.normpath(Path(room) / DEEP / name): contents(path)}


def contents(path: Path) -> bytes:
    """The content of a file; raises InputError where it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"Cannot read {path}: {error.strerror}; check the path.") from None


def laid(luggage: Luggage) -> Path:
    """The folder on this machine with the files of the luggage; they are written where they are not there yet."""
    folder = Path(tempfile.gettempdir()) / f"rths-sweep-{os.getuid()}-{luggage.digest}"
    if not luggage.files or (folder.is_dir() and folder.stat().st_uid == os.getuid()):
        return folder
    new = Path(tempfile.mkdtemp(prefix="rths-sweep-new-"))
    for name, content in luggage.files.items():
        (new / name).parent.mkdir(parents=True, exist_ok=True)
        (new / name).write_bytes(content)
    for room in rooms(luggage.sweep):
        (new / room / DEEP).mkdir(parents=True, exist_ok=True)
    try:
        new.rename(folder)
    except OSError:  # another process of this machine was faster
        shutil.rmtree(new)
    return folder


def rooms(sweep: Sweep) -> list[str]:
    """The folders of the luggage: one for each place from which paths start."""
    return ["plan", "reality", *(f"motion/{place}" for place in range(len(sweep.motions)))]


def unpacked(luggage: Luggage) -> Sweep:
    """The sweep with paths that lead to its files on this machine."""
    folder, sweep = laid(luggage), luggage.sweep
    motions = (
        replace(one, base=folder / f"motion/{place}" / DEEP) for place, one in enumerate(sweep.motions)
    )
    plan = replace(sweep.plan, base=folder / "plan" / DEEP)
    return replace(sweep, plan=plan, motions=tuple(motions), base=folder / "reality" / DEEP)
