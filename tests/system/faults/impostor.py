"""`python -m tests.system.faults.impostor PLAN --connect ENDPOINT`: a second master, with a session of its own."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from common.link.transport import CONTROL, TICK, Route
from common.link.zenoh_link import configuration, key, reach, unrefused
from common.plan import read as plans
from common.plan.plan import PROTOCOL_VERSION
from common.protocol import codec
from common.protocol.messages import Command, Message, Register, Stop, Trip
from common.roles import MASTER, SLAVE

SESSION, SECONDS, EVERY = 4711, 1.5, 0.002
FAR = 0.3  # m, where it would have the table


def main() -> None:
    """Command the slave for a while, and try to end the test."""
    plan = plans.load(Path(sys.argv[1]))
    endpoint = sys.argv[sys.argv.index("--connect") + 1]
    config = configuration(SLAVE, "", endpoint)
    own, shared = (codec.session_key(session, plan.digest()) for session in (SESSION, 0))
    with reach(config, endpoint, 10.0, str, unrefused) as session:

        def say(channel: str, message: Message, sign: codec.Key) -> None:
            session.put(key(plan.test.name, Route(MASTER, channel)), codec.encode(message, sign))

        say(CONTROL, Register(SESSION, PROTOCOL_VERSION, plan.digest()), shared)
        for seq in range(round(SECONDS / EVERY)):
            say(TICK, Command(SESSION, seq, 0, 0, -1, FAR, 0.0, 0.0, 0.0, 0.0), own)
            time.sleep(EVERY)
        for sign in (own, shared):
            say(CONTROL, Stop(SESSION, 1, "the impostor wants it."), sign)
            say(CONTROL, Trip(SESSION, MASTER, "tripped", "the impostor wants it."), sign)
        time.sleep(0.2)


if __name__ == "__main__":
    main()
