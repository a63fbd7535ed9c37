"""The exchange between the laboratories, read off the numbers of the messages that were used, never off waveforms.

At tick k a laboratory uses the newest message that is there. With independent extra delays the message
that is j ticks old has not come yet with probability G(j), so ages a have P(age > a) = G(0)·G(1)·…·G(a), and

    G(j) = p + (1 − p)·Q((j·dt − delay)/σ)

with loss p, delay and jitter σ, Q the normal tail. Where every message that comes is equally old nothing
scatters: what is missing then is lost, and its runs are the bursts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import ndtr

from common.recording.reader import Run
from diagnosis.record import Mask, laid_out
from models.closed_loop import Exchange

Index = NDArray[np.int64]

LATE = 0.3  # of an interval: a tick that woke later than that says nothing of the network
SPOILT = 2  # ticks after such a tick that say nothing either
RARE = 3e-4  # share of old messages below which the link is as planned; of a run in real time ten times that
STEADY = 0.98  # share of fresh messages of one age from which on nothing scatters
WORTH = 8.0  # gain of twice the log-likelihood that a further parameter must bring


class Direction(NamedTuple):
    """The messages of one direction that were used."""

    ages: Index  # (n,) ticks beyond the plan's, at ticks that count
    fresh: Index  # (m,) the same of messages used for the first time
    missing: list[int]  # lengths of runs of numbers that were never used


class Account(NamedTuple):
    """Both directions, and how the ticks were paced."""

    directions: tuple[Direction, ...]
    real_time: bool
    interval: float


class Finding(NamedTuple):
    """An effect of the link."""

    effect: str
    parameters: dict[str, tuple[float, tuple[float, float]]]
    evidence: str
    z: float  # standard deviations above what the plan's link would show


def account(run: Run, interval: float) -> Account:
    """What a recording's message numbers say; needs the topics of master and slave."""
    good, real_time = steady_ticks(run, interval)
    pairs = (("slave", "command_seq", 0), ("master", "damper_force_seq", 1))
    found = []
    for topic, name, nominal in pairs:
        if run.has(topic) and name in run.columns[topic]:
            found.append(direction(run.sequences[topic], run.columns[topic][name], nominal, good))
    return Account(tuple(found), real_time, interval)


def steady_ticks(run: Run, interval: float) -> tuple[Mask, bool]:
    """Ticks at which both laboratories were in time, and whether there was a clock to be late by."""
    ticks = 1 + max(int(values.max()) for values in run.sequences.values() if values.size)
    good = np.ones(ticks, dtype=bool)
    if not run.has("latency"):
        return good, False
    lateness = np.nan_to_num(run.columns["latency"]["wake_lateness"])
    late = run.sequences["latency"][lateness > LATE * interval]
    if "command_sent_ns" in run.columns["latency"]:
        late = np.union1d(late, run.sequences["latency"][run.columns["latency"]["command_sent_ns"] == 0])
    for after in range(SPOILT + 1):
        good[np.clip(late + after, 0, ticks - 1)] = False
    return good, bool(np.any(lateness != 0.0))


def direction(ticks: Index, used: NDArray[np.float64], nominal: int, good: Mask) -> Direction:
    """Ages and holes of one direction; `used` is −1 until the first message has come."""
    numbers = used.astype(np.int64)
    there = (numbers >= 0) & good[ticks]
    ages = (ticks - nominal - numbers)[there]
    new = np.flatnonzero((np.diff(numbers, prepend=-1) > 0) & there)
    steps = np.diff(numbers[np.flatnonzero(np.diff(numbers, prepend=-1) > 0)])
    return Direction(ages, (ticks - nominal - numbers)[new], [int(step) - 1 for step in steps if step > 1])


def findings(found: Account, interval: float) -> list[Finding]:
    """Effects of the link with their parameters and intervals, none where it did what the plan says."""
    ages = np.concatenate([item.ages for item in found.directions] or [np.zeros(0, dtype=np.int64)])
    if ages.size == 0:
        return []
    old = float(np.mean(ages > 0))
    if old < (10.0 if found.real_time else 1.0) * RARE:
        return []
    fresh = np.concatenate([item.fresh for item in found.directions])
    usual = int(np.median(fresh))
    if float(np.mean(fresh == usual)) >= STEADY:
        return steady(found, usual, interval)
    return scattered(ages, interval)


def steady(found: Account, usual: int, interval: float) -> list[Finding]:
    """Every message that comes takes equally long: a delay of whole ticks, and losses seen one by one."""
    result = []
    if usual > 0:
        bounds = ((usual - 1) * interval, usual * interval)
        text = f"every message is used {usual} ticks after its own"
        result.append(Finding("link.delay", {"delay": (sum(bounds) / 2.0, bounds)}, text, float(100 * usual)))
    lost = np.array([run for item in found.directions for run in item.missing], dtype=np.float64)
    total = sum(item.ages.size for item in found.directions)
    share = float(lost.sum()) / max(total, 1)
    if share >= RARE * (10.0 if found.real_time else 1.0):
        burst = float(lost.mean())
        error = 1.96 * math.sqrt(share * (1.0 - share) * (2.0 * burst - 1.0) / total)
        wide = 1.96 * float(lost.std()) / math.sqrt(lost.size)
        values = {
            "probability": (share, (max(share - error, 0.0), share + error)),
            "burst": (burst, (max(burst - wide, 1.0), burst + wide)),
        }
        text = f"{lost.sum():.0f} messages of {total} were never used, those that came were on time"
        result.append(Finding("link.loss", values, text, share / max(error / 1.96, 1e-12)))
    return result


def tail(p: tuple[float, float, float], ages: NDArray[np.float64], interval: float) -> NDArray[np.float64]:
    """G(j) for delay (s), jitter (s) and loss."""
    delay, jitter, loss = p
    late = ndtr(-(ages * interval - delay) / max(jitter, 1e-9))
    return np.clip(loss + (1.0 - loss) * late, 1e-9, 1.0 - 1e-9)


def scattered(ages: Index, interval: float) -> list[Finding]:
    """Delay, jitter and loss from the ages' distribution, each kept where it is needed."""
    counts = np.bincount(np.clip(ages, 0, None)).astype(np.float64)
    places = np.arange(counts.size, dtype=np.float64)
    beyond = counts.sum() - np.cumsum(counts)

    def unlikely(p: tuple[float, float, float]) -> float:
        g = tail(p, places, interval)
        return -2.0 * float(np.sum(beyond * np.log(g) + counts * np.log1p(-g)))

    best, cost = fitted(unlikely, (True, True), interval, counts)
    for free in ((False, False), (True, False), (False, True)):
        simpler, more = fitted(unlikely, free, interval, counts)
        if more < cost + WORTH * (2 - sum(free)):
            best, cost = simpler, more
            break
    delay, jitter, loss = best
    spread = 4.0 / math.sqrt(counts.sum())
    names = (
        ("link.jitter", "std", jitter),
        ("link.delay", "delay", delay),
        ("link.loss", "probability", loss),
    )
    text = f"the age of messages scatters over {int(np.count_nonzero(counts))} ticks"
    found = []
    for effect, key, value in names:
        if value > 0.0:
            wide = spread * max(value, jitter if key != "probability" else 0.0) + (
                spread if key == "probability" else 0.0
            )
            values = {key: (value, (max(value - wide, 0.0), value + wide))}
            if key == "probability":
                values["burst"] = (1.0, (1.0, math.inf))
            found.append(Finding(effect, values, text, value / wide * 2.0))
    return found


def fitted(
    unlikely: object, free: tuple[bool, bool], interval: float, counts: NDArray[np.float64]
) -> tuple[tuple[float, float, float], float]:
    """Most likely (delay, jitter, loss) with delay and loss free or zero, and −2·log-likelihood there."""
    mean = float(counts @ np.arange(counts.size) / counts.sum()) * interval

    def cost(p: NDArray[np.float64]) -> float:
        delay = math.exp(p[1]) if free[0] else 0.0
        loss = 1.0 / (1.0 + math.exp(-p[2])) if free[1] else 0.0
        return unlikely((delay, math.exp(p[0]), loss))  # type: ignore[operator]

    start = [math.log(max(mean, 0.1 * interval)), math.log(max(mean, 0.1 * interval)), -5.0]
    found = minimize(
        cost, start, method="Nelder-Mead", options={"maxiter": 2000, "xatol": 1e-5, "fatol": 1e-4}
    )
    p = found.x
    delay = math.exp(p[1]) if free[0] else 0.0
    loss = 1.0 / (1.0 + math.exp(-p[2])) if free[1] else 0.0
    return (delay, math.exp(p[0]), loss), float(found.fun)


def exchange_of(run: Run, ticks: int) -> Exchange:
    """Which message each tick used, as recorded; where a tick is missing, the one before serves on."""
    result = []
    for topic, name in (("slave", "command_seq"), ("master", "damper_force_seq")):
        values, there = laid_out(run.columns[topic][name].astype(np.float64), run.sequences[topic], ticks)
        result.append(
            np.minimum(np.where(there.cumsum() > 0, values, -1.0).astype(np.int64), np.arange(ticks))
        )
    return Exchange(*result)
