"""The peer of `rths serve` counts the ticks without a displacement as `rths serve` does."""

from __future__ import annotations

import pytest

from benchmarks.opensees.bare import missed

INTERVAL, SHARE = 2000, 1500


@pytest.mark.parametrize(
    ("handed", "came", "late"),
    [
        (10_050, 10_300, 0),
        (10_050, 11_501, 1),  # after the share of tick 5: imposed in the next tick
        (10_050, 13_600, 2),
        (
            10_900,
            13_000,
            0,
        ),  # handed over when less than half of the share was left: tick 5 is not the client's
        (10_900, 13_501, 1),
        (24_100, 24_400, 0),  # after a pause of seven ticks
    ],
)
def test_ticks_without_a_displacement_are_attributed_to_the_client_if_it_had_time(
    handed: int, came: int, late: int
) -> None:
    assert missed(5, handed, came, INTERVAL, SHARE) == late
