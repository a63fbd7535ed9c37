"""The roles in a test: a master, one slave or several with names, a recorder; an operator and an observer.

A role is the name of a process in messages, keys and topics: `master`, `recorder`, `slave` where there is one,
`slave.NAME` where the plan names its slaves. An operator sends on the control channel only; an observer receives all
messages and sends none. A test needs neither.
"""

from __future__ import annotations

MASTER, SLAVE, RECORDER, LATENCY = "master", "slave", "recorder", "latency"
OPERATOR, OBSERVER = "operator", "observer"
CLIENT = "client"  # a program that has the building, where the master's laboratories are served to one
BUILDING = "building"  # a program beside the master that computes the building's model
RAMP = "_ramp"


def slave_role(name: str) -> str:
    """The role of a slave; `name` is empty for the one that has none."""
    return f"{SLAVE}.{name}" if name else SLAVE


def kind_of(text: str) -> str:
    """A role or a topic without a slave's name: `slave` for `slave.roof`."""
    return text.partition(".")[0]


def name_of(text: str) -> str:
    """The slave's name in a role or a topic, empty where there is none: `roof` for `slave.roof`."""
    return text.partition(".")[2]


def title(role: str) -> str:
    """A role as a sentence names it: `slave 'roof'`."""
    name = name_of(role)
    return f"{kind_of(role)} '{name}'" if name else role


def latency_topic(role: str) -> str:
    """The topic of a slave's latency."""
    return LATENCY + role.removeprefix(SLAVE)


def ramp_topic(role: str) -> str:
    """The topic of a laboratory's ramp to rest: `master_ramp`, `slave_ramp.roof`."""
    kind, point, name = role.partition(".")
    return f"{kind}{RAMP}{point}{name}"


def ramps_of(topic: str) -> str:
    """The laboratory whose ramp to rest a topic holds, empty for any other topic."""
    kind, point, name = topic.partition(".")
    return f"{kind.removesuffix(RAMP)}{point}{name}" if kind.endswith(RAMP) else ""
