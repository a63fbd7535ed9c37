"""Force-deformation models of columns, experimental and numerical: one file each, listed here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from common.errors import InputError
from common.schema import nearest
from models import registry
from models.compiled import jit
from models.registry import Array
from models.specimens import bilinear, bouc_wen, linear

MEMORY = 4  # numbers that a model may remember


@dataclass(frozen=True)
class Specimen:
    """One model: its code in the dispatch below and its parameters, the stiffness (N/m) first."""

    code: int
    params: type[Any]


SPECIMENS = {
    "linear": Specimen(0, linear.Params),
    "bilinear": Specimen(1, bilinear.Params),
    "bouc_wen": Specimen(2, bouc_wen.Params),
}


def build(name: str, stiffnesses: Sequence[float], parameters: Mapping[str, float]) -> tuple[int, Array, Array]:
    """Code, parameters (columns, parameters) and memory at rest (columns, MEMORY) of columns of one model.

    Raises:
        InputError: the model or a parameter is unknown, or no column can have such a value.
    """
    if name not in SPECIMENS:
        raise InputError(f"Unknown column model '{name}': {nearest(name, SPECIMENS)}")
    model, what = SPECIMENS[name], f"column model '{name}'"
    for parameter, value in parameters.items():
        if value < 0.0 or (value == 0.0 and parameter == "yield_displacement"):
            raise InputError(f"Parameter '{parameter}' of {what} is {value}, but must be positive.")
    rows = [registry.pack(model.params, {**parameters, "stiffness": k}, what) for k in stiffnesses]
    return model.code, np.stack(rows), np.zeros((len(rows), MEMORY))


@jit
def step(code: int, p: Array, s: Array, i: int, deformation: float) -> float:
    """Force (N) at a deformation (m) of the column described in row `i`, whose memory moves on."""
    if code == 1:
        return bilinear.step(p, s, i, deformation)
    if code == 2:
        return bouc_wen.step(p, s, i, deformation)
    return linear.step(p, i, deformation)
