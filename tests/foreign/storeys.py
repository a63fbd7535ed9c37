"""A linear building of two storeys by the explicit Newmark method, which stands in for another program."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from common.foreign import FloorMotion, ForeignModel

MASS, STIFFNESS, DAMPING = (160e3, 120e3), (18.75e6, 20e6), (2e5, 1e5)


def tridiagonal(values: Sequence[float]) -> np.ndarray:
    lower, upper = values
    return np.array([[lower + upper, -upper], [-upper, upper]])


class Storeys(ForeignModel):
    """Its ground acceleration (ticks + 1,) m/s²; a step that is in `late` is answered at the second request."""

    def __init__(self, ground: np.ndarray, interval: float, late: Sequence[int] = ()) -> None:
        self.name, self.close = "storeys", lambda: None
        self._ground, self._interval, self._late = ground, interval, list(late)
        M, self._C, self._K = np.diag(MASS), tridiagonal(DAMPING), tridiagonal(STIFFNESS)
        self._inverse = np.linalg.inv(M + 0.5 * interval * self._C)
        self._x, self._half = np.zeros(2), 0.5 * interval * np.full(2, ground[0])
        self._step, self._load = 0, np.zeros(2)

    def advance(self, forces: Sequence[float]) -> None:
        self._load = np.array(forces)

    def motion(self, seconds: float) -> FloorMotion | None:
        if self._step in self._late:
            self._late.remove(self._step)
            return None
        h, x = self._interval, self._x
        load = self._load - np.array(MASS) * self._ground[self._step] - self._K @ x
        a = self._inverse @ (load - self._C @ self._half)
        v = self._half + 0.5 * h * a
        self._half = v + 0.5 * h * a
        self._x, self._step = x + h * self._half, self._step + 1
        rows = (x, v, a, self._x, v + h * a)
        return FloorMotion(*(tuple(row.tolist()) for row in rows))
