"""Numbers as a reader of the field expects them, for every terminal and page: SI prefixes, few digits, one unit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

MISSING = "–"
PREFIXES = ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
# smallest and largest prefix of a unit; other units take none
RANGES = {
    "m": (1e-9, 1.0),
    "s": (1e-9, 1.0),
    "m/s": (1e-3, 1.0),
    "N": (1.0, 1e6),
    "Hz": (1.0, 1e3),
    "N/m": (1.0, 1e6),
    "N·s/m": (1.0, 1e6),
    "m/N": (1e-9, 1.0),
    "J": (1e-9, 1.0),
}
LEAST_ON_AXIS = 0.01  # largest value of an axis below which its numbers would need four decimals
# In the smallest prefix, such as a thousandth of a nanometre: smaller values are rounding errors.
NOTHING = 1e-3
NO_UNIT = ("", "-", "–", "1")


def known(value: object) -> bool:
    """Whether a value is a finite number."""
    return isinstance(value, int | float) and math.isfinite(value)


def scale(size: float, unit: str) -> tuple[float, str]:
    """Factor and unit in which a value of this size reads well."""
    if unit in NO_UNIT:
        return 1.0, ""
    least, most = RANGES.get(unit, (1.0, 1.0))
    fitting = [item for item in PREFIXES if least <= item[0] <= most]
    found = next((item for item in fitting if abs(size) >= item[0]), fitting[-1] if size else (1.0, ""))
    return 1.0 / found[0], found[1] + unit


def axis_scale(size: float, unit: str) -> tuple[float, str]:
    """Factor and unit of an axis up to this size: the unit of `reading`, another prefix where its ticks were tiny."""
    usual = {"m": (1e3, "mm"), "N": (1e-3, "kN") if size >= 1e3 else (1.0, "N")}
    factor, name = usual.get(unit, (1.0, unit))
    return (factor, name) if not 0.0 < size * factor < LEAST_ON_AXIS else scale(size, unit)


def decimals(size: float, width: float = 0.0) -> int:
    """Decimals that show three digits of a value, and two of an interval's width."""
    places = 2 - math.floor(math.log10(abs(size))) if size else 0
    if width > 0.0:
        places = max(places, 1 - math.floor(math.log10(1.001 * width)))
    return min(max(places, 0), 5)


def quantity(value: object, unit: str, bounds: Sequence[object] | None = None) -> str:
    """A value with its unit, and its interval if there is one: `3.10 N (2.90 … 3.30)`."""
    if not isinstance(value, int | float) or not math.isfinite(value):
        return MISSING
    ends = [float(end) for end in bounds or () if isinstance(end, int | float) and math.isfinite(end)]
    size = max(map(abs, (value, *ends)))
    if size < NOTHING * RANGES.get(unit, (0.0, 0.0))[0]:
        return f"0 {unit}".rstrip()
    factor, name = scale(size, unit)
    width = (ends[1] - ends[0]) * factor if len(ends) == 2 else 0.0
    places = decimals(value * factor, width)
    text = f"{fixed(value * factor, places)} {name}".rstrip()
    return text + interval(bounds, factor, places)


def interval(bounds: Sequence[object] | None, factor: float, places: int) -> str:
    """An interval behind its value, of one known end `from` or `up to`; nothing where neither is known."""
    if bounds is None or len(bounds) != 2:
        return ""
    lower, upper = (fixed(as_float(end) * factor, places) if known(end) else "" for end in bounds)
    if lower and upper:
        return f" ({lower} … {upper})"
    return f" (from {lower})" if lower else f" (up to {upper})" if upper else ""


def axis_unit(label: str, size: float) -> tuple[float, str]:
    """Factor and label of an axis whose label ends in `, unit`, `(unit)` or a line with it, so that it reads well."""
    for mark, end in ((", ", ""), ("\n", ""), (" (", ")")):
        head, found, unit = label.removesuffix(end).rpartition(mark)
        if found and label.endswith(end) and unit in RANGES and math.isfinite(size):
            factor, name = scale(size, unit)
            return factor, f"{head}{mark}{name}{end}"
    return 1.0, label


def nats(value: float) -> str:
    """A difference of two scores in words; beyond a thousand nats only that it is larger."""
    if abs(value) >= 1000.0:
        return "more than 1,000 nats"
    return f"{value:.0f} nats" if abs(value) >= 10.0 else f"{value:.1f} nats"


def as_float(value: object) -> float:
    """The number, NaN where there is none."""
    return float(value) if isinstance(value, int | float) else math.nan


def bare_percent(value: float) -> str:
    """A share in percent with two digits, without the sign."""
    hundredth = 100.0 * value
    if abs(hundredth) >= 10.0 or hundredth == 0.0:
        return f"{hundredth:.0f}"
    return f"{hundredth:.1f}" if abs(hundredth) >= 1.0 else f"{hundredth:.2g}"


def blocks(share: float, width: int) -> str:
    """A share between 0 and 1 as a bar of this many characters."""
    filled = round(width * min(max(share, 0.0), 1.0))
    return "█" * filled + "·" * (width - filled)


def percent(value: object, places: int | None = None) -> str:
    """A share in percent, with two digits, or with this many decimals where it is shown with a limit."""
    number = as_float(value)
    if not math.isfinite(number):
        return MISSING
    return f"{bare_percent(number) if places is None else fixed(100.0 * number, places)} %"


def probability(value: object) -> str:
    """A probability in percent, never rounded to 0 or 100 %."""
    number = as_float(value)
    if not math.isfinite(number):
        return MISSING
    if number > 0.99:
        return "> 99 %"
    return "< 1 %" if number < 0.01 else f"{100.0 * number:.0f} %"


def percent_interval(bounds: Sequence[object] | None) -> str:
    """An interval of shares: `86 … 95 %`; nothing where it is unknown."""
    if bounds is None or not all(map(known, bounds)) or len(bounds) != 2:
        return ""
    lower, upper = map(as_float, bounds)
    return f"{100.0 * lower:.0f} … {100.0 * upper:.0f} %"


def times(value: object) -> str:
    """A ratio: `14×`."""
    number = as_float(value)
    if not math.isfinite(number):
        return MISSING
    if 0.0 <= number < 0.05:
        return "< 0.1×"
    return f"{number:.0f}×" if number >= 10.0 else f"{number:.1f}×"


def span(bounds: Sequence[object] | None, unit: str) -> str:
    """A stretch on an axis: `2.1–9.8 s`; nothing where it is unknown or has no length."""
    if bounds is None or len(bounds) != 2 or not all(map(known, bounds)):
        return ""
    lower, upper = map(as_float, bounds)
    if upper <= lower:
        return ""
    return f"{lower:.3g}–{upper:.3g} {unit}"


def reading(value: float, unit: str) -> str:
    """A value in the one prefix that its unit has in columns: mm, kN above 1 kN, µs; others as they are."""
    factors = {"m": (1e3, "mm"), "N": (1e-3, "kN"), "s": (1e6, "µs")}
    if unit == "N" and abs(value) < 1e3:
        return f"{fixed(value, 1)} N"
    factor, name = factors.get(unit, (1.0, unit))
    return f"{fixed(value * factor, 3)} {name}"


def fixed(value: float, places: int) -> str:
    """A number with this many decimals, and no sign before a zero."""
    return f"{value:z.{places}f}"


def signed(value: float, places: int) -> str:
    """A change with its sign, and a plain zero where it rounds to none."""
    text = f"{value:+z.{places}f}".replace("-", "−")
    return text if value and text.strip("+−0.") else fixed(0.0, places)


def milliseconds(value: float | None, places: int = 2) -> str:
    """A time (s) in milliseconds."""
    return MISSING if value is None else f"{fixed(value * 1e3, places)} ms"


def tracked(facts: Mapping[str, Any]) -> list[str]:
    """How a transfer system followed, cell by cell: delay, by correlation, amplitude, at, NRMSE, peak error."""
    amplitude, frequency = facts["amplitude"], facts["frequency"]
    return [
        milliseconds(facts["delay"]),
        milliseconds(facts["correlation_delay"]),
        MISSING if amplitude is None else f"{amplitude:.4f}",
        MISSING if frequency is None else f"{frequency:.2f} Hz",
        f"{facts['nrmse']:.4f}",
        f"{facts['peak_error']:.4f}",
    ]


STOREY = {
    "drift": "drift",
    "displacement": "displacement",
    "absolute_acceleration": "acceleration",
    "shear": "shear",
}


def storey_rows(found: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Peaks of every storey under their head."""
    names = [name for name in STOREY if name in found[0]]
    rows = [
        [str(item["storey"]), *(MISSING if item[name] is None else peak_of(item[name]) for name in names)]
        for item in found
    ]
    return [["storey", *(STOREY[name] for name in names)], *rows]


def peak_of(item: Mapping[str, Any]) -> str:
    """A peak with its unit."""
    return reading(item["peak"], item["unit"])


def modes(found: Sequence[Mapping[str, float | None]], most: int = 6) -> str:
    """Periods with their damping in words, of the longest ones."""
    texts = [
        "no restoring force"
        if item["period"] is None
        else f"{item['period']:.4g} s"
        + ("" if item["damping_ratio"] is None else f" ({percent(item['damping_ratio'])})")
        for item in found[:most]
    ]
    return ", ".join(texts) + (f" and {len(found) - most} shorter ones" if len(found) > most else "")


def apart(counts: dict[str, int]) -> str:
    """The least number of messages that arrived but were not sent by the other laboratory; empty without any."""
    return f"; at least {counts['foreign']} more arrived that it did not send" if counts["foreign"] else ""
