"""A reading comes late: the filter of its amplifier.

    T·ẏ + y = value,    reading = y,    T = time_constant

The parameter `law` chooses another formula:

    1   a filter of second order, as late for slow values: (T/2ζ)²·ÿ + T·ẏ + y = value,    ζ = damping

Not to be confused with a delay of the measured quantity itself: here other readings of the same motion are on time. A
lagging column force looks like a negative `column.viscous`.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import of_second_order, which_law
from laboratories.effects.reading import ReadingFault

# s: an amplifier or an anti-aliasing filter has a corner above 4 Hz; a longer lag belongs to the measured motion
LONGEST = 0.04

FAULT = ReadingFault(
    "lag",
    lambda _: Parameter(
        "time_constant",
        "s",
        null=0.0,
        least=0.0,
        most=1.0,
        sizes=(0.001, 0.003, 0.008, 0.02),
        says="of a low-pass filter",
        believed=LONGEST,
    ),
    says="the reading lags behind",
    reference="time_constant·ẏ + y = value",
    timed=True,
    further={"": which_law(1.0, "0 of first order, 1 of second order"), "lag_damping": of_second_order()},
    laws=(Law("of first order", {}), Law("of second order", {"damping": 0.7})),
)
