"""Two network namespaces connected by a virtual cable; they behave like two machines on one network."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
from collections.abc import Iterator

ADDRESSES = ("10.83.0.1", "10.83.0.2")  # private, and visible inside the two namespaces only


class NoCableError(Exception):
    """Network namespaces are not available on this machine; the text says why."""


def ip(*words: str) -> None:
    """Run the ip command; raises CalledProcessError if it fails."""
    subprocess.run(["ip", *words], check=True, capture_output=True, text=True)  # noqa: S607 - found on the path


def lay(names: tuple[str, str]) -> None:
    """Create both namespaces and the cable; raises CalledProcessError if that is not allowed."""
    for name in names:
        ip("netns", "add", name)
    ends = (f"rva{os.getpid()}", f"rvb{os.getpid()}")
    ip("link", "add", ends[0], "type", "veth", "peer", "name", ends[1])
    for name, end, address in zip(names, ends, ADDRESSES, strict=True):
        ip("link", "set", end, "netns", name)
        ip("-n", name, "addr", "add", f"{address}/24", "dev", end)
        ip("-n", name, "link", "set", end, "up")
        ip("-n", name, "link", "set", "lo", "up")


@contextlib.contextmanager
def cable() -> Iterator[tuple[str, str]]:
    """Create two namespaces, with `ADDRESSES[0]` in the first and `ADDRESSES[1]` in the second; yields their names.

    Raises:
        NoCableError: there is no ip command, or no permission to create namespaces.
    """
    if shutil.which("ip") is None:
        raise NoCableError("there is no ip command: install iproute2")
    names = (f"rths-a-{os.getpid()}", f"rths-b-{os.getpid()}")
    try:
        try:
            lay(names)
        except subprocess.CalledProcessError as error:
            raise NoCableError(f"network namespaces are not allowed here: {error.stderr.strip()}") from None
        yield names
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "delete", name], check=False, capture_output=True)  # noqa: S607
