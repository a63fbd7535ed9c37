"""Frames per second of the codec, compared with msgpack alone and struct alone."""

from __future__ import annotations

import statistics
import struct

import msgpack

from benchmarks.result import BenchmarkFigure, rate_figure, rates
from common.protocol import codec
from common.protocol.messages import Command, Feedback

COUNT = 20_000  # frames of a repeat: about 70 ms, long against the resolution of the clock
REPEATS = 7  # odd, so that the median is a measured value
# messages of tick 10,000 with large counters, which msgpack encodes in 9 bytes, as in a long test
COMMAND = Command(2**60, 10_000, 2**60, 1_000, 9_999, 0.01, 50.0, 0.1, 1.0, 10.0)
FEEDBACK = Feedback(2**60, 10_000, 10_000, 2**60, 10_000, 2**60, 2**60, 2**60, (0.01, 0.2, 0.03, 50.0))
LAYOUT = struct.Struct(f"<B{''.join('q' if type(value) is int else 'd' for value in COMMAND)}")


def run(*, quick: bool = False) -> list[BenchmarkFigure]:
    """Encode and decode the two frames of a tick."""
    count, repeats = (100, 1) if quick else (COUNT, REPEATS)
    key = codec.session_key(2**60, "plan")
    frames = {message: codec.encode(message, key) for message in (COMMAND, FEEDBACK)}

    def packed() -> int:
        for _ in range(count):
            msgpack.unpackb(msgpack.packb(tuple(COMMAND)))
        return count

    def laid_out() -> int:
        for _ in range(count):
            LAYOUT.unpack(LAYOUT.pack(9, *COMMAND))
        return count

    def there_and_back(message: Command | Feedback) -> int:
        for _ in range(count):
            codec.decode(codec.encode(message, key), key)
        return count

    bare, struct_only = rates(packed, repeats), rates(laid_out, repeats)
    figures = [
        rate_figure(
            f"codec, {type(message).__name__.lower()} of {len(frames[message])} bytes there and back",
            "frames/s",
            rates(lambda message=message: there_and_back(message), repeats),  # type: ignore[misc]
            peer="bare msgpack of a command, no check, no validation",
            beside=statistics.median(bare),
        )
        for message in (COMMAND, FEEDBACK)
    ]
    return [*figures, rate_figure("bare struct of a command", "frames/s", struct_only)]
