"""A tick in real time without a displacement is attributed to the client or to the lateness of the tick itself."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from common.opensees.wire import MessageCode
from master.client.pace import RealTime
from tests.serve.client import Element
from tests.serve.serving import Ticking, plan_of, serve

INTERVAL_NS, SHARE = 2_000_000, 0.75
LAB = cast(Any, SimpleNamespace(tick_ns=lambda tick: tick * INTERVAL_NS))


@pytest.mark.parametrize(
    ("since", "fair"),
    [
        (0.0, True),  # in the tick's time
        (0.49 * SHARE, True),
        (0.51 * SHARE, False),
        (7.0, False),  # a pause of the machine, whose ticks are made good one after the other
        (-1.0, True),  # the client has its forces since the tick before
    ],
)
def test_a_client_that_got_less_than_half_of_its_share_of_the_tick_does_not_count_as_late(
    since: float, fair: bool
) -> None:
    assert plan_of().link.wait_share == SHARE
    given = 5 * INTERVAL_NS + round(since * INTERVAL_NS)
    assert RealTime(plan_of()).fair(LAB, 5, given) is fair


class Unfair(Ticking):
    """Ticks that leave the client no time."""

    def fair(self, lab: Any, tick: int, since_ns: int) -> bool:
        """Never."""
        return False


@pytest.mark.parametrize("pace", [Ticking, Unfair])
def test_a_tick_without_a_displacement_is_attributed_to_the_client_if_it_had_time(
    pace: type[Ticking], tmp_path: Path
) -> None:
    def stalls(port: int) -> None:
        client = Element(port)
        client.steps(3)
        client.say(MessageCode.DAMPING)  # and keeps the connection until the test has ended
        client.answer(1)
        client.socket.recv(1)
        client.close()

    served = serve(stalls, tmp_path, pace=pace(0.02))
    assert served.error is not None
    of = served.run.columns["master"]
    held = np.flatnonzero(np.diff(of["client_step"]) == 0) + 1
    assert held.size
    assert np.flatnonzero(of["client_late"]).tolist() == (held.tolist() if pace is Ticking else [])
