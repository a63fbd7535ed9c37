"""Force-deformation models of columns: one file each, listed here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from common.errors import InputError
from common.schema import nearest
from models import registry
from models.compiled import jit
from models.registry import Array
from models.specimens import linear


@dataclass(frozen=True)
class Specimen:
    """One model."""

    code: int
    params: type[Any]


SPECIMENS = {"linear": Specimen(0, linear.Params)}
STATE_SIZE = 4


def pack(name: str, **params: float) -> tuple[int, Array, Array]:
    """Code, parameters, state at rest."""
    if name not in SPECIMENS:
        raise InputError(f"Unknown specimen model '{name}': {nearest(name, SPECIMENS)}")
    model = SPECIMENS[name]
    return model.code, registry.pack(model.params, params, f"specimen model '{name}'"), np.zeros(STATE_SIZE)


@jit
def step(kind: int, p: Array, s: Array, deformation: float) -> float:
    """Force (N)."""
    return linear.step(p, deformation)
