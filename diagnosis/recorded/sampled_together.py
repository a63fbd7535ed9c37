"""Tables that were imported by themselves, of which a logger sampled command and readings together.

A controller writes a command that is reached an interval later, and so do the models. In these models a table without
dead time that was sampled so would have less than none. So its commands are taken one tick earlier, and its dead time
one interval longer, of which the models say the same; what is found of it is told as of the plan's own dead time.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from common.plan.kinds import TABLE
from common.plan.plan import Plan
from common.roles import MASTER
from diagnosis.recorded.nuisances import Nuisance
from diagnosis.recorded.record import Record

DEAD_TIME = "table.delay"  # the plan's parameter


def sampled_together(record: Record) -> Record:
    """An imported record of a table by itself with commands one tick earlier and a dead time that is as much longer."""
    if record.stated is None or record.static or record.has("displacement"):
        return record
    signals, plans = dict(record.signals), dict(record.plans)
    earlier: dict[str, float] = {}
    for lab in record.labs:
        command = lab.signal(lab.kind.channels.command.name)
        if lab.kind.name == TABLE and record.has(command) and math.isfinite(lab.plan.table.frequency):
            signals[command] = np.append(record.signals[command][1:], record.signals[command][-1])
            plans[lab.role], earlier[lab.role] = longer(lab.plan), lab.plan.table.delay
    labs = tuple(replace(lab, plan=plans[lab.role]) for lab in record.labs)
    plan = next((lab.plan for lab in labs if lab.role != MASTER), plans.get(MASTER, record.plan))
    return replace(record, signals=signals, plan=plan, plans=plans, labs=labs, earlier=earlier)


def longer(plan: Plan) -> Plan:
    """The plan with a table whose dead time is an interval longer, and known as well as before."""
    table, known = plan.table, plan.tolerances
    delay = table.delay + plan.test.interval
    tolerance = known.parameters.get(DEAD_TIME, known.default) * table.delay / delay
    tolerances = replace(known, parameters={**known.parameters, DEAD_TIME: tolerance})
    return replace(plan, table=replace(table, delay=delay), tolerances=tolerances)


def as_planned(record: Record, role: str, plan: Plan) -> Plan:
    """A plan of a role as it was found in a record, with the dead time as its own plan counts it."""
    if role not in record.earlier:
        return plan
    moved = plan.table.delay - record.plans[role].table.delay
    return replace(plan, table=replace(plan.table, delay=record.earlier[role] + moved))


def factor_as_planned(record: Record, of: Nuisance, z: float) -> float:
    """The factor on a nominal parameter that is moved by `z` tolerances, as one on the parameter of its own plan."""
    moved = z * of.tolerance
    if of.lab and of.lab.role in record.earlier and of.parameter == DEAD_TIME:
        moved *= of.lab.plan.table.delay / record.earlier[of.lab.role]
    return 1.0 + moved
