"""The faults of a simulated test and their times: drawn from a seed, written in one line, read back from it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.schema import nearest
from common.roles import MASTER, RECORDER, SLAVE

SHORTEST, LONGEST = 10.0, 60.0  # s of a drawn test: room for several faults, within seconds of computation
MOST_FAULTS = 6  # of a schedule: enough that several overlap, few enough to find the cause of a violation
QUIET = 0.1  # share of schedules without a fault, so that an alarm without a cause is found too
SEVERAL = 0.15  # share with two slaves, which take twice the time to simulate
ONE_WAY = 0.6  # share of a route's faults in one direction; these are harder to notice for the sender
PLANS = {1: "default", 2: "two_dampers"}
ROLES = {1: (SLAVE,), 2: ("slave.roof", "slave.middle")}
READINGS = 4  # of the laboratory with the most readings

ROUTE, PROCESS, RIG = "route", "process", "rig"


class DrawRange(NamedTuple):
    """The range of a parameter; drawn log-uniform, as a whole number or uniform."""

    low: float
    high: float
    how: str = "log"  # log, whole or even


class FaultKind(NamedTuple):
    """A kind of fault: the place that it affects, its range of durations (s, None for an instant), its parameters."""

    where: str
    lasts: tuple[float, float] | None
    parameters: Mapping[str, DrawRange] = {}


# The ranges of all faults reach from values that must not matter, as those of a loaded network or machine, to values
# that must stop a test: watchdogs and limits of the plans lie in between.
SHARE = DrawRange(0.002, 0.3)  # of frames
COUNT = DrawRange(1, 1000)  # frames
PLACE = DrawRange(0, READINGS - 1, "whole")
SECONDS = (0.01, 10.0)
MOMENT = (0.002, 5.0)  # from one interval on

KINDS: dict[str, FaultKind] = {
    "delay": FaultKind(ROUTE, SECONDS, {"minimum": DrawRange(1e-4, 0.03), "mean": DrawRange(1e-5, 0.01)}),
    "step": FaultKind(ROUTE, SECONDS, {"minimum": DrawRange(5e-4, 0.2)}),
    "loss": FaultKind(ROUTE, SECONDS, {"loss": SHARE}),
    "burst": FaultKind(ROUTE, SECONDS, {"burst": SHARE, "run": DrawRange(2, 40)}),
    "duplicate": FaultKind(ROUTE, SECONDS, {"duplicate": SHARE}),
    "reorder": FaultKind(ROUTE, SECONDS, {"reorder": SHARE, "hold": DrawRange(0.001, 0.02)}),
    "corrupt": FaultKind(ROUTE, SECONDS, {"corrupt": SHARE}),
    "outage": FaultKind(ROUTE, MOMENT),
    "backlog": FaultKind(ROUTE, MOMENT),
    "replay": FaultKind(ROUTE, None, {"count": COUNT}),
    "garbage": FaultKind(ROUTE, None, {"count": COUNT}),
    "forged": FaultKind(ROUTE, None, {"count": COUNT}),
    "foreign": FaultKind(ROUTE, None, {"count": COUNT}),
    "insider": FaultKind(ROUTE, None, {"what": DrawRange(0, 7, "whole")}),
    "stall": FaultKind(PROCESS, (0.003, 3.0)),
    "kill": FaultKind(PROCESS, None),
    "stop": FaultKind(PROCESS, None),
    "clock": FaultKind(
        PROCESS, None, {"offset": DrawRange(0.0, 1000.0, "even"), "ppm": DrawRange(-100.0, 100.0, "even")}
    ),
    "nan": FaultKind(RIG, MOMENT, {"place": PLACE}),
    "frozen": FaultKind(RIG, MOMENT, {"place": PLACE}),
    "jump": FaultKind(RIG, MOMENT, {"place": PLACE, "by": DrawRange(1e-4, 1e4)}),
    "beyond": FaultKind(RIG, MOMENT, {"place": PLACE, "by": DrawRange(0.1, 1e7)}),
    "raise": FaultKind(RIG, MOMENT),
}


@dataclass(frozen=True)
class InjectedFault:
    """One fault from a world time (s) for a duration; `where` is a role, `A>B` or `A<>B`.

    A kind without a duration is instantaneous. A clock differs from the beginning, independently of `at`.
    """

    kind: str
    where: str
    at: float
    duration: float = 0.0
    parameters: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        values = ",".join(f"{name}={value:g}" for name, value in self.parameters.items())
        lasts = f"+{self.duration:g}" if self.duration else ""
        return f"{self.kind}@{self.at:g}{lasts}:{self.where}" + (f"({values})" if values else "")


@dataclass(frozen=True)
class Schedule:
    """A simulated test: its seed, length (s), number of slaves, whether it is recorded, and its faults in time."""

    seed: int
    duration: float
    slaves: int = 1
    recorded: bool = False
    faults: tuple[InjectedFault, ...] = ()

    def __str__(self) -> str:
        head = f"seed={self.seed} duration={self.duration:g} slaves={self.slaves} recorded={self.recorded:d}"
        return " ".join((head, *map(str, self.faults)))

    @property
    def plan(self) -> str:
        """The plan of the package with this number of slaves."""
        return PLANS[self.slaves]


# -- drawing --------------------------------------------------------------------------------------


def draw(seed: int, duration: float | None = None, *, recorded: bool = False) -> Schedule:
    """The schedule of a seed, of the given or a drawn length."""
    chance = np.random.default_rng([seed, 20])
    drawn = round(float(chance.uniform(SHORTEST, LONGEST)), 1)
    slaves = 2 if chance.random() < SEVERAL else 1
    count = 0 if chance.random() < QUIET else int(chance.integers(1, MOST_FAULTS + 1))
    length = duration if duration is not None else drawn
    faults = [_fault(chance, ROLES[slaves], length, recorded=recorded) for _ in range(count)]
    return Schedule(seed, length, slaves, recorded, tuple(sorted(faults, key=lambda one: one.at)))


def _fault(
    chance: np.random.Generator, slaves: tuple[str, ...], length: float, *, recorded: bool
) -> InjectedFault:
    name = str(chance.choice(list(KINDS)))
    kind = KINDS[name]
    at = rounded(float(chance.uniform(0.0, length)))
    duration = 0.0 if kind.lasts is None else value_of(chance, DrawRange(*kind.lasts))
    parameters = {key: value_of(chance, span) for key, span in kind.parameters.items()}
    return InjectedFault(
        name, _where(chance, kind.where, slaves, recorded=recorded), at, duration, parameters
    )


def _where(chance: np.random.Generator, what: str, slaves: tuple[str, ...], *, recorded: bool) -> str:
    places = [MASTER, str(chance.choice(slaves))] + [RECORDER] * (recorded and what != RIG)
    one, other = map(str, chance.permutation(places)[:2])
    if what != ROUTE:
        return one
    return one + (">" if chance.random() < ONE_WAY else "<>") + other


def value_of(chance: np.random.Generator, span: DrawRange) -> float:
    """A value of a range, rounded so that it is written and read without loss."""
    match span.how:
        case "whole":
            return float(chance.integers(int(span.low), int(span.high) + 1))
        case "even":
            return rounded(float(chance.uniform(span.low, span.high)))
        case _:
            return rounded(float(np.exp(chance.uniform(np.log(span.low), np.log(span.high)))))


def rounded(value: float) -> float:
    """Five significant digits."""
    return float(f"{value:.5g}")


# -- reading --------------------------------------------------------------------------------------

NUMBER = r"[-+0-9.e]+"
FAULT = re.compile(
    rf"(?P<kind>[a-z]+)@(?P<at>{NUMBER}?)(?:\+(?P<duration>{NUMBER}))?:"
    r"(?P<where>[a-z0-9_.<>]+)(?:\((?P<values>.*)\))?"
)
HEAD = {"seed": int, "duration": float, "slaves": int, "recorded": int}


def parse(line: str) -> Schedule:
    """The schedule in a line, in the form that `str(schedule)` has.

    Raises:
        InputError: the line is not a schedule.
    """
    head: dict[str, float] = {"duration": SHORTEST, "slaves": 1, "recorded": 0}
    faults: list[InjectedFault] = []
    for word in line.split():
        name, _, value = word.partition("=")
        if name in HEAD:
            head[name] = number(value, word)
        else:
            faults.append(parse_fault(word))
    if "seed" not in head:
        raise InputError("The schedule has no seed: begin it with seed=N.")
    if head["slaves"] not in PLANS or not 0.0 < head["duration"] <= 7200.0:
        raise InputError("Give the schedule 1 or 2 slaves, and a duration above 0 s and of at most 7200 s.")
    return checked(
        Schedule(
            int(head["seed"]), head["duration"], int(head["slaves"]), bool(head["recorded"]), tuple(faults)
        )
    )


def parse_fault(word: str) -> InjectedFault:
    """The fault in a word; raises InputError where the word is not a fault."""
    found = FAULT.fullmatch(word)
    if found is None:
        raise InputError(f"'{word}' is not a fault: write kind@at[+duration]:where[(name=value,…)].")
    kind = found["kind"]
    if kind not in KINDS:
        raise InputError(f"There is no fault '{kind}': {nearest(kind, KINDS)}")
    pairs = [pair.partition("=") for pair in (found["values"] or "").split(",") if pair]
    values = {name: number(value, word) for name, _, value in pairs}
    wanted = KINDS[kind].parameters
    if set(values) != set(wanted):
        raise InputError(f"Give '{word}' the values {', '.join(wanted) or 'none'}, and no others.")
    return InjectedFault(
        kind, found["where"], number(found["at"], word), number(found["duration"] or "0", word), values
    )


def checked(schedule: Schedule) -> Schedule:
    """The schedule itself; raises InputError where the place of a fault does not exist."""
    labs = (MASTER, *ROLES[schedule.slaves])
    roles = (*labs, RECORDER) if schedule.recorded else labs
    for fault in schedule.faults:
        what, ends = KINDS[fault.kind].where, re.split(r"<>|>", fault.where)
        if len(ends) != 1 + (what == ROUTE) or not set(ends) <= set(labs if what == RIG else roles):
            raise InputError(
                f"'{fault}' names no place of this test: its roles are {', '.join(roles)}, its routes A>B or A<>B."
            )
    return schedule


def number(text: str, where: str) -> float:
    """A finite number from text; raises InputError."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) < 1e12:
        raise InputError(f"'{text}' in '{where}' is not a number of less than 1e12.")
    return value
