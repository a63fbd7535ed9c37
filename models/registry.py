"""Parameters by name, checked and packed for a kernel."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from common.plan.schema import nearest

Array = NDArray[np.float64]


def pack(params: type[Any], values: Mapping[str, float], what: str) -> Array:
    """Values in the order of a NamedTuple's fields, as a kernel's parameter array.

    Raises:
        InputError: a name is unknown or missing, or a value is not finite.
    """
    names: tuple[str, ...] = params._fields
    for name, value in values.items():
        if name not in names:
            raise InputError(f"Unknown parameter '{name}' of {what}: {nearest(name, names)}")
        if not math.isfinite(value):
            raise InputError(f"Parameter '{name}' of {what} is {value}, but must be finite.")
    missing = [name for name in names if name not in values and name not in params._field_defaults]
    if missing:
        raise InputError(f"Parameter '{missing[0]}' of {what} is missing: give a number.")
    return np.array(params(**values), dtype=np.float64)
