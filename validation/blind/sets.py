"""The sets of cases, each with its own distribution of laboratories.

Sets share no draw. The thresholds of the diagnosis are set on "tune"; "judge" is for judging only. Each other set tests
something that "judge" does not; its text says what.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import accumulate
from typing import TYPE_CHECKING

from validation.blind.labs.materials import MATERIALS
from validation.blind.logger.loggers import IN_STEP, OUT_OF_STEP

if TYPE_CHECKING:
    from validation.blind.lots import Lot

# Largest number of effects of a case of the kind "many": three times what a diagnosis names together.
MILD = 9
# Share of the kinds of case. Half are of the catalogue, which has most effects to cover; of the others 300 cases
# contain 30 or more, so that a rate of 90 % is known to ±11 points.
SHARES = {"catalogue": 0.50, "formula": 0.15, "unknown": 0.10, "pair": 0.10, "clean": 0.15}

# Halves of the effects of no catalogue: one to develop on, one to judge on.
HALVES = ("developed", "judged")
CLEAN_TURN = 5  # of the cases with such effects every fifth laboratory is clean


@dataclass(frozen=True)
class CaseSet:
    """How the cases of a set are drawn."""

    text: str  # for --help
    shares: Mapping[str, float] = field(default_factory=lambda: SHARES)  # of kinds of case
    turns: tuple[str, ...] = ()  # kinds that take turns instead, a round of loggers each
    loggers: tuple[
        str, ...
    ] = ()  # taken in turn by the number of the case, none for the test's own recording
    # True parameters are normal about the nominal ones, by tolerances as standard deviations.
    normal: bool = False
    own: bool = False  # every laboratory that has independent code is played by it
    materials: tuple[str, ...] = ()  # OpenSees' materials in the column's place, taken in turn
    half: str = ""  # of the effects of no catalogue in `labs.unlisted`, which are taken in turn
    # A second motion is recorded, on which the diagnosis judges what it found on the first.
    twice: bool = False

    def kind(self, lot: Lot) -> str:
        """The kind of a case."""
        if self.half:
            return "clean" if int(lot[-1]) % CLEAN_TURN == CLEAN_TURN - 1 else "unknown"
        if self.turns:
            return self.turns[self._round(lot) % len(self.turns)]
        from validation.blind import lots

        share = lots.generator(*lot, "kind").random()
        sums = accumulate(self.shares.values())
        return next(kind for kind, most in zip(self.shares, sums, strict=True) if share < most)

    def material(self, lot: Lot) -> str:
        """The material of a case."""
        return self.materials[int(lot[-1]) % len(self.materials)]

    def turn(self, lot: Lot) -> int:
        """The place of a case among those with an effect of no catalogue."""
        return int(lot[-1]) - int(lot[-1]) // CLEAN_TURN

    def logger(self, lot: Lot) -> str:
        """The logger of a case, empty for none."""
        return self.loggers[int(lot[-1]) % len(self.loggers)] if self.loggers else ""

    def _round(self, lot: Lot) -> int:
        return int(lot[-1]) // max(len(self.loggers), 1)


SETS = {
    "judge": CaseSet("for judging only"),
    "tune": CaseSet("for setting thresholds"),
    "loggers": CaseSet(
        "clean laboratories and single effects through data loggers",
        turns=("clean", "catalogue"),
        loggers=tuple(IN_STEP),
    ),
    "out_of_step": CaseSet(
        "clean laboratories and single effects through imports of loggers with clocks of their own",
        turns=("clean", "formula"),
        loggers=tuple(OUT_OF_STEP),
        own=True,
    ),
    "normal": CaseSet("true parameters normal about the nominal ones", normal=True),
    "many": CaseSet("up to nine mild faults at once", {"clean": 0.1, "many": 0.9}),
    "independent": CaseSet(
        "clean laboratories, single effects and pairs in independent code",
        {"clean": 0.35, "formula": 0.3, "pair": 0.35},
        own=True,
    ),
    "unlisted": CaseSet(
        "effects of no catalogue, for judging only, and clean laboratories", half="judged", own=True
    ),
    "unlisted_tune": CaseSet("others of them, to develop on", half="developed", own=True),
    "materials": CaseSet(
        "OpenSees' materials as columns (make opensees)",
        turns=("material",),
        materials=tuple(MATERIALS),
        twice=True,
    ),
}
