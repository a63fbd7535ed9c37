"""A section of layers: its balance, and beside it a core that crushes, friction of cracks, and a constant force."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from models import specimens
from models.registry import Array
from models.specimens import layered, menegotto_pinto
from models.specimens.fit import forces

K, DY = 1e7, 0.01  # N/m, m
SECTION = {"stiffness": K, "yield_displacement": DY, "axial": 0.5, "strength": 0.6}


def through(*corners: float) -> Array:
    """From zero through corners in multiples of the yield displacement, in steps of a hundredth of it."""
    parts = [np.linspace(a, b, max(2, round(100 * abs(b - a)) + 1))[1:] for a, b in pairwise((0.0, *corners))]
    return DY * np.concatenate([[0.0], *parts])


def test_an_eccentric_axial_force_is_a_constant_from_the_first_row_on() -> None:
    path = through(2.0, -3.0, 0.5)
    moved = forces("layered", {**SECTION, "eccentricity": -0.04}, path) - forces("layered", SECTION, path)
    np.testing.assert_allclose(moved, -0.04 * K * DY, rtol=1e-9)


def test_friction_takes_a_share_of_the_stiffness_until_it_slides() -> None:
    path, rubbing = through(2.0, -2.0, 2.0), 0.03
    share, reach = rubbing / layered.CONTACT, layered.CONTACT * DY
    slider, last = np.zeros(path.size), 0.0
    for i, moved in enumerate(np.diff(path), 1):
        last = min(max(last + moved, -reach), reach)
        slider[i] = last
    expected = (1.0 - share) * forces("layered", SECTION, path) + share * K * slider
    found = forces("layered", {**SECTION, "friction": rubbing}, path)
    np.testing.assert_allclose(found, expected, atol=1e-9 * K * DY)


def peaks(core: float) -> Array:
    """Force at the ends of three equal cycles of four times the yield displacement."""
    path = through(*[4.0, -4.0] * 3)
    force = forces("layered", {**SECTION, "axial": 1.0, "spalling": 0.05, "core": core}, path)
    return force[path == path.max()]


def test_a_core_with_few_hoops_loses_strength_from_cycle_to_cycle() -> None:
    held, crushed = peaks(0.0), peaks(1.0)
    assert held.size == crushed.size == 3
    assert held[2] > 0.98 * held[1]
    assert np.all(crushed[1:] < 0.92 * crushed[:-1])


def test_every_row_ends_in_balance() -> None:
    kind, p, s = specimens.pack("layered", **SECTION)
    bars = p[layered.AXIAL]
    for x in through(3.0, -3.0, 1.0)[1:]:
        specimens.step(kind, p, s, x)
        again = s.copy()
        layered.section(p, again, again[layered.STRAIN], again[layered.CURVATURE])
        force, moment = again[layered.SUMS : layered.SUMS + 2]
        assert abs(force + bars) < 1e-9
        assert abs(moment - s[layered.SUMS + 1]) < 1e-9


def test_the_stiffness_of_bars_is_the_slope_of_their_force() -> None:
    p = np.array([1.0, 1.0, 0.01, 18.0, 0.925, 0.15, 0.0])
    s, spare = np.zeros((2, menegotto_pinto.STATE_SIZE))
    for x in (0.5, 4.0, 3.9):
        menegotto_pinto.step(p, s, x)
    for x in np.linspace(3.8, -4.0, 40):
        after, before = (menegotto_pinto.looked_at(p, s, x + way, spare)[0] for way in (1e-6, -1e-6))
        assert np.isclose(menegotto_pinto.looked_at(p, s, x, spare)[1], (after - before) / 2e-6, atol=1e-7)
