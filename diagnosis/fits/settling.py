"""A fit and the noise that it leaves, found in turn: fits of which one follows from the other.

Where the noise is not known, what a fit leaves tells of it; and how good a fit is depends on the noise. What looks like
coloured noise may be an effect, so that effects are held against noise as well.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from diagnosis.fits import candidates, evidence, fitting
from diagnosis.fits.fitting import Fit
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.noise.sensor_noise import quieter
from diagnosis.fits.residuals import Data
from diagnosis.fits.scales import Scales
from diagnosis.fits.screening import ScreenedEffect
from diagnosis.fits.threads import each
from diagnosis.fits.unexplained import MATERIAL, exceeds, gaps, leaves, model_error
from diagnosis.fits.worth import changes, idle, is_gap
from diagnosis.signals.mask import Mask
from diagnosis.signals.strength import BEYOND
from models.registry import Array

ROUNDS = 4  # in which a fit and the noise that it leaves are found in turn
STEPS = 6  # of a fit between two of these
MOVED = 9.0  # fall of the cost from which on a fit may have more to gain: three standard deviations, squared
RIVALS, ROUGH = 3, 4  # candidates that are fitted in the place of coloured noise, and steps of their fits
# Noise at its loudest frequency over that at the highest ones: pink noise of a whole test has less.
LOUDEST = 10.0
# Of a reading's rms that may be coloured noise where only the residual beside effects tells of it.
SMALL = 0.05
UNEVEN = 3.0  # times what the energy of normal noise varies by: such noise comes and goes, as a motion does


def settled(fit: Fit, accepted: Data | None = None) -> Fit:
    """The fit moved to the best parameters under the noise that it leaves, and with data that have this noise.

    Fit and noise follow from each other, and are found in turn. Where much of what the fit leaves follows from the
    inputs, the quiet part holds a gap as well as noise. The noise is then taken to be white, of the level of single
    samples or of averaged ones, whichever is quieter, beside the mains, which no machine follows. The level of the
    highest frequencies alone is no measure: what another formula of the true law leaves lies below them.
    `accepted` are data whose noise beside other effects was accepted; louder noise is doubted.
    """
    if fit.data.part.exact:
        return fit
    found, data = fit, sensor_noise.remodelled(fit)
    for _ in range(ROUNDS):
        if not sensor_noise.altered(data):
            break
        before, found = fitting.at(data, found.values, found.z), again(found, data)
        better = sensor_noise.remodelled(found)
        still = before.cost - found.cost < MOVED
        if still and not (quieter(better, data) or shifted(better, data)):
            break
        data = better
    else:
        found = again(found, data)
    if sensor_noise.coloured(data):
        if not hidden(found, accepted):
            return replace(found, data=data) if found.data is not data else found
        data = sensor_noise.flattened(fit)
        data = replace(data, lines=sensor_noise.mains(found), spikes=None, undoubted=undoubted_noise(found))
    return under_white(found, data, fit.data)


def shifted(after: Data, before: Data) -> bool:
    """Whether the lines of any signal have changed by a visible share of its noise.

    A loud hum takes parameters along with it, and these spoil its first estimate.
    """
    if after.lines is None and before.lines is None:
        return False
    none = np.zeros_like(after.part.measured)
    apart = (none if after.lines is None else after.lines) - (none if before.lines is None else before.lines)
    rms = np.sqrt(np.mean(np.square(apart), axis=0))
    return bool(np.any(rms > MATERIAL * after.white))


def under_white(fit: Fit, data: Data, before: Data) -> Fit:
    """The fit under white noise: that of `before` where it is no lower."""
    changed = bool(before.noise) or sensor_noise.altered(data)
    data = (
        data
        if changed or quieter(data, before)
        else replace(before, related=data.related, undoubted=data.undoubted)
    )
    found = fitting.at(data, fit.values, fit.z)
    return fitting.polished(found) if found.names and leaves(found) else found


def again(fit: Fit, data: Data) -> Fit:
    """A fit moved to the best parameters under another noise; white noise alone leaves it where it is."""
    if sensor_noise.altered(data):
        return fitting.fit(data, fit.values, fit.z, STEPS, rounds=1)
    return fitting.at(data, fit.values, fit.z)


def all_again(fits: Iterable[Fit], data: Data) -> list[Fit]:
    """Fits moved to the best parameters under another noise, as `again` does."""
    return each(lambda fit: again(fit, data), fits)


def hidden(fit: Fit, accepted: Data | None = None) -> bool:
    """Whether the noise that a fit is measured by may hold a gap, in one of four ways.

    More of it follows from the inputs than two good solutions of one model differ by. It is loud at some frequency and
    comes and goes. Something is left beside it, and it is far louder at some frequency than at the highest ones, which
    no sensor's noise is. Or it stands beside effects, is a large share of a reading and louder than the noise
    `accepted`.
    """
    if fit.names and louder(fit.data, accepted):
        return True
    return bool(np.any(doubtful(fit))) or (is_loud(fit) and leaves(fit, model_error(fit)))


def is_loud(fit: Fit) -> bool:
    """Whether the noise that a fit is measured by is far louder at some frequency than that of a sensor."""
    return bool(np.any(sensor_noise.loudest(fit) > LOUDEST))


def stands_out(fit: Fit) -> bool:
    """Whether the noise of one reading is far louder at some frequency, over that at the highest ones, than of others.

    A logger treats its channels alike, so that such noise may be an effect however little of it shows as a gap.
    """
    *_, second, first = np.sort(np.append(sensor_noise.loudest(fit), 1.0))
    return bool(first > LOUDEST * second)


def doubtful(fit: Fit) -> Mask:
    """The signals (signals,) whose coloured noise the inputs foresee, or which is loud and comes and goes."""
    least = np.maximum(MATERIAL, model_error(fit))
    seen = [exceeds(item, limit) for item, limit in zip(sensor_noise.foreseen(fit), least, strict=True)]
    uneven = [item.tails > UNEVEN for item in fit.data.noise]
    return np.array(seen) | (np.array(uneven) & (sensor_noise.loudest(fit) > LOUDEST))


def undoubted_noise(fit: Fit) -> Array:
    """Rms (signals,) of the coloured noise of signals that show no gap, beside others that may; 0 for none."""
    leaving = [exceeds(item, MATERIAL) for item in gaps(fit, fit.data.group)]
    coloured = np.array([item.density is not None for item in fit.data.noise])
    return np.where(coloured & ~doubtful(fit) & ~np.array(leaving), fit.data.white, 0.0)


def louder(data: Data, accepted: Data | None) -> bool:
    """Whether a signal has noise that effects may have left: a large share of its reading, and more than `accepted`.

    A signal whose noise showed no gap without effects may have as much beside them, even where others showed one.
    """
    if no_louder(data, accepted):
        return False
    known = None if accepted is None or sensor_noise.coloured(accepted) else accepted.undoubted
    more = np.zeros(data.white.size) if known is None else known
    return bool(np.any((sensor_noise.shares(data) > SMALL) & (more < sensor_noise.LOWER * data.white)))


def no_louder(data: Data, accepted: Data | None) -> bool:
    """Whether the noise of no signal is louder than noise that was accepted, which was coloured too."""
    if accepted is None or not sensor_noise.coloured(accepted):
        return False
    return not bool(np.any(accepted.white < sensor_noise.LOWER * data.white))


def instead_of_colour(bare: Fit, scales: Scales) -> tuple[Fit, list[Fit]]:
    """The fit without effects, and those with one, best first, under the noise that the best of these leaves.

    What is taken for coloured noise may be an effect, at rest as in motion: effects are fitted under white noise,
    and the best is taken if the data are far more probable under it and the noise that it leaves. Without such an
    effect the list is empty. Effects are also fitted under their further laws where the noise of one reading stands
    out, or where nominal parameters are at the ends of their tolerances as well and noise is far louder than a
    sensor's.
    """
    if not sensor_noise.coloured(bare.data):
        return bare, []
    if not stands_out(bare):
        bare, found = far_likelier_ones(bare, in_white_noise(bare, scales))
        if found or not (is_loud(bare) and is_gap(bare)):
            return bare, found
    white = fitting.at(sensor_noise.whitened(bare), {}, bare.z)
    return far_likelier_ones(bare, candidates.best_laws(white, scales))


def beside_colour(fit: Fit, scales: Scales) -> Fit | None:
    """The fit with one effect more in the place of the coloured noise beside its effects; None where there is none.

    Where the first effect explains nearly all of a gap, as a zero of a sensor may, the rest of it looks like noise.
    What two good solutions of one model may differ by is no effect, unless nothing at all is left of it beside one.
    """
    if not sensor_noise.coloured(fit.data):
        return None
    white = fitting.polished(fitting.at(sensor_noise.whitened(fit), fit.values, fit.z))
    if not leaves(white):
        return None
    rivals = sorted(in_white_noise(fit, scales), key=lambda item: evidence.surprise(remodelled(item)))
    _, found = far_likelier_ones(fit, rivals)
    if not found or idle(best := found[0], changes(best)):
        return None
    larger = leaves(white, model_error(white))
    return best if larger or not leaves(fitting.at(white.data, best.values, best.z)) else None


def beats_colour(fit: Fit, less: Fit) -> bool:
    """Whether a fit under coloured noise is far likelier than one without an effect, under the noise this leaves."""
    return sensor_noise.coloured(fit.data) and far_likelier(fit, remodelled(less))


def far_likelier_ones(bare: Fit, fits: list[Fit]) -> tuple[Fit, list[Fit]]:
    """The fit without effects, and fits with one, best first, under the noise that the best of these leaves.

    The list is empty where the data are not far more probable under the best one and that noise.
    """
    if not fits or not far_likelier(remodelled(fits[0]), bare):
        return bare, []
    best, bare = settled(fits[0], bare.data), as_near(bare, fits[0])
    if not far_likelier(best, bare):
        return bare, []
    bare, *others = all_again((bare, *fits[1:]), best.data)
    return bare, [best, *others]


def as_near(bare: Fit, fit: Fit) -> Fit:
    """The fit without effects, from where it is or from the nominal parameters of another fit: the better one.

    A fit under white noise may take slow noise for a delay, which a few steps under coloured noise do not undo.
    """
    other = again(fitting.at(bare.data, bare.values, fit.z), bare.data)
    return min(bare, other, key=fitting.everywhere)


def in_white_noise(bare: Fit, scales: Scales) -> list[Fit]:
    """Fits with one effect more over a beginning under white noise, held against the whole test, best first."""
    white = fitting.at(sensor_noise.whitened(bare), bare.values, bare.z)
    near = fitting.begun(white)
    slopes = near.jacobian[:, : bare.z.size]
    promising = candidates.promised(near, scales) if bare.names else candidates.screened(near, scales)

    def rough(item: ScreenedEffect) -> Fit:
        start = {**bare.values, item.effect.name: item.values}
        return fitting.fit(near.data, start, item.z, ROUGH, slopes, rounds=1)

    fits = each(rough, promising[:RIVALS])
    whole = [fitting.at(white.data, item.values, item.z) for item in fits]
    return sorted(whole, key=lambda item: item.cost)


def remodelled(fit: Fit) -> Fit:
    """A fit, measured by the noise that it leaves."""
    return fitting.at(sensor_noise.remodelled(fit), fit.values, fit.z)


def far_likelier(fit: Fit, bare: Fit) -> bool:
    """Whether the data are far more probable under a fit and its noise than under the one without effects."""
    return evidence.surprise(fit) < evidence.surprise(bare) - BEYOND
