"""Risks by name: reasons not to move a rig, which a user may accept by name."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from common.errors import InputError
from common.plan.schema import nearest

NAMES = ("partition", "peaks", "building", "sensors", "rig", "link", "disk")


class Risk(NamedTuple):
    """One reason not to move a rig; the sentence states it with its figures and a remedy."""

    name: str
    sentence: str


def known(names: Iterable[str]) -> tuple[str, ...]:
    """The names of the accepted risks, each once.

    Raises:
        InputError: there is no such risk.
    """
    for name in names:
        if name not in NAMES:
            raise InputError(f"There is no risk '{name}' to accept: {nearest(name, NAMES)}")
    return tuple(dict.fromkeys(names))
