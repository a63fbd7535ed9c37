"""The table by logger, by material or by kind of case: the results of the diagnosis on each row's cases."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from report.text.formats import MISSING
from validation.blind.library import MATERIAL
from validation.blind.logger.loggers import LOGGERS
from validation.blind.results.scoring import Outcome
from validation.blind.results.stated import brier_skill, stated_verdicts

HEAD = (
    "",
    "cases",
    "clean called clean",
    "true effect first",
    "in the list",
    "extra names",
    "Brier skill",
    "intervals hold",
    "oracle sees",
)


@dataclass(frozen=True)
class Hits:
    """A share of cases as two numbers."""

    hits: int
    count: int

    @property
    def text(self) -> str:
        """In words, a dash without cases."""
        return f"{self.hits} of {self.count}" if self.count else MISSING


@dataclass(frozen=True)
class CaseRow:
    """A row of the table."""

    name: str
    cases: int
    clean: Hits  # clean laboratories that are called clean
    first: Hits  # visible single effects: the verdict's first name is right
    listed: Hits  # visible effects of any case of the catalogue: the verdict names them
    extra: float  # named effects per case that are not present; distortions of the logger do not count
    skill: float  # of the stated probabilities, over a constant
    inside: Hits  # stated intervals that hold the true parameter
    seen: Hits  # cases with an effect that an oracle sees

    @property
    def cells(self) -> tuple[str, ...]:
        """The row in words."""
        skill = MISSING if math.isnan(self.skill) else f"{self.skill:.2f}"
        hits = (self.clean.text, self.first.text, self.listed.text)
        return (
            self.name,
            str(self.cases),
            *hits,
            f"{self.extra:.2f}",
            skill,
            self.inside.text,
            self.seen.text,
        )


def case_rows(outcomes: Sequence[Outcome]) -> list[CaseRow]:
    """The rows in the order of the loggers, or of materials and kinds by name, and one of all cases."""
    by_logger = any(item.logger for item in outcomes)
    groups: dict[str, list[Outcome]] = {}
    for item in outcomes:
        kind = item.truth[0] if item.kind == MATERIAL else item.kind
        groups.setdefault(item.logger if by_logger else kind, []).append(item)
    order = list(LOGGERS) if by_logger else sorted(groups)
    texts = {name: LOGGERS[name].text if by_logger else name for name in groups}
    rows = [case_row(texts[name], groups[name]) for name in order if name in groups]
    return [*rows, case_row("all cases", outcomes)]


def case_row(name: str, outcomes: Sequence[Outcome]) -> CaseRow:
    """One row."""
    effects = [item for item in outcomes if item.truth]
    singles = [item for item in effects if item.single and item.visible]
    known = [item for item in effects if item.kind != "unknown"]
    stated = [one for item in outcomes for one in item.estimates if one.inside is not None]
    return CaseRow(
        name,
        len(outcomes),
        hits((item for item in outcomes if item.kind == "clean"), lambda item: item.named),
        hits(singles, lambda item: item.first),
        Hits(sum(item.listed for item in known), sum(item.asked for item in known)),
        sum(item.surplus for item in outcomes) / len(outcomes) if outcomes else math.nan,
        brier_skill(stated_verdicts(outcomes)),
        Hits(sum(bool(one.inside) for one in stated), len(stated)),
        hits(effects, lambda item: item.seen),
    )


def hits(outcomes: Iterable[Outcome], good: Callable[[Outcome], bool]) -> Hits:
    """How many cases are good."""
    judged = [good(item) for item in outcomes]
    return Hits(sum(judged), len(judged))
