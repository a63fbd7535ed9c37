r"""Text that comes from elsewhere, made safe for a terminal: what would act on it is written out instead.

A recording, a plan or a message may hold escape sequences, which move the cursor, set the window's title, hide a link
or change what a reader sees of the lines before. `shown` writes such characters as Python does (`\u202e`), and leaves
every letter, sign and space as it is. It is meant for a text within a line, so it writes line ends out too. Whatever a
command prints goes through `Escaping`, which stands before standard output and standard error and works on single
characters: it escapes all but line ends and tabs. The few sequences of our own go to the stream behind it (`behind`).
"""

from __future__ import annotations

import contextlib
import dataclasses
import re
import sys
from collections.abc import Iterator, Mapping
from typing import Any, TextIO, TypeVar, cast

# control characters (C0 without tab and line feed, DEL, C1), what changes the direction of writing, line separators,
# invisible characters, tags, and halves of characters that no encoding takes
ACTING = (
    "\x00-\x08\x0b-\x1f\x7f-\x9f\u00ad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb"
    "\U000e0000-\U000e007f\ud800-\udfff"
)
WITHIN_LINE = re.compile(f"[\t\n{ACTING}]")
ANYWHERE = re.compile(f"[{ACTING}]")


def written_out(found: re.Match[str]) -> str:
    """A character as its number."""
    return found[0].encode("unicode_escape").decode("ascii")


def shown(text: str) -> str:
    """A text as one may print it within a line."""
    return WITHIN_LINE.sub(written_out, text)


Values = TypeVar("Values")


def all_shown(value: Values) -> Values:
    """Plain values, as JSON has them, or a record of them, with every text in them as one may print it."""
    return cast("Values", _all_shown(value))


def _all_shown(value: Any) -> Any:
    match value:
        case str():
            return shown(value)
        case Mapping():
            return {_all_shown(name): _all_shown(item) for name, item in value.items()}
        case list():
            return [_all_shown(item) for item in value]
        case tuple():
            return tuple(_all_shown(item) for item in value)
        case _ if dataclasses.is_dataclass(value) and not isinstance(value, type):
            found = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
            return dataclasses.replace(value, **{name: _all_shown(item) for name, item in found.items()})
        case _:
            return value


class Escaping:
    """A text stream that writes out what would act on the terminal behind it; in all else it is that stream."""

    def __init__(self, stream: TextIO) -> None:
        self.behind = stream

    def write(self, text: str) -> int:
        """Write a text; its length."""
        self.behind.write(ANYWHERE.sub(written_out, text))
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Write several texts."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.behind, name)


def behind(stream: TextIO) -> TextIO:
    """The stream that takes sequences of our own."""
    return stream.behind if isinstance(stream, Escaping) else stream


@contextlib.contextmanager
def escaping() -> Iterator[None]:
    """Within it standard output and standard error are safe for a terminal."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (
        stream if isinstance(stream, Escaping) else Escaping(stream) for stream in before
    )
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
