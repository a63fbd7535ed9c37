"""The table of signals: the signals of a recording with their units and meanings.

The MCAP schemas, listings, plots, exports and limits derive from this table. The signals of a laboratory follow from
the channels of its kind.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from common.errors import InputError
from common.roles import MASTER as MASTER_ROLE
from common.roles import SLAVE as SLAVE_ROLE
from common.roles import latency_topic, ramp_topic


class FieldType(Enum):
    """How a signal is stored: the protobuf type of its field."""

    NUMBER = "double"
    STOREYS = "double per storey"  # a scalar where the structure has one storey
    COUNT = "uint32"
    INDEX = "int32"  # a count in which -1 says "none yet"
    STAMP = "int64"
    FLAG = "bool"
    TEXT = "string"
    VALUES = "map<string, double>"


class Signal(NamedTuple):
    """One field of a recorded message."""

    name: str
    unit: str
    text: str
    kind: FieldType = FieldType.NUMBER
    slaves: tuple[str, ...] = ()  # roles of the slaves for which it has a value each; a scalar for one slave

    def count(self, storeys: int) -> int:
        """How many numbers it holds in a building with this number of storeys."""
        return storeys if self.kind is FieldType.STOREYS else max(len(self.slaves), 1)


RATES = ("velocity", "acceleration", "jerk")  # of a target, each a signal of its own
UNITS_OF_RATES = ("m/s", "m/s²", "m/s³")


@dataclass(frozen=True)
class Channels:
    """The signals of a kind of laboratory, each with its unit and meaning."""

    target: Signal
    command: Signal
    measured: tuple[Signal, ...]
    position: str  # the measured channel that a compensator compares with the target
    force: str  # the measured channel that goes back to the building
    effort: Signal | None = None  # commanded force of a motor, where the kind has one

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the measured channels, in the order of the kind's kernel."""
        return tuple(signal.name for signal in self.measured)

    @property
    def driving(self) -> tuple[Signal, ...]:
        """The target, and the motor's commanded force where the kind has one."""
        return (self.target, *([self.effort] if self.effort else []))

    @property
    def drives(self) -> tuple[str, ...]:
        """The names of the commands written to a rig: the transfer system's, and the motor's where there is one."""
        return (self.command.name, *([self.effort.name] if self.effort else []))

    @property
    def rates(self) -> tuple[str, ...]:
        """The names of the target's rates."""
        return tuple(f"{self.target.name}_{rate}" for rate in RATES)

    @property
    def sent(self) -> tuple[str, ...]:
        """The names of the values sent to a laboratory at a tick.

        Target, motor's force where it has one, target's rates.
        """
        return (*(signal.name for signal in self.driving), *self.rates)

    @property
    def used(self) -> str:
        """The name of the master's signal with a slave's force as a tick used it."""
        return f"{self.force}_used"

    @property
    def used_seq(self) -> str:
        """The name of the master's signal with the tick at which the slave measured the force that was used."""
        return f"{self.force}_seq"

    @property
    def used_age(self) -> str:
        """The name of the master's signal with the age of the force that was used."""
        return f"{self.force}_age"


COLUMN_CHANNELS = Channels(
    target=Signal("column_target", "m", "specimen deformation wanted"),
    command=Signal(
        "actuator_command",
        "m",
        "command written, to be reached at the end of the interval, or held from the tick on",
    ),
    measured=(
        Signal("column_displacement", "m", "specimen deformation measured"),
        Signal("column_force", "N", "restoring force of the specimen measured"),
    ),
    position="column_displacement",
    force="column_force",
)

TABLE_CHANNELS = Channels(
    target=Signal("table_target", "m", "absolute floor displacement wanted"),
    command=Signal(
        "table_command", "m", "command written to the table, to be reached at the end of the interval"
    ),
    measured=(
        Signal("table_displacement", "m", "table displacement measured"),
        Signal("table_acceleration", "m/s²", "table acceleration measured"),
        Signal("damper_stroke", "m", "stroke of the damper measured"),
        Signal("damper_force", "N", "force of the damper on the table measured"),
    ),
    position="table_displacement",
    force="damper_force",
    effort=Signal("damper_command", "N", "motor force of the damper"),
)


SEQ = Signal("seq", "", "tick number", FieldType.COUNT)
TIME = Signal("t", "s", "test time of the tick")

BUILDING = (
    SEQ,
    TIME,
    Signal("ground_acceleration", "m/s²", "ground acceleration"),
    Signal("displacement", "m", "displacement relative to the ground", FieldType.STOREYS),
    Signal("velocity", "m/s", "velocity relative to the ground", FieldType.STOREYS),
    Signal("acceleration", "m/s²", "acceleration relative to the ground", FieldType.STOREYS),
    Signal("absolute_acceleration", "m/s²", "absolute acceleration", FieldType.STOREYS),
)

CLIENT = (
    SEQ,
    TIME,
    Signal(
        "client_step",
        "",
        "steps of the client so far, those at rest too",
        FieldType.COUNT,
    ),
    Signal("client_time", "s", "time of the client's analysis at the newest of them"),
    Signal("client_displacement", "m", "displacement that the client wants, at the end of its step"),
    Signal("client_force", "N", "force handed to the client at this tick, NaN where none was"),
    Signal(
        "client_wait", "s", "from that force handed over to the client's next displacement; NaN where none"
    ),
    Signal(
        "client_late",
        "",
        "the client had time for its next displacement, and it had not come",
        FieldType.FLAG,
    ),
    Signal("wake_lateness", "s", "start of the tick after its nominal time"),
)
"""In place of the building where that is a client's; what the client has a degree of freedom for has a value each."""

OF_DOFS = ("client_displacement", "client_force")

NUMERICAL = Signal(
    "numerical_force",
    "N",
    "restoring force of the numerical columns of the storey; of a matrix the sum of the floors' from above",
    FieldType.STOREYS,
)

OF_STOREYS = tuple(row.name for row in (*BUILDING, NUMERICAL) if row.kind is FieldType.STOREYS)
"""The signals that the master computes for each storey, in the order of the topic."""

LATENCY = (
    SEQ,
    Signal("wake_lateness", "s", "start of the tick after its nominal time"),
    Signal(
        "compute_time",
        "s",
        "from the start of the tick's work to the command's values, with its turn among slaves",
    ),
    Signal("command_one_way", "s", "command from the master to the slave"),
    Signal("slave_time", "s", "from the command's arrival to the feedback sent"),
    Signal("feedback_one_way", "s", "feedback from the slave to the master, its encoding included"),
    Signal("round_trip", "s", "from the command handed to the link to its feedback received"),
    Signal("clock_offset", "s", "slave clock minus master clock, estimated"),
    Signal("clock_offset_bound", "s", "largest possible error of that estimate"),
    Signal(
        "deadline_missed", "", "the tick's work or its answer came too late for the next tick", FieldType.FLAG
    ),
    Signal("encode_time", "s", "from the command's values to its frame handed to the link"),
    Signal("slave_compute_time", "s", "of the slave's time, from the start of its tick on"),
    Signal("decode_time", "s", "from the feedback's arrival to its values, decoded and checked"),
    Signal(
        "age_at_use", "s", "age of the feedback that the tick used, from its measurement to the tick's start"
    ),
    Signal("tick_ns", "ns", "nominal time of the tick, master clock", FieldType.STAMP),
    Signal("wake_ns", "ns", "start of the tick, master clock", FieldType.STAMP),
    Signal("command_sent_ns", "ns", "command handed to the link, master clock", FieldType.STAMP),
    Signal("command_received_ns", "ns", "command received, slave clock", FieldType.STAMP),
    Signal("slave_started_ns", "ns", "start of the slave's tick, slave clock", FieldType.STAMP),
    Signal("feedback_sent_ns", "ns", "feedback sent, slave clock", FieldType.STAMP),
    Signal("feedback_received_ns", "ns", "feedback received, master clock", FieldType.STAMP),
    Signal(
        "feedback_used_ns", "ns", "start of the next tick, which can use it, master clock", FieldType.STAMP
    ),
)

MODE = Signal("mode", "", "safety mode after the tick", FieldType.TEXT)

EVENT = (
    TIME,
    Signal("lab", "", "master, slave or recorder", FieldType.TEXT),
    Signal("level", "", "info, warning or error", FieldType.TEXT),
    Signal("code", "", "short name of what happened", FieldType.TEXT),
    Signal("text", "", "a sentence", FieldType.TEXT),
    Signal("values", "", "numbers that belong to it", FieldType.VALUES),
)

TICK_TOPICS = ("master", "slave", "latency")
SENT_ = "sent_"  # prefix of a sent signal where the master's own laboratory has a signal of the same name


def topics(laboratories: Mapping[str, Channels], *, served: bool = False) -> dict[str, tuple[Signal, ...]]:
    """The topics of a recording with their signals; `laboratories` holds the channels of each role with a laboratory.

    The slaves are in the plan's order. A master without a laboratory of its own is not among the roles. Where the
    laboratories are `served` to a client, the building is the client's.

    Raises:
        InputError: two signals of one topic have one name.
    """
    own = laboratories.get(MASTER_ROLE)
    slaves = {role: channels for role, channels in laboratories.items() if role != MASTER_ROLE}
    before, after = (_served(tuple(laboratories)), ()) if served else (BUILDING, (NUMERICAL,))
    found = {MASTER_ROLE: _master(before, after, own, alike(slaves))}
    found |= {role: _slave(channels) for role, channels in slaves.items()}
    found |= dict.fromkeys(map(latency_topic, slaves), LATENCY)
    found |= {ramp_topic(MASTER_ROLE): _ramp(own)} if own else {}
    found |= {ramp_topic(role): _ramp(channels) for role, channels in slaves.items()}
    for topic, rows in found.items():
        _check(topic, rows)
    return found | {"event": EVENT}


def shared(rows: tuple[Signal, ...]) -> dict[str, tuple[str, ...]]:
    """The roles of the slaves for which a signal has a value each, by the name of the signal."""
    return {row.name: row.slaves for row in rows if row.slaves}


def alike(slaves: Mapping[str, Channels]) -> dict[Channels, tuple[str, ...]]:
    """The slaves by their channels: those with the same channels share fields of the master's topic.

    In the plan's order.
    """
    found: dict[Channels, tuple[str, ...]] = {}
    for role, channels in slaves.items():
        found[channels] = (*found.get(channels, ()), role)
    return found


def _served(roles: tuple[str, ...]) -> tuple[Signal, ...]:
    """What is recorded of a client, with a value of each laboratory where there are several."""
    return tuple(row._replace(slaves=roles) if row.name in OF_DOFS else row for row in CLIENT)


def _master(
    before: tuple[Signal, ...],
    after: tuple[Signal, ...],
    own: Channels | None,
    slaves: Mapping[Channels, tuple[str, ...]],
) -> tuple[Signal, ...]:
    """The signals of the building and of the master's laboratory, and those used from and sent to the slaves."""
    rows = [*before, *(_own(own) if own else ()), *after]
    taken = {row.name for row in rows}
    for channels, roles in slaves.items():
        sent = [row._replace(text=f"{row.text}, as sent") for row in (*_at_end(channels), *_rates(channels))]
        named = [row._replace(name=SENT_ + row.name) if row.name in taken else row for row in sent]
        rows += [row._replace(slaves=roles) for row in (*_used(channels), *named)]
    return tuple(rows)


def _own(channels: Channels) -> tuple[Signal, ...]:
    target, *effort = channels.driving
    target = target._replace(text=f"{target.text} at this tick")
    return (target, *effort, channels.command, *channels.measured)


def _at_end(channels: Channels) -> tuple[Signal, ...]:
    target, *effort = channels.driving
    return (target._replace(text=f"{target.text} at the end of the interval"), *effort)


def _used(channels: Channels) -> tuple[Signal, ...]:
    """The signals of a slave's force as a tick uses it."""
    words = channels.force.replace("_", " ")
    device = words.removesuffix(" force") if words.endswith(" force") else "laboratory"
    return (
        Signal(channels.used, "N", f"{words} used, at the {device}'s own scale"),
        Signal(
            channels.used_seq, "", "tick at which that force was measured, -1 for none yet", FieldType.INDEX
        ),
        Signal(channels.used_age, "s", "its age at use"),
    )


def _rates(channels: Channels) -> tuple[Signal, ...]:
    device = channels.target.name.removesuffix("_target").replace("_", " ")
    texts = (f"velocity of the {device}'s target", "its acceleration", "the rate of that acceleration")
    return tuple(map(Signal, channels.rates, UNITS_OF_RATES, texts))


def _slave(channels: Channels) -> tuple[Signal, ...]:
    """The signals that a slave received, wrote and measured."""
    target, *effort = (row._replace(text=f"{row.text}, as received") for row in channels.driving)
    rates = (row._replace(text=f"{row.text}, as received") for row in _rates(channels))
    seq = Signal("command_seq", "", "tick of the command in force, -1 for none yet", FieldType.INDEX)
    return (SEQ, TIME, seq, target, *effort, channels.command, *channels.measured, *rates)


def _ramp(channels: Channels) -> tuple[Signal, ...]:
    """The signals of the ramp to rest."""
    command, effort = channels.command, channels.effort
    written = [command._replace(text=f"{command.text.partition(',')[0]} on the ramp to rest")]
    if effort:
        written += [effort._replace(text=f"{effort.text.partition(' of ')[0]} written on the way to zero")]
    return (SEQ, TIME, MODE, *written, *channels.measured)


def _check(topic: str, rows: tuple[Signal, ...]) -> None:
    name, times = Counter(row.name for row in rows).most_common(1)[0]
    if times > 1:
        raise InputError(
            f"The topic {topic} would have {times} signals called '{name}': rename that channel in your own kind of "
            "laboratory."
        )


# -- topics of the default plan: a column at the master, a table at the slave -------------------------


def default_topics(slaves: Sequence[str] = (SLAVE_ROLE,)) -> dict[str, tuple[Signal, ...]]:
    """The topics of a test with a column at the master and a table at each slave."""
    return topics({MASTER_ROLE: COLUMN_CHANNELS} | dict.fromkeys(slaves, TABLE_CHANNELS))


TOPICS = default_topics()

SENT = TABLE_CHANNELS.sent
