"""The one table of signals: what a recording holds, in which unit, and what each signal means.

The MCAP schemas, the listings, the plots, the exports and the limits all derive from this table.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

from common.roles import MASTER as MASTER_ROLE
from common.roles import SLAVE as SLAVE_ROLE
from common.roles import kind_of, latency_topic, ramp_topic


class Kind(Enum):
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
    kind: Kind = Kind.NUMBER
    per_slave: bool = False  # one value per slave, in the plan's order, where a test has several


SEQ = Signal("seq", "", "tick number", Kind.COUNT)
TIME = Signal("t", "s", "test time of the tick")

MASTER = (
    SEQ,
    TIME,
    Signal("ground_acceleration", "m/s²", "ground acceleration"),
    Signal("displacement", "m", "displacement relative to the ground", Kind.STOREYS),
    Signal("velocity", "m/s", "velocity relative to the ground", Kind.STOREYS),
    Signal("acceleration", "m/s²", "acceleration relative to the ground", Kind.STOREYS),
    Signal("absolute_acceleration", "m/s²", "absolute acceleration", Kind.STOREYS),
    Signal("column_target", "m", "specimen deformation wanted at this tick"),
    Signal(
        "actuator_command",
        "m",
        "command written, to be reached at the end of the interval, or held from the tick on",
    ),
    Signal("column_displacement", "m", "specimen deformation measured"),
    Signal("column_force", "N", "restoring force of the specimen measured"),
    Signal(
        "numerical_force",
        "N",
        "restoring force of the numerical columns of the storey; of a matrix the sum of the floors' from above",
        Kind.STOREYS,
    ),
    Signal("damper_force_used", "N", "damper force used, at the damper's own scale", per_slave=True),
    Signal(
        "damper_force_seq",
        "",
        "tick at which that force was measured, -1 for none yet",
        Kind.INDEX,
        per_slave=True,
    ),
    Signal("damper_force_age", "s", "its age at use", per_slave=True),
    Signal(
        "table_target",
        "m",
        "absolute floor displacement wanted at the end of the interval, as sent",
        per_slave=True,
    ),
    Signal("damper_command", "N", "motor force of the damper, as sent", per_slave=True),
    Signal("table_target_velocity", "m/s", "velocity of the table's target, as sent", per_slave=True),
    Signal("table_target_acceleration", "m/s²", "its acceleration, as sent", per_slave=True),
    Signal("table_target_jerk", "m/s³", "the rate of that acceleration, as sent", per_slave=True),
)

SLAVE = (
    SEQ,
    TIME,
    Signal("command_seq", "", "tick of the command in force, -1 for none yet", Kind.INDEX),
    Signal("table_target", "m", "absolute floor displacement wanted, as received"),
    Signal("damper_command", "N", "motor force of the damper, as received"),
    Signal("table_command", "m", "command written to the table, to be reached at the end of the interval"),
    Signal("table_displacement", "m", "table displacement measured"),
    Signal("table_acceleration", "m/s²", "table acceleration measured"),
    Signal("damper_stroke", "m", "stroke of the damper measured"),
    Signal("damper_force", "N", "force of the damper on the table measured"),
    Signal("table_target_velocity", "m/s", "velocity of the table's target, as received"),
    Signal("table_target_acceleration", "m/s²", "its acceleration, as received"),
    Signal("table_target_jerk", "m/s³", "the rate of that acceleration, as received"),
)

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
    Signal("deadline_missed", "", "the tick's work or its answer came too late for the next tick", Kind.FLAG),
    Signal("encode_time", "s", "from the command's values to its frame handed to the link"),
    Signal("slave_compute_time", "s", "of the slave's time, from the start of its tick on"),
    Signal("decode_time", "s", "from the feedback's arrival to its values, decoded and checked"),
    Signal(
        "age_at_use", "s", "age of the feedback that the tick used, from its measurement to the tick's start"
    ),
    Signal("tick_ns", "ns", "nominal time of the tick, master clock", Kind.STAMP),
    Signal("wake_ns", "ns", "start of the tick, master clock", Kind.STAMP),
    Signal("command_sent_ns", "ns", "command handed to the link, master clock", Kind.STAMP),
    Signal("command_received_ns", "ns", "command received, slave clock", Kind.STAMP),
    Signal("slave_started_ns", "ns", "start of the slave's tick, slave clock", Kind.STAMP),
    Signal("feedback_sent_ns", "ns", "feedback sent, slave clock", Kind.STAMP),
    Signal("feedback_received_ns", "ns", "feedback received, master clock", Kind.STAMP),
    Signal("feedback_used_ns", "ns", "start of the next tick, which can use it, master clock", Kind.STAMP),
)

MODE = Signal("mode", "", "safety mode after the tick", Kind.TEXT)

MASTER_RAMP = (
    SEQ,
    TIME,
    MODE,
    Signal("actuator_command", "m", "command written on the ramp to rest"),
    Signal("column_displacement", "m", "specimen deformation measured"),
    Signal("column_force", "N", "restoring force of the specimen measured"),
)

SLAVE_RAMP = (
    SEQ,
    TIME,
    MODE,
    Signal("table_command", "m", "command written to the table on the ramp to rest"),
    Signal("damper_command", "N", "motor force written on the way to zero"),
    Signal("table_displacement", "m", "table displacement measured"),
    Signal("table_acceleration", "m/s²", "table acceleration measured"),
    Signal("damper_stroke", "m", "stroke of the damper measured"),
    Signal("damper_force", "N", "force of the damper on the table measured"),
)

EVENT = (
    TIME,
    Signal("lab", "", "master, slave or recorder", Kind.TEXT),
    Signal("level", "", "info, warning or error", Kind.TEXT),
    Signal("code", "", "short name of what happened", Kind.TEXT),
    Signal("text", "", "a sentence", Kind.TEXT),
    Signal("values", "", "numbers that belong to it", Kind.VALUES),
)

MASTER_RAMP_TOPIC, SLAVE_RAMP_TOPIC = ramp_topic(MASTER_ROLE), ramp_topic(SLAVE_ROLE)

TOPICS: dict[str, tuple[Signal, ...]] = {
    "master": MASTER,
    "slave": SLAVE,
    "latency": LATENCY,
    MASTER_RAMP_TOPIC: MASTER_RAMP,
    SLAVE_RAMP_TOPIC: SLAVE_RAMP,
    "event": EVENT,
}

TICK_TOPICS = ("master", "slave", "latency")


def topics(slaves: Sequence[str]) -> dict[str, tuple[Signal, ...]]:
    """What a recording of a test holds; `slaves` are the roles of its slaves."""
    found: dict[str, tuple[Signal, ...]] = {"master": MASTER} | dict.fromkeys(slaves, SLAVE)
    found |= dict.fromkeys(map(latency_topic, slaves), LATENCY)
    found |= {MASTER_RAMP_TOPIC: MASTER_RAMP} | dict.fromkeys(map(ramp_topic, slaves), SLAVE_RAMP)
    return found | {"event": EVENT}


MEASURED = {
    "master": ("column_displacement", "column_force"),
    "slave": ("table_displacement", "table_acceleration", "damper_stroke", "damper_force"),
}

# What the master computes at a tick, by name in the order of the table: of the building, for each slave, of each storey
OF_BUILDING = tuple(
    row.name
    for row in MASTER
    if row.kind is Kind.NUMBER and not row.per_slave and row.name not in (TIME.name, *MEASURED["master"])
)
SENT = tuple(row.name for row in MASTER if row.per_slave and row.name in {other.name for other in SLAVE})
OF_STOREYS = tuple(row.name for row in MASTER if row.kind is Kind.STOREYS)

RESPONSES = ("column_displacement", "column_force", "table_acceleration", "damper_force")


def signal(topic: str, name: str) -> Signal:
    """The row of `name` in `topic`, that of a named slave included; raises KeyError where there is none."""
    for row in TOPICS[kind_of(topic)]:
        if row.name == name:
            return row
    raise KeyError(f"{topic}/{name}")


def topic_of(name: str) -> str:
    """Topic in which a signal is found first (master, slave, latency); raises KeyError where there is none."""
    for topic in TICK_TOPICS:
        if any(row.name == name for row in TOPICS[topic]):
            return topic
    raise KeyError(name)
