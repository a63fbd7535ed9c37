"""`python -m tests.system.faults.ear PLAN --connect ENDPOINT`: says when a laboratory's control messages come by."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from common.link.transport import CONTROL, Packet
from common.link.zenoh_link import ZenohLink
from common.plan import read as plans
from common.roles import OBSERVER


def main() -> None:
    """Listen until killed."""
    plan = plans.load(Path(sys.argv[1]))

    def heard(packet: Packet) -> None:
        if packet.channel == CONTROL:
            said = {"kind": "heard", "role": packet.role, "ns": packet.received_ns}
            sys.stdout.write(json.dumps(said) + "\n")
            sys.stdout.flush()

    link = ZenohLink(
        OBSERVER, plan.test.name, connect=sys.argv[sys.argv.index("--connect") + 1], patience=10.0
    )
    link.listen(heard)
    time.sleep(600.0)


if __name__ == "__main__":
    main()
