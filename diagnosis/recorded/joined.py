"""One laboratory in several recordings as one part: one hypothesis must explain all recordings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from common.errors import InputError
from common.plan.kinds import COLUMN
from diagnosis.recorded.parts import LaboratoryPart, Part
from diagnosis.recorded.record import Record
from models.registry import Array
from models.system import System

# Tables of a plan that describe the laboratories. Ground motion, building, compensation and control may differ from
# test to test, because a laboratory is judged from the commands that it received.
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
    """The same laboratory in several recordings, one after the other; each recording begins at rest.

    Nominal parameters and effects are the same in all of them. So are the delay and the gain of a data logger, because
    one logger recorded all of them.
    """

    def __init__(self, pieces: Sequence[Part]) -> None:
        self.pieces = tuple(pieces)
        first = self.pieces[0]
        self.name, self.role, self.signals = first.name, first.role, first.signals
        self.nuisances, self.candidates, self.exact = first.nuisances, first.candidates, first.exact
        self.retimed = any(piece.retimed for piece in self.pieces)
        self.blurred = np.max(
            [np.broadcast_to(piece.blurred, len(self.signals)) for piece in self.pieces], axis=0
        )
        self.measured = np.concatenate([piece.measured for piece in self.pieces])
        self.present = np.concatenate([piece.present for piece in self.pieces])

    @property
    def passes(self) -> Array:
        """Frequencies (signals,) up to which one logger passed noise in all recordings, Hz."""
        return self.pieces[0].passes

    @property
    def level(self) -> Array:
        """Rms of the readings (signals,) as the pieces have it."""
        sums = sum(len(piece.measured) * np.square(piece.level) for piece in self.pieces)
        return np.asarray(np.sqrt(sums / len(self.measured)))

    def predict(self, system: System) -> Array:
        """The predicted readings of all pieces without noise, (ticks of all pieces, signals)."""
        return np.concatenate([piece.predict(system) for piece in self.pieces])

    def first(self, ticks: int) -> Part:
        """The pieces, cut off after a number of ticks that is counted over all pieces."""
        kept: list[Part] = []
        for piece in self.pieces:
            if ticks > 0:
                kept.append(piece.first(ticks) if ticks < len(piece.measured) else piece)
            ticks -= len(piece.measured)
        return kept[0] if len(kept) == 1 else JoinedPart(kept)


def joined(part: Part, others: Sequence[Part], group: int) -> Part:
    """A part joined with the same part of other recordings, each cut to whole groups of `group` ticks.

    Parts of other recordings with other readings are left out, as are exact parts.
    """
    same = [one for one in others if one.name == part.name and one.signals == part.signals and not one.exact]
    if part.exact or not same:
        return part
    pieces = [one.first(len(one.measured) // group * group) for one in (part, *same)]
    return JoinedPart(pieces)


def laboratory_of(part: Part) -> LaboratoryPart | None:
    """The laboratory of a part, of the first recording where it is that of several; None of other parts."""
    first = part.pieces[0] if isinstance(part, JoinedPart) else part
    return first if isinstance(first, LaboratoryPart) else None


def column_of(part: Part) -> LaboratoryPart | None:
    """The laboratory of a part if it has a column under an actuator, else None."""
    lab = laboratory_of(part)
    return lab if lab is not None and lab.lab.kind.name == COLUMN else None


def refuse_others(record: Record, others: Sequence[Record]) -> None:
    """Raise InputError if a further recording has other laboratories than the first."""
    for other in others:
        found = differing(record, other)
        if found:
            raise InputError(
                f"{other.run.path} does not have the laboratories of {record.run.path}, since their plans differ in "
                f"{', '.join(found)}: diagnose it by itself, or give with --plan the plan of the laboratories."
            )


def differing(one: Record, other: Record) -> list[str]:
    """The tables of laboratories, and the interval, in which two plans differ; static data have no interval."""
    plans = one.plan, other.plan
    found = [f"[{name}]" for name in OF_LABORATORIES if getattr(plans[0], name) != getattr(plans[1], name)]
    timed = not (one.static or other.static)
    return found + (["test.interval"] if timed and plans[0].test.interval != plans[1].test.interval else [])
