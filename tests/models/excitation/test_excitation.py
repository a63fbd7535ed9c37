"""Programmes of bench tests: their commands, and that they start and end at rest."""

from __future__ import annotations

import numpy as np
import pytest

from models import excitation
from models.excitation import ACCELERATION, JERK, PARTS, POSITION, RATE
from models.excitation.pieces import random_wave, sine, static_cycles, sweep

DT = 0.002


@pytest.mark.parametrize("part", PARTS)
def test_a_programme_is_at_rest_at_both_ends_and_between_its_pieces(part: str) -> None:
    found = excitation.programme(PARTS[part](DT, 1), DT)
    still = round(excitation.STILL / DT)
    assert np.all(found.motion[:, :still] == 0.0)
    assert np.all(found.motion[:, -still:] == 0.0)
    ends = [0, *(segment.end for segment in found.segments)]
    assert [segment.begin for segment in found.segments] == [end + still for end in ends[:-1]]
    assert found.motion.shape[1] == ends[-1] + still + 1
    assert np.all(np.isfinite(found.motion))


def test_the_static_cycles_have_the_papers_amplitudes() -> None:
    piece = static_cycles(DT, (1.5e-3, 7.5e-3), cycles=3, speed=3e-3, hold=0.25)
    turns = piece.values[np.flatnonzero(np.diff(np.sign(np.diff(piece.values, append=0.0))) != 0) + 1]
    assert np.max(np.abs(np.diff(piece.values))) == pytest.approx(3e-3 * DT, rel=1e-9)
    assert sorted({round(abs(x), 7) for x in turns} - {0.0}) == [1.5e-3, 7.5e-3]
    assert piece.values[-1] == 0.0


def test_the_programmes_derivatives_are_those_of_the_sine() -> None:
    found = excitation.join([sine(DT, 2.0, amplitude=5e-3, cycles=10)], DT)
    ((_, begin, end, _),) = found.segments
    t = np.arange(end - begin) * DT
    middle = slice(begin + 1000, end - 1000)
    inner, omega = t[1000:-1000], 4.0 * np.pi
    wanted = [np.sin(omega * inner), np.cos(omega * inner), -np.sin(omega * inner), -np.cos(omega * inner)]
    for order, shape in zip((POSITION, RATE, ACCELERATION, JERK), wanted, strict=True):
        scale = 5e-3 * omega**order
        assert found.motion[order, middle] == pytest.approx(scale * shape, abs=1e-3 * scale)


def test_a_step_has_no_derivatives() -> None:
    found = excitation.programme(PARTS["actuator"](DT, 1), DT, ("step",))
    assert np.max(found.motion[POSITION]) == 5e-3
    assert np.all(found.motion[RATE:] == 0.0)


def test_the_random_wave_has_the_band_and_rms_asked_for_and_depends_on_its_seed() -> None:
    first, again, other = (
        random_wave(DT, band=(0.1, 3.0), rms=1.5e-3, duration=30.0, seed=seed).values for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert np.std(first) == pytest.approx(1.5e-3, rel=0.1)
    power = np.abs(np.fft.rfft(first)) ** 2
    frequency = np.fft.rfftfreq(first.size, DT)
    assert power[frequency > 3.2].sum() < 1e-3 * power.sum()


def test_the_sweep_keeps_its_peak_acceleration() -> None:
    values = sweep(DT, (0.5, 25.0), duration=40.0, amplitude=10e-3, curvature=3.0).values
    assert np.max(np.abs(values)) == pytest.approx(10e-3, rel=0.05)
    assert np.max(np.abs(np.diff(values, 2) / DT**2)) < 3.3


@pytest.mark.parametrize("reach", [excitation.Reach(20e-3, 0.5, 5.0), excitation.Reach(5e-3, 0.02, 3.0)])
def test_the_programme_of_any_laboratory_stays_within_its_reach(reach: excitation.Reach) -> None:
    pieces = excitation.target(DT, reach)
    assert [piece.name.split()[0] for piece in pieces] == ["step", "sine", "sine", "sine", "sine", "sweep"]
    found = excitation.programme(pieces, DT, ("sine", "sweep")).motion
    for order, most in (
        (POSITION, reach.amplitude),
        (RATE, reach.velocity),
        (ACCELERATION, reach.acceleration),
    ):
        assert (
            np.max(np.abs(found[order])) <= 1.1 * most
        )  # the growing frequency of a sweep and its fade add to it
    assert np.max(np.abs(found[POSITION])) > 0.5 * min(reach.amplitude, reach.velocity**2 / reach.amplitude)
