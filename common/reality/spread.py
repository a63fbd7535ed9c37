"""The uncertainty of a diagnosis: covariance of parameters, noise of sensors, the unexplained rest, the ranges seen.

`rths diagnose --found` writes it into the .npz file beside the reality, and `rths predict` draws laboratories from it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from common.errors import PlanError

KNOWN, COVARIANCE = "known", "covariance"  # names of arrays in the .npz file beside a reality
KEY = "rest"  # of [found]: the name of that file

ByRole = dict[str, dict[str, float]]


class UncertainParameter(NamedTuple):
    """One parameter that a diagnosis found, and the scale of its spread.

    For a nominal parameter the spread is that of a factor on it. For an effect's parameter it is that of the value or,
    if `logarithmic`, of the value's logarithm.
    """

    laboratory: str  # role
    parameter: str  # `table.name` of the plan, or the name of an effect's parameter
    effect: str = ""  # the effect's name in the catalogue, empty for a nominal parameter
    storey: int = 0  # the storey whose value is meant, counted from 1; 0 for all storeys
    logarithmic: bool = False
    least: float = -math.inf
    most: float = math.inf


class SeenRange(NamedTuple):
    """The range of one laboratory's motion in the diagnosed recording."""

    amplitudes: dict[str, float]  # largest magnitude of each reading that exceeds its noise, SI units
    band: tuple[float, float]  # Hz, frequencies that hold nearly all of the target's energy


@dataclass(frozen=True)
class Spread:
    """The uncertainty of a reality that a diagnosis found."""

    parameters: tuple[UncertainParameter, ...] = ()
    covariance: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))
    noise: ByRole = field(default_factory=dict)  # rms of each channel's noise by role
    rest: ByRole = field(default_factory=dict)  # unexplained share of each signal's envelope, by role
    seen: dict[str, SeenRange] = field(default_factory=dict)  # by role

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The arrays for the .npz file."""
        text = json.dumps(
            {
                "parameters": [one._asdict() for one in self.parameters],
                "noise": self.noise,
                "rest": self.rest,
                "seen": {role: one._asdict() for role, one in self.seen.items()},
            }
        )
        return {KNOWN: np.array(text), COVARIANCE: self.covariance}


def beside(tables: Mapping[str, Any], base: Path) -> Spread:
    """The spread in the file that `[found]` of a reality names, relative to `base`.

    Raises:
        PlanError: the reality names none, or it cannot be read.
    """
    given = tables.get("found")
    name = given.get(KEY) if isinstance(given, dict) else None
    if not isinstance(name, str):
        raise PlanError(
            "it does not hold the uncertainty of a diagnosis: give a file that `rths diagnose --found` wrote, not a "
            "reality of your own."
        )
    path = base / name
    try:
        with np.load(path, allow_pickle=False) as file:
            return read(json.loads(str(file[KNOWN])), np.asarray(file[COVARIANCE], dtype=np.float64))
    except (OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, BadZipFile):
        raise PlanError(
            f"Cannot read the uncertainty in {path}: keep the .npz file that `rths diagnose --found` wrote beside the "
            "reality."
        ) from None


def read(plain: Mapping[str, Any], covariance: NDArray[np.float64]) -> Spread:
    """A spread from plain values; raises ValueError, KeyError, TypeError or AttributeError for others."""
    parameters = tuple(UncertainParameter(**one) for one in plain["parameters"])
    if covariance.shape != (len(parameters),) * 2 or not np.all(np.isfinite(covariance)):
        raise ValueError("no covariance of these parameters")
    seen = {
        role: SeenRange(numbers(one["amplitudes"]), (float(one["band"][0]), float(one["band"][1])))
        for role, one in plain["seen"].items()
    }
    noise, rest = (
        {role: numbers(values) for role, values in plain[name].items()} for name in ("noise", "rest")
    )
    return Spread(parameters, covariance, noise, rest, seen)


def numbers(given: Mapping[str, Any]) -> dict[str, float]:
    """Numbers by name; raises ValueError where one is negative or not finite."""
    result = {name: float(value) for name, value in given.items()}
    if not all(0.0 <= value < math.inf for value in result.values()):
        raise ValueError("a size is negative or not finite")
    return result
