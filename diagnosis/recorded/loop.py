"""The closed loop simulated again with what was found, and the gap that it leaves to the recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from common.recording.reader import share
from common.roles import MASTER, SLAVE
from common.signals import shared
from diagnosis.recorded.record import Record
from diagnosis.signals.mask import Mask
from laboratories.kinds import topics
from loop import closed_loop, substructure
from loop.closed_loop import Exchange
from models.registry import Array
from models.system import System

RESPONSE = ("column_displacement", "column_force", "table_acceleration", "damper_force")
UNIT = {"column_displacement": "m", "column_force": "N", "table_acceleration": "m/s²", "damper_force": "N"}
NOISY = 2  # noisy simulations by which the floor is found
DIVERGED = 10.0  # gap of a simulation that diverges

Signals = dict[str, Array]


@dataclass(frozen=True)
class Loop:
    """The data that all re-simulations of one recording share."""

    record: Record
    ground: Array  # as believed
    exchange: Exchange | None  # as it was, where the link was not as planned
    names: tuple[str, ...]  # response signals that were recorded

    def simulate(self, system: System, *, linked: bool = True, seed: int | None = None) -> Signals | None:
        """Response signals (ticks,) of a system, None where the loop diverges; `linked` with the recorded exchange."""
        believed = self.record.plan.ground_motion.scale
        factor = system.plan.ground_motion.scale / believed if believed else 1.0
        rows = substructure.shifted(
            self.ground * factor, system.effects.time_shift / system.plan.test.interval
        )
        found = simulated(self.record, system, rows, self.exchange if linked else None, seed)
        return None if found is None else {name: found[name] for name in self.names}

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
        self, system: System, levels: Mapping[str, float], mask: Mask | None = None
    ) -> dict[str, float]:
        """Gap that the sensors' noise alone makes: noisy simulations against one without noise."""
        quiet = self.simulate(system)
        noisy = System(noised(system, levels).plan, system.effects)
        squares = dict.fromkeys(self.names, 0.0)
        for seed in range(NOISY):
            loud = self.simulate(noisy, seed=seed)
            if quiet is None or loud is None:
                return dict.fromkeys(self.names, 0.0)
            for name in self.names:
                there = self.record.present[name] if mask is None else self.record.present[name] & mask
                level = float(np.mean(self.record.signals[name][there] ** 2)) or 1.0
                squares[name] += float(np.mean((loud[name][there] - quiet[name][there]) ** 2)) / level / NOISY
        return {name: float(np.sqrt(value)) for name, value in squares.items()}


def simulated(
    record: Record, system: System, ground: Array, exchange: Exchange | None = None, seed: int | None = None
) -> Signals | None:
    """Signals of the closed loop of a record's test by name, None where it diverges.

    Of a test with several slaves those of the master and of the slave that the record shows; the other slaves are what
    they were found to be, or what the plan says.
    """
    whole, ticks = record.whole, record.ticks
    if whole is None:
        role, plan, slaves = SLAVE, system.plan.with_ticks(ticks), None
    else:
        role, plan = whole.role, whole.joined(system.plan).with_ticks(ticks)
        slaves = {one: System(plan.of(one)) for one in plan.roles} | {
            one: replace(given, plan=given.plan.with_ticks(ticks))
            for one, given in (whole.others | {role: system}).items()
        }
    rollout = closed_loop.simulate(
        plan,
        ground,
        effects=system.effects,
        slaves=slaves,
        exchange={role: exchange} if exchange else None,
        seed=seed,
    )
    if not rollout.finite:
        return None
    if whole is None:
        return rollout.master | rollout.slaves[role]
    return share(rollout.master, shared(topics(plan)[MASTER]), role) | rollout.slaves[role]


def noised(system: System, levels: Mapping[str, float]) -> System:
    """The system with sensors as noisy as they were found to be."""
    known = vars(system.plan.sensors)
    return system.moved("sensors", **{name: value for name, value in levels.items() if name in known})


def overall(gaps: Mapping[str, float]) -> float:
    """Rms over the response signals."""
    return float(np.sqrt(np.mean([value**2 for value in gaps.values()]))) if gaps else 0.0


def closed_share(before: float, after: float, floor: float) -> float:
    """Share of the gap above noise that is closed."""
    room = before - floor
    return (before - after) / room if room > 1e-12 else 0.0
