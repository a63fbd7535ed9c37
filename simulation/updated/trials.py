"""Every compensator of the actuator, tried on the laboratories that a diagnosis found."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from common.plan.kinds import COLUMN
from common.plan.laboratory_tables import CompensatorTable
from common.plan.plan import Plan
from common.roles import MASTER
from common.terminal.telling import Tell, untold
from laboratories.kinds import kind_of
from loop import substructure
from loop.nominal import limited
from loop.nominal.partition import assess
from loop.nominal.preflight import expected_delay
from loop.of_reality import rolled_out
from loop.signals import by_role
from models.compensators import COMPENSATORS
from simulation.foretold.draws import FoundLaboratories, drawn

PLANNED = "as planned"
# Gains of the loop beside a feedforward: those of the default test, of the paper, and weaker ones beside an inverse,
# which leaves the loop little to do.
GAINS = {"proportional": 1.93, "integral": 0.047, "derivative": 0.0}
WEAKER = {"proportional": 1.0, "integral": 0.0, "derivative": 0.0}


class Lag(NamedTuple):
    """A transfer system at low frequency: a dead time, a lag and a gain."""

    delay: float  # s
    time_constant: float  # s
    gain: float

    @property
    def whole(self) -> float:
        """Its delay at low frequency, s."""
        return self.delay + self.time_constant

    @property
    def inverse(self) -> dict[str, float]:
        """The first coefficients of the series of its inverse in the derivatives of the target."""
        late, lag = self.delay, self.time_constant
        series = (1.0, late + lag, late * (0.5 * late + lag), late**2 * (late / 6.0 + 0.5 * lag))
        return {f"a{order}": value / self.gain for order, value in enumerate(series)}


class Margins(NamedTuple):
    """What pre-flight says of the column's path under a compensator."""

    critical: float  # s, delay beyond which the loop is unstable
    expected: float  # s, delay to expect
    damping_points: float  # damping ratio that the path costs the first mode

    @property
    def margin(self) -> float:
        """The one over the other."""
        return self.critical / self.expected if self.expected > 0.0 else math.inf


class Trial(NamedTuple):
    """One compensator on the laboratories found."""

    name: str
    chosen: CompensatorTable
    error: float  # rms of measured minus target over that of the target; inf where the loop diverges
    margins: Margins
    limit: float  # largest peak over its limit

    def serves(self, wanted: float) -> bool:
        """Whether it keeps the plan's limits and the margin wanted."""
        return self.limit <= 1.0 and math.isfinite(self.error) and self.margins.margin >= wanted


def margins(plan: Plan) -> Margins:
    """The margins of a plan's nominal models."""
    found = assess(plan)
    expected = expected_delay(plan, found)
    return Margins(found.critical_delay, expected, found.damping_points)


def lag_of(plan: Plan) -> Lag:
    """The actuator of a plan at low frequency; one that interacts with its specimen as a pure delay."""
    actuator = plan.actuator
    if actuator.model == "servo_hydraulic":
        bare = replace(plan, compensator=replace(plan.compensator, kind="none", parameters={}))
        return Lag(assess(bare).delay, 0.0, 1.0)
    return Lag(actuator.delay, actuator.time_constant, actuator.gain)


def settings(plan: Plan) -> dict[str, CompensatorTable]:
    """Every compensator with parameters that follow from the actuator of a plan; the plan's own stands first."""
    lag = lag_of(plan)
    known = {"delay": lag.delay, "time_constant": lag.time_constant, "gain": lag.gain}
    given: dict[str, dict[str, float]] = {
        "none": {},
        "pid": GAINS,
        "taylor": {"lead": lag.whole, "order": 2.0},
        "pid_taylor": GAINS | {"lead": lag.whole},
        "horiuchi": {"delay": lag.whole, "order": 3.0},
        "inverse": known | {"order": 2.0},
        "pid_inverse": WEAKER | known | {"order": 2.0},
        "ats": {"lead": lag.delay, "time_constant": lag.time_constant, "trigger": 1e-4},
        "pi_lead": {},
        "series": lag.inverse,
        "amb": lag.inverse,
    }
    own = {PLANNED: CompensatorTable(plan.compensator.kind, dict(plan.compensator.parameters))}
    return own | {name: CompensatorTable(name, given.get(name, {})) for name in COMPENSATORS}


def trials(found: FoundLaboratories, updated: Plan, tell: Tell = untold) -> list[Trial]:
    """All compensators, the best first; none where the master drives no column.

    The error is that of the laboratories as found, the margins are those of the updated plan's models.
    """
    if updated.kinds.get(MASTER) != COLUMN:
        return []
    every = settings(updated)
    result = []
    for place, (name, chosen) in enumerate(every.items()):
        tell(f"trying {name}", place, len(every))
        result.append(trial(found, updated, name, chosen))
    wanted = updated.preflight.delay_margin
    return sorted(result, key=lambda one: (not one.serves(wanted), one.error))


def with_compensator(plan: Plan, chosen: CompensatorTable) -> Plan:
    """The plan with another compensator of the actuator; what is done to the measured force stays."""
    return replace(
        plan, compensator=replace(plan.compensator, kind=chosen.kind, parameters=dict(chosen.parameters))
    )


def trial(found: FoundLaboratories, updated: Plan, name: str, chosen: CompensatorTable) -> Trial:
    """One compensator."""
    truth = replace(found.truth, plan=with_compensator(found.truth.plan, chosen))
    systems = drawn(replace(found, truth=truth), np.zeros(len(found.spread.parameters)), truth.seed)
    rollout = rolled_out(truth, systems, substructure.motion(systems[MASTER].plan), noise=True)
    plan = with_compensator(updated, chosen)
    channels = kind_of(plan, MASTER).channels
    error, most = math.inf, limited.most(plan)
    peak = math.inf
    if rollout.finite:
        wanted, got = rollout.master[channels.target.name], rollout.master[channels.position]
        rms = float(np.sqrt(np.mean(wanted**2)))
        error = float(np.sqrt(np.mean((got - wanted) ** 2))) / rms if rms > 0.0 else 0.0
        tops = limited.magnitudes(plan, by_role(plan, rollout))
        peak = max(float(np.max(values, initial=0.0)) / most[one] for one, values in tops.items())
    return Trial(name, chosen, error, margins(plan), peak)


def plain(one: Trial) -> dict[str, Any]:
    """A trial as JSON holds it."""
    return {
        "name": one.name,
        "kind": one.chosen.kind,
        "parameters": one.chosen.parameters,
        "tracking_error": finite(one.error),
        "margins": plain_margins(one.margins),
        "largest_share_of_a_limit": finite(one.limit),
    }


def plain_margins(one: Margins) -> dict[str, float | None]:
    """Margins as JSON holds them."""
    return {name: finite(value) for name, value in (one._asdict() | {"margin": one.margin}).items()}


def finite(value: float) -> float | None:
    """A number as JSON can hold it."""
    return value if math.isfinite(value) else None
