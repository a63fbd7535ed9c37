"""A text file of numbers, and the errors that name its lines."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError


@dataclass(frozen=True)
class MotionFile:
    """The lines of a file and a digest of its content."""

    path: Path
    lines: tuple[str, ...]
    digest: str

    @property
    def version(self) -> str:
        """The version of the record that this file holds: its name and eight hex digits of its content's digest."""
        return f"file {self.path.name}, digest {self.digest}"

    def at(self, index: int) -> str:
        """Place of the line with this index, counted from 0, as `file:line` counted from 1."""
        return f"{self.path}:{index + 1}"


def read_source(path: Path) -> MotionFile:
    """The file's lines; a byte order mark is dropped and bytes that are not UTF-8 are replaced.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"Cannot read ground motion {path}: {error.strerror}; check the path.") from None
    text = content.decode("utf-8-sig", errors="replace")
    digest = hashlib.blake2b(content, digest_size=4).hexdigest()
    return MotionFile(path, tuple(text.splitlines()), digest)


def printable(text: str) -> str:
    """Text of a file that is safe to show in a sentence: at most 60 characters, all of them printable."""
    return "".join(letter if letter.isprintable() else "?" for letter in text[:60])


def number(word: str, where: str) -> float:
    """A finite number from text.

    Raises:
        InputError: `word` at the place `where` is not a number, or is not finite.
    """
    try:
        value = float(word.replace("_", "?"))  # float() would take 1_000
    except ValueError:
        raise InputError(f"'{printable(word)}' at {where} is not a number: correct the file.") from None
    if not math.isfinite(value):
        raise InputError(f"The value at {where} is {word}, but must be finite: correct the file.")
    return value


def numbers(source: MotionFile, start: int) -> NDArray[np.float64]:
    """All values, separated by blanks, in the lines from index `start` on.

    Raises:
        InputError: a value is not a finite number.
    """
    lines = enumerate(source.lines[start:], start)
    return np.array([number(word, source.at(i)) for i, line in lines for word in line.split()])
