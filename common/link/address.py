"""Endpoints, at which a process listens or to which it connects, written as tcp/HOST:PORT."""

from __future__ import annotations

import contextlib
import ipaddress
import re

from common.errors import InputError

ENDPOINT = re.compile(r"(tcp|tls|udp|quic)/(.+):(\d+)")


def checked(endpoint: str) -> str:
    """The endpoint itself; raises InputError if it is not valid."""
    if endpoint and not ENDPOINT.fullmatch(endpoint):
        raise InputError(f"'{endpoint}' is not an endpoint: write it as tcp/HOST:PORT.")
    return endpoint


def secured(endpoint: str) -> str:
    """The endpoint as one over TLS: tcp/ and tls/ mean the same in a plan with security.

    Raises:
        InputError: it is of a protocol that security does not cover.
    """
    protocol, _, rest = checked(endpoint).partition("/")
    if protocol not in ("tcp", "tls", ""):
        raise InputError(f"'{endpoint}' cannot be used with [link.security]: write it as tls/HOST:PORT.")
    return f"tls/{rest}" if rest else ""


def dialled(endpoint: str) -> str:
    """An endpoint over TLS to connect to; raises InputError for an IPv6 address, which zenoh takes for a host name."""
    if "/[" in endpoint:
        raise InputError(
            f"'{endpoint}' cannot be dialled with [link.security]: give the master's name, or IPv4."
        )
    return secured(endpoint)


def place(endpoint: str) -> tuple[str, int]:
    """Host and port of an endpoint; raises InputError if it is not valid."""
    found = ENDPOINT.fullmatch(checked(endpoint))
    return (found[2].strip("[]"), int(found[3])) if found else ("", 0)


def loopback(endpoint: str) -> bool:
    """Whether an endpoint can be reached from this machine only; True for an empty one."""
    host = place(endpoint)[0]
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return host in ("localhost", "")
