"""The segments of a tick's latency, on simulated clocks and a simulated network with known delays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from common import signals
from common.host.clock import VirtualClock
from common.host.clock_offset import ClockOffset
from common.lab.laboratory import Laboratory, Setting
from common.link.memory_link import MemoryHub
from common.plan.plan import Plan
from common.protocol.messages import Feedback, Recorder
from common.recording.rows import layout
from master.latency import LatencyAccount
from master.partner import NO_FEEDBACK, OFFSET_BLOCK, OFFSET_BLOCKS

INTERVAL = 2_000_000
SECOND = 1_000_000_000
PLANTED = 3_000_000
HANDSHAKE = 200

Delays = Callable[[int], tuple[int, int]]  # test time, ns -> one way there and back, ns


class Clock:
    """A laboratory's clock: off by `offset` at time 0, and drifting."""

    def __init__(self, offset: int, ppm: float) -> None:
        self.offset, self.ppm = offset, ppm

    def __call__(self, true: int) -> int:
        return true + self.offset + round(true * self.ppm * 1e-6)


class Trial:
    """An account fed by a network with known delays; the plug-in's delay is `extra` (s) on every feedback."""

    def __init__(self, plan: Plan, master: Clock, slave: Clock, delays: Delays, extra: float = 0.0) -> None:
        self.master, self.slave, self.delays, self.extra = master, slave, delays, extra
        clock = VirtualClock()
        self.lab = Laboratory(
            "master", Setting(plan, MemoryHub().join("master", clock), clock), signals.TOPICS
        )
        self.lab.enter(1)
        self.lab.recorder = Recorder(1, "recording", "", "", b"")
        self.offset = ClockOffset(length=OFFSET_BLOCK, blocks=OFFSET_BLOCKS)
        self.account = LatencyAccount(self.lab, self.offset, "latency")
        self.truth: list[tuple[int, int]] = []
        self.lab.start_ns = master(SECOND)

    def play(self, ticks: int) -> dict[str, Any]:
        """The latency rows, and the true one-way times beside them, by name."""
        for sync in range(HANDSHAKE):
            self.offset.add(*self._exchange(SECOND // 2 + sync * 300_000))
        feedback = NO_FEEDBACK
        for tick in range(ticks):
            true = SECOND + tick * INTERVAL
            wake = self.master(true)
            self.account.close(tick - 1, wake)
            t1, t2, t3, t4 = self._exchange(true + 60_000)
            self.account.open(tick, wake, t1 - 9_000, t1, feedback)
            feedback = Feedback(1, tick, tick, t2, tick, t2, t2 + 25_000, t3, (0.0, 0.0, 0.0, 0.0))
            self.account.answer(feedback, t4, t4 + 7_000, self.extra)
            self.truth.append(self.delays(true + 60_000))
        self.account.finish(ticks - 1, self.master(SECOND + ticks * INTERVAL))
        unpack = layout(signals.LATENCY, 1).unpack
        rows = [unpack(row)[2:] for topic, row in self.lab.outlet._pending if topic == "latency"]
        names = [row.name for row in signals.LATENCY]
        columns: dict[str, Any] = {
            name: np.array([row[place] for row in rows]) for place, name in enumerate(names)
        }
        there, back = np.array(self.truth).T * 1e-9
        return columns | {"there": there, "back": back}

    def _exchange(self, true: int) -> tuple[int, int, int, int]:
        there, back = self.delays(true)
        return (
            self.master(true),
            self.slave(true + there),
            self.slave(true + there + 50_000),
            self.master(true + there + 50_000 + back),
        )


def quick(seed: int) -> Delays:
    random = np.random.default_rng(seed)
    return lambda _true: (60_000 + int(random.exponential(40_000)), 60_000 + int(random.exponential(40_000)))


def planted(base: Delays, way: int, since: int) -> Delays:
    """The delays of `base`, with three milliseconds more in one direction from a moment on."""

    drawn: dict[int, tuple[int, int]] = {}

    def delays(true: int) -> tuple[int, int]:
        if true not in drawn:
            pair = list(base(true))
            pair[way] += PLANTED if true >= since else 0
            drawn[true] = (pair[0], pair[1])
        return drawn[true]

    return delays


AHEAD, BEHIND = Clock(SECOND, 50.0), Clock(-SECOND, -50.0)


@pytest.mark.parametrize(("way", "segment"), [(0, "command_one_way"), (1, "feedback_one_way")])
@pytest.mark.parametrize(("master", "slave"), [(AHEAD, BEHIND), (BEHIND, AHEAD), (Clock(0, 0.0), AHEAD)])
def test_a_delay_on_the_wire_appears_in_its_segment(
    short_plan: Plan, way: int, segment: str, master: Clock, slave: Clock
) -> None:
    since = 3 * SECOND
    found = Trial(short_plan, master, slave, planted(quick(way), way, since)).play(6_000)
    t = found["seq"] * 0.002 + 1.0
    settled, slow = t > 1.5, t > 3.1
    for name, true in (("command_one_way", "there"), ("feedback_one_way", "back")):
        assert np.max(np.abs(found[name] - found[true])[settled]) < 0.2e-3
    assert np.median(found[segment][slow]) == pytest.approx(
        3e-3 + np.median(found[segment][~slow]), abs=0.2e-3
    )


def test_a_plug_ins_delay_appears_in_its_segment_from_the_first_tick_on(short_plan: Plan) -> None:
    found = Trial(short_plan, BEHIND, AHEAD, planted(quick(5), 0, 10**18), extra=0.003).play(4_000)
    assert np.max(np.abs(found["feedback_one_way"] - found["back"] - 0.003)) < 0.2e-3
    assert np.max(np.abs(found["command_one_way"] - found["there"])) < 0.2e-3
    assert np.all(found["deadline_missed"])


def test_a_constant_one_way_delay_shifts_the_clock_offset_within_its_bound(
    short_plan: Plan,
) -> None:
    found = Trial(short_plan, AHEAD, BEHIND, planted(quick(6), 1, 0)).play(2_000)
    error = np.abs(found["feedback_one_way"] - found["back"])
    assert np.all(error <= found["clock_offset_bound"])
    assert np.median(error) == pytest.approx(1.5e-3, abs=0.2e-3)
    assert np.median(found["round_trip"]) == pytest.approx(3.25e-3, abs=0.1e-3)  # this one is certain


def test_the_latency_segments_add_up_to_the_total(short_plan: Plan) -> None:
    found = Trial(short_plan, AHEAD, BEHIND, planted(quick(7), 0, 10**18)).play(1_000)
    parts = found["command_one_way"] + found["slave_time"] + found["feedback_one_way"]
    assert np.allclose(parts, found["round_trip"], atol=2e-9)
    used = (found["feedback_used_ns"] - found["wake_ns"]) * 1e-9
    spent = found["compute_time"] + found["encode_time"] + found["round_trip"] + found["decode_time"]
    assert np.all(spent < used)
    ages = found["age_at_use"][1:]  # from the measurement, 25 µs after the command came, to the next tick
    before = found["compute_time"] + found["encode_time"] + found["there"] + 25e-6
    assert np.isnan(found["age_at_use"][0])
    settled = slice(500, None)  # the clocks' offset is known by then
    assert np.allclose(ages[settled], (used - before)[:-1][settled], atol=50e-6)
