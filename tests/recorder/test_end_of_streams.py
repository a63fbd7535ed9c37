"""In which order a laboratory sends its last messages."""

from __future__ import annotations

from pathlib import Path

import pytest

from common.plan.plan import Plan
from common.protocol.messages import Finished, Message, Stopped
from common.reality import reality
from simulation import virtual


def test_a_slave_sends_the_end_of_its_stream_before_the_master_may_leave(
    short_plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The master forwards what passes between slave and recorder, until it knows that the slave has stopped."""
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), tmp_path / "a.mcap", lambda *_: None)
    endpoint, sent = bench.slave.lab.endpoint, list[type[Message]]()
    send = endpoint.send

    def noted(message: Message) -> None:
        sent.append(type(message))
        send(message)

    monkeypatch.setattr(endpoint, "send", noted)
    assert virtual.run(bench, lambda: "") is None
    assert sent.index(Finished) < sent.index(Stopped)
