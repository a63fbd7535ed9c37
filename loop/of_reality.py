"""The compiled simulation of the closed loop with the deviations of a reality."""

from __future__ import annotations

from collections.abc import Mapping

from common.errors import InputError
from common.reality.reality import Reality
from common.roles import MASTER
from loop import substructure
from loop.closed_loop import Rollout, simulate
from loop.exchange import exchange
from loop.links import link_model
from loop.realised import true_slaves, true_system
from models.ground_motion import GroundMotion
from models.system import System


def really(truth: Reality, *, noise: bool) -> Rollout:
    """The simulation of the true laboratories and the true network of a reality.

    Raises:
        InputError: a laboratory's rig is a plug-in, which has no model, or an effect cannot be applied.
    """
    refuse_plugins(truth)
    systems = {MASTER: true_system(truth)} | true_slaves(truth)
    return rolled_out(truth, systems, substructure.motion(systems[MASTER].plan), noise=noise)


def refuse_plugins(truth: Reality) -> None:
    """Raise InputError where a laboratory's rig is a plug-in, which has no model."""
    rigs = {MASTER: truth.master} | {role: truth.of(role).slave for role in truth.plan.roles}
    for role, rig in rigs.items():
        if rig.class_:
            raise InputError(
                f"[{role}.rig] names a plug-in, which a simulation has no model of: use rths run --virtual."
            )


def rolled_out(
    truth: Reality, systems: Mapping[str, System], motion: GroundMotion, *, noise: bool
) -> Rollout:
    """The simulation of laboratories by role, with the reality's links and, with `noise`, its seed."""
    master, slaves = systems[MASTER], {role: systems[role] for role in truth.plan.roles}
    plan = master.plan
    ground = substructure.ground_rows(plan, motion, master.effects.time_shift)
    links = {role: link_model(truth.of(role)) for role in plan.roles}
    return simulate(
        plan,
        ground,
        effects=master.effects,
        slaves=slaves,
        seed=truth.seed if noise else None,
        exchange={role: exchange(plan.ticks, plan.test.interval, link) for role, link in links.items()},
    )
