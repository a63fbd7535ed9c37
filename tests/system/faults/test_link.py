"""Fault rows F05 to F10, F17, F18 and F35: the link is cut, flaps, loses one way, is slow, is spoilt, loses a STOP."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from common.link.zenoh_link import LEASE_MS
from common.protocol.codec import KINDS
from common.protocol.messages import Stop
from tests.faults.rows import passed
from tests.system.faults.bench import INTERVAL, LABS, Bench, Place, Process, loopback, undisturbed
from tests.system.faults.network import ADDRESSES, Network, inside, network
from tests.system.faults.reactions import Reaction, evidence, exchanged, judge, worst
from tests.system.faults.relay import TO_SLAVE, Relay, untouched

pytestmark = pytest.mark.faults

LEASE = LEASE_MS * 1e-3  # s of silence after which zenoh closes a session
RATE = round(0.4 / INTERVAL)  # kbit/s, a third of what a test sends
RECONNECT = LEASE + 0.5  # s from where the link works again to the next word of the other laboratory


@pytest.fixture(scope="module")
def machines() -> Iterator[Network]:
    with network() as found:
        yield found


def both(bench: Bench, *causes: str) -> tuple[dict[str, Reaction], dict[str, float]]:
    """Both laboratories came to rest for one of the causes, and their accounts together."""
    run = bench.finish()
    found = {lab: judge(run, bench, lab, causes or ["watchdog"]) for lab in LABS}
    return found, {**exchanged(run, "slave"), **exchanged(run, "master")}


def row(fault: str, title: str, how: str, found: dict[str, Reaction], more: str = "") -> None:
    """Keep what two laboratories that tripped have shown."""
    passed(fault, title, how, "both safe", *worst(found), evidence(found) + (more and f"; {more}"))


def ear(bench: Bench, *before: str) -> Process:
    """Who says when control messages come by at the master."""
    found = Process(
        "tests.system.faults.ear", bench.path, "--connect", bench.place.connect["recorder"], before=before
    )
    bench.all.append(found)
    return found


def heard_after(listener: Process, since: float) -> float:
    """How long after a moment (monotonic s) the slave was heard at the master again, s."""
    listener.wait(lambda data: data["role"] == "slave" and data["ns"] * 1e-9 > since, 15.0)
    return next(
        float(data["ns"]) * 1e-9 - since
        for _, data in list(listener.said)
        if data["role"] == "slave" and data["ns"] * 1e-9 > since
    )


def test_f05_a_short_outage_without_notice(machines: Network, tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder, machines.place("tcp")).start_all() as bench:
            try:
                machines.cut()
                time.sleep(25 * INTERVAL)
            finally:
                machines.mend()
            bench.rest(*LABS)
            found, _ = both(bench)
        apart = abs(found["master"].seconds - found["slave"].seconds)
        assert apart <= 2 * INTERVAL
        row("F05", f"black hole of {25e3 * INTERVAL:.0f} ms", "switch port cut, tcp", found)

    undisturbed(scenario, tmp_path)


@pytest.mark.parametrize("protocol", ["tcp", "udp"])
def test_f06_after_an_outage_of_500_ms_nothing_moves(
    protocol: str, machines: Network, tmp_path: Path
) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder, machines.place(protocol)).start_all() as bench:
            try:
                cut = machines.cut()
                time.sleep(max(cut + 0.5 - time.monotonic(), 0.0))
            finally:
                machines.mend()
            bench.rest(*LABS)
            time.sleep(0.8)  # until TCP has sent again what was lost: it waits twice as long each time
            bench.rest(*LABS)
            found, account = both(bench)
        stale = sum(count for name, count in account.items() if "stale" in name)
        if protocol == "tcp":
            assert stale > 0, account
            row("F06", "black hole of 500 ms", "switch port cut, tcp and udp", found, f"{stale:.0f} stale")

    undisturbed(scenario, tmp_path)


def test_f07_f08_an_outage_longer_than_the_lease_needs_a_reset(machines: Network, tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder, machines.place("tcp")).start_all() as bench:
            listener = ear(bench, *inside(machines.master))
            try:
                cut = machines.cut()
                bench.rest(*LABS)
                time.sleep(max(cut + 5.0 - time.monotonic(), 0.0))
            finally:
                mended = machines.mend()
            again = heard_after(listener, mended)
            bench.rest(*LABS)
            answers = bench.operator("reset")
            assert answers.finish() == 0, answers.errors
            for lab in LABS:
                assert bench.lab(lab).modes[-1] == "safe → idle (reset)"
            found, _ = both(bench)
        assert again <= RECONNECT
        row("F07", "black hole of 5 s", "switch port cut, tcp", found)
        title = f"outage of 5 s, lease {LEASE:g} s"
        row("F08", title, "switch port cut, tcp", found, f"link back after {again:.2f} s, reset by operator")

    undisturbed(scenario, tmp_path)


def test_f09_a_flapping_link_recovers_soon(machines: Network, tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder, machines.place("udp")).start_all() as bench:
            listener = ear(bench, *inside(machines.master))
            time.sleep(0.7)  # until it listens
            try:
                machines.unplug()
                time.sleep(25 * INTERVAL)
            finally:
                plugged = machines.plug()
            again = heard_after(listener, plugged)
            bench.rest(*LABS)
            found, _ = both(bench)
        assert again <= RECONNECT
        row(
            "F09",
            f"link flaps for {25e3 * INTERVAL:.0f} ms",
            "interface down and up, udp",
            found,
            f"link back after {again:.2f} s",
        )

    undisturbed(scenario, tmp_path)


def test_f10_a_link_that_loses_one_way(machines: Network, tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder, machines.place("udp")).start_all() as bench:
            try:
                machines.drop(machines.slave, f"ip saddr {ADDRESSES[0]}")
                bench.rest(*LABS)
            finally:
                machines.keep(machines.slave)
            run = bench.finish()
            # the slave's word that it has stopped comes an interval before the master's own watchdog
            found = {
                "slave": judge(run, bench, "slave", ["watchdog"]),
                "master": judge(run, bench, "master", ["watchdog", "remote_trip"]),
            }
        assert found["slave"].cause == "watchdog"
        row("F10", "one-way loss, master to slave", "nftables at the slave's input, udp", found)

    undisturbed(scenario, tmp_path)


def test_f18_a_slow_link_trips_on_age(machines: Network, tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder, machines.place("udp")).start_all() as bench:
            try:
                machines.slow(f"{RATE}kbit")
                bench.rest(*LABS)
            finally:
                machines.fast()
            run = bench.finish()
            found = {
                "slave": judge(run, bench, "slave", ["watchdog"]),
                "master": judge(run, bench, "master", ["watchdog", "remote_trip"]),
            }
        stale = exchanged(run, "slave").get("commands.turned_away.stale", 0.0)
        assert stale > 0
        how = "token bucket at the switch, udp"
        row("F18", f"bandwidth of {RATE} kbit/s", how, found, f"{stale:.0f} stale commands turned away")

    undisturbed(scenario, tmp_path)


def relayed(relay: Relay, listen: str) -> Place:
    """The slave dials a relay, the others the master."""
    return Place(listen, {"slave": relay.endpoint, "recorder": listen}, {})


def test_f17_flipped_bits_in_the_headers_of_zenoh(tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        listen = loopback("udp").listen
        with (
            Relay(int(listen.rpartition(":")[2])) as relay,
            Bench(folder, relayed(relay, listen)).start_all() as bench,
        ):
            listener = ear(bench)
            time.sleep(0.7)
            relay.change = lambda datagram, _: bytes([datagram[0] ^ 0x10]) + datagram[1:]
            time.sleep(50 * INTERVAL)
            relay.change = untouched
            again = heard_after(listener, time.monotonic())
            bench.rest(*LABS)
            run = bench.finish()
            found = {lab: judge(run, bench, lab, ["watchdog", "remote_trip"]) for lab in LABS}
        assert again <= RECONNECT
        row(
            "F17",
            "bit flips in zenoh's headers",
            f"relay, udp, {50e3 * INTERVAL:.0f} ms",
            found,
            f"link back after {again:.2f} s",
        )

    undisturbed(scenario, tmp_path)


def test_f35_the_watchdog_acts_when_a_stop_is_lost(tmp_path: Path) -> None:
    mark = bytes([0x94, KINDS[Stop], 0xCF])  # a frame of four items, its kind, a session of 64 bits
    lost: list[float] = []

    def lose_stops(datagram: bytes, way: str) -> bytes | None:
        if way == TO_SLAVE and mark in datagram:
            lost.append(time.monotonic())
            return None
        return datagram

    def scenario(folder: Path) -> None:
        listen = loopback("udp").listen
        with (
            Relay(int(listen.rpartition(":")[2])) as relay,
            Bench(folder, relayed(relay, listen)).start_all() as bench,
        ):
            relay.change = lose_stops
            bench.master.signal(signal.SIGTERM)
            bench.slave.mode("safe", 5.0)
            run = bench.finish()
            found = {"slave": judge(run, bench, "slave", ["watchdog"])}
        assert lost
        state = "slave safe by its watchdog"
        told = f"{evidence(found)}; {len(lost)} times sent and lost"
        passed("F35", "STOP lost", "relay loses it again and again, udp", state, *worst(found), told)

    undisturbed(scenario, tmp_path)
