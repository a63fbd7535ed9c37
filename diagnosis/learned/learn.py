"""The laws learned in one part, and how they are laid over a system."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from diagnosis.fits.fitting import Fit
from diagnosis.learned.equations import Equation, equations
from diagnosis.learned.regression import Regression, regress
from models.system import System

Of = Literal["law", "interleaved", "weaker"]  # which data a law is of, as `Regression` names them


@dataclass(frozen=True)
class LearnedLaw:
    """What no effect explains at one machine, as a law of its motion."""

    site: str
    role: str  # of whom the laboratory is
    equation: Equation
    regression: Regression

    def laid(self, system: System, of: Of = "law") -> System:
        """The system with the law added to what the machine does."""
        return system.laid(self.equation.machine, learned=tuple(getattr(self.regression, of).tolist()))


def learn(fit: Fit) -> list[LearnedLaw]:
    """The laws of what a fit leaves in its part: one for each machine where one predicts time that it has not seen."""
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
