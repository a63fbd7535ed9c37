"""The file of a campaign: the tests to choose from, what is asked, and the limits."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from common.errors import PlanError
from common.plan import read as plans
from common.plan.laboratory_tables import Control
from common.plan.plan import Plan
from common.plan.schema import fill, key, nearest, plain, table_fields
from common.plan.toml_file import load_tables
from models.ground_motion.motions import MOTIONS
from simulation.sweep.definition import MotionTable, SweptMotion, listed, motion, plan_path

VIRTUAL, REAL_TIME, BY_HAND = "virtual", "real time", "by hand"
# A diagnosis leaves 2 % for a cause that its catalogue does not have, so nothing can be more certain than 98 %.
SUREST = 0.97
MOST_CANDIDATES = 500  # each is simulated after every test, in about 0.1 s


@dataclass(frozen=True)
class GoalTable:
    """The keys at the head of the file."""

    plan: str = key("the plan: a file, or the name of one that ships", default="default")
    seed: int = key("added to the number of a test for the seed of its noise", default=0, least=0)
    tests: int = key("tests at most", default=8, least=1, most=99)
    certain: float = key("probability at which a cause is certain", default=0.95, least=0.5, most=SUREST)
    gap: float = key(
        "gap that may be left in each part, relative to its signals; 0 to go on until the cause is certain",
        default=0.0,
        least=0.0,
        most=1.0,
    )
    mode: str = key(
        "who plays the tests: this machine in virtual time or in real time, or a person",
        default=VIRTUAL,
        choices=(VIRTUAL, REAL_TIME, BY_HAND),
    )
    reality: str = key(
        "what the emulated laboratories really do, a file; empty for laboratories as planned", default=""
    )


@dataclass(frozen=True)
class CampaignLimits:
    """`[limits]`: what no test may do to the specimens, beside the limits of the plan."""

    drift: float = key("of any storey in any test", default=math.inf, unit="m", above=0.0, infinite=True)
    energy: float = key(
        "that a specimen absorbs in all tests together", default=math.inf, unit="J", above=0.0, infinite=True
    )
    growth: float = key(
        "largest drift of a test over the largest one before it", default=math.inf, least=1.0, infinite=True
    )
    margin: float = key("by which a test may exceed what was predicted", default=0.1, least=0.0, most=10.0)


@dataclass(frozen=True)
class CampaignTest:
    """A test to choose, by its number from 1."""

    number: int
    motion: SweptMotion
    scale: float
    duration: float  # s
    amd: bool

    @property
    def text(self) -> str:
        """The test in words."""
        damper = "" if self.amd else ", damper off"
        return f"{self.motion.ground_motion['record']}, scale {self.scale:g}, {self.duration:g} s{damper}"


@dataclass(frozen=True)
class Goal:
    """A campaign."""

    head: GoalTable
    limits: CampaignLimits
    plan: Plan
    candidates: tuple[CampaignTest, ...]
    base: Path  # from which the paths of the file start

    @cached_property
    def digest(self) -> str:
        """Sixteen hex digits of all that the course of a campaign depends on, what is hidden aside."""
        head = {name: value for name, value in plain(self.head).items() if name != "reality"}
        tests = [plan_of(self, one.number, 1).digest() for one in self.candidates]
        text = json.dumps([head, plain(self.limits), self.plan.digest(), tests], sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()

    @property
    def files(self) -> tuple[str, ...]:
        """The files of the user's that its tests need: records of motion, and kinds of laboratory."""
        named = (str(one.motion.ground_motion["record"]) for one in self.candidates)
        kinds = (one.rpartition(":")[0] for one in self.plan.kinds.values())
        return tuple(
            dict.fromkeys(
                [
                    *(one for one in named if one not in MOTIONS),
                    *(one for one in kinds if one.endswith(".py")),
                ]
            )
        )

    @property
    def gentle(self) -> bool:
        """Whether the first test has the smallest drift, because the drift may only grow from test to test."""
        return math.isfinite(self.limits.growth)

    def candidate(self, number: int) -> CampaignTest:
        """The candidate of a number."""
        return self.candidates[number - 1]


def load(path: Path) -> Goal:
    """The campaign in a TOML file.

    Raises:
        PlanError: the file or the plan cannot be read, or holds what no campaign can.
    """
    tables = load_tables(path, "campaign")
    try:
        return from_tables(tables, path.parent)
    except PlanError as error:
        raise PlanError(f"The campaign {path}: {error}") from None


def from_tables(tables: Mapping[str, Any], base: Path) -> Goal:
    """The campaign of nested plain values; paths start from `base`."""
    heads = [field.name for field in table_fields(GoalTable)]
    known = (*heads, "limits", "candidate")
    for name in tables:
        if name not in known:
            raise PlanError(f"Unknown entry '{name}': {nearest(name, known)}")
    head = fill(GoalTable, {name: tables[name] for name in heads if name in tables}, "campaign")
    if head.mode == BY_HAND and head.reality:
        raise PlanError("reality is for emulated laboratories, but the mode is 'by hand': leave it out.")
    plan = anywhere(plans.load(plan_path(head.plan, base)))
    if plan.served or plan.foreign:
        raise PlanError(
            "The plan's building is computed by another program, which no next test can be predicted with: leave out "
            "model in [structure]."
        )
    limits = fill(CampaignLimits, tables.get("limits", {}), "limits")
    rows = [row for given in listed(tables, "candidate") for row in candidates(given, plan, base)]
    found = Goal(
        head, limits, plan, tuple(replace(row, number=place) for place, row in enumerate(rows, 1)), base
    )
    check(found)
    return found


def check(goal: Goal) -> None:
    """Raise PlanError where there is nothing to choose from, or a candidate is no test of the plan."""
    if not goal.candidates:
        raise PlanError("It has no test to choose from: give at least one [[candidate]].")
    if len(goal.candidates) > MOST_CANDIDATES:
        raise PlanError(
            f"It has {len(goal.candidates)} tests to choose from, but may have at most {MOST_CANDIDATES}: leave some "
            "out."
        )
    texts = [one.text for one in goal.candidates]
    for one in goal.candidates:
        if texts.count(one.text) > 1:
            raise PlanError(f"The candidate '{one.text}' is there twice: leave one of them out.")
        plan_of(goal, one.number, 1)


def candidates(given: Mapping[str, Any], plan: Plan, base: Path) -> Iterator[CampaignTest]:
    """The tests of a `[[candidate]]`: each of its scales with each of its durations, with the damper or without."""
    names = [field.name for field in table_fields(MotionTable)]
    known = (*names, "scales", "durations", "amd")
    for name in given:
        if name not in known:
            raise PlanError(f"Unknown key '{name}' in [[candidate]]: {nearest(name, known)}")
    moved = motion({name: given[name] for name in (*names, "scales") if name in given}, plan, base)
    for duration in several(given, "durations", plan.test.duration, (int, float)):
        for amd in several(given, "amd", plan.control.amd, (bool,)):
            for scale in moved.scales:
                yield CampaignTest(0, moved, scale, float(duration), amd)


def several(given: Mapping[str, Any], name: str, default: Any, kinds: tuple[type, ...]) -> list[Any]:
    """The values of a key that may be one or several; raises PlanError where one has another type."""
    found = given.get(name, default)
    values = found if isinstance(found, list) else [found]
    if not values or not all(
        isinstance(one, kinds) and (bool in kinds or not isinstance(one, bool)) for one in values
    ):
        words = "true or false" if bool in kinds else "numbers"
        raise PlanError(f"{name} in [[candidate]] is {found!r}, but must be {words}.")
    return values


def plan_of(goal: Goal, candidate: int, test: int) -> Plan:
    """The plan of a candidate as the campaign's test of a number, checked like that of a file.

    Raises:
        PlanError: a value is out of its range.
    """
    one = goal.candidate(candidate)
    tables = goal.plan.written()
    tables["test"] |= {
        "name": f"{goal.plan.test.name}-{test:02d}",
        "duration": one.duration,
        "seed": goal.plan.test.seed + goal.head.seed + test - 1,
    }
    given = dict(one.motion.ground_motion)
    if given["record"] not in MOTIONS:
        given["record"] = str((one.motion.base / given["record"]).resolve())
    tables["ground_motion"] |= given | {"scale": one.scale}
    made = replace(plans.from_tables(tables, goal.plan.base), follows_in=goal.plan.follows_in)
    return made.everywhere(control=Control(amd=one.amd, gain=made.control.gain)) if not one.amd else made


def anywhere(plan: Plan) -> Plan:
    """The plan with full paths of its files, because the plans of a campaign's tests lie in another folder."""

    def full(reference: str) -> str:
        file, colon, name = reference.rpartition(":")
        return f"{(plan.base / file).resolve()}{colon}{name}" if file.endswith(".py") else reference

    def placed(lab: Any) -> Any:
        return replace(lab, kind=full(lab.kind), rig=replace(lab.rig, class_=full(lab.rig.class_)))

    slaves = {name: placed(lab) for name, lab in plan.slaves.items()}
    folder = plan.link.security.folder
    secured = replace(plan.link.security, folder=str((plan.base / folder).resolve()) if folder else "")
    motion_ = plan.ground_motion
    own = motion_.record not in MOTIONS
    return replace(
        plan,
        master=placed(plan.master),
        slave=placed(plan.slave),
        slaves=slaves,
        link=replace(plan.link, security=secured),
        ground_motion=replace(motion_, record=str((plan.base / motion_.record).resolve()))
        if own
        else motion_,
    )
