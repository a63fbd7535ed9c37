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
from simulation.prediction.draws import FoundLaboratories, drawn

PLANNED = "as planned"
# Gains of the feedback loop: GAINS, those of the paper and of the default test, beside a feedforward; WEAKER beside an
# inverse model, which leaves the feedback little to correct.
GAINS = {"proportional": 1.93, "integral": 0.047, "derivative": 0.0}
WEAKER = {"proportional": 1.0, "integral": 0.0, "derivative": 0.0}


class Lag(NamedTuple):
    """A transfer system at low frequency: a dead time, a lag and a gain."""

    delay: float  # s
    time_constant: float  # s
    gain: float

    @property
    def whole(self) -> float:
        """The total delay at low frequency, s."""
        return self.delay + self.time_constant

    @property
    def inverse(self) -> dict[str, float]:
        """Coefficients of the derivatives of the target, up to the third, in the series of its inverse."""
        late, lag = self.delay, self.time_constant
        series = (1.0, late + lag, late * (0.5 * late + lag), late**2 * (late / 6.0 + 0.5 * lag))
        return {f"a{order}": value / self.gain for order, value in enumerate(series)}


class Margins(NamedTuple):
    """The figures of pre-flight for the column's path under a compensator."""

    critical: float  # s, delay beyond which the loop is unstable
    expected: float  # s, delay to expect
    damping_points: float  # change of the first mode's damping ratio by the path

    @property
    def margin(self) -> float:
        """Critical over expected delay; inf if no delay is expected."""
        return self.critical / self.expected if self.expected > 0.0 else math.inf


class Trial(NamedTuple):
    """The results of one compensator on the laboratories as found."""

    name: str
    chosen: CompensatorTable
    error: float  # rms of measured minus target over that of the target; inf where the loop diverges
    margins: Margins
    limit: float  # largest ratio of a peak to its limit

    def serves(self, wanted: float) -> bool:
        """Whether the loop is stable, keeps the plan's limits and has at least the wanted margin."""
        return self.limit <= 1.0 and math.isfinite(self.error) and self.margins.margin >= wanted


def margins(plan: Plan) -> Margins:
    """The margins of a plan's nominal models."""
    found = assess(plan)
    expected = expected_delay(plan, found)
    return Margins(found.critical_delay, expected, found.damping_points)


def lag_of(plan: Plan) -> Lag:
    """The actuator of a plan at low frequency; a servo-hydraulic one counts as a pure delay."""
    actuator = plan.actuator
    if actuator.model == "servo_hydraulic":
        bare = replace(plan, compensator=replace(plan.compensator, kind="none", parameters={}))
        return Lag(assess(bare).delay, 0.0, 1.0)
    return Lag(actuator.delay, actuator.time_constant, actuator.gain)


def settings(plan: Plan) -> dict[str, CompensatorTable]:
    """The plan's own compensator first, then every other with parameters derived from the plan's actuator."""
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
    """The results of all compensators, the best first; empty if the master drives no column.

    Errors are those of the laboratories as found; margins are those of the updated plan's nominal models.
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
    """The plan with another compensator of the actuator, and with the same correction of the measured force."""
    return replace(
        plan, compensator=replace(plan.compensator, kind=chosen.kind, parameters=dict(chosen.parameters))
    )


def trial(found: FoundLaboratories, updated: Plan, name: str, chosen: CompensatorTable) -> Trial:
    """Simulate the test with one compensator on the laboratories as found."""
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
    """A trial as plain values for JSON."""
    return {
        "name": one.name,
        "kind": one.chosen.kind,
        "parameters": one.chosen.parameters,
        "tracking_error": finite(one.error),
        "margins": plain_margins(one.margins),
        "largest_share_of_a_limit": finite(one.limit),
    }


def plain_margins(one: Margins) -> dict[str, float | None]:
    """Margins as plain values for JSON."""
    return {name: finite(value) for name, value in (one._asdict() | {"margin": one.margin}).items()}


def finite(value: float) -> float | None:
    """A finite number, or None, since JSON has no infinity."""
    return value if math.isfinite(value) else None
