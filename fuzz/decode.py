"""Coverage-guided fuzzing of the decoder of frames, and of the recorder's decoder of pieces of samples.

    python fuzz/decode.py [-max_total_time=600] [-seed=1] [FOLDER]

Options are those of libFuzzer; FOLDER keeps inputs that reached something new. Atheris is no dependency of the
project. Ends with a traceback, and the input in a file, where decoding does anything but give a message or reject.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import get_type_hints

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

try:
    import atheris
except ImportError:
    sys.exit("fuzz: Atheris is missing; install it with: pip install atheris==3.0.0 (Python 3.11 to 3.13).")

import msgpack

with atheris.instrument_imports(
    include=["common.protocol.codec", "common.link.endpoint", "common.lab.outlet", "recorder.items"]
):
    from common.lab import outlet
    from common.link import endpoint
    from common.link.transport import CHANNELS, Packet, Transport
    from common.plan.plan import Plan
    from common.protocol import codec
    from common.protocol.messages import Samples
    from common.recording.rows import layout, other
    from common.signals import TOPICS
    from recorder.items import Items

SESSION = 7
KEY = codec.session_key(SESSION, "plan")
ROLES = ("master", "slave", "recorder", "operator")
PLAN = Plan()
ITEMS = {lab: Items(PLAN, lab) for lab in ("master", "slave")}


class SilentLink:
    """A link on which nothing is sent."""

    def send(self, channel: str, frame: bytes, to: str = "") -> None:
        """Discard a frame."""

    def listen(self, heard: object) -> None:
        """Frames are handed to the endpoint itself."""

    def close(self) -> None:
        """Nothing to leave."""


def listening(session: int) -> endpoint.FrameEndpoint:
    """An endpoint in a session."""
    wire: Transport = SilentLink()
    found = endpoint.FrameEndpoint(wire, "plan")
    found.enter(session)
    return found


ENDS = (listening(SESSION), listening(0))


def one_input(data: bytes) -> None:
    """A frame as it is, and one that holds the same bytes under the right key, on a route that its first byte picks."""
    if not data:
        return
    choice, payload = data[0], data[1:]
    role, channel = ROLES[choice % 4], CHANNELS[choice // 4 % 3]
    keyed = codec.session_key(0, "") if choice & 64 else KEY
    frame = payload + codec._check(keyed, payload)
    for end in ENDS:
        for bits in (data, frame):
            hear(end, Packet(role, channel, bits, 1))
    take(payload)
    outlet.next_of(payload, "slave")


def hear(end: endpoint.FrameEndpoint, packet: Packet) -> None:
    """What arrives is a message with that frame and no other, or it is counted."""
    before = end.rejected.total()
    end._heard(packet)
    received = end.receive()
    if (received is None) == (end.rejected.total() == before):
        raise AssertionError("a frame must be either a message or rejected")
    if received is not None and codec.encode(received.message, KEY)[:-8] != packet.frame[:-8]:
        raise AssertionError("a message must have one frame only")


def take(payload: bytes) -> None:
    """The recorder's side of a piece: items that can be recorded, or none."""
    for items in ITEMS.values():
        inlet = outlet.Inlet(items.unpack, most=1_000)
        for first in (0, 5, 10):
            inlet.take(Samples(SESSION, "slave", first, payload))
        inlet.missing()
        inlet.give_up()


def seeds(folder: Path) -> None:
    """One valid frame of every kind, and one piece, for the fuzzer to begin with."""
    folder.mkdir(parents=True, exist_ok=True)
    for kind in codec.MESSAGES:
        hints = get_type_hints(kind)
        message = kind(*(hints[name]() for name in kind._fields))
        body = codec.encode(message, KEY)[: -codec.CHECK_SIZE]
        for choice in range(12):
            (folder / f"{kind.__name__}-{choice}").write_bytes(bytes([choice]) + body)
    event = other("event", 0, 0, (0.0, "master", "info", "begin", "begun", {"a": 1.0}))
    row = layout(TOPICS["slave"], 1).pack(0, 0, 0, 0.0, -1, *[0.5] * 10)
    (folder / "piece").write_bytes(b"\0" + msgpack.packb([event, ("slave", row)]))


def main() -> None:
    """Fuzz until the time is over or something is found."""
    folders = [word for word in sys.argv[1:] if not word.startswith("-")]
    if folders:
        seeds(Path(folders[0]))
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
