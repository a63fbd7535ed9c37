"""Gaps of one recording: without effects, with the effects found in it or in another recording, and of noise alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from common.recording.logger.passing import later
from diagnosis.findings.found import Diagnosis
from diagnosis.fits import residuals
from diagnosis.fits.worth import SEEN
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.link.exchange import exchange_of
from diagnosis.recorded.loop import RecordedLoop, overall
from diagnosis.recorded.record import Record
from diagnosis.signals.mask import Mask
from models.registry import Array
from models.system import System

QUIET = 0.2  # noise over a signal's rms from which on a gap relative to that rms is mostly noise, and is not judged


# data of a recording itself on which its gap is judged
INTERLEAVED, SAME = "interleaved (interpolation)", "same seconds"


def saw_all(found: Diagnosis) -> bool:
    """Whether fits saw the whole recording, since a gap showed in too few seconds to withhold any."""
    return any(bool(verdict.searched.data.train.all()) for verdict in found.verdicts)


def judging(found: Diagnosis) -> tuple[Mask, str]:
    """The ticks of a recording by which its gap is judged, and what is said of them.

    They are those that no fit has used, or all where fits saw all.
    """
    record = found.record
    if saw_all(found):
        return np.ones(record.ticks, dtype=bool), SAME
    return residuals.withheld_ticks(record.ticks, record.plan.test.interval), INTERLEAVED


class RecordingGaps:
    """Gaps of one recording under the hypotheses found in another, or in the same."""

    def __init__(self, found: Diagnosis, record: Record, mask: Mask) -> None:
        self.found, self.record, self.mask = found, record, mask
        names = tuple(name for name in record.responses if record.has(name))
        self.loop: RecordedLoop | None = None
        if record.simulable and record.has(*record.targets) and names and record.ground is not None:
            exchange = (
                exchange_of(record.run, record.ticks, record.plan.test.interval) if found.link else None
            )
            self.loop = RecordedLoop(record, record.ground, exchange, names)
        own = record is found.record
        whole = [verdict.search.data.part for verdict in found.verdicts] if own else parts_of(record)
        self._parts = [part for part in whole if not part.exact]
        # where each reading judges: without the loop not where it follows from commands that are missing
        self._there = dict(record.present)
        if self.loop is None:
            for part in self._parts:
                self._there |= dict(zip(part.signals, part.present.T, strict=True))

    @property
    def judges(self) -> bool:
        """Whether the recording can judge a finding: by its closed loop, or by parts that were judged elsewhere too."""
        known = {name for verdict in self.found.verdicts for name in verdict.search.data.part.signals}
        return self.loop is not None or any(known & set(part.signals) for part in self._parts)

    def signals(
        self, sites: frozenset[str] | None, left: Mapping[str, Array] | None = None
    ) -> Mapping[str, Array] | None:
        """Simulated response with the effects of some sites, of all where None.

        To its readings is added what no effect explains of them and is `left` (ticks,), by signal.
        """
        linked = sites is None or "link" in sites
        return self.simulated(self.found.systems(sites, self.record.plans), linked=linked, left=left)

    def simulated(
        self, systems: Mapping[str, System], *, linked: bool = True, left: Mapping[str, Array] | None = None
    ) -> Mapping[str, Array] | None:
        """Simulated response of systems behind the logger, with the exchange that was found where `linked`.

        What is `left` of readings goes round the loop.
        """
        more = left or {}
        if self.loop is not None:
            linked = linked and bool(self.found.link)
            rows = self.loop.simulate(systems, linked=linked, errors=self.errors(more))
            return None if rows is None else self.logged(rows)
        return {name: values + more.get(name, 0.0) for name, values in self.open(systems).items()}

    def errors(self, left: Mapping[str, Array]) -> dict[str, Array]:
        """What is left of readings by signal, as rows (ticks, channels) of the laboratories that have any, by role."""
        none = np.zeros(self.record.ticks)
        return {
            lab.role: np.column_stack([left.get(name, none) for name in lab.measured])
            for lab in self.record.labs
            if any(name in left for name in lab.measured)
        }

    def logged(self, simulated: Mapping[str, Array]) -> Mapping[str, Array]:
        """Simulated readings as the logger that was found has them: late, and with its gain, unless they diverge."""
        if self.record.stated is None:
            return simulated
        interval = self.record.plan.test.interval
        result = dict(simulated)
        for name, (delay, gain) in self.found.logger.items():
            if name in result and np.isfinite(result[name]).all():
                result[name] = gain * later(result[name], delay / interval)
        return result

    def nominal(self) -> Mapping[str, Array] | None:
        """Response of the nominal models, without what a logger did to it."""
        systems = self.record.systems
        if self.loop is not None:
            return self.loop.simulate(systems, linked=False)
        return self._parted(systems)

    def _parted(self, systems: Mapping[str, System]) -> dict[str, Array]:
        """Each part's own prediction from what was recorded of its input."""
        result: dict[str, Array] = {}
        for part in self._parts:
            result |= dict(zip(part.signals, part.predict(systems[part.role]).T, strict=True))
        return result

    def open(self, systems: Mapping[str, System]) -> Mapping[str, Array]:
        """Each part's own prediction behind the logger, from what was recorded of its input."""
        return self.logged(self._parted(systems))

    def gap(self, simulated: Mapping[str, Array] | None, mask: Mask | None = None) -> dict[str, float]:
        """Gap per response signal."""
        chosen = self.mask if mask is None else mask
        if self.loop is not None:
            return self.loop.gap(simulated, chosen)
        known = simulated or {}
        names = [
            name
            for name in self.record.responses
            if name in known and self.record.has(name) and self.moves(name) and self._there[name].any()
        ]
        result = {}
        for name in names or [name for name in known if self.record.has(name) and self._there[name].any()]:
            there = self._there[name] & chosen
            recorded = self.record.signals[name][there]
            error = recorded - known[name][there]
            level = float(np.mean(recorded**2)) if recorded.size else 0.0
            with np.errstate(over="ignore"):  # of a simulation that diverges
                result[name] = float(np.sqrt(np.mean(error**2) / level)) if level > 0.0 else 0.0
        return result

    def between(self, one: Mapping[str, Array] | None, other: Mapping[str, Array] | None) -> float:
        """Rms of the difference of two simulated responses over that of the recorded one, over all response signals."""
        if one is None or other is None:
            return math.inf
        apart = {name: self.record.signals[name] + other[name] - one[name] for name in self.gap(one)}
        return overall(self.gap(apart))

    def moves(self, name: str) -> bool:
        """Whether a signal stands well out of its noise."""
        level = float(np.sqrt(np.mean(self.record.signals[name] ** 2)))
        return level > 0.0 and self.found.white.get(name, 0.0) < QUIET * level

    def changes(self, name: str, known: Sequence[Mapping[str, Array]]) -> bool:
        """Whether two predictions of a signal differ by more than its noise hides."""
        apart = (known[1][name] - known[0][name])[self.mask]
        return float(np.sqrt(np.mean(apart**2))) > SEEN * self.found.white.get(name, 0.0)

    def floor(self) -> dict[str, float]:
        """Gap that noise alone makes, with the lines that sensors pick up."""
        found = self.found
        if self.loop is None:
            return {name: self.over(name, found.noise(name)) for name in found.white if name in self._there}
        systems = found.systems(plans=self.record.plans, noisy=False)
        noisy = self.loop.floor(systems, found.white, self.mask)
        lines = {name: self.over(name, found.lines.get(name, 0.0)) for name in noisy}
        return {name: math.hypot(value, lines[name]) for name, value in noisy.items()}

    def over(self, name: str, rms: float) -> float:
        """An rms of a reading's unit over that of the reading where the gap is judged, 0 where it has none."""
        there = self._there[name] & self.mask
        level = float(np.mean(self.record.signals[name][there] ** 2)) if there.any() else 0.0
        return rms / math.sqrt(level) if level > 0.0 else 0.0
