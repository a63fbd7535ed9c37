"""The uncertainty of a diagnosis: parameter covariance, sensor noise, the unexplained rest, and observed ranges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.signal import hilbert

from common.reality.spread import ByRole, SeenRange, Spread, UncertainParameter
from common.roles import MASTER
from diagnosis.findings.certainty.covariances import covariance
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.gaps import RecordingGaps, judging
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Problem
from diagnosis.recorded.loop import NOISY, noised
from diagnosis.signals.mask import Mask
from models.registry import Array

COVERED = 0.9  # share of the time that the band of a prediction is to hold
NORMAL = 1.645  # standard deviations on both sides that contain this share of a normal distribution
HALVINGS = 40  # of the interval in which a share is searched: to a part in 10¹²
LARGEST = 10.0  # share of a signal's envelope beyond which nothing is predicted at all
# Share of the energy of a target's motion that may lie below, and above, the band that counts as observed.
TAIL = 0.005
LOUD = 5.0  # least ratio of peak to noise at which a reading shows how far a laboratory moved


class PartSpread(NamedTuple):
    """The uncertain parameters of one part with their covariance."""

    parameters: tuple[UncertainParameter, ...]
    covariance: Array


def spread(found: Mapping[str, Diagnosis]) -> Spread:
    """The uncertainties of the findings in the diagnoses of one test, by role of the slave."""
    parts = [
        part_spread(item, verdict)
        for place, (role, item) in enumerate(found.items())
        for verdict in item.verdicts
        if verdict.search.data.part.role == role or (place == 0 and verdict.search.data.part.role == MASTER)
    ]
    rest: ByRole = {}
    for item in found.values():
        for role, name, share in left(item):
            of_role = rest.setdefault(role, {})
            of_role[name] = max(share, of_role.get(name, 0.0))
    return Spread(
        tuple(one for part in parts for one in part.parameters),
        np.asarray(block_diag(*(part.covariance for part in parts))) if parts else np.zeros((0, 0)),
        {role: levels for item in found.values() for role, levels in noise(item).items()},
        rest,
        {role: seen for item in found.values() for role, seen in ranges(item).items()},
    )


def part_spread(found: Diagnosis, verdict: PartVerdict) -> PartSpread:
    """The parameters that the fit of a part moved, those of the recording alone left out."""
    fit = verdict.searched.chosen
    problem = Problem(fit.data, fit.values)
    known: list[tuple[int, UncertainParameter, float]] = [
        *nominal(found, fit),
        *of_effects(found, fit, problem),
    ]
    places = [place for place, _, _ in known]
    scales = np.array([scale for _, _, scale in known])
    chosen = covariance(fit)[np.ix_(places, places)] if places else np.zeros((0, 0))
    return PartSpread(tuple(one for _, one, _ in known), chosen * np.outer(scales, scales))


def nominal(found: Diagnosis, fit: Fit) -> Iterator[tuple[int, UncertainParameter, float]]:
    """Nominal parameters: place in the fit, name, and the relative change of the value per unit of the fit."""
    part = fit.data.part
    for place, item in enumerate(part.nuisances):
        if not item.of_record:
            one = UncertainParameter(part.role, item.parameter, storey=item.storey)
            yield place, one, item.tolerance / (1.0 + item.tolerance * float(fit.z[place]))


def of_effects(
    found: Diagnosis, fit: Fit, problem: Problem
) -> Iterator[tuple[int, UncertainParameter, float]]:
    """Parameters of effects: place in the fit, name, and the change of the value per unit of the fit."""
    role = fit.data.part.role
    before = next((lab.before for lab in found.record.labs if lab.role == role), "")
    for place, item in enumerate(problem.frees, start=problem.count):
        parameter = item.parameter
        one = UncertainParameter(
            role,
            parameter.name,
            item.effect.removeprefix(before),
            logarithmic=item.logarithmic,
            least=parameter.least,
            most=parameter.most,
        )
        yield place, one, 1.0 if item.logarithmic else item.scale


def noise(found: Diagnosis) -> ByRole:
    """Rms of the noise of every reading whose noise was found."""
    return {
        lab.role: {
            channel: float(found.white[name])
            for channel, name in zip(lab.kind.channels.names, lab.measured, strict=True)
            if name in found.white
        }
        for lab in found.record.labs
    }


def ranges(found: Diagnosis) -> dict[str, SeenRange]:
    """How far and at which frequencies every laboratory moved."""
    result = {}
    for lab in found.record.labs:
        target = lab.signal(lab.kind.channels.target.name)
        amplitudes = {}
        for channel, name in zip(lab.kind.channels.names, lab.measured, strict=True):
            if found.record.has(name):
                top = float(np.max(np.abs(found.record.signals[name])))
                if top > LOUD * found.white.get(name, 0.0):
                    amplitudes[channel] = top
        if found.record.has(target) and amplitudes:
            series = found.record.signals[target]
            result[lab.role] = SeenRange(amplitudes, band(series, found.record.plan.test.interval))
    return result


def band(series: Array, interval: float) -> tuple[float, float]:
    """Frequencies (Hz) below and above which only a little of a series' energy lies."""
    energy = np.cumsum(np.square(np.abs(np.fft.rfft(series - np.mean(series)))))
    if not energy[-1] > 0.0:
        return 0.0, 0.0
    low, high = np.searchsorted(energy, np.array([TAIL, 1.0 - TAIL]) * energy[-1])
    step = 1.0 / (series.size * interval)
    return float(low * step), float(high * step)


def left(found: Diagnosis) -> Iterator[tuple[str, str, float]]:
    """Role, signal and share of its envelope that is left of every signal that the corrected models predict."""
    own = RecordingGaps(found, found.record, judging(found)[0])
    corrected = found.corrected(plans=found.record.plans)
    if own.loop is not None:
        linked = bool(found.link)
        quiet = own.loop.every(corrected, linked=linked)
        if quiet is None:
            return
        loud = noised(found.record, found.systems(plans=found.record.plans, noisy=False), found.white)
        noisy = [own.loop.every(loud, linked=linked, seed=seed) for seed in range(NOISY)]
        base = own.loop.every(found.systems(plans=found.record.plans, noisy=False), linked=linked)
        spreads = {
            name: float(np.sqrt(np.mean([np.mean((one[name] - base[name]) ** 2) for one in noisy if one])))
            for name in quiet
            if base is not None and any(noisy)
        }
    else:
        quiet, spreads = dict(own.open(corrected)), dict(found.white)
    for name, series in quiet.items():
        if own.record.has(name) and own.record.signals[name].shape == series.shape:
            mask = own.mask & own.record.present[name]
            share = share_left(own.record.signals[name] - series, series, spreads.get(name, 0.0), mask)
            yield (*owner(found, name), share)


def owner(found: Diagnosis, name: str) -> tuple[str, str]:
    """The role that measured or wrote a signal, the master for those of the building, and its name there."""
    for lab in found.record.labs:
        for channel in (*lab.kind.channels.names, lab.kind.channels.command.name):
            if lab.signal(channel) == name:
                return lab.role, channel
    return MASTER, name


def share_left(error: Array, series: Array, rms: float, mask: Mask) -> float:
    """The smallest share of a signal's envelope with which a band holds as often as it should.

    `error` and `series` (ticks, …), `rms` of noise beside it; of several storeys the largest share counts.
    """
    errors, values = (item.reshape(len(mask), -1) for item in (error, series))
    if not mask.any() or not values.size:
        return 0.0
    return max(share_of(errors[:, at], values[:, at], rms, mask) for at in range(values.shape[1]))


def share_of(error: Array, series: Array, rms: float, mask: Mask) -> float:
    """As `share_left`, of one storey."""
    envelope = np.abs(hilbert(series))[mask]
    wrong = np.abs(error[mask])

    def holds(share: float) -> bool:
        return bool(np.mean(wrong <= NORMAL * np.sqrt(rms**2 + (share * envelope) ** 2)) >= COVERED)

    low, high = 0.0, LARGEST
    if holds(low) or not holds(high):
        return low if holds(low) else high
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high
