"""Tables and values of the documents as Markdown."""

from __future__ import annotations

from collections.abc import Iterable


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = [
        f"| {' | '.join(cells)} |\n".replace("|  |", "| |").replace("|  |", "| |") for cells in (head, *rows)
    ]
    return "".join([lines[0], f"|{'---|' * len(head)}\n", *lines[1:]])


def quantity(value: object) -> str:
    """A value as written in a plan."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return ", ".join(map(quantity, value))
    if isinstance(value, int | float):
        return f"{value:g}"
    return f'`"{value}"`' if isinstance(value, str) else ""
