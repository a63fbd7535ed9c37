"""The signals of a simulated test, by the names and topics of a recording."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from common import signals as table
from common.plan.plan import Plan
from common.roles import MASTER, SLAVE, name_of
from laboratories import kinds
from laboratories.kinds import kinds_of
from loop.closed_loop import Rollout, per_kind
from loop.names import sent_names
from models.registry import Array


def signals(plan: Plan, rollout: Rollout) -> dict[str, Array]:
    """The rollout's signals by name, as a recording names them; (ticks,), (ticks, storeys) or (ticks, slaves) each.

    Signals of a named slave are called `NAME.signal`. Those of a slave without a name are called `slave.signal` where
    the master's own laboratory has a signal of the same name.
    """
    result: dict[str, Array] = {}
    order = kinds.topics(plan)
    own = {row.name for row in order[MASTER] if not row.slaves} - {table.TIME.name}
    for topic, columns in topics(plan, rollout).items():
        name = name_of(topic)
        for row in order[topic]:
            key = row.name
            if row.kind not in (table.FieldType.NUMBER, table.FieldType.STOREYS) or key not in columns:
                continue
            if name and key != table.TIME.name:
                result[f"{name}.{key}"] = columns[key]
            elif topic != MASTER and key in own:
                result[f"{SLAVE}.{key}"] = columns[key]
            elif not name:
                result.setdefault(key, columns[key])
    for name in [name for name in result if name in ages(plan, rollout.slaves)]:
        del result[name]
    return result


def ages(plan: Plan, slaves: Iterable[str]) -> set[str]:
    """The names of the ages of the forces that the master used."""
    hosted = kinds_of(plan)
    return {f"{hosted[role].channels.force}_age" for role in slaves}


def received(plan: Plan, rollout: Rollout) -> dict[str, dict[str, Array]]:
    """The values sent to each slave, (ticks,) each, by role and name in its own topic, at the ticks of sending."""
    hosted, names = kinds_of(plan), sent_names(plan)
    groups = table.alike({role: hosted[role].channels for role in rollout.slaves})
    result: dict[str, dict[str, Array]] = {}
    for channels, roles in groups.items():
        for place, role in enumerate(roles):
            sent = (rollout.master[name] for name in names[role])
            values = (every if len(roles) == 1 else every[:, place] for every in sent)
            result[role] = dict(zip(channels.sent, values, strict=True))
    return result


def by_role(plan: Plan, rollout: Rollout) -> dict[str, dict[str, Array]]:
    """The signals of building and master, and by role the values that each slave was sent, wrote and measured."""
    sent = received(plan, rollout)
    return {MASTER: rollout.master} | {role: sent[role] | own for role, own in rollout.slaves.items()}


def topics(plan: Plan, rollout: Rollout) -> dict[str, dict[str, Any]]:
    """All signals that a recording of the simulation holds, by topic and name."""
    seq = np.arange(rollout.ticks)
    own: dict[str, Any] = {"seq": seq, "t": seq.astype(np.float64) * plan.test.interval}
    used = {role: item.feedback[: rollout.ticks] for role, item in rollout.exchange.items()}
    age = {role: np.where(of < 0, 0.0, (seq - of) * plan.test.interval) for role, of in used.items()}
    about = per_kind(plan, used, "seq") | per_kind(plan, age, "age")
    result = {MASTER: own | rollout.master | about}
    sent = received(plan, rollout)
    for role, columns in rollout.slaves.items():
        command = rollout.exchange[role].command[: rollout.ticks]
        came = {name: np.where(command < 0, 0.0, values[command]) for name, values in sent[role].items()}
        result[role] = own | {"command_seq": command} | came | columns
    return result


def rows(plan: Plan, rollout: Rollout) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """The rollout's messages as a recording holds them: topic and values in the order of the signal table."""
    order = kinds.topics(plan)
    tables = {
        topic: list(zip(*(columns[row.name].tolist() for row in order[topic]), strict=True))
        for topic, columns in topics(plan, rollout).items()
    }
    for tick in range(rollout.ticks):
        for topic, values in tables.items():
            yield topic, values[tick]
