"""The content of a recording as a record: columns by topic and name, ramps to rest, events, metadata, attachments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from common import signals
from common.errors import InputError
from common.roles import LATENCY, MASTER, SLAVE, latency_topic, title

Values = NDArray[Any]

GROUND = "ground_motion"
PEAKS = "peaks"  # metadata: the largest magnitude of each quantity (SI) and its tick, by topic and name
CLOCK = "clock"  # metadata: `kind`, virtual or real
MACHINES = "real_time"  # metadata: real-time settings and load of the laboratories' machines, and the bare timing loop


@dataclass
class Run:
    """The content of a recording: columns by topic and name, metadata, attachments.

    `columns` are arrays (messages,), or (messages, n) for a signal of n storeys or slaves, in SI units; `sequences` and
    `log_ns` are arrays (messages,). `roles` are those of the slaves, and `ramps` holds the columns of the ramps to rest
    by role. `part_of` is the role of the slave whose part of a recording this is, empty for a whole one. `damage` tells
    where the file is damaged; it is read up to there only.
    """

    path: Path
    test: str = ""
    roles: tuple[str, ...] = (SLAVE,)
    part_of: str = ""
    columns: dict[str, dict[str, Values]] = field(default_factory=dict)
    ramps: dict[str, dict[str, Values]] = field(default_factory=dict)
    sequences: dict[str, Values] = field(default_factory=dict)
    log_ns: dict[str, Values] = field(default_factory=dict)
    units: dict[str, dict[str, str]] = field(default_factory=dict)
    texts: dict[str, dict[str, str]] = field(
        default_factory=dict
    )  # meaning of each signal, by topic and name
    shared: dict[str, tuple[str, ...]] = field(
        default_factory=dict
    )  # the slaves' roles of a signal with a value each
    events: list[dict[str, Any]] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    finished: bool = False
    damage: str = ""

    def has(self, topic: str) -> bool:
        """Whether the recording holds any message of a topic."""
        return bool(self.columns.get(topic)) and self.sequences[topic].size > 0

    def ticks(self, topic: str) -> int:
        """How many messages of a topic there are."""
        return int(self.sequences[topic].size) if topic in self.sequences else 0

    def of(self, role: str) -> Run:
        """The part of the recording that belongs to one slave, under the topic names of a test with one slave.

        Raises:
            InputError: the test has no such slave.
        """
        if role not in self.roles:
            there = ", ".join(map(title, self.roles)) or "no slave"
            raise InputError(f"{self.path} has no {title(role)}; it has {there}.")
        if self.roles == (SLAVE,):
            return self
        own = {MASTER: MASTER, SLAVE: role, LATENCY: latency_topic(role)}
        here = {kind: topic for kind, topic in own.items() if topic in self.columns}
        columns = {kind: self.columns[topic] for kind, topic in here.items()}
        if MASTER in columns and len(self.roles) > 1:
            columns[MASTER] = share(columns[MASTER], self.shared, role)
        return replace(
            self,
            roles=(SLAVE,),
            part_of=role,
            columns=columns,
            sequences={kind: self.sequences[topic] for kind, topic in here.items()},
            log_ns={kind: self.log_ns[topic] for kind, topic in here.items()},
            units={kind: self.units[topic] for kind, topic in here.items()},
            texts={kind: self.texts[topic] for kind, topic in here.items()},
            shared={},
        )

    def signal(self, name: str) -> Values | None:
        """A signal by name, from the laboratory that computed or measured it; None where it is not recorded."""
        for topic in signals.TICK_TOPICS:  # a slave's measurements are in its own topic only
            if name in self.columns.get(topic, {}):
                return self.columns[topic][name]
        return None


def share(
    columns: Mapping[str, Values], shared: Mapping[str, tuple[str, ...]], role: str
) -> dict[str, Values]:
    """The master's columns for one slave: its own value of a column with a value per slave, and none of other slaves.

    `shared` holds the roles of the slaves of such a column, by its name.
    """
    mine = {name: roles.index(role) for name, roles in shared.items() if role in roles and len(roles) > 1}
    return {
        name: column[:, mine[name]] if name in mine and column.size else column
        for name, column in columns.items()
        if name not in shared or role in shared[name]
    }
