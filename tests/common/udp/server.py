"""The example's server in a thread of its own, and rigs with scripted answers."""

from __future__ import annotations

import contextlib
import importlib.util
import socket
import threading
import zlib
from collections.abc import Callable, Iterator
from typing import Any

from common.signals import Channels
from common.udp import packets
from tests.helpers import ROOT

_spec = importlib.util.spec_from_file_location("udp_rig_example", ROOT / "examples" / "udp_rig.py")
assert _spec
assert _spec.loader
example = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(example)


def words(channels: Channels) -> str:
    """The channels as a text that the example's server accepts."""
    driving = (channels.command, *([channels.effort] if channels.effort else []))
    return ";".join(f"{row.name} {row.unit}" for row in (*driving, *channels.measured))


@contextlib.contextmanager
def served(build: Callable[[float, int], Any], channels: str) -> Iterator[str]:
    """The example's server around a rig, in a thread of its own; its address."""
    server = example.Server(build, channels)
    with contextlib.ExitStack() as stack:
        place = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        place.bind(("127.0.0.1", 0))
        going = threading.Event()
        going.set()
        thread = threading.Thread(target=example.serve, args=(server, place, going.is_set))
        thread.start()
        try:
            yield f"udp/{place.getsockname()[1]}"
        finally:
            going.clear()
            thread.join()


Answers = Callable[[int, int, bytes, bytes], list[bytes]]  # kind, count of its kind, packet, sound answer


@contextlib.contextmanager
def scripted(answers: Answers) -> Iterator[str]:
    """The address of a rig whose correct answers pass through a function that may change them."""
    server = example.Server(example.Column)
    counts: dict[int, int] = {}

    def answer(packet: bytes) -> list[bytes]:
        kind = int.from_bytes(packet[6:8], "little")
        counts[kind] = counts.get(kind, 0) + 1
        return answers(kind, counts[kind], packet, server.answer(packet))

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as place:
        place.bind(("127.0.0.1", 0))
        place.settimeout(0.01)
        going = threading.Event()
        going.set()

        def serve() -> None:
            while going.is_set():
                with contextlib.suppress(TimeoutError):
                    packet, whence = place.recvfrom(200)
                    for one in answer(packet):
                        place.sendto(one, whence)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield f"udp/{place.getsockname()[1]}"
        finally:
            going.clear()
            thread.join()


def changed(answer: bytes, **fields: Any) -> bytes:
    """An answer with changed fields and the checksum that belongs to them."""
    names = [field.name for field in packets.ANSWER if field.name != "values"]
    unpacked = list(example.ANSWER.unpack(answer))
    head, values, tail = unpacked[:8], unpacked[8:16], unpacked[16:]
    by_name = dict(zip(names, [*head, *tail], strict=True))
    values = [*fields.pop("values", values)]
    values += [0.0] * (8 - len(values))
    by_name |= fields
    ordered = [by_name[name] for name in names]
    body: bytes = example.ANSWER.pack(*ordered[:8], *values, *ordered[8:])[: packets.CHECKED]
    return body + zlib.crc32(body).to_bytes(4, "little")
