"""The language of `rths catalog find`: conditions on columns and peaks, as a condition of SQL with its values.

    condition = comparison | "not" condition | condition "and" condition | condition "or" condition | "(" condition ")"
    comparison = column operator value | "peak" signal operator value
    operator = "=" | "!=" | "<" | "<=" | ">" | ">=" | "~"

A number may have a unit; `~` asks whether a text contains another. Texts are compared without regard to case.
"""

from __future__ import annotations

import re
import sqlite3
from typing import NamedTuple

from common.errors import InputError
from common.plan.units import in_si
from report.catalogue.columns import BY_NAME, CatalogueColumn
from report.catalogue.store import escaped

TOKEN = re.compile(
    r"""\s*(?:(?P<text>"[^"]*"|'[^']*')|(?P<sign>[()]|[<>!]=|[<>=~])|(?P<word>[^\s()<>=~!"']+))"""
)
OPERATORS = ("=", "!=", "<", "<=", ">", ">=", "~")
JOINS = ("and", "or", "not")
EXAMPLE = 'such as "peak drift > 5 mm and outcome = tripped"'
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


class Condition(NamedTuple):
    """A condition of SQL on `recordings`, its values, and the columns and peaks that it asks for."""

    sql: str
    values: tuple[object, ...]
    columns: tuple[str, ...] = ()
    peaks: tuple[str, ...] = ()

    def joined(self, word: str, other: Condition) -> Condition:
        """Both conditions, joined by the word of SQL."""
        return Condition(
            f"({self.sql} {word} {other.sql})",
            self.values + other.values,
            self.columns + other.columns,
            self.peaks + other.peaks,
        )


def parsed(text: str, base: sqlite3.Connection) -> Condition:
    """The condition that a text says; `base` is the catalogue, which knows the signals.

    Raises:
        InputError: the text is no condition, or names a column, a signal or a unit that is not known.
    """
    found = ConditionParser(tokens(text), base)
    condition = found.either()
    if found.rest:
        raise InputError(f"The condition ends before '{found.rest[0]}': join conditions by 'and' or 'or'.")
    return condition


def tokens(text: str) -> list[str]:
    """Words, signs and quoted texts in order; a quoted text keeps its quotes."""
    found, place = [], 0
    text = text.rstrip()
    while place < len(text):
        token = TOKEN.match(text, place)
        if token is None:
            raise InputError(
                f"The condition cannot be read from '{text[place:].strip()}' on: write one {EXAMPLE}."
            )
        found.append(token.group(token.lastgroup or 0))
        place = token.end()
    return found


class ConditionParser:
    """Reads tokens from the first to the last; `rest` are those that are left."""

    def __init__(self, rest: list[str], base: sqlite3.Connection) -> None:
        self.rest = rest
        self._base = base

    def _next(self, wanted: str) -> str:
        if not self.rest:
            raise InputError(f"The condition ends where {wanted} should stand: write one {EXAMPLE}.")
        return self.rest.pop(0)

    def _join(self, word: str) -> bool:
        found = bool(self.rest) and self.rest[0].lower() == word
        if found:
            self.rest.pop(0)
        return found

    def either(self) -> Condition:
        """Conditions joined by `or`."""
        found = self.both()
        while self._join("or"):
            found = found.joined("OR", self.both())
        return found

    def both(self) -> Condition:
        """Conditions joined by `and`."""
        found = self.one()
        while self._join("and"):
            found = found.joined("AND", self.one())
        return found

    def one(self) -> Condition:
        """A comparison, a condition in brackets, or one with `not`."""
        if self._join("not"):
            inner = self.one()
            return inner._replace(sql=f"(({inner.sql}) IS NOT 1)")
        if self._join("("):
            found = self.either()
            if self._next("a closing bracket") != ")":
                raise InputError("A bracket of the condition is not closed.")
            return found
        name = self._next("a column")
        return self.peak() if name == "peak" else self.comparison(name)

    def comparison(self, name: str) -> Condition:
        """A comparison of a column."""
        column = BY_NAME.get(name)
        if column is None:
            raise InputError(f"The catalogue has no column '{name}': {suggested(name, [*BY_NAME, 'peak'])}")
        operator = self.operator(name)
        if column.unit is None:
            return of_text(column, operator, unquoted(" ".join(self.value(name))))
        number = of_number(" ".join(self.value(name)), operator, column.unit, name)
        return Condition(f"({name} {operator} ?)", (number,), (name,))

    def peak(self) -> Condition:
        """A comparison of the largest peak of a signal."""
        name = self._next("a signal")
        found = self._base.execute("SELECT unit FROM peaks WHERE name = ? LIMIT 1", (name,)).fetchone()
        if found is None:
            known = [row[0] for row in self._base.execute("SELECT DISTINCT name FROM peaks")]
            hint = suggested(name, known) if known else "no recording has peaks."
            raise InputError(f"No recording of the catalogue has a signal '{name}': {hint}")
        operator = self.operator(f"peak {name}")
        number = of_number(" ".join(self.value(f"peak {name}")), operator, found[0], f"peak {name}")
        fits = f"SELECT file FROM peaks WHERE name = ? GROUP BY file HAVING max(value) {operator} ?"  # noqa: S608 - of OPERATORS
        return Condition(f"(file IN ({fits}))", (name, number), peaks=(name,))

    def operator(self, name: str) -> str:
        """The operator behind a name."""
        found = self._next("an operator")
        if found not in OPERATORS:
            raise InputError(f"'{found}' behind {name} is no operator: use one of {' '.join(OPERATORS)}.")
        return found

    def value(self, name: str) -> list[str]:
        """The words of a value, up to the next word that joins conditions."""
        found = []
        while self.rest and self.rest[0].lower() not in JOINS and self.rest[0] not in (")", "(", *OPERATORS):
            found.append(self.rest.pop(0))
        if not found:
            raise InputError(f"A value is missing behind {name}: write a condition {EXAMPLE}.")
        return found


def suggested(name: str, known: list[str]) -> str:
    """What a name may have been meant to be."""
    from common.plan.schema import nearest  # which takes longer to load than a question to answer

    return nearest(name, known)


def of_text(column: CatalogueColumn, operator: str, text: str) -> Condition:
    """A comparison of a column of texts."""
    if operator == "~":
        return Condition(f"({column.name} LIKE ? ESCAPE '\\')", (f"%{escaped(text)}%",), (column.name,))
    return Condition(f"({column.name} COLLATE NOCASE {operator} ?)", (text,), (column.name,))


def unquoted(text: str) -> str:
    """A text without the quotes around it."""
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] and text[0] in "\"'" else text


def of_number(text: str, operator: str, unit: str, name: str) -> float:
    """The value of a number, in the unit of what it is compared with."""
    if operator == "~":
        raise InputError(f"{name} is a number, in which no text can be sought: compare it by < or >.")
    text = unquoted(text)
    return float(text) if NUMBER.fullmatch(text) else in_si(text, unit, name)
