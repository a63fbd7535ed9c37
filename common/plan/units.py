"""Converts numbers with units in a plan, such as `"160 t"`, `"12.5 kN/mm"` or `"4.87 mm"`, to SI values."""

from __future__ import annotations

import re
from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING, Any

from common.errors import PlanError

if TYPE_CHECKING:
    from collections.abc import Mapping

NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?(?P<unit>\D.*)?$", re.DOTALL)
ONE = r"[^\W\d]+(?:[²³]|(?:\^|\*\*)-?\d)?"  # a unit and its power
# the units that are handed to pint, which would otherwise evaluate any expression, 9**9**9 too
WRITTEN_BESIDE = re.compile(r"(?<=[a-zA-Z])[23](?!\w)")  # a power as many loggers write it, m/s2
RAISED = {"2": "²", "3": "³"}
UNIT = re.compile(rf"%|\(?{ONE}\)?(?:\s*[·*/ ]\s*\(?{ONE}\)?)*\)?")
LONGEST = (
    60  # characters: ample for 17 digits with an exponent and for the longest unit of a key, 11 characters
)
ACCELERATION = "m/s²"
ANY = (Exception,)  # pint lets exceptions of its parser, of Python's tokenizer and of decimal through
OF_ACCELERATION = {"g": "g_n", "gal": "cm/s²", "Gal": "cm/s²"}  # for other keys g means gram and gal gallon
PREFIXES = {"k": 3, "c": -2, "m": -3, "µ": -6, "M": 6}  # powers of ten of the usual ones
FIRST = re.compile(
    r"(?:m|s|N|Pa|Hz|rad)(?![²³^\w])"
)  # a unit at the beginning, to no power, to which a prefix belongs
SAME = {"kp": "kgf", "Kip": "kip", "Kips": "kip", "kips": "kip", "tonf": "t * g_n", "ms2": "m/s²"}


@cache
def registry() -> Any:
    """Pint's units with decimal numbers, so that 4.87 mm become exactly the float 0.00487 m."""
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


def in_si(text: str, unit: str | None, name: str) -> float:
    """The value of a text such as "12.5 kN/mm" in the SI unit of its key.

    Args:
        text: a number followed by its unit; "%" is a hundredth.
        unit: that of the key, such as "N/m"; empty for a plain number, None where any unit is accepted.
        name: the name of the key in errors.

    Raises:
        PlanError: the text is no number with a unit, or its unit is one of another quantity.
    """
    found = NUMBER.match(text) if len(text) <= LONGEST else None
    given = (found["unit"] or "").strip() if found else ""
    if found is None or not given:
        raise PlanError(
            f"{name} must be a number{f' in {unit}' if unit else ''}, or one with its unit, not {text!r}."
        )
    return converted(Decimal(text[: found.start("unit")]), given, unit, name)


def converted(number: Decimal, given: str, unit: str | None, name: str) -> float:
    """A number with the unit `given`, converted to the `unit` of the key; raises PlanError where they do not fit."""
    given = WRITTEN_BESIDE.sub(lambda power: RAISED[power[0]], given)
    if (
        unit and given[1:] == unit and given[0] in PREFIXES and FIRST.match(unit)
    ):  # without loading pint, 0.2 s
        return float(number.scaleb(PREFIXES[given[0]]))
    import pint

    unknown = PlanError(
        f"{name} has the unit {given!r}, which is not known: give it in {unit or 'SI units'}."
    )
    if given and not UNIT.fullmatch(given):
        raise unknown
    known: Mapping[str, str] = SAME | OF_ACCELERATION if unit == ACCELERATION else SAME
    quantity = registry().Quantity
    try:
        value = quantity(number, known.get(given, given) or "dimensionless")
        return float((value.to_base_units() if unit is None else value.to(unit or "dimensionless")).magnitude)
    except pint.DimensionalityError:
        wanted = f"in {unit}, or in another unit of the same quantity" if unit else "without a unit"
        raise PlanError(f"{name} is in {given}, which does not fit: give it {wanted}.") from None
    except ANY as error:
        raise unknown from error


def is_unit(text: str) -> bool:
    """Whether a text is a unit, as of a logger's column."""
    try:
        converted(Decimal(1), text, None, "")
    except PlanError:
        return False
    return bool(text)
