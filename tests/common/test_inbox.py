from __future__ import annotations

import os
import signal
import threading
import time

from common.link.inbox import Inbox
from common.link.transport import Packet
from tests.processes import HANG_S


def packet(number: int) -> Packet:
    return Packet("master", "tick", b"", number)


def test_frames_come_in_order_and_a_missing_one_is_awaited_for_a_bounded_time() -> None:
    inbox: Inbox[Packet] = Inbox()
    for number in range(3):
        inbox.put(packet(number))
    assert [found.received_ns for _ in range(3) if (found := inbox.get(0.0))] == [0, 1, 2]
    began = time.monotonic()
    while inbox.get(0.05) is not None or time.monotonic() - began < 0.05:
        pass
    assert time.monotonic() - began < HANG_S


def test_a_waiting_consumer_is_woken() -> None:
    inbox: Inbox[Packet] = Inbox()
    threading.Timer(0.05, inbox.put, [packet(7)]).start()
    found, deadline = None, time.monotonic() + HANG_S
    while found is None and time.monotonic() < deadline:
        found = inbox.get(5.0)
    assert found == packet(7)


def test_nothing_is_lost_between_several_producers_and_a_consumer() -> None:
    inbox: Inbox[Packet] = Inbox()
    each = 2_000

    def produce() -> None:
        for number in range(each):
            inbox.put(packet(number))

    producers = [threading.Thread(target=produce) for _ in range(3)]
    for producer in producers:
        producer.start()
    got, deadline = 0, time.monotonic() + HANG_S
    while got < 3 * each and time.monotonic() < deadline:
        got += inbox.get(0.01) is not None
    assert got == 3 * each
    for producer in producers:
        producer.join(10.0)
    assert not any(producer.is_alive() for producer in producers)


def test_a_signal_handler_does_not_prolong_the_wait() -> None:
    inbox: Inbox[Packet] = Inbox()
    before = signal.signal(signal.SIGUSR1, lambda *_: time.sleep(0.2))
    try:
        threading.Timer(0.05, os.kill, [os.getpid(), signal.SIGUSR1]).start()
        began = time.monotonic()
        assert inbox.get(0.1) is None
        assert time.monotonic() - began < HANG_S
    finally:
        signal.signal(signal.SIGUSR1, before)
