"""The nine criteria of the 2020 benchmark, in the order of its Table 3.

The paper's text and its table order J5 to J9 differently. The order here is the table's, because the published numbers
fit it: the peak of floor 1, the rms of floors 2 and 3, then their peaks. In J4 and J5 floor 1 is the measured
displacement of the specimen, noise included; with the computed displacement J5 differs from the table by up to four
points. As in the published program, "rms" is taken about the mean, and the delay is searched among lags of 0 to 49
intervals only, so that a measurement that leads its target reads 0. `indicators.correlation_delay` finds either sign.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models import indicators
from models.registry import Array


class Criteria(NamedTuple):
    """J1 in s, the others as shares of the reference's."""

    j1: float  # delay of the measurement behind its target
    j2: float  # rms of the tracking error
    j3: float  # peak of the tracking error
    j4: float  # rms of the difference of measured floor 1 and the reference
    j5: float  # peak of floor 1 as measured
    j6: float  # rms of floor 2
    j7: float  # rms of floor 3
    j8: float  # peak of floor 2
    j9: float  # peak of floor 3


MEANINGS = {
    "J1": "delay of the measured behind the target displacement, by correlation",
    "J2": "tracking error, rms",
    "J3": "tracking error, peak",
    "J4": "error of floor 1, measured against the reference, rms",
    "J5": "error of floor 1, measured against the reference, peak",
    "J6": "error of floor 2, rms",
    "J7": "error of floor 3, rms",
    "J8": "error of floor 2, peak",
    "J9": "error of floor 3, peak",
}


def criteria(target: Array, measured: Array, floors: Array, reference: Array, interval: float) -> Criteria:
    """The criteria of one test.

    `target` and `measured` (n,) m of the specimen, which is floor 1; `floors` and `reference` (n, 3) m of the hybrid
    test and of the whole building computed; `interval` in s.
    """
    tracking, first = measured - target, reference[:, 0]
    error = floors - reference
    return Criteria(
        indicators.correlation_lag(target, measured, interval),
        rms(tracking) / rms(target),
        peak(tracking) / peak(target),
        near(measured, first),
        peak(measured - first) / peak(first),
        *(rms(error[:, floor]) / rms(reference[:, floor]) for floor in (1, 2)),
        *(peak(error[:, floor]) / peak(reference[:, floor]) for floor in (1, 2)),
    )


def near(measured: Array, reference: Array) -> float:
    """J4: rms error of floor 1 as measured (n,) m over the rms of its reference."""
    return rms(measured - reference) / rms(reference)


def rms(values: Array) -> float:
    """Root of the mean square about the mean."""
    return float(np.std(values))


def peak(values: Array) -> float:
    """Largest magnitude."""
    return float(np.max(np.abs(values)))
