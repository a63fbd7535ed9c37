"""Everything the master's loop is made of, built and warmed up before anything moves."""

from __future__ import annotations

import secrets

from common.host.clock import real, unix_ns
from common.lab.laboratory import Setting
from common.lab.preflight import Gate, PreflightCheck
from common.plan.plan import Plan
from common.plan.reality import Reality
from common.rig import AtRest, GuardedRig
from common.roles import MASTER
from loop import rigs, substructure
from loop.links import link_model
from loop.nominal import preflight as nominal
from loop.realised import true_system
from master.limits import MasterLimits
from master.loop import MasterLoop
from master.own import OwnLaboratory
from master.step import MasterStep
from models.registry import Array
from models.system import System


def preflight(plan: Plan) -> list[PreflightCheck]:
    """What nominal models say of the test before anything is built; raises InputError where they cannot be."""
    return nominal.checks(plan)


def build_rig(reality: Reality, at_rest: AtRest | None = None, *, paced: bool = False) -> GuardedRig:
    """The master's own laboratory, judged `at_rest` as it is armed; raises InputError where it cannot be."""
    return rigs.build(reality, MASTER, at_rest, paced=paced)


def check(reality: Reality) -> None:
    """Raise InputError where the laboratory could not be built; nothing of it is constructed or moved."""
    master_step(reality)
    rigs.check(reality, MASTER)


def master_step(reality: Reality) -> MasterStep:
    """The master's computation for the building and the ground motion that really are."""
    system = true_system(reality)
    return MasterStep(system.plan, true_ground(system), system.effects.p_delta)


def true_ground(system: System) -> Array:
    """Ground motion that really comes, as the master's kernel takes it."""
    return substructure.ground_rows(system.plan, substructure.motion(system.plan), system.effects.time_shift)


def build_loop(
    setting: Setting,
    reality: Reality,
    *,
    session: int | None = None,
    epoch_ns: int | None = None,
    gate: Gate | None = None,
) -> MasterLoop:
    """The master's loop, its kernels compiled; session and epoch are drawn and read where none are given.

    With a `gate` its rig's sensors must pass it.
    """
    warm_up(reality)
    return MasterLoop(
        setting,
        build_rig(reality, rigs.at_rest(gate, setting, MASTER), paced=real(setting.clock)),
        master_step(reality),
        {role: link_model(reality.of(role)) for role in setting.plan.roles},
        session=session if session is not None else secrets.randbelow(2**62) + 1,
        epoch_ns=epoch_ns if epoch_ns is not None else unix_ns(),
        gate=gate,
    )


def warm_up(reality: Reality) -> None:
    """Compile the kernels on arrays that are thrown away."""
    plan = reality.plan
    own = OwnLaboratory(plan)
    outputs = master_step(reality)(0, 0.0, 0.0, [0.0] * len(plan.roles))
    measured = (0.0,) * (len(own.channels.names) if own.channels else 0)
    MasterLimits(plan).violation(measured, own.command(outputs), outputs)
    rigs.warm_up(reality, MASTER)
