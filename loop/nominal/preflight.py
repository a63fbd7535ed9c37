"""The risks of a test that nominal models show: too small a margin of delay, peaks too close to the limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from common.lab.preflight import PreflightCheck
from common.plan import patience
from common.plan.kinds import TABLE
from common.plan.laboratory_tables import Control
from common.plan.plan import Plan
from common.roles import MASTER, name_of, title
from common.safety.risks import Risk
from laboratories.column.kind import COLUMN
from laboratories.kind import Chosen, Kind
from laboratories.kinds import kind_of
from loop import substructure
from loop.closed_loop import simulate
from loop.nominal import free_motion, limited
from loop.nominal.partition import Partition, assess, drifts
from loop.signals import by_role
from models.compensators import COMPENSATORS
from models.registry import Array

MOST_TICKS = 1_000_000  # of the simulation, over all slaves: its signals then take some hundred MB of memory
# Largest error of the compensated amplitude with which a longer lead is recommended: more of it would be like a
# specimen whose stiffness is wrong by a fifth.
AMPLITUDE_ERROR = 0.2
LIMITS: dict[str, Any] = limited.RULES


class Findings(NamedTuple):
    """The results of the nominal models: the partition, the peaks of the simulated test, and the checks of both."""

    partition: Partition
    peaks: Peaks | None  # None where the simulated loop has no finite command
    unstable: bool  # whether the simulated loop is unstable, so that the peaks have no meaning
    checks: list[PreflightCheck]


def findings(plan: Plan) -> Findings:
    """Analyse a plan by its nominal models; raises InputError where a model or parameter is not valid.

    Peaks are compared with the limits that hold with a rig, even where those of emulated laboratories are larger. The
    linear building of [structure] stands for one that another program computes.
    """
    plan = patience.strict(plan).by_tables
    found = assess(plan)
    top, unstable, check = simulated_peaks(plan, known_unstable=found.unstable)
    return Findings(found, top, unstable, [partition_check(plan, found), check])


def checks(plan: Plan) -> list[PreflightCheck]:
    """The checks of a plan's partition and peaks; raises InputError where a model or parameter is not valid."""
    return findings(plan).checks


# -- partition ------------------------------------------------------------------------------------


def expected_delay(plan: Plan, found: Partition) -> float:
    """Expected delay (s) of the latest path: that of the compensated transfer system, and one interval for a late tick.

    It is 0 without a path.
    """
    return found.delay + plan.test.interval if found.paths else 0.0


def partition_check(plan: Plan, found: Partition) -> PreflightCheck:
    """The check of the partition."""
    return PreflightCheck(partition_text(plan, found), partition_risk(plan, found))


def partition_risk(plan: Plan, found: Partition) -> Risk | None:
    """The risk of an expected delay too close to the critical one; None where the plan's margin is kept."""
    if not found.stable:
        return Risk("partition", unstable_path(plan, found.role))
    if keeps_margin(plan, found):
        return None
    expected, margin = expected_delay(plan, found), plan.preflight.delay_margin
    return Risk(
        "partition",
        f"{path_of(plan, found.role)} is unstable beyond {found.critical_delay * 1e3:.1f} ms of delay, and "
        f"{expected * 1e3:.1f} ms are expected with a required margin of {margin:g}, so "
        f"{compensation(plan, found.delay, found.role)}, give the structure more mass or damping, or let the specimen "
        "stand for less of its stiffness",
    )


def keeps_margin(plan: Plan, found: Partition) -> bool:
    """Whether the critical delay is at least the expected one times the plan's margin."""
    expected = expected_delay(plan, found)
    return expected <= 0.0 or found.critical_delay >= plan.preflight.delay_margin * expected


def path_of(plan: Plan, role: str) -> str:
    """The name of a specimen's path in a sentence, with its laboratory where there are several."""
    kind = kind_of(plan, role)
    if len(drifts(plan)) == 1 and kind is COLUMN:
        return "the column's path"
    return f"the path of the {kind.says} of the {title(role)}"


def chosen_of(plan: Plan, role: str) -> tuple[Chosen, str]:
    """The compensator of a role's laboratory, and the table of the plan that holds it."""
    chosen = kind_of(plan, role).compensator(plan.of(role))
    return chosen, f"{role}.{chosen.where}" if name_of(role) and not name_of(chosen.where) else chosen.where


def unstable_path(plan: Plan, role: str) -> str:
    """The sentence for a transfer system that is unstable under its compensator, and what to change."""
    (chosen, where), kind = chosen_of(plan, role), kind_of(plan, role)
    gains = ", ".join(f"{name} = {value:g}" for name, value in chosen.parameters.items()) or "its defaults"
    system, late, remedy = transfer_system(plan.of(role), kind)
    return (
        f"{path_of(plan, role)} is unstable by itself: the {system}{late}, does not come "
        f"to rest under compensator '{chosen.kind}' ({gains}), so lower the feedback's gains in [{where}] or take "
        f"one that only feeds forward, {remedy}or shorten interval in [test]"
    )


def transfer_system(plan: Plan, kind: Kind) -> tuple[str, str, str]:
    """The name of a kind's transfer system, its dead time in words, and the remedy for it."""
    if kind is not COLUMN:
        return kind.says, "", ""
    actuator = plan.actuator
    late = actuator.servo.delay if actuator.model == "servo_hydraulic" else actuator.delay
    return "actuator", f", with {late * 1e3:.1f} ms of dead time", "lower the delay in [actuator], "


def compensation(plan: Plan, left: float, role: str = MASTER) -> str:
    """What to change in a role's compensator against the remaining delay `left` (s); a lead only where it helps."""
    chosen, where = chosen_of(plan, role)
    system = transfer_system(plan, kind_of(plan, role))[0]
    lead = chosen.parameters.get("lead", 0.0)
    if chosen.kind == "none":
        return f"compensate the {system} in [{where}]"
    if "lead" not in chosen.parameters or left <= 0.0:
        return f"compensate the {system} better in [{where}]"
    longer = round(lead + left * (1.0 + chosen.parameters.get("proportional", 0.0)), 4)
    if not serves(plan, longer, role):
        return (
            f"lower the delay {'in [actuator]' if system == 'actuator' else f'of the {system}'} (no lead in [{where}] "
            f"removes the remaining {left * 1e3:.1f} ms)"
        )
    return (
        f"raise lead in [{where}] from {lead * 1e3:.1f} ms to {longer * 1e3:.1f} ms, which removes the remaining "
        f"{left * 1e3:.1f} ms"
    )


def serves(plan: Plan, lead: float, role: str = MASTER) -> bool:
    """Whether margin and amplitude are kept with that lead (s) in the compensator of a role's laboratory."""
    chosen, _ = chosen_of(plan, role)
    if not COMPENSATORS[chosen.kind].rules["lead"].admits(lead):
        return False
    led = led_by(plan, lead, role)
    found = assess(led)
    return (
        found.stable
        and keeps_margin(led, found)
        and abs(found.paths[role].amplitude - 1.0) <= AMPLITUDE_ERROR
    )


def led_by(plan: Plan, lead: float, role: str) -> Plan:
    """The plan with another lead (s) in the compensator of a role's laboratory."""
    name = name_of(role)
    lab: Any = plan.slaves[name] if name else plan
    kind = plan.kinds[role]
    if kind == "column":
        parameters = lab.compensator.parameters | {"lead": lead}
        led = replace(lab, compensator=replace(lab.compensator, parameters=parameters))
    else:
        part = "table" if kind == "table" else "device"
        within = getattr(lab, part)
        parameters = within.compensator.parameters | {"lead": lead}
        chosen = replace(within.compensator, parameters=parameters)
        led = replace(lab, **{part: replace(within, compensator=chosen)})
    return replace(plan, slaves=plan.slaves | {name: led}) if name else led


def partition_text(plan: Plan, found: Partition) -> str:
    """Critical and expected delay of the partition in words."""
    if not found.stable:
        return f"The {transfer_system(plan, kind_of(plan, found.role))[0]} is unstable under its compensator"
    if not found.paths:
        return "Stable at any delay, because no laboratory follows a storey's drift"
    expected, points = expected_delay(plan, found), found.damping_points * 100.0
    cost = f"{'costing' if points >= 0.0 else 'adding'} {abs(points):.2f} points of damping at {found.frequency:.2f} Hz"
    if math.isinf(found.critical_delay):
        return f"Stable at any delay; {expected * 1e3:.1f} ms expected, {cost}"
    figures = f"{found.critical_delay * 1e3:.1f} ms of delay; {expected * 1e3:.1f} ms expected"
    if found.unstable:
        return f"Unstable beyond {figures}"
    if len(found.paths) > 1:
        figures = f"{figures} at the {title(found.role)}"
    ratio = f" (margin {times(found.critical_delay / expected)})" if expected > 0.0 else ""
    return f"Stable up to {figures}{ratio}, {cost}"


def times(ratio: float) -> str:
    """A margin as a factor, with one decimal below 10."""
    return f"{ratio:.0f}" if ratio >= 10.0 else f"{ratio:.1f}"


# -- peaks ----------------------------------------------------------------------------------------


class Peaks(NamedTuple):
    """The peaks of the simulated test relative to its limits."""

    share: float  # largest peak over its limit
    name: str  # of that quantity
    first: str  # quantity that first exceeds its share of the limit, empty where none does
    tick: int  # at which it does
    peak: float  # of that quantity, in its unit
    every: dict[str, float]  # peak of each limited quantity, in its unit
    most: dict[str, float]  # limit of each
    units: dict[str, str]  # of each


def simulated_peaks(plan: Plan, *, known_unstable: bool = False) -> tuple[Peaks | None, bool, PreflightCheck]:
    """Peaks of the simulated test, whether its loop is unstable, and the check of both.

    For a loop that is `known_unstable`, which another check refuses, only peaks beyond their share are a risk here.
    """
    short = plan.with_ticks(min(plan.ticks, MOST_TICKS // max(len(plan.roles), 1)))
    columns, finite = simulated(short)
    if not columns[MASTER]["displacement"].size:
        risk = Risk(
            "peaks", "the simulated test has no finite command at all, so check the values in [structure]"
        )
        return None, True, PreflightCheck("", risk)
    found = peaks(short, columns)
    grows = not finite or free_motion.unstable(plan)
    if grows and (found.first or not finite or not known_unstable):
        return (
            found,
            True,
            PreflightCheck(
                "The peaks are not known, because the simulated loop is unstable", unstable_risk(plan, found)
            ),
        )
    return found, grows, PreflightCheck(peaks_text(plan, found, short.ticks), peaks_risk(plan, found))


def simulated(plan: Plan) -> tuple[dict[str, dict[str, Array]], bool]:
    """Signals by role of the nominal test with its sensors' noise, and whether they are finite to its end."""
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    rollout = simulate(plan, ground, seed=plan.test.seed)
    return by_role(plan, rollout), rollout.finite


def peaks(plan: Plan, columns: Mapping[str, Mapping[str, Array]]) -> Peaks:
    """Peaks of simulated signals, by role and name, over the plan's limits."""
    most = limited.most(plan)
    magnitudes = limited.magnitudes(plan, columns)
    shares = {name: values / most[name] for name, values in magnitudes.items()}
    tops = {name: float(np.max(share)) for name, share in shares.items()}
    over = {
        name: int(np.argmax(~(share <= plan.preflight.peak_share)))
        for name, share in shares.items()
        if not tops[name] <= plan.preflight.peak_share
    }
    name = max(tops, key=lambda one: tops[one])
    first = min(over, key=lambda one: over[one], default="")
    every = {name: float(np.max(values)) for name, values in magnitudes.items()}
    units = {name: limited.unit_of(plan, name) for name in every}
    return Peaks(tops[name], name, first, over.get(first, 0), every.get(first, 0.0), every, most, units)


def unstable_risk(plan: Plan, found: Peaks) -> Risk:
    """The risk of an unstable loop, whose peaks have no meaning and for which no limit would help."""
    share = plan.preflight.peak_share
    seen = ""
    if found.first:
        limit, unit = found.most[found.first], found.units[found.first]
        seen = (
            f": {found.first} exceeds {share:.0%} of its limit of {limit:g} {unit} at "
            f"t = {found.tick * plan.test.interval:.3f} s and keeps growing"
        )
    return Risk(
        "peaks",
        f"the simulated loop is unstable{seen}, so {remedy(plan)}; no limit would help",
    )


def remedy(plan: Plan) -> str:
    """What to change in a plan whose loop is unstable."""
    carried = any(plan.kinds[role] == TABLE and plan.of(role).control.amd for role in plan.kinds)
    calm = plan.everywhere(control=Control(amd=False, gain=plan.control.gain))
    if carried and not free_motion.unstable(calm):
        return (
            f"lower gain in [control], {plan.control.gain:g} N·s/m, or make the shaking table faster (delay and "
            "frequency in [table], its compensator), because the loop is stable without the damper"
        )
    found = assess(plan)
    if not found.stable:
        _, where = chosen_of(plan, found.role)
        late = ", or the delay in [actuator]" if kind_of(plan, found.role) is COLUMN else ""
        return f"lower the feedback's gains in [{where}]{late}"
    if found.unstable:
        return compensation(plan, found.delay, found.role)
    tables = dict.fromkeys(chosen_of(plan, role)[1] for role in plan.kinds)
    return f"check {' and '.join(f'[{name}]' for name in tables)}, or shorten interval in [test]"


def peaks_risk(plan: Plan, found: Peaks) -> Risk | None:
    """The risk of a peak of a stable loop too close to its limit; None where all peaks are within their share."""
    if not found.first:
        return None
    unit, limit, share = found.units[found.first], found.most[found.first], plan.preflight.peak_share
    limits = "limits" if found.first in LIMITS else "device.limits"
    return Risk(
        "peaks",
        f"the simulated {found.first} exceeds {share:.0%} of its limit of {limit:g} {unit} at "
        f"t = {found.tick * plan.test.interval:.3f} s and peaks at {found.peak:.4g} {unit}, so lower scale in "
        f"[ground_motion], check {compensated(plan)}, or raise {found.first} in [{limits}] where the laboratory "
        "allows it",
    )


def compensated(plan: Plan) -> str:
    """The table of the compensator of the master's laboratory, or without one of the first slave's."""
    return f"[{chosen_of(plan, next(iter(plan.kinds)))[1]}]"


def peaks_text(plan: Plan, found: Peaks, ticks: int) -> str:
    """The largest simulated peak relative to its limit, in words."""
    part = f" in the first {ticks * plan.test.interval:g} s" if ticks < plan.ticks else ""
    return f"Simulated peaks reach {found.share * 100.0:.0f} % of their limits at most ({found.name}){part}"
