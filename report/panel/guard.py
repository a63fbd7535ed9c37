"""Who may use the panel: its own pages alone, under the names by which it was started, with its token where it has one.

A page of another site can send requests to this machine, and a name that it owns can be made to lead here (DNS
rebinding). Such requests carry that name in `Host`, or the other site in `Origin`, and are refused by them.
"""

from __future__ import annotations

import hmac
import ipaddress
from collections.abc import Mapping

from common.errors import InputError

LOOPBACK = "127.0.0.1"
LOCAL = (LOOPBACK, "localhost")
FRAMES = ("iframe", "frame", "embed", "object")  # in which another site's page could hide a button
ITSELF = ("same-origin", "none")  # `none`: the operator has typed the address


class Guard:
    """Judges requests to the panel at `host` and `port`; with a `token` the pages must bring it."""

    def __init__(self, host: str, port: int, token: str = "") -> None:
        names = LOCAL if local(host) else (host,)
        self.hosts = frozenset(f"[{name}]:{port}" if ":" in name else f"{name}:{port}" for name in names)
        self.origins = frozenset(f"http://{name}" for name in self.hosts)
        self.cookie = f"rths-panel-{port}"  # cookies of one host are shared by all its ports
        self._token = token
        self._first = f"http://{f'[{host}]' if ':' in host else host}:{port}/"

    @property
    def url(self) -> str:
        """The address of the page, with the token where there is one."""
        return f"{self._first}?token={self._token}" if self._token else self._first

    def stranger(self, headers: Mapping[str, str]) -> str:
        """Why a request is not answered at all, empty where it is."""
        if headers.get("Host", "").lower() not in self.hosts:
            return "This is not the name of this panel."
        if (origin := headers.get("Origin")) is not None and origin.lower() not in self.origins:
            return "Another site's page may not use this panel."
        if headers.get("Sec-Fetch-Dest", "document") in FRAMES:
            return "The panel is not shown within another page."
        own, opened = (
            headers.get("Sec-Fetch-Site", "none") in ITSELF,
            headers.get("Sec-Fetch-Mode") == "navigate",
        )
        if not own and not opened:
            return "Another site's page may not use this panel."
        return ""

    def disorderly(self, headers: Mapping[str, str]) -> str:
        """Why a request may give no order, empty where it may: it must say that it comes from a page of the panel."""
        if headers.get("Origin", "").lower() not in self.origins:
            return "An order must come from a page of this panel."
        if headers.get("Content-Type", "").partition(";")[0].strip().lower() != "application/json":
            return "An order must be JSON."
        return ""

    def admits(self, given: str) -> bool:
        """Whether this is the token, or none is needed; the comparison takes the same time for every wrong one."""
        return not self._token or hmac.compare_digest(given.encode(), self._token.encode())


def local(host: str) -> bool:
    """Whether only this machine reaches an address or name."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def checked(host: str) -> str:
    """The host, one name or address at which pages will ask for it; raises InputError for one that stands for all."""
    try:
        every = ipaddress.ip_address(host).is_unspecified
    except ValueError:
        every = host in ("", "*")
    if every or any(letter.isspace() or letter in "/@" for letter in host):
        raise InputError(
            f"--host '{host}' cannot be used: give the one name or address of this machine that browsers will use."
        )
    return host
