"""The closed loop of a recorded test, simulated with the effects found, and its gap to the recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from common.recording.imported import NOTHING_STATED, ImportedChannel
from common.recording.run import share
from common.roles import MASTER
from common.signals import shared
from diagnosis.recorded.nuisances import channels
from diagnosis.recorded.record import Record
from diagnosis.signals.mask import Mask
from laboratories.kinds import topics
from loop import closed_loop, substructure
from loop.closed_loop import MessagesUsed
from models.registry import Array
from models.system import System

# Noisy simulations from which the noise floor is found: each costs as much as all other simulations of a site.
NOISY = 2
DIVERGED = 10.0  # gap given to a simulation that diverges: far above that of any wrong model that is stable

Signals = dict[str, Array]
Systems = Mapping[str, System]  # master and slave by role


@dataclass(frozen=True)
class RecordedLoop:
    """The data that all re-simulations of one recording share."""

    record: Record
    ground: Array  # rows of the ground motion in the plan
    exchange: MessagesUsed | None  # which message each tick used, where the link was not as planned
    names: tuple[str, ...]  # response signals that were recorded

    def simulate(
        self, systems: Systems, *, linked: bool = True, errors: Mapping[str, Array] | None = None
    ) -> Signals | None:
        """Response signals (ticks,) of systems, as their channels are stated to record them; None where it diverges.

        `linked` with the recorded exchange; `errors` are as `every` takes them.
        """
        found = self.every(systems, linked=linked, errors=errors)
        interval = self.record.plan.test.interval
        if found is None:
            return None
        return {name: self.stated[name].through(found[name], interval) for name in self.names}

    @cached_property
    def stated(self) -> dict[str, ImportedChannel]:
        """The stated properties of the channels of response signals, by signal."""
        labs = self.record.labs
        known = {
            name: one
            for lab in labs
            for name, one in zip(lab.measured, channels(self.record.stated, lab), strict=True)
        }
        return {name: known.get(name, NOTHING_STATED) for name in self.names}

    def every(
        self,
        systems: Systems,
        *,
        linked: bool = True,
        seed: int | None = None,
        errors: Mapping[str, Array] | None = None,
    ) -> Signals | None:
        """All signals of systems by name, otherwise as `simulate`.

        Their readings have the plan's noise with a `seed`, or `errors` (ticks, channels) of single roles.
        """
        believed, system = self.record.plan.ground_motion.scale, systems[MASTER]
        factor = system.plan.ground_motion.scale / believed if believed else 1.0
        rows = substructure.shifted(
            self.ground * factor, system.effects.time_shift / system.plan.test.interval
        )
        return simulated(self.record, systems, rows, self.exchange if linked else None, seed, errors)

    def gap(self, simulated: Mapping[str, Array] | None, mask: Mask | None = None) -> dict[str, float]:
        """rms(recorded − simulated)/rms(recorded) per signal over some of the ticks."""
        if simulated is None:
            return dict.fromkeys(self.names, DIVERGED)
        result = {}
        for name in self.names:
            there = self.record.present[name] if mask is None else self.record.present[name] & mask
            recorded = self.record.signals[name][there]
            level = float(np.sqrt(np.mean(recorded**2))) if recorded.size else 0.0
            error = (
                float(np.sqrt(np.mean((recorded - simulated[name][there]) ** 2))) if recorded.size else 0.0
            )
            result[name] = min(error / level, DIVERGED) if level > 0.0 else 0.0
        return result

    def floor(
        self, systems: Systems, levels: Mapping[str, float], mask: Mask | None = None
    ) -> dict[str, float]:
        """Gap that the sensors' noise alone makes: noisy simulations against one without noise."""
        quiet = self.every(systems)
        noisy = noised(self.record, systems, levels)
        squares = dict.fromkeys(self.names, 0.0)
        for seed in range(NOISY):
            loud = self.every(noisy, seed=seed)
            if quiet is None or loud is None:
                return dict.fromkeys(self.names, 0.0)
            for name in self.names:
                there = self.record.present[name] if mask is None else self.record.present[name] & mask
                level = float(np.mean(self.record.signals[name][there] ** 2)) or 1.0
                squares[name] += float(np.mean((loud[name][there] - quiet[name][there]) ** 2)) / level / NOISY
        return {name: float(np.sqrt(value)) for name, value in squares.items()}


def simulated(
    record: Record,
    systems: Systems,
    ground: Array,
    exchange: MessagesUsed | None = None,
    seed: int | None = None,
    errors: Mapping[str, Array] | None = None,
) -> Signals | None:
    """Signals of the closed loop of a record's test by name, None where it diverges.

    In a test with several slaves these are the signals of the master and of the slave that the record shows; the other
    slaves have the effects that were found in them, or are as the plan says.
    """
    plan = systems[MASTER].plan.with_ticks(record.ticks)
    role = next((one for one in systems if one != MASTER), "")
    others = record.whole.others if record.whole else {}
    given = {one: system for one, system in {**others, **systems}.items() if one != MASTER}
    slaves = {one: System(plan.of(one)) for one in plan.roles} | {
        one: replace(system, plan=system.plan.with_ticks(record.ticks)) for one, system in given.items()
    }
    rollout = closed_loop.simulate(
        plan,
        ground,
        effects=systems[MASTER].effects,
        slaves=slaves,
        exchange={role: exchange} if exchange and role else None,
        seed=seed,
        noise=errors,
    )
    if not rollout.finite:
        return None
    if not role:
        return rollout.master
    mine = share(rollout.master, shared(topics(plan)[MASTER]), role)
    other = record.other
    return mine | {other.signal(name) if other else name: row for name, row in rollout.slaves[role].items()}


def noised(record: Record, systems: Systems, levels: Mapping[str, float]) -> dict[str, System]:
    """The systems with the noise that was found in their sensors, by role."""
    result = dict(systems)
    for lab in record.labs:
        names = zip(lab.kind.channels.names, lab.measured, strict=True)
        known = {channel: levels[name] for channel, name in names if name in levels}
        result[lab.role] = lab.kind.noisy(result[lab.role], known)
    return result


def overall(gaps: Mapping[str, float]) -> float:
    """Rms over the response signals."""
    return float(np.sqrt(np.mean([value**2 for value in gaps.values()]))) if gaps else 0.0


def closed_share(before: float, after: float, floor: float) -> float:
    """Share of the gap above noise that is closed."""
    room = before - floor
    return (before - after) / room if room > 1e-12 else 0.0
