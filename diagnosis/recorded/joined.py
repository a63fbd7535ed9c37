"""One laboratory in several recordings as one part: what explains it must explain all of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from diagnosis.recorded.parts import Part
from diagnosis.recorded.record import Record
from models.registry import Array
from models.system import System

# The tables of a plan that say what the laboratories are. The motion, the building, the compensation and the control
# may differ from test to test: a laboratory is judged from the commands that it got.
OF_LABORATORIES = (
    "column",
    "actuator",
    "table",
    "damper",
    "device",
    "sensors",
    "tolerances",
    "master",
    "slave",
)


class JoinedPart:
    """The same laboratory in several recordings, one after the other; in each of them it begins anew.

    Nominal parameters and effects are the same in all of them. So is what a logger did, its delay and its gain: the
    recordings are of one logger.
    """

    def __init__(self, pieces: Sequence[Part]) -> None:
        self.pieces = tuple(pieces)
        first = self.pieces[0]
        self.name, self.role, self.signals = first.name, first.role, first.signals
        self.nuisances, self.candidates, self.exact = first.nuisances, first.candidates, first.exact
        self.measured = np.concatenate([piece.measured for piece in self.pieces])
        self.present = np.concatenate([piece.present for piece in self.pieces])

    def predict(self, system: System) -> Array:
        """What the pieces would have given, without noise; (ticks of all, signals)."""
        return np.concatenate([piece.predict(system) for piece in self.pieces])

    def first(self, ticks: int) -> Part:
        """The pieces over the first ticks of all."""
        kept: list[Part] = []
        for piece in self.pieces:
            if ticks > 0:
                kept.append(piece.first(ticks) if ticks < len(piece.measured) else piece)
            ticks -= len(piece.measured)
        return kept[0] if len(kept) == 1 else JoinedPart(kept)


def joined(part: Part, others: Sequence[Part], group: int) -> Part:
    """A part with the same one of other recordings, each whole averaged samples of `group` ticks long.

    Parts of other recordings that lack it, or that hold other readings, are left out.
    """
    same = [one for one in others if one.name == part.name and one.signals == part.signals and not one.exact]
    if part.exact or not same:
        return part
    pieces = [one.first(len(one.measured) // group * group) for one in (part, *same)]
    return JoinedPart(pieces)


def refuse_others(record: Record, others: Sequence[Record]) -> None:
    """Raise InputError where a further recording is not of the same laboratories as the first."""
    for other in others:
        found = differing(record.plan, other.plan)
        if found:
            raise InputError(
                f"{other.run.path} is not of the laboratories of {record.run.path}: their plans differ in "
                f"{', '.join(found)}. Diagnose it by itself, or say with --plan what the laboratories are."
            )


def differing(one: Plan, other: Plan) -> list[str]:
    """The tables of laboratories, and the interval, in which two plans differ."""
    tables = [f"[{name}]" for name in OF_LABORATORIES if getattr(one, name) != getattr(other, name)]
    return tables + (["test.interval"] if one.test.interval != other.test.interval else [])
