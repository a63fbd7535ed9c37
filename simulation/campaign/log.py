"""The log of a campaign: a line for each step, appended and synced, so that a command that is killed loses none.

A line that was cut off in the middle was never acted upon; it is removed when the log is opened again.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from common.errors import InputError
from simulation.campaign import steps
from simulation.campaign.steps import Step
from simulation.workers.parts import synced

LOG = "log.jsonl"


class CampaignLog:
    """The steps so far, and the file to which further ones are appended."""

    def __init__(self, file: BinaryIO, found: list[Step]) -> None:
        self._file = file
        self.steps = found

    def append(self, step: Step) -> None:
        """Append a step; it is on the disk when this returns."""
        self._file.write(steps.line(step))
        self._file.flush()
        os.fsync(self._file.fileno())
        self.steps.append(step)


@contextlib.contextmanager
def opened(folder: Path) -> Iterator[CampaignLog]:
    """The log in a folder, held against other processes within the context.

    Raises:
        InputError: another process is at work on the campaign, the log is damaged, or cannot be written.
    """
    path = folder / LOG
    try:
        file = path.open("a+b")
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror}; give another folder with -o.") from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"Another process is at work on the campaign in {folder}: wait for it, or give another folder with -o."
            ) from None
        file.seek(0)
        whole, _, rest = file.read().rpartition(b"\n")
        if rest:
            file.truncate(len(whole) + 1 if whole else 0)
            file.seek(0, os.SEEK_END)
        synced(folder)
        yield CampaignLog(file, read(whole, path))


def read(text: bytes, path: Path) -> list[Step]:
    """The steps of whole lines; raises InputError where one of them is none."""
    found = []
    for number, each in enumerate(text.splitlines(), 1):
        try:
            found.append(steps.parsed(each))
        except ValueError:
            raise InputError(
                f"Line {number} of {path} is damaged: restore the file, or begin anew in another folder with -o."
            ) from None
    return found
