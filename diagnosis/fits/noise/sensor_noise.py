"""The noise of a part's sensors, from what no model of the part could explain: its colour, lines, spikes and level.

What depends on the part's inputs is no noise. So a flexible model takes it away first, each stretch of time without a
look at it; what is left at rest, or else where the part moves least, is the noise of the sensors.

A reading of static data settles before the next row, so that its noise is independent from row to row. What changes
slowly from row to row is the error of a law along the path, unless rows at rest have it too.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from diagnosis.fits import hypothesis, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.noise.inputs import inputs, related
from diagnosis.fits.noise.remainder import Remainder, remainder, spans
from diagnosis.fits.noise.unsteady_noise import evened
from diagnosis.fits.residuals import Data
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals.mask import Mask
from diagnosis.signals.noise import colour, pickup
from diagnosis.signals.noise.model import NoiseModel, Source
from diagnosis.signals.systematic import samples_per_sample
from models.registry import Array
from models.system import System

WINDOW = 0.5  # s, of a stretch that counts as quiet or as loud
REST = 2e-3  # of the largest motion of a window, below which it is at rest
QUIET = 0.1  # below which it is quiet
ENOUGH = 5.0  # s of quiet windows that suffice
SHARE = 0.35  # of the windows, the quietest, where fewer than `ENOUGH` seconds are quiet
SURE = 4.0  # standard errors beyond which noise follows the motion
# Motion elsewhere over that of the quiet part, from which on noise that is as loud in both does not follow it.
VARIED = 2.0
# Times the density before the test, from which on slow noise in the test is another one: some seconds tell it to less.
LOUDER = 4.0
# Of the noise at the highest frequencies before a test, up to which it is that of the test: both are known to 3 %, and
# readings that were moved in time have less.
AS_LOUD = 1.08
# Of the noise at the highest frequencies, from which on what commands moved that were not recorded counts beside it.
UNSEEN = 0.2
LOWER = 0.9  # of the noise first found, from which on a lower one is believed


def quieter(after: Data, before: Data) -> bool:
    """Whether the noise of any signal is lower than it was."""
    return bool(np.any(after.white < LOWER * before.white))


def remodelled(fit: Fit) -> Data:
    """The data of a fit with the noise that it leaves."""
    data, system = fit.data, hypothesis.lay(fit.data, fit.z, fit.values)
    if data.part.exact:
        return data
    return modelled(residuals.measured_by(data, data.white_part(data.residual(system))), system)


def modelled(data: Data, system: System) -> Data:
    """The data with noise as a hypothesis leaves it."""
    if data.related is None:
        data = replace(data, related=related(data, system))
    data, rest = evened(data, remainder(data, system), system)
    quiet = quiet_part(data, system)
    models = tuple(model(data, rest, quiet, place) for place in range(len(data.part.signals)))
    white = np.array([item.rms for item in models])
    lines = rest.lines if rest.lines.any() else None
    spiky = rest.spikes if rest.spikes.any() else None
    return residuals.measured_by(replace(data, noise=models, lines=lines, spikes=spiky), white)


def mains(fit: Fit) -> Array | None:
    """What sensors pick up of the mains (ticks, signals), by the residuals that a fit leaves; None where nothing."""
    data, interval = replace(fit.data, lines=None, spikes=None), fit.data.system.plan.test.interval
    raw = data.residual(hypothesis.lay(data, fit.z, fit.values))
    lines = np.zeros_like(raw)
    for span in spans(data.part):
        for place, column in enumerate(raw[span].T):
            found = [one for one in pickup.pickups(column, interval) if pickup.of_mains(one.frequency)]
            lines[span, place] = pickup.waves(column, found, interval)
    return lines if lines.any() else None


def coloured(data: Data) -> bool:
    """Whether the noise of any signal is not white."""
    return any(item.density is not None for item in data.noise)


def altered(data: Data) -> bool:
    """Whether readings hold more than steady white noise: noise of a colour, unsteady noise, lines or spikes."""
    return coloured(data) or any(known is not None for known in (data.loudness, data.lines, data.spikes))


def whitened(fit: Fit) -> Data:
    """The data of a fit with white noise of the level of the highest frequencies, lines and spikes taken away."""
    data = replace(fit.data, noise=())
    return residuals.measured_by(
        data, data.white_part(data.residual(hypothesis.lay(data, fit.z, fit.values)))
    )


def flattened(fit: Fit) -> Data:
    """The data with white noise in the place of the coloured noise that a fit leaves, no louder than averages of that.

    What follows the highest frequencies of a motion, as the inertia of a specimen does, hardly shows in averages, and
    white noise of the level of single samples would hide it. Noise that readings at rest before the test have stays.
    """
    data, flat = remodelled(fit), whitened(fit)
    rested = [before_the_test(flat, place) for place in range(len(data.noise))]
    models = tuple(
        replace(known, lines=item.lines, resolution=item.resolution) if known else as_white(item)
        for item, known in zip(data.noise, rested, strict=True)
    )
    level = np.minimum(data.white, [item.rms for item in models])
    return residuals.measured_by(replace(data, noise=models if any(rested) else ()), level)


def as_white(item: NoiseModel) -> NoiseModel:
    """White noise that averaged samples of another noise are as loud as."""
    if item.density is None:
        return item
    rms = math.sqrt(np.trapezoid(item.density, colour.GRID))
    return NoiseModel(rms, lines=item.lines, resolution=item.resolution)


def share(data: Data) -> float:
    """Largest of `shares`."""
    return float(np.max(shares(data), initial=0.0))


def shares(data: Data) -> Array:
    """Rms (signals,) of a coloured noise that only the residual tells of over that of its reading; zero for others.

    Noise that is steady while the motion is not does not count: what an effect leaves follows the motion.
    """
    level = np.sqrt(np.mean(np.square(data.part.measured), axis=0))
    own = np.array([item.unproven for item in data.noise] or np.zeros(level.size), dtype=bool)
    return np.where(own, data.white / np.maximum(level, 1e-300), 0.0)


def loudest(fit: Fit) -> Array:
    """Largest rms density (signals,) of each sensor's noise over that at the highest frequencies; one if white."""
    white = fit.data.white_part(fit.data.residual(hypothesis.lay(fit.data, fit.z, fit.values)))
    if not fit.data.noise:
        return np.ones(white.size)
    return np.array([loudness(item, float(level)) for item, level in zip(fit.data.noise, white, strict=True)])


def loudness(item: NoiseModel, level: float) -> float:
    """Largest rms density of a noise over its `level` at the highest frequencies, one where it is white."""
    return 1.0 if item.density is None else math.sqrt(float(item.density.max())) / max(level, 1e-300)


class Foreseen(NamedTuple):
    """How much of a residual follows from what the part was given, whatever model it takes."""

    ratio: float  # rms over that of the noise
    significance: float  # standard deviations above noise


def foreseen(fit: Fit) -> list[Foreseen]:
    """What the inputs say of the residuals of every signal that no model of the noise can have."""
    data = fit.data
    if data.related is None or data.related.count != data.groups:
        return [Foreseen(0.0, 0.0)] * data.sigma.size
    return told(fit, data.related.predict(fit.reduced))


def told(fit: Fit, said: Array) -> list[Foreseen]:
    """How much of the residuals of every signal a prediction (groups, signals) says.

    The prediction ŷ of a stretch of time has not seen it, so with white noise y of unit variance Σyŷ/√Σŷ² is a standard
    normal number.
    """
    data = fit.data
    energy = np.sum(said**2, axis=0)
    along = np.sum(fit.reduced * said, axis=0)
    tails = np.array([item.tails for item in data.noise]) if data.noise else np.ones(data.sigma.size)
    sure = np.where(energy > 0.0, along / np.sqrt(np.maximum(energy, 1e-300)) / tails, 0.0)
    ratio = np.sqrt(np.maximum(2.0 * along - energy, 0.0) / (data.groups * data.group))
    return [Foreseen(float(r), float(z)) for r, z in zip(ratio, sure, strict=True)]


class QuietPart(NamedTuple):
    """Where a part is at rest, or moves least."""

    there: Mask  # (groups,)
    source: Source  # which of the two it is
    varied: float  # rms of the motion elsewhere over that there


def quiet_part(data: Data, system: System) -> QuietPart:
    """The averaged samples in which a part is at rest, or moves least."""
    moving = inputs(data.part, system)
    size = max(1, round(WINDOW / (data.system.plan.test.interval * data.group)))
    count = max(1, data.groups // size)
    edges = np.round(np.linspace(0, data.groups, count + 1)).astype(np.int64)
    starts = edges[:-1] * data.group
    energy = np.add.reduceat(np.square(moving - moving[0]), starts, axis=0)
    level = np.sqrt(np.max(energy / np.maximum(energy.max(axis=0), 1e-300), axis=1, initial=0.0))
    enough = max(1, round(ENOUGH / WINDOW))
    source: Source = "quiet part"
    if np.count_nonzero(level < REST) >= enough:
        chosen, source = level < REST, "at rest"
    elif np.count_nonzero(level < QUIET) >= enough:
        chosen = level < QUIET
    else:
        chosen, source = level <= np.quantile(level, SHARE), "residual"
    still, loud = (
        float(np.mean(np.square(part))) if part.size else 0.0 for part in (level[chosen], level[~chosen])
    )
    return QuietPart(np.repeat(chosen, np.diff(edges)), source, math.sqrt(loud / max(still, 1e-300)))


def model(data: Data, rest: Remainder, part: QuietPart, place: int) -> NoiseModel:
    """The noise of one signal: white where nothing speaks against the level at the highest frequencies."""
    quiet, source, steady = part.there, part.source, False
    flat = float(data.white[place])
    lines = pickup.named(rest.found[place])
    resolution = float(data.rounded[place])
    segments = stretches(rest.noise[:, place], quiet)
    heard = float(rest.single[:, place][np.repeat(quiet, data.group)].std())
    # steps on which a reading rests count by themselves, and more than noise of their size
    stepping = resolution > residuals.STEPPING * max(flat, heard) and data.sigma[place] > resolution
    smooth = data.static and source != "at rest"  # what changes slowly is the error of a law
    if stepping or smooth or not segments or not np.any(rest.noise[:, place]):
        return NoiseModel(flat, lines=lines, resolution=resolution)
    known = before_the_test(data, place)
    if known is not None and known.density is None:
        return replace(known, lines=lines, resolution=resolution)
    if alike(rest.noise[:, place], quiet):
        quiet, source, steady = np.ones_like(quiet), "residual", part.varied > VARIED
        segments = stretches(rest.noise[:, place], quiet)
    if colour.is_white(segments, flat, resolution):
        return NoiseModel(flat, lines=lines, resolution=resolution)
    segments = [piece - piece.mean() for piece in segments]
    density, order = colour.density(segments)
    samples = sum(piece.size for piece in segments)
    rms = float(rest.single[:, place][np.repeat(quiet, data.group)].std())
    gains = colour.gains(density + data.beside[place], data.groups)[:, None]
    tails = colour.heaviness(colour.whitened(rest.noise[:, [place]], gains)[quiet, 0])
    if known is not None and known.density is not None:
        most = known.at_most(density)
        if np.any(density > LOUDER * most):
            return replace(known, lines=lines, resolution=resolution, density=most)
        source = "at rest"
    return NoiseModel(rms, "ar", order, source, lines, resolution, density, samples, tails, steady)


def before_the_test(data: Data, place: int) -> NoiseModel | None:
    """The noise of one signal by its readings at rest before the test, None where none are kept.

    Its level is that of the highest frequencies in the test. It is none where the sensor is far louder or quieter
    there: a pump that did not run, or a converter whose noise lies below its step. So it is where commands that no row
    showed move the part by as much as noise, which they do in the test alone.
    """
    kept = data.part.rest[place] if isinstance(data.part, LaboratoryPart) else None
    flat, interval = float(data.white[place]), data.system.plan.test.interval
    groups = 0 if kept is None else kept.size // data.group
    if kept is None or groups < 2 * colour.SEGMENT or moved_unseen(data)[place]:
        return None
    still = kept - kept.mean()
    still = still - pickup.waves(still, pickup.pickups(still, interval), interval)
    every = np.zeros((still.size, data.white.size))
    every[:, place] = still
    level = float(data.white_part(every)[place])
    if not flat < AS_LOUD * level < AS_LOUD**2 * flat:
        return None
    still *= flat / level
    averaged = still[: groups * data.group].reshape(groups, data.group).sum(axis=1) / math.sqrt(data.group)
    if colour.is_white([averaged], flat, float(data.rounded[place])):
        return NoiseModel(flat, source="at rest")
    density, order = colour.density([averaged])
    gains = colour.gains(density + data.beside[place], groups)[:, None]
    tails = colour.heaviness(colour.whitened(averaged[:, None], gains)[:, 0])
    rms = float(still.std())
    return NoiseModel(rms, "ar", order, "at rest", density=density, samples=groups, tails=tails)


def moved_unseen(data: Data) -> Mask:
    """Which signals (signals,) move by some of their noise where nothing that was recorded says so."""
    return np.asarray(data.part.blurred > UNSEEN * data.white)


def alike(noise: Array, quiet: Mask) -> bool:
    """Whether noise (groups,) is no louder where the part moves more: all of it then tells its colour.

    The variances of its sums over time are held against each other, whitened by the colour of the whole: of slow noise,
    which hardly forgets, two stretches differ by chance. That of slow sums is known least.
    """
    whole = colour.density([noise - noise.mean()])[0]
    white = colour.whitened(noise[:, None], colour.gains(whole, noise.size)[:, None])[:, 0]
    for size in colour.SLOWER:
        still, loud = (colour.summed(stretches(white, mask), size) for mask in (quiet, ~quiet))
        if min(still.size, loud.size) < 8:
            continue
        more = float(np.var(loud)) / max(float(np.var(still)), 1e-300) - 1.0
        sums = colour.summed([white], size)
        one = 2.0 * samples_per_sample(sums - sums.mean())
        if more > SURE * math.sqrt(one / still.size + one / loud.size):
            return False
    return True


def stretches(noise: Array, quiet: Mask) -> list[Array]:
    """The quiet stretches of noise (groups,) that are long enough to show its colour."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]]).astype(np.int8)))
    pieces = [noise[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [piece for piece in pieces if piece.size >= colour.SEGMENT]
