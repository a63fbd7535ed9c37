"""The programmes of bench tests: pieces of motion or force on the grid of ticks, joined.

A programme starts and ends at rest; every piece is at rest at both ends and lies between spans without motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from models.excitation.pieces import Piece, random_wave, sine, static_cycles, steps, sweep
from models.registry import Array

__all__ = [
    "PARTS",
    "Piece",
    "Programme",
    "ProgrammeSegment",
    "Reach",
    "join",
    "programme",
    "target",
]

# s, between pieces: more than ten times the nominal actuator's delay of 44 ms, so that its response has ended
STILL = 0.5
POSITION, RATE, ACCELERATION, JERK = range(4)


class ProgrammeSegment(NamedTuple):
    """The place of a piece: ticks `begin` to `end`, the latter excluded, and the parameters it was made with."""

    name: str
    begin: int
    end: int
    values: dict[str, float]


class Programme(NamedTuple):
    """The commanded motion or force at every tick, and the places of its pieces."""

    motion: Array  # (4, ticks + 1): value (m or N) and its first three derivatives in time
    segments: tuple[ProgrammeSegment, ...]


def join(pieces: Sequence[Piece], interval: float, *, still: float = STILL) -> Programme:
    """The pieces one after the other, with a still span (s) before, between and behind them."""
    span = np.zeros((4, round(still / interval)))
    parts, segments, at = [span], [], span.shape[1]
    for piece in pieces:
        count = piece.values.size
        motion = np.zeros((4, count))
        motion[POSITION] = piece.values
        if piece.smooth:
            for order in range(1, 4):
                motion[order] = np.gradient(motion[order - 1], interval)
        parts += [motion, span]
        segments.append(ProgrammeSegment(piece.name, at, at + count, piece.made_with))
        at += count + span.shape[1]
    return Programme(np.concatenate([*parts, span[:, :1]], axis=1), tuple(segments))


def column(interval: float, _seed: int) -> list[Piece]:
    """Static cyclic loading of the seed paper (section 2.2): ±1.5 to ±7.5 mm, three cycles each."""
    return [
        static_cycles(interval, (1.5e-3, 3.0e-3, 4.5e-3, 6.0e-3, 7.5e-3), cycles=3, speed=3e-3, hold=0.25)
    ]


def actuator(interval: float, seed: int) -> list[Piece]:
    """Steps of 5 mm, sines of 0.5 to 3 Hz, a random wave below 3 Hz (section 3)."""
    sines = [
        sine(interval, frequency, amplitude=5e-3, cycles=max(6, round(6 * frequency)))
        for frequency in (0.5, 1.0, 2.0, 3.0)
    ]
    wave = random_wave(interval, band=(0.1, 3.0), rms=1.5e-3, duration=30.0, seed=seed)
    return [steps(interval, height=5e-3, hold=0.5, count=8), *sines, wave]


def table(interval: float, _seed: int) -> list[Piece]:
    """Steps of 2 mm and a sweep of 0.5 to 25 Hz, at most 10 mm and 3 m/s².

    The sweep covers the nominal table's natural frequency of 15 Hz, at a tenth of its limit of acceleration.
    """
    return [
        steps(interval, height=2e-3, hold=0.5, count=8),
        sweep(interval, (0.5, 25.0), duration=40.0, amplitude=10e-3, curvature=3.0),
    ]


def damper(interval: float, _seed: int) -> list[Piece]:
    """A sweep of the motor's force of 20 N from 0.8 to 20 Hz.

    It begins above the nominal damper's natural frequency of 0.3 Hz, at which that force would give a stroke of 1.8 m.
    """
    return [sweep(interval, (0.8, 20.0), duration=40.0, amplitude=20.0, curvature=np.inf)]


class Reach(NamedTuple):
    """The largest amplitude, velocity and acceleration of a target in a bench test."""

    amplitude: float  # m
    velocity: float  # m/s
    acceleration: float  # m/s²


def target(interval: float, reach: Reach) -> list[Piece]:
    """Steps of a quarter of the amplitude, sines of 0.5 to 4 Hz and a sweep of 0.2 to 20 Hz within the reach."""
    # where sweep and sines change from bounded amplitude to bounded acceleration they are fastest: v² = amplitude·most
    most = min(reach.acceleration, reach.velocity**2 / reach.amplitude)
    sines = [
        sine(
            interval,
            frequency,
            amplitude=min(reach.amplitude, most / (2.0 * np.pi * frequency) ** 2),
            cycles=max(6, round(6 * frequency)),
        )
        for frequency in (0.5, 1.0, 2.0, 4.0)
    ]
    wave = sweep(interval, (0.2, 20.0), duration=40.0, amplitude=reach.amplitude, curvature=most)
    return [steps(interval, height=0.25 * reach.amplitude, hold=0.5, count=8), *sines, wave]


PARTS = {"column": column, "actuator": actuator, "table": table, "damper": damper}


def programme(pieces: Sequence[Piece], interval: float, only: Sequence[str] = ()) -> Programme:
    """Pieces of a bench test in a row: all, or those whose names begin with one of `only`."""
    chosen = [piece for piece in pieces if not only or any(piece.name.startswith(word) for word in only)]
    return join(chosen, interval)
