"""The lines of a text file with a table, as a reader of tables can take them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

LABVIEW = ".lvm"  # ending of what LabVIEW writes
COMMENT = re.compile(r"([\t,;])Comment\s*$")  # its last name


def lines_of(path: Path, encoding: str) -> Iterator[str]:
    """Its lines with their ends; those of LabVIEW without the column of comments, which most rows leave out.

    Raises:
        OSError: the file cannot be opened.
    """
    with path.open(encoding=encoding, newline="") as stream:
        if path.suffix.lower() != LABVIEW:
            yield from stream
            return
        for line in stream:
            if found := COMMENT.search(line):
                yield line[: found.start()] + "\n"
                break
            yield line
        else:
            return
        separator, width = found[1], line.count(found[1])
        for line in stream:
            yield separator.join(line.rstrip("\r\n").split(separator)[:width]) + "\n"
