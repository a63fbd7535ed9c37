"""The verdict on a building: exact where the master used the forces recorded, else by the balance of its forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from diagnosis.findings.verdict import UNNAMED, WITHOUT_GAP, PartVerdict, judge
from diagnosis.fits import fitting, residuals
from diagnosis.fits.residuals import Data
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import search
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import LoggedBuilding, logged
from diagnosis.recorded.parts import Part
from diagnosis.recorded.record import Record
from diagnosis.signals.noise import level

# Ratio of the noise in a balance of forces to that of the forces used, from which on a logger caused it.
# A wrong mass gives a smaller ratio.
OTHERS = 0.7
# Share of a balance's rms below which its content at the highest frequencies belongs to the motion.
SMOOTH = 1e-5


def other_view(part: Part, record: Record, steps: Mapping[str, float]) -> Data | None:
    """A building as one whose forces a logger recorded, None for all else."""
    view = logged(part) if isinstance(part, Building) else None
    return None if view is None else residuals.prepare(view, record, view.rounded(steps))


def verdict_on(data: Data, scales: Scales, view: Data | None = None) -> PartVerdict:
    """The verdict on a part; a building that no effect makes exact is judged as one whose forces a logger recorded.

    It is so from the start where the forces recorded have noise that those used had not.
    """
    if view is None or not own_noise(view):
        verdict = judge(search(data, scales))
        if view is None or verdict.outcome not in UNNAMED:
            return verdict
    return as_planned(by_balance(view, scales))


def by_balance(view: Data, scales: Scales) -> PartVerdict:
    """The verdict on a building's balance: that over longer averages where these show no gap, or explain one.

    What its parameters or forces do shows over these as well. Noise that only the controller read does not: over
    shorter ones it shrinks with the building's parameters, which move by tolerances for that, or is a gap without a
    cause beside what explains all over longer ones.
    """
    part = view.part
    longer = residuals.over_longer(view, part) if isinstance(part, LoggedBuilding) else None
    over_longer = None if longer is None else judge(search(longer, scales))
    if over_longer and over_longer.outcome in WITHOUT_GAP:
        return over_longer
    verdict = judge(search(view, scales))
    explains = over_longer is not None and over_longer.outcome == "explained"
    return over_longer if over_longer and explains and verdict.outcome in UNNAMED else verdict


def as_planned(verdict: PartVerdict) -> PartVerdict:
    """The verdict on a building of which the plan's parameters leave nothing, with these in place of those fitted.

    Fitted ones move by tolerances to make noise smaller that the controller read and the log does not show.
    """
    if verdict.outcome != "none":
        return verdict
    data = verdict.search.data
    planned = fitting.at(data, {}, np.zeros(verdict.search.chosen.z.size))
    return replace(verdict, search=replace(verdict.search, chosen=planned))


def own_noise(data: Data) -> bool:
    """Whether the balance of a building's forces has noise that its motion, and so the forces used, did not have.

    Forces that lie behind a filter or delay of the logger are not those used, whatever their noise.
    """
    if isinstance(data.part, LoggedBuilding) and data.part.behind:
        return True
    used = level.white_rms(data.part.measured)
    least = SMOOTH * np.sqrt(np.mean(np.square(data.part.measured), axis=0))
    return bool(np.any(data.white > np.maximum(OTHERS * used, least)))
