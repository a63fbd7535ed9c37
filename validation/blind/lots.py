"""Draws by name: what is drawn depends on the names of the draw alone, not on how many draws came before it.

So a catalogue that grows, or an effect that gets a further parameter, leaves all other draws as they were.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable

import numpy as np

Lot = tuple[str | int, ...]  # seed, set and number of a case: what all of its draws are named by


def number(*words: str | int) -> int:
    """A number of 128 bits: the same for the same words on every machine, without relation for any others."""
    text = "\0".join(map(str, words))
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=16).digest(), "big")


def generator(*words: str | int) -> np.random.Generator:
    """The random generator that belongs to the words."""
    return np.random.default_rng(number(*words))


def chosen(names: Iterable[str], *words: str | int) -> str:
    """One of the names, each as likely as any other: the one with the largest number behind the words.

    A further name wins its share of the draws; the winner of every other draw stays (rendezvous hashing: Thaler,
    Ravishankar, IEEE/ACM Trans. Networking 6 (1998) 1-14).
    """
    return max(names, key=lambda name: number(*words, name))
