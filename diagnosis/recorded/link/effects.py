"""Effects of the link with their parameters: delay, jitter and loss, as the account of the messages shows them."""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import beta

from diagnosis.recorded.link.ages import LEAST_OLD, scattered
from diagnosis.recorded.link.exchange import (
    CERTAIN,
    LEAST_STAMPS,
    TINY,
    Direction,
    LinkAccount,
    LinkFinding,
    certainty,
    scatters,
)
from models.registry import Array

LEAST_LOST = 3  # messages on a real clock: one or two may be lost when a process starts or ends
# Of messages lost where there are no time stamps, by which a late message looks like a lost one.
LEAST_SHARE = 0.005
LEAST_RUNS = (
    3  # of two and more messages without a successor in time, from which on fewer are taken for lost as well
)
LEAST_OFF = 0.001  # share of messages off the usual age, without time stamps, from which on delays scatter
REAL = 0.1  # of an interval: scatter and delay of which a real clock's time stamps are certain
QUICK = 0.25  # of an interval, most of the clocks' error that is taken away from a delay: a fast network's own delay
CLEAR = 2.5  # errors, of two standard deviations each, by which a delay must exceed zero
SYMMETRIC = 0.5  # skewness up to which the constant part of a delay is its mean, not its minimum; an exponential has 2
STAMP = 1e-9  # s: stamps are whole nanoseconds, so that a difference of two is known to one


def findings(found: LinkAccount, interval: float) -> list[LinkFinding]:
    """Effects of the link with their parameters and intervals, none where it was as the plan says."""
    if found.stamped and found.feedback is not None:
        result = [delayed(found, interval), jittered(found, interval), lossy(found)]
    elif any(1.0 - item.steady > LEAST_OFF for item in found.directions):
        return scattered(np.concatenate([item.ages for item in found.directions]), interval)
    else:
        result = [aged(found, interval), lossy(found)]
    return [item for item in result if item is not None]


def known(found: LinkAccount) -> list[Array]:
    """One-way times of each direction."""
    return [item.one_way for item in found.directions if item.one_way.size >= LEAST_STAMPS]


def whole(found: LinkAccount) -> list[Array]:
    """One-way times of directions in which slow messages are known as well; of all where none of these scatters."""
    chosen = [item.one_way for item in found.directions if not item.selected and scatters(item.one_way)]
    return chosen or known(found)


def constant(times: Array) -> tuple[float, float]:
    """The part of a delay that all messages have, and its error (two standard deviations), s.

    The least time where the scatter is one-sided; its mean where it is symmetric, as of noise about a delay.
    """
    centred, spread = times - times.mean(), float(times.std())
    if spread > TINY and float(np.mean(centred**3)) < SYMMETRIC * spread**3:
        return float(times.mean()), 2.0 * spread / math.sqrt(times.size)
    return float(times.min()) - spread / times.size, 4.0 * spread / times.size


def delayed(found: LinkAccount, interval: float) -> LinkFinding | None:
    """A constant delay, if the one-way times have one that the plan's link has not."""
    parts = [constant(item) for item in known(found)]
    if not parts:
        return None
    value = float(np.mean([part for part, _ in parts]))
    error = max(error for _, error in parts) + STAMP
    if found.virtual:
        there = value > max(CLEAR * error, TINY)
    else:
        quick = min(found.bound, QUICK * interval)
        old = max(float(np.median(item.fresh)) if item.fresh.size else 0.0 for item in found.directions)
        there = old >= 1.0 and value - quick > max(CLEAR * error, REAL * interval)
        error += found.bound
    if not there:
        return None
    bounds = (
        max(min(part for part, _ in parts) - error, 0.0),
        max(part for part, _ in parts) + error,
    )
    each = " and ".join(f"{1e3 * part:.3f} ms" for part, _ in parts)
    text = f"every message takes at least {each} one way ({', '.join(ways(found))})"
    return LinkFinding("link.delay", {"delay": (value, bounds)}, text, certainty(value, error / 2.0))


def ways(found: LinkAccount) -> list[str]:
    """Each direction's median one-way time, in words."""
    named = (("command", found.command), ("feedback", found.feedback))
    return [
        f"median {name} {1e3 * float(np.median(item.one_way)):.3f} ms"
        for name, item in named
        if item is not None and item.one_way.size
    ]


def jittered(found: LinkAccount, interval: float) -> LinkFinding | None:
    """Jitter, if the one-way times scatter."""
    groups = [item - item.mean() for item in whole(found)]
    centred = np.concatenate(groups or [np.zeros(1)])
    value = float(centred.std())
    if found.virtual:
        there = value > TINY
    else:
        low, high = np.percentile(centred, [25.0, 75.0])
        moved = any(item.usual > 0 or 1.0 - item.steady > LEAST_OLD for item in found.directions)
        there = high - low > REAL * interval and moved
    if not there:
        return None
    kurtosis = float(np.mean(centred**4)) / value**4
    error = value * math.sqrt(max(kurtosis - 1.0, 0.1) / (4.0 * centred.size))
    bounds = (max(value - 1.96 * error, 0.0), value + 1.96 * error)
    late = sum(item.overtaken for item in found.directions)
    text = f"one-way times scatter by {1e3 * value:.3f} ms; {late} feedbacks arrived after a later one"
    return LinkFinding("link.jitter", {"std": (value, bounds)}, text, certainty(value, error))


def aged(found: LinkAccount, interval: float) -> LinkFinding | None:
    """A constant delay in recordings without time stamps, known to a whole tick."""
    usual = [item.usual for item in found.directions]
    if not usual or max(usual) == 0:
        return None
    bounds = (max(min(usual) - 1, 0) * interval, max(usual) * interval)
    text = f"messages are used {' and '.join(map(str, usual))} ticks late; there are no time stamps to tell it closer"
    return LinkFinding("link.delay", {"delay": (sum(bounds) / 2.0, bounds)}, text, CERTAIN)


def lossy(found: LinkAccount) -> LinkFinding | None:
    """Loss, if messages never arrived: a two-state Markov chain, by its share of lost messages and their mean run."""
    tried = sum(item.tried.size for item in found.directions)
    lost = sum(int(item.lost.sum()) for item in found.directions)
    least = 1 if found.virtual else LEAST_LOST
    several = sum(map(runs_of_several, found.directions)) >= LEAST_RUNS
    if lost < least or (not found.stamped and lost < LEAST_SHARE * tried and not several):
        return None
    followed, ended = np.sum([runs(item) for item in found.directions], axis=0)
    share, leave = lost / tried, max(ended, 0.5) / followed if followed else 1.0
    memory = max(1.0 - leave - leave * share / max(1.0 - share, 1e-9), 0.0)
    heavy = (1.0 - memory) / (1.0 + memory)  # of the messages count as independent
    a, b = lost * heavy + 0.5, (tried - lost) * heavy + 0.5
    low, high = beta.ppf((0.025, 0.975), a, b)
    quick, slow = beta.ppf((0.975, 0.025), ended + 0.5, followed - ended + 0.5)
    values = {
        "probability": (share, (float(min(low, share)), float(max(high, share)))),
        "burst": (
            float(1.0 / leave),
            (float(min(1.0 / quick, 1.0 / leave)), float(max(1.0 / slow, 1.0 / leave))),
        ),
    }
    late = "" if found.stamped else " in time: without time stamps late ones look like lost ones"
    text = f"{lost} of {tried} messages never arrived{late}"
    return LinkFinding("link.loss", values, text, certainty(math.sqrt(lost * heavy), 1.0))


def runs_of_several(item: Direction) -> int:
    """Number of runs of two and more lost messages; late ones come one by one."""
    pairs = item.lost[:-1] & item.lost[1:] & (np.diff(item.tried) == 1)
    return int(np.sum(pairs & ~np.append(False, pairs)[:-1]))


def runs(item: Direction) -> tuple[int, int]:
    """Number of lost messages with a known successor, and how many of these successors arrived."""
    pairs = item.lost[:-1] & (np.diff(item.tried) == 1)
    return int(pairs.sum()), int(np.sum(pairs & ~item.lost[1:]))
