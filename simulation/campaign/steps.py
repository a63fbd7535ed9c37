"""The steps of a campaign, as its log holds them: one line of JSON each."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, NamedTuple


class Endured(NamedTuple):
    """What the specimens have been through."""

    drift: float = 0.0  # m, the largest so far; 0 before the first test
    energy: float = 0.0  # J, absorbed so far


@dataclass(frozen=True)
class Option:
    """A candidate as it is seen before a test: what it would tell, and what it would do to the specimens."""

    candidate: int
    drift: float  # m, the largest that any plausible cause predicts
    energy: float  # J, that a specimen absorbs, likewise
    refused: str = ""  # the limit that forbids it, empty where it may be played
    bits: float = 0.0  # expected information
    certainty: float = 0.0  # expected probability of the true cause afterwards


@dataclass(frozen=True)
class PossibleCause:
    """What may explain the gap, with its probability; no effects: nothing does."""

    effects: tuple[str, ...]
    probability: float


@dataclass(frozen=True)
class BegunStep:
    """The campaign began; the candidates as the nominal models predict them."""

    step: ClassVar[str] = "begun"
    goal: str  # digest
    version: str
    options: tuple[Option, ...]


@dataclass(frozen=True)
class DecidedStep:
    """A test was chosen."""

    step: ClassVar[str] = "decided"
    test: int
    candidate: int
    bits: float
    why: str


@dataclass(frozen=True)
class RecordedStep:
    """What the recording of a test holds."""

    test: int
    file: str
    drift: float  # m, the largest of any storey
    energy: float  # J, that a specimen absorbed, the largest of several


@dataclass(frozen=True)
class InterruptedStep(RecordedStep):
    """A test in real time did not reach its end because this program was ended."""

    step: ClassVar[str] = "interrupted"


@dataclass(frozen=True)
class PlayedStep(RecordedStep):
    """A test was played."""

    step: ClassVar[str] = "played"
    digest: str
    outcome: str


@dataclass(frozen=True)
class DiagnosedStep:
    """All tests so far were diagnosed together, and the candidates judged by what they would tell."""

    step: ClassVar[str] = "diagnosed"
    test: int
    file: str
    version: str
    status: str
    gap: float  # the largest that is left in a part
    causes: tuple[PossibleCause, ...]  # of all parts together, the most probable first
    # The most probable cause, and with it those that no candidate within the limits would tell from it.
    same: tuple[tuple[str, ...], ...]
    together: float  # probability that one of `same` is true
    options: tuple[Option, ...]  # none where the campaign ends

    @property
    def certainty(self) -> float:
        """The probability of the most probable cause."""
        return self.causes[0].probability


@dataclass(frozen=True)
class EndedStep:
    """The campaign ended."""

    step: ClassVar[str] = "ended"
    outcome: str
    text: str


Step = BegunStep | DecidedStep | InterruptedStep | PlayedStep | DiagnosedStep | EndedStep
KINDS: Mapping[str, type[Any]] = {
    one.step: one for one in (BegunStep, DecidedStep, InterruptedStep, PlayedStep, DiagnosedStep, EndedStep)
}


def plain(step: Step) -> dict[str, Any]:
    """A step as plain values for JSON."""
    return {"step": step.step} | asdict(step)


def line(step: Step) -> bytes:
    """A step as a line of the log."""
    return f"{json.dumps(plain(step), allow_nan=False)}\n".encode()


def parsed(text: bytes) -> Step:
    """The step of a line; raises ValueError where it is none."""
    given = json.loads(text)
    if not isinstance(given, dict) or given.get("step") not in KINDS:
        raise ValueError("no step")
    kind = KINDS[given.pop("step")]
    try:
        found: Step = kind(**{name: _of(name, value) for name, value in given.items()})
    except TypeError as error:
        raise ValueError(str(error)) from None
    return found


def _of(name: str, value: Any) -> Any:
    """The value of a field: lists of options and causes as their classes, lists as tuples."""
    if name == "options":
        return tuple(Option(**one) for one in value)
    if name == "causes":
        return tuple(PossibleCause(tuple(one["effects"]), one["probability"]) for one in value)
    if name == "same":
        return tuple(tuple(one) for one in value)
    return value
