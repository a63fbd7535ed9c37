"""The laboratory of a rig in another process whose answers are late, missing, old or damaged, or that has stopped."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest

from common.errors import EmergencyStopError, InputError, RigError
from common.signals import COLUMN_CHANNELS, TABLE_CHANNELS
from common.udp import rig as udp
from common.udp.packets import Asked, RigState
from common.udp.peer import place
from common.udp.rig import Terms, UdpRig
from tests.common.udp.server import Answers, changed, example, scripted, served, words

TERMS = Terms("", "[master.rig]", 0.002, 3, 0.2, 1.0, 10.0, 3, paced=True)


def sound(_kind: int, _count: int, _packet: bytes, answer: bytes) -> list[bytes]:
    return [answer] if answer else []


def at(kind: Asked, numbers: set[int], change: Callable[[bytes], list[bytes]]) -> Answers:
    """Correct answers, except to the packets of a kind with these numbers, counted from 1."""

    def answers(of: int, count: int, _packet: bytes, answer: bytes) -> list[bytes]:
        return change(answer) if of == kind and (count in numbers or not numbers) else [answer]

    return answers


def driven(answers: Answers, commands: int, **terms: Any) -> tuple[UdpRig, list[tuple[float, ...]]]:
    """A rig after arming and this many commands, and its reading after each command."""
    found = []
    with scripted(answers) as address:
        rig = UdpRig(COLUMN_CHANNELS, TERMS._replace(address=address, **terms))
        rig.arm()
        assert rig.read() == (0.0, 0.0)
        for number in range(commands):
            rig.write((1e-3 * (number + 1),))
            found.append(rig.read())
        rig.disarm()
    return rig, found


def column(commands: int) -> list[tuple[float, float]]:
    """The readings of the same rig in this process."""
    rig, found = example.Column(0.002, 3), []
    for number in range(commands):
        rig.write((1e-3 * (number + 1),))
        found.append(rig.read())
    return found


def test_a_rig_over_udp_gives_the_same_readings_as_in_this_process() -> None:
    rig, found = driven(sound, 20)
    assert found == column(20)
    assert len(rig.echoes.round_trips_s) == udp.ECHOES
    assert rig.echoes.lost == 0
    assert rig.account.values()["answers"] == 20.0
    assert rig.missed == 0


def test_a_missed_answer_repeats_the_newest_reading_and_a_late_one_is_used() -> None:
    kept: list[bytes] = []

    def delayed(_kind: int, _count: int, _packet: bytes, answer: bytes) -> list[bytes]:
        kept.append(answer)
        return []

    def answers(kind: int, count: int, packet: bytes, answer: bytes) -> list[bytes]:
        if kind == Asked.COMMAND and count == 5:
            return delayed(kind, count, packet, answer)
        return [*(kept.pop() for _ in kept[:1]), answer] if kind == Asked.COMMAND else [answer]

    rig, found = driven(answers, 8)
    expected = column(8)
    assert found[4] == expected[3]
    assert found[:4] + found[5:] == expected[:4] + expected[5:]
    assert (rig.account.counts["missed"], rig.account.counts["late"], rig.missed) == (1, 1, 0)


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (lambda answer: [answer, answer], "old"),
        (lambda answer: [changed(answer, seq=1), answer], "old"),
        (lambda answer: [changed(answer, seq=10**6), answer], "old"),
        (lambda answer: [changed(answer, session=1), answer], "foreign"),
        (lambda answer: [answer[:-1], answer], "damaged"),
        (lambda answer: [bytes(128), b"", b"x" * 500, answer], "damaged"),
        (lambda answer: [changed(answer, version=2), answer], "damaged"),
        (lambda answer: [changed(answer, count=1), answer], "damaged"),
    ],
    ids=["twice", "old", "ahead", "of another test", "short", "nonsense", "version", "too few numbers"],
)
def test_an_answer_that_does_not_belong_to_the_tick_is_counted_and_ignored(
    change: Callable[[bytes], list[bytes]], cause: str
) -> None:
    rig, found = driven(at(Asked.COMMAND, {3, 4, 5}, change), 9)
    assert found == column(9)
    assert rig.account.counts[cause] >= 3
    assert rig.account.counts.keys() == {cause}


@pytest.mark.parametrize(
    "change",
    [lambda _: [], lambda answer: [answer[:-1]], lambda answer: [changed(answer, seq=1)]],
    ids=["silent", "damaged", "old"],
)
def test_a_rig_without_a_valid_answer_is_given_up_after_the_plans_intervals(
    change: Callable[[bytes], list[bytes]],
) -> None:
    with scripted(at(Asked.COMMAND, set(range(3, 99)), change)) as address:
        rig = UdpRig(COLUMN_CHANNELS, TERMS._replace(address=address))
        rig.arm()
        missed = []
        for number in range(4):
            rig.write((1e-3 * (number + 1),))
            rig.read()
            missed.append(rig.missed)
        rig.write((5e-3,))
        with pytest.raises(
            RigError, match="for 3 intervals in a row no valid answer was there 200 ms into the"
        ):
            rig.read()
        assert missed == [0, 0, 1, 2]


def test_a_tick_waits_for_an_answer_at_most_the_allowed_time() -> None:
    with scripted(at(Asked.COMMAND, set(), lambda _: [])) as address:
        rig = UdpRig(COLUMN_CHANNELS, TERMS._replace(address=address, wait=2e-3, most=99))
        rig.arm()
        took = []
        for _ in range(20):
            rig.write((0.0,))
            begun = time.perf_counter()
            rig.read()
            took.append(time.perf_counter() - begun)
    assert min(took) >= 2e-3
    assert min(took) < 4e-3  # the machine may hold up the others


@pytest.mark.parametrize(
    ("state", "error", "text"),
    [
        (RigState.STOPPED, RigError, "it has stopped and says: oil is hot."),
        (RigState.EMERGENCY, EmergencyStopError, "its emergency stop was pressed: oil is hot."),
    ],
)
def test_a_rig_that_stops_on_its_own_ends_the_test_with_its_own_words(
    state: RigState, error: type[RigError], text: str
) -> None:
    change = at(Asked.COMMAND, {2}, lambda answer: [changed(answer, state=state, text=b"oil is hot")])
    with pytest.raises(error) as told:
        driven(change, 3)
    assert (type(told.value), str(told.value)) == (error, text)


@pytest.mark.parametrize(
    ("answers", "text"),
    [
        (lambda *_: [], "nothing answers at udp/"),
        (lambda *_: [b"short"], "answers with packets that are not valid"),
        (at(Asked.ARM, set(), lambda _: []), "it was not ready after 0.3 s and says: nothing"),
        (
            at(Asked.ARM, set(), lambda one: [changed(one, state=RigState.IDLE, text=b"busy")]),
            "it does not arm and says: busy.",
        ),
        (
            at(Asked.ARM, set(), lambda one: [changed(one, state=RigState.PREPARING)]),
            "it was not ready after 0.3 s and says: that it is not ready",
        ),
        (
            at(Asked.ARM, set(), lambda one: [changed(one, count=4)]),
            "it answers with 4 numbers, but must measure 2",
        ),
        (at(Asked.ECHO, set(), lambda one: [changed(one, channels=5)]), "so it is the rig of another kind"),
    ],
    ids=["not there", "short packets", "does not arm", "busy", "slow", "numbers", "channels"],
)
def test_a_rig_that_is_not_ready_gives_its_reason(
    answers: Answers, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(udp, "FIRST_NS", 10_000_000)
    with scripted(answers) as address, pytest.raises(RigError) as told:
        UdpRig(COLUMN_CHANNELS, TERMS._replace(address=address, arm_timeout=0.3)).arm()
    assert text in str(told.value)
    assert str(told.value).endswith(".")


def test_a_port_without_a_listener_is_reported() -> None:
    with pytest.raises(RigError, match="nothing answers at udp/9: start the rig's program there"):
        UdpRig(COLUMN_CHANNELS, TERMS._replace(address="udp/9")).arm()


def test_a_rig_that_arms_slowly_is_waited_for() -> None:
    slow = at(Asked.ARM, {1, 2}, lambda one: [changed(one, state=RigState.PREPARING)])
    assert driven(slow, 2)[1] == column(2)


def test_a_rig_that_allows_readings_at_rest_is_read_at_rest() -> None:
    change = at(Asked.ECHO, set(), lambda one: [changed(one, count=2, values=(1.0, 2.0))])
    with scripted(change) as address:
        rig = UdpRig(COLUMN_CHANNELS, TERMS._replace(address=address))
        rig.arm()
        assert rig.idle_readings
        assert [rig.read() for _ in range(3)] == [(1.0, 2.0)] * 3


def test_a_rig_that_does_not_confirm_that_it_is_disarmed_is_reported() -> None:
    with pytest.raises(RigError, match="it has not confirmed that it is disarmed"):
        driven(at(Asked.DISARM, set(), lambda _: []), 1)


# -- the example's own side -------------------------------------------------------------------------


def test_the_examples_rig_stops_on_its_own_when_packets_cease() -> None:
    stopped = []

    class Column(example.Column):  # type: ignore[name-defined,misc]
        def disarm(self) -> None:
            stopped.append(time.monotonic())

    with served(Column, words(COLUMN_CHANNELS)) as address:
        rig = UdpRig(COLUMN_CHANNELS, TERMS._replace(address=address, silence=0.03))
        rig.arm()
        time.sleep(0.05)
        assert stopped == []  # nothing has moved
        rig.write((1e-3,))
        rig.read()
        time.sleep(0.3)
        assert len(stopped) == 1
        rig.write((2e-3,))
        with pytest.raises(RigError, match="it has stopped and says: no packet for 30 ms"):
            rig.read()


def test_the_examples_rig_serves_one_test_at_a_time_and_the_next_after_it() -> None:
    with served(example.Column, words(COLUMN_CHANNELS)) as address:
        first, second = (UdpRig(COLUMN_CHANNELS, TERMS._replace(address=address)) for _ in range(2))
        first.arm()
        with pytest.raises(RigError, match="busy with another test"):
            second.arm()
        first.disarm()
        second.arm()


def test_the_examples_rig_refuses_another_kinds_channels() -> None:
    with served(example.Column, words(COLUMN_CHANNELS)) as address:
        rig = UdpRig(TABLE_CHANNELS, TERMS._replace(address=address))
        with pytest.raises(RigError, match="it is the rig of another kind of laboratory"):
            rig.arm()


# -- addresses --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("address", "found"),
    [
        ("udp/9100", ("127.0.0.1", 9100)),
        ("udp/192.0.2.7:1", ("192.0.2.7", 1)),
        ("udp/lab.example:65535", ("lab.example", 65535)),
    ],
)
def test_an_address_without_a_host_is_on_this_machine(address: str, found: tuple[str, int]) -> None:
    assert place(address, "[master.rig]") == found


@pytest.mark.parametrize(
    "address", ["tcp/127.0.0.1:9100", "udp/", "udp/0", "udp/70000", "udp/[::1]:9100", "9100", "udp/a:b"]
)
def test_a_wrong_address_is_refused_and_its_key_is_named(address: str) -> None:
    with pytest.raises(InputError, match=r"address in \[master.rig\] is .*, but must be udp/HOST:PORT"):
        place(address, "[master.rig]")
