"""Draws by name: a draw depends on its names alone, not on the number of draws before it.

So a catalogue that grows, or an effect that gets a further parameter, does not change any other draw.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable

import numpy as np

Lot = tuple[str | int, ...]  # seed, set and number of a case: the beginning of the names of all its draws


def number(*words: str | int) -> int:
    """A number of 128 bits: the same for the same words on every machine, unrelated for any others."""
    text = "\0".join(map(str, words))
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=16).digest(), "big")


def generator(*words: str | int) -> np.random.Generator:
    """The random generator that belongs to the words."""
    return np.random.default_rng(number(*words))


def chosen(names: Iterable[str], *words: str | int) -> str:
    """One of the names, all equally likely: the one with the largest number for the words and the name.

    A further name takes its share of the draws; all other draws stay the same (rendezvous hashing: Thaler,
    Ravishankar, IEEE/ACM Trans. Networking 6 (1998) 1-14).
    """
    return max(names, key=lambda name: number(*words, name))
