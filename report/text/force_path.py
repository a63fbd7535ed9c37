"""The delay of the measured column force behind that of the plan's specimen, as a sentence for every report."""

from __future__ import annotations

from collections.abc import Sequence


def sentence(delay: float, interval: Sequence[float], gain: float) -> str:
    """Delay (s) of the force with its interval of 95 %, and its gain; the force leads where the delay is negative."""
    low, high = (1e3 * end for end in interval)
    digits = decimals(high - low)
    verb = "leads" if delay < 0.0 else "lags behind"
    return (
        f"The measured force {verb} the planned specimen's by {abs(delay) * 1e3:.{digits}f} ms "
        f"(95 %: {span(low, high, digits)}); amplitude {percents(gain)}."
    )


def decimals(width: float) -> int:
    """Decimals that show an interval of this width (ms)."""
    return 1 if width >= 1.0 else 2 if width >= 0.02 else 3


def span(low: float, high: float, digits: int) -> str:
    """An interval (ms) as magnitudes where both ends have one sign, else with the direction of each."""
    if low < 0.0 < high:
        return f"from {-low:.{digits}f} ms ahead to {high:.{digits}f} ms behind"
    ends = sorted((abs(low), abs(high)))
    return f"{ends[0]:.{digits}f}–{ends[1]:.{digits}f}"


def percents(gain: float) -> str:
    """A gain as its deviation from one; two decimals where it is small."""
    deviation = 100.0 * (gain - 1.0)
    return f"{deviation:+.1f} %" if abs(deviation) >= 0.1 else f"{deviation:+.2f} %"
