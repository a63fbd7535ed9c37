r"""Makes text of other origin safe for a terminal: characters that control the terminal are escaped.

A recording, a plan or a message may hold escape sequences, which move the cursor, set the window's title, hide a link
or change the lines printed before. `shown` writes such characters as Python does (`\u202e`), and leaves all others as
they are. It is meant for a text within a line, so it escapes line ends too. Everything that a command prints goes
through `Escaping`, which replaces standard output and standard error and escapes all control characters but line ends
and tabs. The few escape sequences of our own are written to the stream behind it (`behind`).
"""

from __future__ import annotations

import contextlib
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
    """A character as an escape sequence of Python."""
    return found[0].encode("unicode_escape").decode("ascii")


def shown(text: str) -> str:
    """A text that may be printed within a line."""
    return WITHIN_LINE.sub(written_out, text)


Values = TypeVar("Values")


def all_shown(value: Values) -> Values:
    """Plain values as in JSON, or a dataclass of them, with every text in them safe to print."""
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
        case _ if hasattr(type(value), "__dataclass_fields__"):
            import dataclasses  # here, as most commands need none and it takes a tenth of their start

            found = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
            return dataclasses.replace(value, **{name: _all_shown(item) for name, item in found.items()})
        case _:
            return value


class Escaping:
    """A text stream that escapes control characters for the stream behind it; otherwise it acts as that stream."""

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
    """The stream to which our own escape sequences are written."""
    return stream.behind if isinstance(stream, Escaping) else stream


@contextlib.contextmanager
def escaping() -> Iterator[None]:
    """Make standard output and standard error safe for a terminal within the context."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (
        stream if isinstance(stream, Escaping) else Escaping(stream) for stream in before
    )
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
