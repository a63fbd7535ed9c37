"""Hostile frames on the link: noise, wrong keys, other sessions, and a peer who has all keys."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_type_hints

import numpy as np

from common.link.transport import TICK
from common.plan.plan import PROTOCOL_VERSION, Plan
from common.protocol import codec
from common.protocol.messages import Arm, Command, Feedback, Message, Register, Start, Stop, Trip
from common.roles import MASTER
from laboratories.kinds import kind_of
from validation.faults.wire import INSIDER, Letter, WireRoute

LONGEST = 300  # bytes of noise, so that frames shorter and longer than real messages are tried
OTHER_SESSION = 77  # any number but the session's
FAR = 100_000  # numbers ahead: more than the ticks of any test here, a loop that took it would reject all later ones


def letter(message: Message, key: codec.Key, origin: str) -> Letter:
    """A message as the frame of a process outside the test."""
    return Letter(codec.encode(message, key), type(message).__name__, -1, 0, origin, intact=False)


def garbage(count: int, chance: np.random.Generator) -> list[Letter]:
    """Frames of random bytes."""
    lengths = chance.integers(0, LONGEST, count).tolist()
    return [Letter(chance.bytes(length), "garbage", -1, 0, "injected", intact=False) for length in lengths]


def forged(direction: WireRoute, plan: Plan, session: int, count: int) -> list[Letter]:
    """Messages of the test's session under the key of another plan."""
    key = codec.session_key(session, plan.digest()[::-1] + "x")
    return [
        letter(tick_message(direction, plan, session, FAR + seq), key, "injected") for seq in range(count)
    ]


def foreign(direction: WireRoute, plan: Plan, count: int) -> list[Letter]:
    """Messages of another session, like those of a test that ran before."""
    key = codec.session_key(OTHER_SESSION, plan.digest())
    return [
        letter(tick_message(direction, plan, OTHER_SESSION, FAR + seq), key, "injected")
        for seq in range(count)
    ]


def tick_message(
    direction: WireRoute, plan: Plan, session: int, seq: int, value: float = 0.01
) -> Command | Feedback:
    """A message of a tick for the direction, its first quantity of a given value."""
    if direction.route.role == MASTER:
        return command(session, seq, value)
    channels = kind_of(plan, direction.route.role).channels
    return feedback(session, seq, value, channels=len(channels.names))


def farthest(direction: WireRoute, plan: Plan) -> float:
    """The limit of the target (m) of the slave at one end of a direction; 1 m where there is none."""
    role = direction.hearer.role if direction.route.role == MASTER else direction.route.role
    kind = kind_of(plan, role)
    return kind.limits(plan.of(role)).get(kind.channels.target.name, 1.0)


def command(session: int, seq: int, target: float, force: float = 0.0) -> Command:
    """A command with a target (m) and a motor's force (N), all else zero."""
    given = {"session": session, "seq": seq, "target": target, "effort": force}
    return Command(**blank(Command) | given)


def feedback(session: int, seq: int, *measured: float, channels: int = 4) -> Feedback:
    """A feedback that answers the command of its tick; its first channels are given, all else is zero."""
    numbers = {"session": session, "seq": seq, "command_seq": seq, "heard_seq": seq}
    values = (*measured, *[0.0] * (channels - len(measured)))
    return Feedback(**blank(Feedback) | numbers | {"measured": values})


def blank(kind: type[Any]) -> dict[str, Any]:
    """Fields of a message, each with the zero value of its type."""
    return {name: hint() for name, hint in get_type_hints(kind).items()}


def insider(direction: WireRoute, plan: Plan, session: int, what: int) -> Letter | None:
    """One message of a peer who knows session and keys; None where this route does not carry its kind."""
    role, on_tick = direction.route.role, direction.route.channel == TICK
    newest = max(direction.ledger.numbers["sent"], default=0)
    ticks: dict[int, Callable[[], Message]] = {
        0: lambda: tick_message(direction, plan, session, newest + 3, 10.0 * farthest(direction, plan)),
        1: lambda: tick_message(direction, plan, session, newest + 3, 0.5 * farthest(direction, plan)),
        2: lambda: tick_message(direction, plan, session, newest + FAR),
    }
    words: dict[int, Callable[[], Message]] = {
        3: lambda: Stop(session, newest, "an insider's stop."),
        4: lambda: Trip(session, role, "insider", "an insider's trip."),
        5: lambda: Register(OTHER_SESSION, PROTOCOL_VERSION, plan.digest()),
        6: lambda: Start(session, 0, 0),
        7: lambda: Arm(session, OTHER_SESSION),
    }
    build = (ticks if on_tick else words).get(what)
    if build is None:
        return None
    key = codec.session_key(session if on_tick else 0, plan.digest())
    return letter(build(), key, INSIDER)
