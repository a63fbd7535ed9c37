"""The link model against its parameters, and what it counts."""

from __future__ import annotations

from itertools import groupby
from typing import NamedTuple

import numpy as np
import pytest

from common.link.transport import TICK, Packet
from common.roles import MASTER, SLAVE
from simulation.world import World
from validation.faults.wire import BACKLOG, DROPS, QUEUES, SOCKET, Conditions, Letter, Wire, WireRoute

MS = 1_000_000
COUNT = 20_000


class Line(NamedTuple):
    world: World
    direction: WireRoute
    packets: list[Packet]

    def send(self, count: int, every: int = MS) -> None:
        """Sends frames at a steady rate and lists all that arrive."""
        start = self.world.time
        for number in range(count):
            time = start + number * every
            letter = Letter(number.to_bytes(4, "big") * 20, "Command", number, time)
            self.world.at(time, self.direction.send, letter, time)

    def numbers(self) -> list[int]:
        return [int.from_bytes(packet.frame[:4], "big") for packet in self.packets]

    def counts(self) -> dict[str, int]:
        return dict(self.direction.ledger.counts["Command"])


def line(conditions: Conditions = Conditions(), seed: int = 1, ends_at: int = 60_000 * MS) -> Line:  # noqa: B008
    world = World(100_000 * MS)
    wire = Wire(world, (SLAVE,), Conditions(), seed)
    ports = {role: wire.join(world.process(role)) for role in (SLAVE, MASTER)}
    for process in world.processes.values():
        process.start(lambda process=process: process.sleep_until(ends_at))  # type: ignore[misc]
    direction = next(one for one in wire.between(MASTER, SLAVE) if one.route.channel == TICK)
    packets: list[Packet] = []
    ports[SLAVE].listen(packets.append)
    direction.lay("given", conditions)
    return Line(world, direction, packets)


def played(conditions: Conditions, count: int = COUNT) -> Line:
    found = line(conditions)
    found.send(count)
    found.world.run()
    return found


def test_a_delay_is_a_minimum_plus_an_exponential_part() -> None:
    found = played(Conditions(minimum=0.002, mean=0.0001))
    delays = np.array([time - sent for time, _, sent, _, _ in found.direction.ledger.arrivals]) * 1e-9
    assert delays.min() == pytest.approx(0.002, abs=1e-7)
    assert delays.mean() - 0.002 == pytest.approx(1e-4, rel=0.05)
    assert delays.std() == pytest.approx(1e-4, rel=0.05)
    assert found.numbers() == list(range(COUNT))


def test_single_losses_and_bursts_have_the_given_share_and_length() -> None:
    single, runs = played(Conditions(loss=0.05)), played(Conditions(burst=0.05, run=8.0))
    for found in (single, runs):
        assert found.counts()["lost"] / COUNT == pytest.approx(0.05, rel=0.25)
        assert found.counts()["lost"] + found.counts()["delivered"] == COUNT
    lost = set(runs.direction.ledger.numbers["lost"])
    lengths = [len(list(run)) for gone, run in groupby(range(COUNT), key=lost.__contains__) if gone]
    assert np.mean(lengths) == pytest.approx(8.0, rel=0.3)


def test_duplicates_corruption_and_reordering_have_the_given_shares() -> None:
    found = played(Conditions(duplicate=0.1, corrupt=0.05, reorder=0.02, hold=0.005))
    counts = found.counts()
    assert counts["duplicated"] / COUNT == pytest.approx(0.1, rel=0.1)
    assert counts["corrupted"] / COUNT == pytest.approx(0.05, rel=0.1)
    assert counts["reordered"] / COUNT == pytest.approx(0.02, rel=0.2)
    assert counts["delivered"] == COUNT + counts["duplicated"]
    assert counts["damaged"] == counts["corrupted"]
    arrivals = found.direction.ledger.arrivals
    for packet, (_, number, _, _, intact) in zip(found.packets, arrivals, strict=True):
        changed = int.from_bytes(packet.frame, "big") ^ int.from_bytes(number.to_bytes(4, "big") * 20, "big")
        assert changed.bit_count() == (not intact)
    numbers = np.array([number for _, number, _, _, _ in arrivals])
    assert 0 < np.count_nonzero(np.diff(numbers) < 0) <= counts["reordered"]


@pytest.mark.parametrize(("state", "there"), [(QUEUES, 100), (DROPS, 50)])
def test_an_outage_queues_frames_as_tcp_does_or_loses_them(state: str, there: int) -> None:
    found = line(Conditions())
    found.send(100)
    found.world.at(25 * MS, found.direction.lay, "outage", Conditions(state=state))
    found.world.at(75 * MS, found.direction.lift, "outage")
    found.world.run()
    assert len(found.packets) == there
    times = np.array([packet.received_ns for packet in found.packets])
    assert np.diff(times).max() >= 50 * MS
    assert np.count_nonzero(times == 75 * MS) == there - 50  # frame 75 was sent just before
    assert found.numbers() == sorted(found.numbers())


def test_the_backlog_of_a_link_is_bounded() -> None:
    found = line(Conditions(state=QUEUES))
    found.send(BACKLOG + 7)
    found.world.at(10_000 * MS, found.direction.lift, "given")
    found.world.run()
    assert len(found.packets) == BACKLOG
    assert found.counts()["lost"] == 7


def test_simultaneous_impairments_add_up_and_end_completely() -> None:
    found = line(Conditions(minimum=0.001))
    found.direction.lay("more", Conditions(minimum=0.002, loss=0.5))
    both = Conditions(loss=0.5).over(Conditions(loss=0.5, state=QUEUES)).over(Conditions(state=DROPS))
    assert both.loss == pytest.approx(0.75)
    assert both.state == DROPS
    found.direction.lift("more")
    found.send(100)
    found.world.run()
    assert {time - sent for time, _, sent, _, _ in found.direction.ledger.arrivals} == {MS}
    assert found.counts() == {"sent": 100, "delivered": 100}


def test_draws_depend_on_seed_and_direction_only() -> None:
    def lost(seed: int) -> list[int]:
        found = line(Conditions(loss=0.1), seed)
        found.send(500)
        found.world.run()
        return found.direction.ledger.numbers["lost"]

    assert lost(1) == lost(1)
    assert lost(1) != lost(2)


def test_frames_for_a_paused_process_wait_in_its_socket() -> None:
    found = line()
    found.send(SOCKET + 100)
    process = found.direction.hearer.process
    found.world.at(10 * MS + 1, process.stall, 5000 * MS)
    found.world.run()
    times = np.array([packet.received_ns for packet in found.packets])
    assert np.count_nonzero(times == 5010 * MS + 1) == SOCKET
    assert found.counts()["overflow"] == 100 - 11


def test_replayed_frames_arrive_again_and_are_counted_separately() -> None:
    found = line()
    found.send(10)
    found.world.at(50 * MS, found.direction.again, 4)
    found.world.run()
    assert found.numbers() == [*range(10), 0, 1, 2, 3]
    assert found.counts() == {"sent": 10, "delivered": 14, "replayed": 4}
    assert found.direction.ledger.numbers["sent"] == list(range(10))
