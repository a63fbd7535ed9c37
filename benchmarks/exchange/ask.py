"""`python -m benchmarks.exchange.ask`: measure exchanges over every transport in turns and write them as JSON.

The transports take turns in blocks of exchanges, in a new random order each round, so that disturbances by the machine
affect all alike. In a paced run an exchange begins at each multiple of the interval, and the lateness of the sleep is
recorded with it, as by a bare timing loop.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.exchange.transports import (
    NAMES,
    Asking,
    RthsAsking,
    TcpAsking,
    UdpAsking,
    ZenohAsking,
)
from common.host import realtime

OURS = ("rths", "rths_tls", "rths_lab")
PEERS: dict[str, Callable[[str, int], Asking]] = {"zenoh": ZenohAsking, "tcp": TcpAsking, "udp": UdpAsking}
SOCKETS = ("tcp", "udp")  # transports whose answering end listens
WARM_UP = 300  # exchanges that are not counted, six blocks: the first ones load kernels and fill caches
BLOCK = 50  # exchanges: 0.1 s when paced, so that all six transports are measured within 0.6 s


def block(asking: Asking, interval_ns: int) -> tuple[list[int], list[int]]:
    """Round trips of a block, and the lateness of each, ns; with an interval of 0 exchanges follow without a pause."""
    trips, late = [], []
    due = time.monotonic_ns() + interval_ns
    for _ in range(BLOCK):
        if interval_ns:
            time.sleep(max(due - time.monotonic_ns(), 0) * 1e-9)
        began = time.monotonic_ns()
        trips.append(asking.exchange() - began)
        late.append(began - due)
        due = max(due, began - began % interval_ns if interval_ns else began) + interval_ns
    return trips, late


def main() -> int:
    """Measure according to the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--here", required=True, help="address of this end, where zenoh listens")
    parser.add_argument("--answering", required=True, help="address of the answering end")
    parser.add_argument("--ports", type=int, nargs=len(NAMES), required=True, help=" ".join(NAMES))
    parser.add_argument("--keys", type=Path, required=True, help="folder of certificates")
    parser.add_argument("--rounds", type=int, default=60, help=f"blocks of {BLOCK} exchanges per transport")
    parser.add_argument("--interval", type=float, default=0.0, help="s between exchanges, 0 for free-running")
    parser.add_argument("--rt", choices=realtime.MODES, default="auto")
    parser.add_argument("--processor", type=int)
    args = parser.parse_args()
    granted = realtime.prepare(args.rt, args.processor)
    ports = dict(zip(NAMES, args.ports, strict=True))
    kinds = {name: partial(RthsAsking, name, args.keys) for name in OURS} | PEERS
    asking = {
        name: kind(args.answering if name in SOCKETS else args.here, ports[name])
        for name, kind in kinds.items()
    }
    for one in asking.values():
        for _ in range(WARM_UP):
            one.exchange()
    realtime.freeze()
    found = rounds(asking, args.rounds, round(args.interval * 1e9))
    for one in asking.values():
        one.close()
    json.dump({"granted": granted.values(), **found}, sys.stdout)
    return 0


def rounds(asking: dict[str, Asking], count: int, interval_ns: int) -> dict[str, dict[str, list[int]]]:
    """Round trips (`trips`) and lateness (`late`) by transport, ns."""
    draw = random.Random(1)  # noqa: S311 - an order, not a secret
    trips: dict[str, list[int]] = {name: [] for name in asking}
    late: dict[str, list[int]] = {name: [] for name in asking}
    for _ in range(count):
        for name in draw.sample(sorted(asking), len(asking)):
            more = block(asking[name], interval_ns)
            trips[name] += more[0]
            late[name] += more[1]
    return {"trips": trips, "late": late}


if __name__ == "__main__":
    sys.exit(main())
