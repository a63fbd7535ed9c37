"""The paper's experiments, run on the emulated laboratories in virtual time and recorded."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from common.lab.preflight import Gate
from common.plan import read as plans
from common.plan.laboratory_tables import Actuator, CompensatorTable, Control, TableCompensator
from common.plan.plan import Plan, ideal
from common.plan.tables import GroundMotionTable
from common.reality.reality import as_planned
from common.recording.reader import read
from common.recording.run import Run
from common.terminal import cli
from common.terminal.telling import Tell
from loop import substructure
from loop.closed_loop import simulate
from loop.nominal import preflight
from loop.nominal.partition import felt, storey_stiffness
from loop.signals import signals
from models import indicators
from models.registry import Array
from simulation import benches, virtual
from simulation.benches import Order

GAINS = {"proportional": 1.93, "integral": 0.047, "derivative": 0.0}  # as printed in the paper
PID = CompensatorTable("pid", GAINS)
BEYOND = CompensatorTable(
    "pid_inverse", {**GAINS, "delay": 0.014, "time_constant": 0.030}
)  # the paper's L and T
# The table's lag at low frequency: 2ζ/ω of its loop and its dead time.
TABLE_LEAD = TableCompensator("taylor", {"lead": 0.01885, "order": 2.0})
PULSE = 0.1  # s, length of the pulse that starts a free vibration: a fifth of the building's period
UNSTABLE = "uncompensated"  # unstable on purpose; its limits stop it
DELAYS = (
    np.array([0.0, 2.0, 4.0, 8.0, 12.0, 16.0]) * 1e-3
)  # s, up to the paper's residual of 16 ms with PID alone


@dataclass
class PaperEvidence:
    """Results of the experiments."""

    default: Plan
    paper: Plan
    benches: dict[str, Run] = field(default_factory=dict)
    tests: dict[str, Run] = field(default_factory=dict)
    simulations: dict[str, dict[str, Array]] = field(default_factory=dict)
    damping: dict[str, float] = field(default_factory=dict)  # ratio, from free vibration
    period: float = 0.0  # s
    damping_by_delay: Array = field(default_factory=lambda: np.zeros(0))
    critical_delay: tuple[float, float] = (0.0, 0.0)  # bracket, s


def gather(folder: Path, tell: Tell) -> PaperEvidence:
    """Run everything; recordings go into `folder`."""
    default, paper = (plans.load(cli.plan_path(name)) for name in ("default", "paper"))
    evidence = PaperEvidence(default, paper)
    run_benches(evidence, folder, tell)
    run_tests(evidence, folder, tell)
    tell("pure simulations and free vibrations", 0, 0)
    run_simulations(evidence)
    free_vibrations(evidence)
    evidence.critical_delay = bisect(evidence.default)
    return evidence


def without_amd(plan: Plan) -> Plan:
    """The plan with no damper on the building."""
    return replace(plan, control=Control(amd=False, gain=plan.control.gain))


def unwatched(plan: Plan) -> Plan:
    """The plan without the limits that recognise an unstable loop early: the paper's diverged until it was stopped."""
    return replace(plan, limits=replace(plan.limits, error_energy=math.inf, column_error=math.inf))


def at_scale(plan: Plan, scale: float) -> Plan:
    """The plan at another scale of the record."""
    return replace(plan, ground_motion=GroundMotionTable(plan.ground_motion.record, scale))


def compensated_by(plan: Plan, compensator: CompensatorTable) -> Plan:
    """The plan with another compensator of the actuator."""
    return replace(plan, compensator=compensator)


def beyond(plan: Plan) -> Plan:
    """The plan with the best compensation of actuator and table by this package with constant parameters."""
    return replace(plan, compensator=BEYOND, table=replace(plan.table, compensator=TABLE_LEAD))


def run_benches(evidence: PaperEvidence, folder: Path, tell: Tell) -> None:
    """Run the characterisation tests, with noise."""
    default, paper = evidence.default, evidence.paper
    realistic = plans.load(cli.plan_path("rc_column"))
    orders = {
        "column": (default, Order("column")),
        "rc-column": (realistic, Order("column")),
        "actuator": (default, Order("actuator")),
        "actuator-paper": (paper, Order("actuator", compensated=True, only=("sine",))),
        "actuator-pid": (compensated_by(default, PID), Order("actuator", compensated=True, only=("random",))),
        "table": (default, Order("table")),
        "damper": (default, Order("damper")),
    }
    for number, (name, (plan, order)) in enumerate(orders.items(), 1):
        tell(f"bench test {name}", number, len(orders))
        path = folder / f"bench-{name}.mcap"
        result = benches.play(plan, as_planned(plan), order, path, never)
        if result.error is not None:
            raise result.error
        evidence.benches[name] = read(path)


def run_tests(evidence: PaperEvidence, folder: Path, tell: Tell) -> None:
    """Run closed-loop tests of both laboratories with the real loops; the unstable one is stopped by its limits."""
    default, paper = evidence.default, evidence.paper
    cases = {
        UNSTABLE: unwatched(without_amd(compensated_by(default, CompensatorTable("none", {})))),
        "pid": compensated_by(default, PID),
        "pid-taylor": paper,
        "beyond": beyond(default),
        "with-amd-20": at_scale(paper, 0.2),
        "without-amd-20": without_amd(at_scale(paper, 0.2)),
    }
    for number, (name, plan) in enumerate(cases.items(), 1):
        tell(f"closed-loop test {name}", number, len(cases))
        path = folder / f"test-{name}.mcap"
        bench = virtual.assemble(plan, as_planned(plan), path, gate=gate_of(name, plan))
        error = virtual.run(bench, never)
        if error is not None and name != UNSTABLE:
            raise error
        evidence.tests[name] = read(path)


def gate_of(name: str, plan: Plan) -> Gate:
    """The gate that a case must pass; the unstable one accepts the risks by name."""
    gate = Gate(("partition", "peaks") if name == UNSTABLE else ())
    gate.judge(preflight.checks(plan))
    return gate


def never() -> str:
    """No reason to stop: no user stops an experiment."""
    return ""


def run_simulations(evidence: PaperEvidence) -> None:
    """The pure simulation, and the same with the damping lost by the residual delay subtracted from the building's."""
    plan = evidence.default
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    evidence.simulations["ideal"] = simulated(ideal(plan), ground)
    for name in ("pid", "pid-taylor"):
        run = evidence.tests[name].columns["master"]
        path = indicators.frequency_evaluation_index(
            run["column_target"], run["column_displacement"], plan.test.interval
        )
        evidence.simulations[f"{name}-equivalent"] = simulated(with_path(ideal(plan), path), ground)


def simulated(plan: Plan, ground: Array) -> dict[str, Array]:
    """Signals of the closed loop without noise."""
    return signals(plan, simulate(plan, ground))


def with_path(plan: Plan, path: Any) -> Plan:
    """The building with stiffness and damping equivalent to an amplitude and a delay in the column's path."""
    column, structure = plan.column, plan.structure
    omega = float(np.sqrt(storey_stiffness(plan) / structure.mass[0]))
    lost, _ = indicators.damping_equivalent(felt(plan).stiffness, path.amplitude, path.delay, omega)
    softer = column.stiffness * path.amplitude * float(np.cos(omega * path.delay))
    return replace(
        plan,
        structure=replace(structure, damping=(structure.damping[0] - lost,)),
        column=replace(column, stiffness=softer),
    )


def pulse(plan: Plan) -> Array:
    """Ground rows of one short pulse of acceleration; for the table the ground stays at rest."""
    t = np.arange(plan.ticks + 1) * plan.test.interval
    rows = np.zeros((2, t.size))
    rows[0] = np.where(t < PULSE, np.sin(2.0 * np.pi * t / PULSE), 0.0)
    return rows


def free_damping(plan: Plan, *, noise: bool = True) -> tuple[float, float]:
    """Frequency (Hz) and damping ratio of the free vibration after a pulse."""
    plan = plans.with_test(plan, duration=6.0)
    columns = signals(plan, simulate(plan, pulse(plan), seed=plan.test.seed if noise else None))
    begin = round(0.5 / plan.test.interval)
    return indicators.free_vibration_damping(columns["displacement"][begin:], plan.test.interval)


def delayed(plan: Plan, delay: float) -> Plan:
    """The plan with only a dead time in the column's path, and no damper."""
    return without_amd(replace(ideal(plan), actuator=Actuator(gain=1.0, delay=delay, time_constant=0.0)))


def free_vibrations(evidence: PaperEvidence) -> None:
    """Damping from free vibration of the cases that the table needs."""
    default, paper = evidence.default, evidence.paper
    cases = {
        "ideal": without_amd(ideal(default)),
        "ideal-amd": ideal(default),
        "paper": without_amd(paper),
        "paper-amd": paper,
        "beyond": without_amd(beyond(default)),
    }
    for name, plan in cases.items():
        frequency, evidence.damping[name] = free_damping(plan)
        if name == "ideal":
            evidence.period = 1.0 / frequency
    evidence.damping_by_delay = np.array(
        [free_damping(delayed(default, float(delay)), noise=False)[1] for delay in DELAYS]
    )


def bisect(plan: Plan) -> tuple[float, float]:
    """Two delays (s), at most 0.1 ms apart, between which the closed loop becomes unstable."""
    low, high, width = 0.01, 0.1, 1e-4
    while high - low > width:
        middle = 0.5 * (low + high)
        if free_damping(delayed(plan, middle), noise=False)[1] > 0.0:
            low = middle
        else:
            high = middle
    return low, high
