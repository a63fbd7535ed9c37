"""A load cell whose charge leaks in the place of an effect of its column: both turn the phase of the force."""

from __future__ import annotations

import math

import numpy as np
from scipy import signal

from diagnosis.findings.sensors.own_reading import of_column
from diagnosis.findings.sites.likely import APART
from diagnosis.findings.sites.signatures import laboratory_of
from diagnosis.fits import fitting, hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import TOLERANCES
from models.registry import Array

# Time constants of a charge amplifier, s, each a third longer than the one before: the shortest is below the periods of
# a structure, the longest beyond what a test of a minute tells from none.
CONSTANTS = np.geomspace(0.3, 100.0, 21)


def leaks(fit: Fit) -> str:
    """The effect of a column that a leak of its load cell's charge explains as well, empty for none.

    A charge amplifier reads force·s/(s + 1/τ). Of slow motion its reading is early, as the force beside a dashpot is.
    Nominal parameters and the other effects of the fit move beside it, and must not do as well by themselves.

    Source: G. Gautschi, Piezoelectric Sensorics (2002), ch. 11.
    """
    _, own = of_column(fit)
    apart = 2.0 * APART * max(1.0, float(np.mean(np.square(fit.reduced))))
    spent = float(np.sum(np.square(fit.reduced))) + fit.prior
    for name in own:
        less = {key: values for key, values in fit.values.items() if key != name}
        without = fitting.at(fit.data, less, fit.z)
        leaking = least(without)
        if leaking - spent < apart < cost(without, math.inf) - leaking:
            return name
    return ""


def least(fit: Fit) -> float:
    """The least cost of a fit whose column's force leaks, over time constants and all that the fit moves."""
    return min(cost(fit, float(constant)) for constant in CONSTANTS)


def cell(fit: Fit) -> str:
    """The site of the load cell of a fit's column, empty where its laboratory has none."""
    part = laboratory_of(fit.data.part)
    return part.lab.site("sensor.column_force") if part is not None and of_column(fit)[0] else ""


def cost(fit: Fit, constant: float) -> float:
    """What a fit costs whose column's force leaks with a time constant, s, once all that it moves has moved.

    Residuals are linear in what is moved, and a leak passes their slopes as it passes the force.
    """
    data, part, count = fit.data, laboratory_of(fit.data.part), fit.z.size
    if part is None:
        return math.inf
    place = [part.lab.sensor(name) for name in part.signals].index(cell(fit))
    interval = data.system.plan.test.interval
    said = data.part.predict(hypothesis.lay(data, fit.z, fit.values))[:, place]
    lost = np.zeros(data.part.measured.shape)
    lost[:, place] = (said - leaked(said, interval, constant)) / data.sigma[place]
    left = (fit.reduced + data.whitened(lost)).ravel()
    slopes = fit.jacobian.reshape(*fit.reduced.shape, -1).copy()
    slopes[:, place] = leaked(slopes[:, place], interval * data.group, constant)
    matrix = np.concatenate([slopes.reshape(left.size, -1), np.eye(count, slopes.shape[2])])
    wanted = -np.concatenate([left, fit.z])
    by = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
    by[:count] = np.clip(fit.z + by[:count], -TOLERANCES, TOLERANCES) - fit.z
    return float(np.sum(np.square(matrix @ by - wanted)))


def leaked(force: Array, interval: float, constant: float) -> Array:
    """What a charge amplifier with a time constant, s, reads of forces (n, …), sampled every `interval` s."""
    kept = math.exp(-interval / constant)
    return np.asarray(signal.lfilter([1.0, -1.0], [1.0, -kept], force, axis=0))
