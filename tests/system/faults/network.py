"""Two machines on a switch, as three network namespaces: ports of the switch can be cut, slowed and made to lose."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import time
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import pytest

from tests.processes import HANG_S
from tests.system.faults.bench import Place

ADDRESSES = ("10.83.0.1", "10.83.0.2")
PORT = 7447


def run(*words: str) -> str:
    """Run a command; what it wrote; raises CalledProcessError where it complains."""
    return subprocess.run(words, check=True, capture_output=True, text=True, timeout=HANG_S).stdout


class Network(NamedTuple):
    """Names of the namespaces: the master's machine, the slave's, and the switch."""

    master: str
    slave: str
    switch: str

    def place(self, protocol: str) -> Place:
        """Master and recorder on the first machine, the slave on the second."""
        listen = f"{protocol}/{ADDRESSES[0]}:{PORT}"
        into = {
            "master": inside(self.master),
            "recorder": inside(self.master),
            "slave": inside(self.slave),
        }
        return Place(listen, {"slave": listen, "recorder": listen}, into)

    def cut(self) -> float:
        """Everything between the machines is lost from now on, and neither notices; when, monotonic s."""
        at = time.monotonic()
        run("ip", "-n", self.switch, "link", "set", "to_slave", "nomaster")
        return at

    def mend(self) -> float:
        """The switch's port works again; when, monotonic s."""
        run("ip", "-n", self.switch, "link", "set", "to_slave", "master", "switch")
        return time.monotonic()

    def unplug(self) -> float:
        """The slave's machine loses its cable, and notices; when, monotonic s."""
        at = time.monotonic()
        run("ip", "-n", self.slave, "link", "set", "port", "down")
        return at

    def plug(self) -> float:
        """The cable is back; when, monotonic s."""
        run("ip", "-n", self.slave, "link", "set", "port", "up")
        return time.monotonic()

    def drop(self, machine: str, rule: str) -> None:
        """A machine loses what comes to it where an nftables rule fits, counted; its sender does not notice."""
        run(*inside(machine), "nft", "add table inet fault")
        hook = "{ type filter hook input priority 0 ; }"
        run(*inside(machine), "nft", f"add chain inet fault in {hook}")
        run(*inside(machine), "nft", f"add rule inet fault in {rule} counter drop")

    def keep(self, machine: str) -> int:
        """It loses nothing any more; how many packets it has lost."""
        found = run(*inside(machine), "nft", "list", "table", "inet", "fault")
        run(*inside(machine), "nft", "delete", "table", "inet", "fault")
        return int(found.partition("counter packets ")[2].split()[0])

    def slow(self, rate: str) -> None:
        """What the switch sends to the slave's machine goes through at this rate, and waits for seconds before."""
        run(
            *("tc", "-n", self.switch, "qdisc", "add", "dev", "to_slave", "root"),
            *("tbf", "rate", rate, "burst", "1600", "latency", "5s"),
        )

    def fast(self) -> None:
        """Through without delay again."""
        run("tc", "-n", self.switch, "qdisc", "del", "dev", "to_slave", "root")


def inside(name: str) -> Sequence[str]:
    """How a command gets into a namespace."""
    return ("ip", "netns", "exec", name)


@contextlib.contextmanager
def network() -> Iterator[Network]:
    """Two machines on a switch; skips the test where that is not to be had."""
    if shutil.which("ip") is None or shutil.which("nft") is None:
        pytest.skip("there is no ip or no nft command: install iproute2 and nftables")
    found = Network(*(f"rths-{part}-{os.getpid()}" for part in ("m", "s", "x")))
    try:
        for name in found:
            run("ip", "netns", "add", name)
    except subprocess.CalledProcessError as error:
        pytest.skip(f"network namespaces are not allowed here: {error.stderr.strip()}")
    try:
        build(found)
        yield found
    finally:
        for name in found:
            subprocess.run(["ip", "netns", "delete", name], check=False, capture_output=True)


def build(found: Network) -> None:
    """Connect the namespaces."""
    switch = found.switch
    run("ip", "-n", switch, "link", "add", "switch", "type", "bridge", "forward_delay", "0")
    run("ip", "-n", switch, "link", "set", "switch", "up")
    for name, far, address in zip(found, ("to_master", "to_slave"), ADDRESSES, strict=False):
        run("ip", "-n", switch, "link", "add", far, "type", "veth", "peer", "name", "port", "netns", name)
        run("ip", "-n", switch, "link", "set", far, "master", "switch")
        run("ip", "-n", switch, "link", "set", far, "up")
        run("ip", "-n", name, "addr", "add", f"{address}/24", "dev", "port")
        run("ip", "-n", name, "link", "set", "port", "up")
        run("ip", "-n", name, "link", "set", "lo", "up")
