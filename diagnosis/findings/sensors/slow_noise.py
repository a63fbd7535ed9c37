"""Slow noise of readings, which may be a machine's unknown effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.findings.sensors.common_noise import in_common
from diagnosis.findings.sensors.readings import LEAST
from diagnosis.findings.sites.likely import APART, TRUE_LEAVES, ranked
from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.residuals import Data
from diagnosis.fits.search import Search, likeliest
from diagnosis.fits.threads import each
from laboratories.effects.sites import is_sensor

# Noise of a reading at its loudest frequency over that at the highest ones, from which on it is doubted where no other
# reading of its laboratory has more than QUIET, or all others have so many times less. Pink noise of a test has less
# than LONE.
LONE, QUIET = 10.0, 2.0
SLACK = 1.25  # of the noise of a reading over the plan's beside that of others
AGAIN = 6  # steps of a fit under another noise, from where it was


def under_less_noise(search: Search) -> tuple[Search, str]:
    """A search whose effects, if any, are held against less noise where coloured noise may hide an unknown effect.

    That is white noise where several readings have the noise as they would follow from one motion: it is that motion.
    Where commands that no row showed make such a motion, it says nothing. For a lone reading it is the noise that all
    readings have; with it goes the reading of which that is doubtful, empty where there is none or where the effects
    explain it as well.
    """
    if not sensor_noise.coloured(search.chosen.data):
        return search, ""
    data, name = sensor_noise.whitened(search.chosen), ""
    unseen = bool(np.any(sensor_noise.moved_unseen(data)))
    if unseen or not moves(fitting.at(data, search.chosen.values, search.chosen.z)):
        name = lone_noise(search.chosen)
        if not name:
            return search, ""
        fit = search.chosen
        data = in_common(fit if fit.names else replace(fit, data=fit.data.fine))
    return fitted_again(search, data), name


def fitted_again(search: Search, data: Data) -> Search:
    """A search under another noise: all of its fits moved to the best parameters."""
    if not search.chosen.names:
        bare = fitting.fit(data, {}, search.chosen.z)
        return replace(search, data=data, commissioned=bare, chosen=bare)
    fits = (search.commissioned, search.chosen, *search.alternatives)
    bare, chosen, *others = each(lambda fit: fitting.fit(data, fit.values, fit.z, AGAIN, rounds=1), fits)
    others.sort(key=lambda fit: fit.cost)
    return likeliest(Search(data, bare, chosen, tuple(others)))


def moves(fit: Fit) -> bool:
    """Whether the readings follow from a machine's unknown motion so well that no sensor's error explains as much."""
    found = ranked(fit)
    near = [item.site for item in found if item.cost < APART]
    return bool(near) and not any(map(is_sensor, near)) and found[0].left < TRUE_LEAVES


def lone_noise(fit: Fit) -> str:
    """The only reading with loud slow noise of which nothing but its motion tells, empty where there is none.

    A logger treats its channels alike, and what a machine with a resonance does by an unknown effect looks like this.
    Where the machine is not at rest the effect is there as well, in the part that moves least too. Noise that the plan
    makes expected is that of the sensor.
    """
    loud = sensor_noise.loudest(fit)
    if loud.size < 2 or any(item.source == "at rest" for item in fit.data.noise):
        return ""
    place, (second, first) = int(np.argmax(loud)), np.sort(loud)[-2:]
    if first < LONE or (second > QUIET and first < LONE * second):
        return ""
    return "" if expected(fit, place) else fit.data.part.signals[place]


def expected(fit: Fit, place: int) -> bool:
    """Whether the noise of a reading, over what the plan says of it, is no louder than on half of all other readings.

    It may be louder by as much as the plan errs for these, and a quarter: a plan rarely knows noise better than that.
    """
    planned = fit.data.planned
    if planned is None or not planned[place] > 0.0:
        return False
    known = (planned > 0.0) & (fit.data.white > 0.0)
    known[place] = False
    others = fit.data.white[known] / planned[known]
    usual, apart = (np.median(others), others.max() / others.min()) if others.size > 1 else (1.0, LEAST)
    own = fit.data.white[place] / planned[place]
    return bool(own <= usual * min(LEAST, SLACK * apart))
