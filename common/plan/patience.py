"""Safety figures of a test whose laboratories are all emulated, which pauses of the machine must not end.

A user's rig must be brought to rest within milliseconds after messages stop coming. Emulated laboratories can damage
nothing, and they run on laptops and in containers that pause a process for tens of milliseconds. So where the plan
names no rig, the figures that it does not set take the values below. They follow from the plan alone, because every
process of a test derives them for itself and their digests are compared.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from common.plan.kinds import COLUMN, OWN, TABLE, known_kind
from common.plan.plan import OVERRUN, Plan
from common.roles import MASTER

# s. Pauses of 50 ms have to be tolerated; under other load they were seen to reach 0.5 s, and four of these may
# coincide (those of master, slave, recorder and operating system).
PATIENCE = 2.0
NOTICED = 0.1  # s: a shorter silence is an expected pause, twice 50 ms, and does not change the mode
# Of the exchanges. One that a pause held up for 100 ms is sent again and counts as lost; 1 % of the thousand exchanges
# allows ten such pauses during the check.
LOST_SHARE = 0.01
# Factor on the limits of the table's acceleration, 30 m/s² by default, and of the damper's stroke, 0.4 m. After a pause
# of 50 ms the table took 53 m/s² to reach its target, and twice as much after 100 ms; 300 m/s² covers pauses up to a
# quarter of a second. The motor holds its force while the master is held up: 84 N on 16 kg for 0.5 s swing the damper
# by up to 1.5 m.
SHOCK = 10.0

Figure = Callable[["Plan"], float]


def intervals(seconds: float) -> Figure:
    """The number of intervals in a time (s), rounded up, as a function of the plan."""
    return lambda plan: math.ceil(seconds / plan.test.interval - 1e-9)


# A slave whose commands were held up moves to the newest one within an interval: its rates then show the pause.
FIGURES: Mapping[str, Figure] = {
    "link.loss_timeout": lambda _: 2.5 * PATIENCE,  # longer than a partner's pause and one's own together
    "safety.hold_after": intervals(NOTICED),
    "safety.ramp_after": intervals(PATIENCE),
    OVERRUN: intervals(PATIENCE),
    "safety.message_age": lambda _: (
        PATIENCE
    ),  # a laboratory that is late by `overrun` sends messages of that age
    "preflight.lost": lambda plan: math.ceil(LOST_SHARE * plan.preflight.exchanges),
    "preflight.late_share": lambda _: 1.0,  # late ticks are reported while the test runs
    "limits.table_velocity": lambda _: math.inf,
    "limits.table_step": lambda _: math.inf,
    "limits.table_error": lambda _: math.inf,
    "limits.damper_step": lambda _: math.inf,
    "limits.table_acceleration": lambda plan: SHOCK * plan.limits.table_acceleration,
    "limits.damper_stroke": lambda plan: SHOCK * plan.limits.damper_stroke,
    "limits.actuator_velocity": lambda _: math.inf,
    "limits.actuator_acceleration": lambda _: math.inf,
    "limits.actuator_step": lambda _: math.inf,
    "limits.column_error": lambda _: math.inf,
}
OF_KIND = {  # the limits among them, by the kind of laboratory whose slaves they concern
    TABLE: (
        "table_velocity",
        "table_step",
        "table_error",
        "damper_step",
        "table_acceleration",
        "damper_stroke",
    ),
    COLUMN: ("actuator_velocity", "actuator_acceleration", "actuator_step", "column_error"),
}
TABLES = tuple(dict.fromkeys(name.partition(".")[0] for name in FIGURES))
TOGETHER = {"safety.hold_after", "safety.ramp_after"}  # where the plan sets one of them neither is eased


def eased(plan: Plan, given: Mapping[str, Any]) -> Plan:
    """The plan with eased figures for those that `given`, the tables of its file, does not set.

    A figure is never made stricter than it is with a rig, and a plan that names a rig is returned as it is.
    """
    if not plan.emulated:
        return plan
    written = {f"{table}.{key}" for table in TABLES for key in given.get(table, {})}
    if written & TOGETHER:
        written |= TOGETHER
    foreign = foreign_to(plan)
    found = {name: FIGURES[name](plan) for name in FIGURES if name not in written | foreign}
    found = {name: value for name, value in found.items() if value > figure(plan, name)}
    return replace(with_figures(plan, found), eased=tuple(found))


def foreign_to(plan: Plan) -> set[str]:
    """The limits of the kinds of laboratory that no slave of the plan hosts.

    They are not eased: the master's own laboratory misses no command, because late ticks are caught up one by one.
    """
    hosted = {kind for role, kind in plan.kinds.items() if role != MASTER}
    return {f"limits.{name}" for kind, names in OF_KIND.items() if kind not in hosted for name in names}


def strict(plan: Plan) -> Plan:
    """The plan with the figures that hold with a rig in place of the eased ones."""
    return replace(with_figures(plan, {name: standard(name) for name in plan.eased}), eased=())


def standard(name: str) -> float:
    """The default of a figure, which holds with a rig where the plan does not set it."""
    return figure(Plan, name)


def figure(plan: Plan | type[Plan], name: str) -> float:
    """A figure of a plan by its name, `table.key`."""
    table, _, key = name.partition(".")
    return float(getattr(getattr(plan, table), key))


def with_figures(plan: Plan, figures: Mapping[str, float]) -> Plan:
    """The plan with some figures in place of its own; a count stays a whole number."""
    parts: dict[str, dict[str, float]] = {}
    for name, value in figures.items():
        table, _, key = name.partition(".")
        whole = isinstance(getattr(getattr(plan, table), key), int)
        parts.setdefault(table, {})[key] = round(value) if whole else value
    return replace(
        plan, **{table: replace(getattr(plan, table), **values) for table, values in parts.items()}
    )


def sentence(plan: Plan) -> str:
    """The eased figures with their values, those that hold with a rig in brackets, and the reason."""
    figures = (f"{name.partition('.')[2]} {figure(plan, name):g} ({standard(name):g})" for name in plan.eased)
    own = any(known_kind(kind) == OWN for kind in plan.kinds.values())
    return (
        "All laboratories are emulated, so a pause of this machine does no harm and does not end the test. "
        f"Figures that the plan does not set are larger than with a rig (in brackets): {', '.join(figures)}. "
        + "Limits of a kind of your own on the rates of its command are not checked. " * own
        + "A late tick is caught up and counted."
    )


def values(plan: Plan) -> dict[str, float]:
    """The eased figures by name."""
    return {name: figure(plan, name) for name in plan.eased}
