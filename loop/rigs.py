"""The rig of a role by plan and reality: emulated, of a class of the user's, or none."""

from __future__ import annotations

from functools import partial
from typing import Any

from common.lab.laboratory import Setting
from common.lab.preflight import Gate, SensorsAtRest
from common.plan import patience
from common.plan.plan import Plan
from common.plan.plugins import construct, find
from common.reality.reality import Reality, as_planned
from common.rig import METHODS, AtRest, GuardedRig, NoRig, NothingMeasurement, measurement_of
from common.roles import MASTER, name_of, title
from common.udp import packets
from common.udp.probe import Probed, probe
from common.udp.rig import Terms, UdpRig
from laboratories import kinds
from laboratories.emulated import EmulatedLab
from laboratories.kind import Kind
from laboratories.limits import TickLimits
from laboratories.sensors import noise, readings
from loop.realised import true_system

OWN = "rths."  # package of the rigs that ship with this program
FREE_SILENCE = 10.0  # s without a packet in virtual time: a computation that is held up for longer is dead


def hosted(reality: Reality, role: str) -> Kind | None:
    """The kind of laboratory of a role, None for a master without one; raises InputError as `kinds.kind_of`."""
    plan = (reality.whole or reality).plan
    return kinds.own(plan) if role == MASTER else kinds.kind_of(plan, role)


def build(
    reality: Reality,
    role: str,
    at_rest: AtRest | None = None,
    *,
    paced: bool = False,
    seed: int | None = None,
) -> GuardedRig:
    """A role's rig, whose sensors `at_rest` judges when it is armed; `reality` is that of the slave's role.

    Its seed is that of `rig_seed`, unless one is given. In a test in real time (`paced`) the answers of a rig in
    another process must come within the plan's time limits.

    Raises:
        InputError: it cannot be constructed.
    """
    kind, hidden = hosted(reality, role), role in reality.hidden
    name, where = called(role), f"[{role}.rig]"
    if kind is None:
        return GuardedRig(NoRig(), name, NothingMeasurement)
    measurement = measurement_of(kind.channels)
    rig = reality.master if role == MASTER else reality.slave
    seed = rig_seed(reality, role) if seed is None else seed
    if rig.address:
        terms = exchange(reality, role, seed, paced=paced)
        shown = name if hidden else f"{name} ({rig.address})"
        return GuardedRig(UdpRig(kind.channels, terms), shown, measurement, hidden=hidden, at_rest=at_rest)
    if not rig.class_:
        twin = partial(EmulatedLab, kind, true_system(reality), seed)
        return GuardedRig(twin(), name, measurement, at_rest=at_rest, twin=twin)
    found = find(rig.class_, reality.base, where)
    arguments: dict[str, Any] = {"interval": reality.plan.test.interval, "seed": seed}
    built = construct(found, arguments | rig.options, where, METHODS)
    shown = name if hidden else f"{name} ({found.__name__})"
    return GuardedRig(built, shown, measurement, hidden=hidden, at_rest=at_rest)


def rig_seed(reality: Reality, role: str) -> int:
    """The seed of a role's rig under that of the reality."""
    place = noise.LAB_A if role == MASTER else noise.LAB_B + reality.place
    return noise.lab_seed(reality.seed, place)


def exchange(reality: Reality, role: str, seed: int, *, paced: bool) -> Terms:
    """The terms of the exchange with a role's rig in another process.

    The rig's own time limit without packets is the larger of the time by which this laboratory's loop may be late and
    twice the time of missing answers after which the laboratory ramps down: as long as the laboratory runs, it brings
    the rig to rest itself. In virtual time a tick may take any time.
    """
    plan = patience.strict(reality.plan)
    rig = reality.master if role == MASTER else reality.slave
    interval, safety = plan.test.interval, plan.safety
    return Terms(
        rig.address,
        f"[{role}.rig]",
        interval,
        seed,
        rig.answer_share * interval,
        rig.arm_timeout,
        max(safety.overrun, 2 * safety.ramp_after) * interval if paced else FREE_SILENCE,
        safety.ramp_after,
        paced,
    )


def probed(plan: Plan) -> list[Probed]:
    """Ask every rig of a plan that runs in another process whether it answers; nothing moves."""
    reality, found = as_planned(plan), []
    for role, kind in kinds.kinds_of(plan).items():
        own = reality.of(role)
        rig = own.master if role == MASTER else own.slave
        if rig.address:
            terms = exchange(own, role, 0, paced=True)
            found.append(probe(terms, packets.number(kind.channels)))
    return found


def tried(plan: Plan) -> None:
    """Construct every rig of a plan whose class is this program's own, and let it go; nothing is armed.

    Behind such a class stands a model in OpenSees or an FMU. A class of the user's is not imported: it may stand for a
    device.

    Raises:
        InputError: one cannot be constructed.
    """
    reality = as_planned(plan)
    for role in kinds.kinds_of(plan):
        own = reality.of(role)
        if (own.master if role == MASTER else own.slave).class_.startswith(OWN):
            build(own, role).disarm()


def called(role: str) -> str:
    """The name of a role's laboratory in errors."""
    if role == MASTER:
        return "laboratory A"
    return f"laboratory B of the {title(role)}" if name_of(role) else "laboratory B"


def check(reality: Reality, role: str) -> None:
    """Raise InputError where a role's laboratory could not be built, without constructing or moving the rig."""
    kind = hosted(reality, role)
    if kind is not None:
        kind.build(true_system(reality))
    rig = reality.master if role == MASTER else reality.slave
    if rig.class_:
        find(rig.class_, reality.base, f"[{role}.rig]")


def at_rest(gate: Gate | None, setting: Setting, role: str) -> AtRest | None:
    """The check of the sensors of a role's rig at rest, None without a gate or without a rig."""
    if gate is None or role not in setting.plan.kinds:
        return None
    kind = kinds.kind_of(setting.plan, role)
    # offsets are compared with the limits for a rig, even for emulated ones
    plan = patience.strict(setting.plan.of(role))
    levels = dict(zip(kind.channels.names, kind.noise(plan).tolist(), strict=True))
    return SensorsAtRest(gate, setting, kind.limits(plan), levels)


def warm_up(reality: Reality, role: str) -> None:
    """Compile the kernels of a role's emulated laboratory and of its limits."""
    kind = hosted(reality, role)
    if kind is not None:
        kind.mover(kind.build(true_system(reality)))(*(0.0 for _ in kind.channels.drives))
    readings.step(readings.build(reality.plan.test.interval, ("any",), {}), 0, 0.0, 0.0, 0.0)
    TickLimits(None, reality.plan, [], commands=0).violation(0.0)
