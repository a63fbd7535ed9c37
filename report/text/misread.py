"""Cells of a text file that would be misread: numbers in another notation than the one in which they are read."""

from __future__ import annotations

from collections.abc import Sequence

from report.text.cells import OTHER, THOUSANDS, Notation, grouped, number

SAID = {"'": "apostrophes", " ": "spaces", ",": "commas", ".": "points"}


def misread(cells: Sequence[str], notation: Notation, *, stated: bool) -> str:
    """What is wrong with a column of texts, as the end of a sentence; empty where nothing is.

    `stated` says whether the decimal sign is given. Where it is not, the other sign parts thousands only in a column
    with a number that shows it: one with both signs, or with more than one group.
    """
    texts = [cell.strip() for cell in cells]
    other = OTHER[notation.decimal]
    for text in texts:
        if number(text, notation) is None and (wrong := in_another(text, notation)):
            return wrong
    if stated or notation.thousands:
        return ""
    groups = [text for text in texts if grouped(text, notation.decimal, other)]
    if not groups or any(notation.decimal in text or text.count(other) > 1 for text in groups):
        return ""
    return (
        f"'{groups[0]}', which is {number(groups[0], notation):g} or {number(groups[0], Notation(other)):g}: give "
        f'thousands = "{other}" or decimal = "{other}" in the map'
    )


def in_another(text: str, notation: Notation) -> str:
    """The end of a sentence on a text that is a number in another notation; empty where it is none."""
    decimal, other = notation.decimal, OTHER[notation.decimal]
    for mark in THOUSANDS:
        if grouped(text, decimal, mark):
            return f"'{text}', whose thousands are parted by {SAID[mark]}: give thousands = \"{mark}\" in the map"
    if number(text, Notation(other, notation.thousands)) is not None:
        return (
            f"'{text}', but {SAID[decimal]} are read as decimal signs: give decimal = \"{other}\" in the map"
        )
    return ""
