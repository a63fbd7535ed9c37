"""`python -m benchmarks.exchange.answer`: the process that answers on every transport, until its input closes."""

from __future__ import annotations

import argparse
import select
import sys
import threading
from pathlib import Path

from benchmarks.exchange import transports
from benchmarks.exchange.transports import NAMES
from common.host import realtime


def main() -> int:
    """Answer on every transport; sockets and bare zenoh answer in threads of their own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--asking", required=True, help="address of the asking end, where zenoh listens")
    parser.add_argument("--here", required=True, help="address of this end, where the sockets listen")
    parser.add_argument("--ports", type=int, nargs=len(NAMES), required=True, help=" ".join(NAMES))
    parser.add_argument("--keys", type=Path, required=True, help="folder of certificates")
    parser.add_argument("--rt", choices=realtime.MODES, default="auto")
    parser.add_argument("--processor", type=int)
    args = parser.parse_args()
    realtime.prepare(args.rt, args.processor)
    ports = dict(zip(NAMES, args.ports, strict=True))
    transports.answer_tcp(args.here, ports["tcp"])
    transports.answer_udp(args.here, ports["udp"])
    sys.stdout.write("listening\n")
    sys.stdout.flush()
    close = transports.answer_zenoh(args.asking, ports["zenoh"])
    realtime.freeze()
    others = [
        threading.Thread(
            target=transports.answer_rths, args=(name, args.keys, args.asking, ports[name], input_ended)
        )
        for name in ("rths_tls", "rths_lab")
    ]
    for other in others:
        other.start()
    transports.answer_rths("rths", args.keys, args.asking, ports["rths"], input_ended)
    for other in others:
        other.join()
    close()
    return 0


def input_ended() -> bool:
    """Whether the parent process has closed the input of this process."""
    return bool(select.select([sys.stdin], [], [], 0.0)[0])


if __name__ == "__main__":
    sys.exit(main())
