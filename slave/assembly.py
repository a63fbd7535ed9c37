"""Builds the parts of the slave's loop, and compiles their kernels, before anything moves."""

from __future__ import annotations

import secrets

from common.host.clock import real
from common.lab.laboratory import Setting
from common.lab.preflight import Gate, PreflightCheck
from common.plan.plan import Plan
from common.reality.reality import Reality
from common.rig import AtRest, GuardedRig
from loop import rigs
from loop.links import link_model
from slave.loop import NO_COMMAND, SlaveLoop
from slave.step import SlaveStep


def preflight(_plan: Plan) -> list[PreflightCheck]:
    """No check: the master judges the test as a whole, and a slave judges its own rig when it is armed."""
    return []


def build_rig(reality: Reality, at_rest: AtRest | None = None, *, paced: bool = False) -> GuardedRig:
    """The rig of the slave whose reality is given, whose sensors `at_rest` judges when it is armed.

    Raises:
        InputError: it cannot be constructed.
    """
    return rigs.build(reality, reality.role, at_rest, paced=paced)


def build_step(reality: Reality) -> SlaveStep:
    """The slave's computation; raises InputError where its compensator is not valid."""
    kind = rigs.hosted(reality, reality.role)
    assert kind is not None  # noqa: S101 - every slave has a laboratory
    return SlaveStep(reality.plan, kind)


def check(reality: Reality) -> None:
    """Raise InputError where a slave's laboratory could not be built, without constructing or moving the rig."""
    rigs.check(reality, reality.role)
    build_step(reality)


def build_loop(
    setting: Setting, reality: Reality, *, instance: int | None = None, gate: Gate | None = None
) -> SlaveLoop:
    """The loop of the slave whose reality is given, with compiled kernels; the setting's plan is the whole test's.

    `instance` identifies this process among others of its role; it is drawn by default. With a `gate` the sensors of
    its rig must pass their check.
    """
    warm_up(reality)
    return SlaveLoop(
        setting,
        build_rig(reality, rigs.at_rest(gate, setting, reality.role), paced=real(setting.clock)),
        link_model(reality),
        role=reality.role,
        instance=instance if instance is not None else secrets.randbelow(2**62) + 1,
    )


def warm_up(reality: Reality) -> None:
    """Compile the kernels by calling them once."""
    rigs.warm_up(reality, reality.role)
    kind = rigs.hosted(reality, reality.role)
    build_step(reality)(NO_COMMAND, (0.0,) * len(kind.channels.names if kind else ()))
