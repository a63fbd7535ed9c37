"""Recordings with made-up latency; the test and the bare loop beside it have the same machine's noise."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from common.recording.run import Run
from common.roles import MASTER, name_of, slave_role
from report.budget.limits import PERCENTILES

INTERVAL = 2e-3
SPIKES = {"ordinary": 0.008, "fifo": 0.0005}  # share of waits in which another process runs first


class Machine:
    """The wake-up times of threads on a machine: mostly tens of microseconds, with occasional spikes."""

    def __init__(self, seed: int, ticks: int, scheduler: str = "ordinary") -> None:
        self.random = np.random.default_rng(seed)
        self.ticks = ticks
        self.spikes = SPIKES[scheduler]

    def body(self, median: float) -> Any:
        return median * self.random.lognormal(0.0, 0.35, self.ticks)

    def wait(self) -> Any:
        spiked = self.random.random(self.ticks) < self.spikes
        return self.body(55e-6) + spiked * self.random.exponential(0.6e-3, self.ticks)


def columns(machine: Machine, delayed: Any = 0.0) -> dict[str, Any]:
    """The latency of every tick; `delayed` (s) is added to the feedback."""
    found = {"wake_lateness": machine.wait(), "compute_time": machine.body(40e-6)}
    for name in ("command_one_way", "slave_time", "feedback_one_way"):
        found[name] = machine.body(50e-6) + machine.wait()
    found["feedback_one_way"] = found["feedback_one_way"] + delayed
    found["round_trip"] = sum(found[name] for name in ("command_one_way", "slave_time", "feedback_one_way"))
    slack = 1.25 * INTERVAL - found["wake_lateness"] - found["compute_time"]
    found["deadline_missed"] = found["round_trip"] > slack
    found["command_sent_ns"] = np.where(found["wake_lateness"] > INTERVAL, 0, 1)
    return found


def bare_loop(machine: Machine) -> dict[str, str]:
    """The metadata record of a bare loop on the machine."""
    lateness = machine.wait()
    late = int(np.sum(lateness >= INTERVAL))
    values: dict[str, float] = {name: np.percentile(lateness, rank) for name, rank in PERCENTILES.items()}
    values |= {"ticks": machine.ticks, "late": late, "interval": INTERVAL, "max": lateness.max()}
    return {f"bare_loop.{name}": repr(float(value)) for name, value in values.items()}


def run(found: dict[str, Any], record: dict[str, str] | None = None, topic: str = "latency") -> Run:
    """A recording of such latency."""
    result = Run(Path("made_up.mcap"), roles=(), finished=True)
    result.metadata = {"real_time": record} if record is not None else {}
    add(result, topic, found)
    return result


def add(result: Run, topic: str, found: dict[str, Any]) -> None:
    """Latency of one more topic, of the slave that belongs to it."""
    result.roles += (slave_role(name_of(topic)),)
    result.columns[topic] = {name: np.asarray(values) for name, values in found.items()}
    result.sequences[topic] = np.arange(len(next(iter(found.values()))))


def ticked(result: Run, ticks: int) -> Run:
    """The recording with the ticks of its master, and a summary that says how many were planned."""
    result.columns[MASTER] = {"seq": np.arange(ticks)}
    result.sequences[MASTER] = np.arange(ticks)
    result.log_ns[MASTER] = np.arange(ticks) * round(INTERVAL * 1e9)
    result.metadata["summary"] = {"ticks_expected": str(ticks)}
    return result


def keep(result: Run, topic: str, rows: Any) -> Run:
    """The recording with only some rows of a topic, by index or mask."""
    result.columns[topic] = {name: values[rows] for name, values in result.columns[topic].items()}
    result.sequences[topic] = result.sequences[topic][rows]
    return result


def clean(seed: int, ticks: int, scheduler: str = "ordinary") -> Run:
    """A recording with noise only."""
    machine = Machine(seed, ticks, scheduler)
    return run(columns(machine), bare_loop(machine))


def delayed(seed: int, ticks: int, scheduler: str = "ordinary") -> Run:
    """A recording with noise in which 2 % of the feedback comes one millisecond later."""
    machine = Machine(seed, ticks, scheduler)
    extra = np.zeros(ticks)
    extra[machine.random.choice(ticks, ticks // 50, replace=False)] = 1e-3
    return run(columns(machine, extra), bare_loop(machine))
