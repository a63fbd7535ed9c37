"""The laws learned in one part, and how they are laid over a system."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from common.reality.found import LearnedEntry
from diagnosis.fits.fitting import Fit
from diagnosis.learned.equations import Equation, equations
from diagnosis.learned.regression import Regression, regress
from models.system import System

# The data from which a law was learned, as `Regression` names them.
Of = Literal["law", "interleaved", "weaker"]


@dataclass(frozen=True)
class LearnedLaw:
    """What no effect explains at one machine, as a law of its motion."""

    site: str
    role: str  # of the process that drives the laboratory
    equation: Equation
    regression: Regression

    @property
    def entry(self) -> LearnedEntry:
        """The law as a reality says it."""
        return LearnedEntry(self.role, self.equation.machine, tuple(self.regression.law.tolist()))

    def laid(self, system: System, of: Of = "law") -> System:
        """The system with the law added to what the machine does."""
        return system.laid(self.equation.machine, learned=tuple(getattr(self.regression, of).tolist()))


def learn(fit: Fit) -> list[LearnedLaw]:
    """The laws of what a fit leaves in its part, of the machines whose law predicts time that it was not fitted on."""
    result = []
    for equation in equations(fit):
        found = regress(
            equation.motion,
            equation.rate,
            equation.left,
            equation.there,
            fit.data.system.plan.test.interval,
        )
        if found is not None:
            result.append(LearnedLaw(equation.site, fit.data.part.role, equation, found))
    return result
