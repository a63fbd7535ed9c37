"""How frames get from one process to the others: channels, who hears whom, and the interface of a link."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from common.roles import MASTER, OBSERVER, OPERATOR, RECORDER, SLAVE


class Packet(NamedTuple):
    """One received frame: the role that sent it, its channel, and when it arrived (own clock, ns)."""

    role: str
    channel: str
    frame: bytes
    received_ns: int


class Route(NamedTuple):
    """The messages of one role on a channel: to all that hear it, or to the role `to` alone."""

    role: str
    channel: str
    to: str = ""


TICK, CONTROL, SAMPLES = "tick", "control", "samples"
CHANNELS = (TICK, CONTROL, SAMPLES)


def addressed(slave: str) -> str:
    """The address of the master's frames for one slave: its role where it has a name, otherwise empty."""
    return slave if slave != SLAVE else ""


def said(role: str, slaves: Sequence[str]) -> tuple[Route, ...]:
    """The routes on which a role sends; `slaves` are the roles of all slaves of the test."""
    if role == OBSERVER:
        return ()
    if role == OPERATOR:
        return (Route(role, CONTROL),)
    routes = [Route(role, channel) for channel in CHANNELS]
    if role == MASTER:
        routes += [
            Route(role, channel, slave) for slave in slaves if addressed(slave) for channel in CHANNELS[:2]
        ]
    return tuple(routes)


def heard(role: str, slaves: Sequence[str]) -> tuple[Route, ...]:
    """The routes that a role listens to; a slave hears the master's messages to it or to all, and no other slave's."""
    labs = (MASTER, *slaves)
    if role == MASTER:
        here = [Route(slave, channel) for slave in slaves for channel in (TICK, CONTROL)]
        return (*here, Route(RECORDER, CONTROL), Route(OPERATOR, CONTROL))
    if role == RECORDER:
        return tuple(Route(lab, channel) for channel in (SAMPLES, CONTROL) for lab in labs)
    if role == OPERATOR:
        return tuple(Route(lab, CONTROL) for lab in (*labs, RECORDER))
    if role == OBSERVER:
        return tuple(route for speaker in (*labs, RECORDER, OPERATOR) for route in said(speaker, slaves))
    to = addressed(role)
    own = (
        Route(MASTER, TICK, to),
        Route(MASTER, CONTROL),
        Route(RECORDER, CONTROL),
        Route(OPERATOR, CONTROL),
    )
    return (*own, Route(MASTER, CONTROL, to)) if to else own


class Transport(Protocol):
    """One process's access to the link."""

    def send(self, channel: str, frame: bytes, to: str = "") -> None:
        """Hand a frame to the link, for all that hear the channel or for the role `to` alone; never blocks."""

    def listen(self, heard: Callable[[Packet], None]) -> None:
        """Call `heard` with every frame from now on, in a thread of the link; may be called once."""

    def close(self) -> None:
        """Leave the link."""
