"""Coverage-guided fuzzing of the decoder of frames, and of the decoder with which the recorder reads samples.

    python fuzz/decode.py [-max_total_time=600] [-seed=1] [FOLDER]

The options are those of libFuzzer; FOLDER keeps the inputs that covered new code. Atheris is not a dependency of the
project. If decoding does anything but return a message or reject the frame, the program ends with a traceback and
writes the input to a file.
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

SESSION = 7  # any but 0, which stands for no session
KEY = codec.session_key(SESSION, "plan")
ROLES = ("master", "slave", "recorder", "operator")
PLAN = Plan()
ITEMS = {lab: Items(PLAN, lab) for lab in ("master", "slave")}


class SilentLink:
    """A link that discards all frames."""

    def send(self, channel: str, frame: bytes, to: str = "") -> None:
        """Discard a frame."""

    def listen(self, heard: object) -> None:
        """Do nothing: `hear` passes frames to the endpoint directly."""

    def close(self) -> None:
        """Do nothing."""


def listening(session: int) -> endpoint.FrameEndpoint:
    """An endpoint that has entered a session."""
    wire: Transport = SilentLink()
    found = endpoint.FrameEndpoint(wire, "plan")
    found.enter(session)
    return found


ENDS = (listening(SESSION), listening(0))


def one_input(data: bytes) -> None:
    """Decode the input as a frame, and its bytes with a valid check; the first byte chooses the route."""
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
    """Check that a frame is either the only encoding of a message, or counted as rejected."""
    before = end.rejected.total()
    end._heard(packet)
    received = end.receive()
    if (received is None) == (end.rejected.total() == before):
        raise AssertionError("a frame must either be decoded into a message or be rejected")
    if received is not None and codec.encode(received.message, KEY)[:-8] != packet.frame[:-8]:
        raise AssertionError("the message is encoded into another frame than the one it was decoded from")


def take(payload: bytes) -> None:
    """Decode a piece of samples as the recorder does: it yields items that can be recorded, or none."""
    for items in ITEMS.values():
        inlet = outlet.Inlet(items.unpack, most=1_000)
        for first in (0, 5, 10):
            inlet.take(Samples(SESSION, "slave", first, payload))
        inlet.missing()
        inlet.give_up()


def seeds(folder: Path) -> None:
    """Write one valid frame of every kind and one piece of samples, from which the fuzzer starts."""
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
    """Fuzz until the time is over or an error is found."""
    folders = [word for word in sys.argv[1:] if not word.startswith("-")]
    if folders:
        seeds(Path(folders[0]))
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
