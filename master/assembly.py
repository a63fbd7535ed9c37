"""Builds the parts of the master's loop, and compiles their kernels, before anything moves."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from datetime import date

from common.foreign import PATIENCE_S, file_of
from common.host.clock import real, unix_ns
from common.lab.laboratory import Setting
from common.lab.preflight import Gate, PreflightCheck, calibration_checks
from common.plan.plan import Plan
from common.reality.reality import Reality
from common.rig import AtRest, GuardedRig
from common.roles import MASTER
from common.signals import OF_STOREYS
from laboratories import kinds
from loop import foreign, rigs, substructure
from loop.links import link_model
from loop.nominal import preflight as nominal
from loop.realised import true_system
from master.building import BuildingStep, Outputs
from master.client.building import ClientBuilding, compensator
from master.client.coupled import CoupledLaboratory
from master.client.pace import AsFastAsItGoes, RealTime
from master.foreign import ForeignBuilding
from master.limits import MasterLimits
from master.loop import MasterLoop
from master.own import OwnLaboratory
from master.step import MasterStep
from models.registry import Array
from models.system import System


def preflight(plan: Plan) -> list[PreflightCheck]:
    """The checks of the plan by nominal models; raises InputError where a model or parameter is not valid."""
    return [*nominal.checks(plan), *foreign.checked(plan), *calibration_checks(plan, date.today())]


def build_rig(reality: Reality, at_rest: AtRest | None = None, *, paced: bool = False) -> GuardedRig:
    """The master's own rig, whose sensors `at_rest` judges when it is armed.

    Raises InputError if it cannot be built.
    """
    return rigs.build(reality, MASTER, at_rest, paced=paced)


def check(reality: Reality) -> None:
    """Raise InputError where the laboratory could not be built, without constructing or moving the rig."""
    if reality.plan.served or reality.plan.foreign:
        compensator(reality.plan)
    else:
        master_step(reality)
    if reality.plan.foreign:
        file_of(reality.plan.structure.model, reality.plan.base)
        foreign.stiffnesses(reality.plan)
    rigs.check(reality, MASTER)


def master_step(reality: Reality) -> MasterStep:
    """The master's computation for the true building and the true ground motion."""
    system = true_system(reality)
    return MasterStep(system.plan, true_ground(system), system.effects.p_delta)


def true_ground(system: System) -> Array:
    """The true ground motion (2, ticks + 1), as `substructure.ground_rows` returns it."""
    return substructure.ground_rows(system.plan, substructure.motion(system.plan), system.effects.time_shift)


def build_loop(
    setting: Setting,
    reality: Reality,
    *,
    session: int | None = None,
    epoch_ns: int | None = None,
    gate: Gate | None = None,
) -> MasterLoop:
    """The master's loop with compiled kernels; by default the session is drawn and the epoch read from the clock.

    With a `gate` the sensors of its rig must pass their check.
    """
    warm_up(reality)
    step = foreign_building(reality, setting) if reality.plan.foreign else master_step(reality)
    return serve(setting, reality, building=step, session=session, epoch_ns=epoch_ns, gate=gate)


def foreign_building(reality: Reality, setting: Setting) -> ForeignBuilding:
    """The building that another program computes, started; raises InputError where it cannot be."""
    system = true_system(reality)
    plan, rows = system.plan, true_ground(system)
    pace = RealTime(plan) if real(setting.clock) else AsFastAsItGoes(PATIENCE_S, str, "building")
    return ForeignBuilding(plan, foreign.started(plan, rows[0]), rows, pace)


def serve(
    setting: Setting,
    reality: Reality,
    *,
    building: BuildingStep,
    session: int | None = None,
    epoch_ns: int | None = None,
    gate: Gate | None = None,
) -> MasterLoop:
    """The loop of a master with the given `building`, whose kernels must be compiled; otherwise as `build_loop`."""
    return MasterLoop(
        setting,
        build_rig(reality, rigs.at_rest(gate, setting, MASTER), paced=real(setting.clock)),
        building,
        {role: link_model(reality.of(role)) for role in setting.plan.roles},
        session=session if session is not None else secrets.randbelow(2**62) + 1,
        epoch_ns=epoch_ns if epoch_ns is not None else unix_ns(),
        gate=gate,
    )


class Served:
    """Builds a master that serves clients of OpenSees at `addresses` in real time."""

    def __init__(self, addresses: Sequence[str]) -> None:
        self._addresses = addresses

    def warm_up(self, reality: Reality) -> None:
        """Compile the kernels."""
        warm_up_served(reality)

    def preflight(self, _plan: Plan) -> list[PreflightCheck]:
        """No checks, because the client's building is not known."""
        return []

    def build_loop(self, setting: Setting, reality: Reality, *, gate: Gate | None = None) -> MasterLoop:
        """The loop, with open ports; raises InputError if a port cannot be opened."""
        plan = setting.plan
        building = ClientBuilding(plan, self._addresses, RealTime(plan))
        return serve(setting, reality, building=building, gate=gate)


def warm_up_served(reality: Reality) -> None:
    """Compile the master's kernels for a building of a client or of another program."""
    plan = reality.plan
    compensator(plan)
    for kind in kinds.kinds_of(plan).values():
        CoupledLaboratory(kind.coupling(plan), plan.test.interval, 1).resists(0.0)
    storeys = [0.0] * (len(OF_STOREYS) * plan.storeys * (not plan.served))
    sent = [(0.0,) * substructure.SENT_VALUES for _ in plan.roles]
    of_own(reality, Outputs(0.0, 0.0, 0.0, 0.0, sent, storeys))


def warm_up(reality: Reality) -> None:
    """Compile the kernels by calling them once."""
    if reality.plan.foreign:
        warm_up_served(reality)
        return
    of_own(reality, master_step(reality)(0, 0.0, 0.0, [0.0] * len(reality.plan.roles)))


def of_own(reality: Reality, outputs: Outputs) -> None:
    """Compile the kernels of the master's own laboratory and of the limits."""
    plan = reality.plan
    own = OwnLaboratory(plan)
    measured = (0.0,) * (len(own.channels.names) if own.channels else 0)
    MasterLimits(plan).violation(measured, own.command(outputs), outputs)
    rigs.warm_up(reality, MASTER)
