"""How many decimals the numbers in the columns of a text have, where a program printed all with as many."""

from __future__ import annotations

from collections.abc import Sequence

from report.text.cells import Notation, number

FEWEST = 30  # numbers of a column, from which on they may be said to have as many decimals


def fixed_decimals(rows: Sequence[Sequence[str]], names: Sequence[str], notation: Notation) -> dict[str, int]:
    """The decimals by name of those columns whose numbers in all rows of cells have as many of them.

    A program that leaves out zeros at the end prints numbers of many lengths, and so does one that prints as many
    digits of each. Numbers with an exponent have no fixed decimals.
    """
    found = {}
    for place, name in enumerate(names):
        cells = [row[place].strip() for row in rows if len(row) == len(names)]
        filled = [cell for cell in cells if number(cell, notation) is not None]
        parts = [cell.partition(notation.decimal)[2] for cell in filled]
        plain = all(not part or part.isdigit() for part in parts) and not any(
            "e" in cell.lower() for cell in filled
        )
        lengths = {len(part) for part in parts}
        if (
            len(filled) >= FEWEST
            and plain
            and len(lengths) == 1
            and any(part[-1:] in ("", "0") for part in parts)
        ):
            found[name] = lengths.pop()
    return found
