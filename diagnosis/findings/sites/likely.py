"""The site from which residuals most likely come: that whose signature leaves least beside it.

Per band of frequencies residuals in σ are split into the share along a site's signature, which is an unknown series of
any size, and the rest, which must be noise. Nominal parameters move within their tolerances beside the series.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.plan.kinds import COLUMN
from diagnosis.findings.sensors.common_noise import in_common
from diagnosis.findings.sites import functions
from diagnosis.findings.sites.signatures import Signature, Spectrum, signatures
from diagnosis.fits import fitting, hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import TOLERANCES
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.residuals import Data
from diagnosis.recorded.joined import laboratory_of
from diagnosis.recorded.parts import LaboratoryPart
from laboratories.effects.sites import is_sensor
from loop import replay
from models.registry import Array
from models.system import System

# Of a residual's rms in a band, by which a signature may err: nominal parameters are known to 2 %, and the phase of a
# damped resonance reacts to them several times as much.
ERRING = 0.05
# Nats by which sites differ that can be told apart. Of 24 unknown effects outside this repository the true site led by
# more than 60 nats wherever any reading differs; of noise the differences scatter by 3 to 5.
APART = 15.0
SCATTER = 5.0  # the largest of these
# Nats that speak against a rare cause from the start, so that by the same trial it counts only where a reading differs.
RARE = 60.0
# Share of a gap's energy that the true mechanism may leave under another law. A stand-in rarely leaves less: on the
# set "tune" and on effects of no catalogue stand-ins explained 0.59 to 0.93 of it where no nominal parameter was at its
# bound, true mechanisms 0.95 to 1.00.
TRUE_LEAVES = 0.06
# Times what a force is missed by when the plan's command moves its specimen, below which the motion that was read tells
# it: a fault of specimen or load cell leaves as much by either, and one of the actuator what tolerances leave.
NEARER = 0.5
NARROWEST, RELATIVE, FEWEST = 0.5, 6.0, 4  # bands: Hz, frequency over width, and lines at least
END = 1.5  # s, over which the end is faded out, so that a motion that goes on there does not wrap around
ROUNDS = 3  # in which parameters and the bands' energies are found in turn


class LikelySite(NamedTuple):
    """A site with what speaks against it."""

    site: str
    cost: float  # nats beyond the likeliest site
    left: float  # share of the residuals' energy beyond noise that its signature leaves


class Spectra(NamedTuple):
    """Residuals of a fit in σ by frequency, and how they change with the nominal parameters."""

    frequencies: Array  # (lines,) Hz
    edges: NDArray[np.int64]  # first lines of the bands, and the end of the last one
    scale: Array  # (lines, signals) from a reading's unit to σ
    residual: Spectrum  # (lines, signals) of unit variance for noise
    slopes: Spectrum  # (lines, signals, nuisances)
    z: Array  # (nuisances,)


def likely_sites(fit: Fit) -> tuple[str, ...]:
    """The sites that the residuals of a fit cannot tell apart; none where no signature is known.

    The machines come first, but a sensor before one where the residuals are likelier functions of what it reads than
    forces there. At a machine of which an effect is named that is not asked: what is left is its law's.
    """
    near = [item.site for item in ranked(fit) if item.cost < APART]
    order = sorted(near, key=is_sensor)
    part = laboratory_of(fit.data.part)
    if part is None:
        return tuple(order)
    explained = {fit.data.catalogue[name].site for name in fit.names}
    leads = {
        (sensor, machine): functions.lead(fit, part, sensor, machine)
        for sensor in order
        for machine in order
        if is_sensor(sensor) and not is_sensor(machine) and machine not in explained
    }
    beaten = {
        machine if nats > 0.0 else sensor for (sensor, machine), nats in leads.items() if abs(nats) > APART
    }
    for (sensor, machine), nats in leads.items():
        if nats > SCATTER and order.index(sensor) > order.index(machine):
            order.remove(sensor)
            order.insert(order.index(machine), sensor)
    return tuple(site for site in order if site not in beaten)


def ranked(fit: Fit) -> list[LikelySite]:
    """The sites of a laboratory by what speaks against them, the likeliest first.

    Where noise was taken to be white because its colour may hide a gap, the colour that all readings have is none of
    the gap: without it the reading with the loudest noise would be the likeliest site.
    """
    part = laboratory_of(fit.data.part)
    if part is None:
        return []
    if not sensor_noise.coloured(fit.data):
        fit = fitting.at(in_common(fit), fit.values, fit.z)
    given = spectra(fit)
    system = hypothesis.lay(fit.data, fit.z, fit.values)
    exact = follows_motion(part, system)
    found = [
        site_cost(given, item)
        for item in signatures(part, system, given.frequencies)
        if item.site not in exact
    ]
    rows = sorted((item for item in found if item is not None), key=lambda item: item.cost)
    best: dict[str, LikelySite] = {}
    for row in rows:
        best.setdefault(row.site, row._replace(cost=row.cost - rows[0].cost))
    return list(best.values())


def follows_motion(part: LaboratoryPart, system: System) -> tuple[str, ...]:
    """The sites of a specimen and its load cell where its force follows from the motion that was read, else none.

    A signature is of small changes. Where a specimen yields, what shakes its actuator changes where it stands
    afterwards, and its force with that.
    """
    lab = part.lab
    if lab.kind.name != COLUMN or not part.present.any(axis=0).all():
        return ()
    motion, force = part.measured.T
    there = part.present.all(axis=1)
    by_motion = (force - replay.column(system, motion))[there]
    by_command = (force - part.predict(system)[:, 1])[there]
    if float(np.linalg.norm(by_motion)) > NEARER * float(np.linalg.norm(by_command)):
        return ()
    return lab.site(COLUMN), lab.sensor(lab.kind.channels.force)


def spectra(fit: Fit) -> Spectra:
    """The spectra of a fit's residuals, of the readings that were recorded."""
    data = fit.data
    interval = data.system.plan.test.interval * data.group
    count, signals = fit.reduced.shape
    fade = min(count // 5, max(1, round(END / interval)))
    window = np.ones(count)
    window[-fade:] = 0.5 * (1.0 + np.cos(np.pi * (np.arange(fade) + 1.0) / fade))
    size = float(np.sqrt(np.sum(window**2)))
    slopes = fit.jacobian[:, : fit.z.size].reshape(count, signals, fit.z.size)
    frequencies: Array = np.asarray(np.fft.rfftfreq(count, interval), dtype=np.float64)
    there = np.asarray(data.part.present.any(axis=0))
    return Spectra(
        frequencies,
        bands(frequencies),
        np.where(there, whitening(data, frequencies.size) / data.sigma, 0.0),
        np.fft.rfft(fit.reduced * window[:, None], axis=0) * there / size,
        np.fft.rfft(slopes * window[:, None, None], axis=0) * there[:, None] / size,
        fit.z,
    )


def whitening(data: Data, lines: int) -> Array:
    """Factors (lines, signals) that made the noise of residuals white."""
    if data.factors is None:
        return np.ones((lines, data.sigma.size))
    ours, theirs = np.arange(lines) / max(lines - 1, 1), np.arange(data.groups) / data.groups
    return np.stack([np.interp(ours, theirs, column) for column in data.factors.T], axis=1)


def bands(frequencies: Array) -> NDArray[np.int64]:
    """The first lines of bands that grow with the frequency, and the end of the last one; the mean is left out."""
    edges = [1]
    while edges[-1] < frequencies.size:
        low = float(frequencies[edges[-1]])
        end = int(np.searchsorted(frequencies, low + max(NARROWEST, low / RELATIVE)))
        edges.append(min(frequencies.size, max(edges[-1] + FEWEST, end)))
    return np.array(edges)


def site_cost(given: Spectra, signature: Signature) -> LikelySite | None:
    """A site with what speaks against it, up to a constant of all sites; None where no recorded reading shows it."""
    columns = signature.readings * given.scale
    length = np.linalg.norm(columns, axis=1)
    if not np.any(length[1:] > 0.0):
        return None
    unit = columns / np.maximum(length, 1e-300)[:, None]
    along = np.einsum("fp,fpk->fk", unit.conj(), given.slopes)
    beside = given.slopes - unit[:, :, None] * along[:, None, :]
    moved = np.zeros(given.z.size)
    for turn in range(ROUNDS + 1):
        residual = given.residual + given.slopes @ moved
        share = np.einsum("fp,fp->f", unit.conj(), residual)
        rest = residual - share[:, None] * unit
        said = mean(given.edges, np.abs(share) ** 2)
        left = mean(given.edges, np.sum(np.abs(rest) ** 2, axis=1))
        others = max(int(np.any(given.scale > 0.0, axis=0).sum()) - 1, 1)
        noise = 1.0 + ERRING**2 * (said + left) / others
        if turn < ROUNDS:
            weights = (spread(given.edges, np.maximum(said, 1.0)), spread(given.edges, noise))
            moved = settled(given, unit, along, beside, weights)
    lines = np.diff(given.edges)
    series = np.log(np.maximum(said, 1.0)) + np.minimum(said, 1.0)
    remainder = others * np.log(noise) + left / noise
    cost = float(lines @ (series + remainder) + 0.5 * np.sum((given.z + moved) ** 2)) + RARE * signature.rare
    beyond, whole = (
        float(lines @ np.maximum(item, 0.0)) for item in (left - others, said + left - others - 1.0)
    )
    return LikelySite(signature.site, cost, beyond / whole if whole > 0.0 else 1.0)


def settled(
    given: Spectra, unit: Spectrum, along: Spectrum, beside: Spectrum, weights: tuple[Array, Array]
) -> Array:
    """By how much the nominal parameters move (nuisances,), under the variances along a signature and beside it."""
    one, other = (np.sqrt(2.0 / item) for item in weights)
    inside = slice(int(given.edges[0]), int(given.edges[-1]))
    share = np.einsum("fp,fp->f", unit.conj(), given.residual)
    rest = given.residual - share[:, None] * unit
    count = given.z.size
    matrix = np.concatenate(
        [one[:, None] * along[inside], (other[:, None, None] * beside[inside]).reshape(-1, count)]
    )
    target = -np.concatenate([one * share[inside], (other[:, None] * rest[inside]).ravel()])
    found = np.linalg.lstsq(
        np.concatenate([matrix.real, matrix.imag, np.eye(count)]),
        np.concatenate([target.real, target.imag, -given.z]),
        rcond=None,
    )[0]
    return np.asarray(np.clip(given.z + found, -TOLERANCES, TOLERANCES) - given.z)


def mean(edges: NDArray[np.int64], values: Array) -> Array:
    """Means (bands,) over bands of values (lines,)."""
    return np.asarray(np.add.reduceat(values, edges[:-1]) / np.diff(edges))


def spread(edges: NDArray[np.int64], values: Array) -> Array:
    """Values (bands,) for every line of the bands."""
    return np.repeat(values, np.diff(edges))
