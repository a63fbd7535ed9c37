"""Clients that die, stall, send nonsense or come second: the laboratory is safe in 10 ms, the recording whole.

Each case is a real client at a real socket; the laboratory's loops, rig and recorder run in virtual time, so that what
the machine does beside them does not count.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from common.opensees import wire
from common.opensees.port import OTHERS, ElementPort, Ports
from common.opensees.wire import ClientHeader, MessageCode, Sizes
from tests.helpers import ROOT
from tests.serve.client import FRESCO, HOST, PATIENCE_S, Element, free_port
from tests.serve.serving import Served, Ticking, serve

SAFE_S = 0.010
STEPS = 12
HERE = [1e-4 * STEPS]
NEXT = [1e-4 * (STEPS + 1)]
FOUND: list[Element] = []  # kept, because a socket that is collected is closed


def begun(port: int) -> Element:
    """A client that has made some steps."""
    client = Element(port)
    client.steps(STEPS)
    FOUND.append(client)
    return client


def closes(port: int) -> None:
    begun(port).close()


def closes_within_a_message(port: int) -> None:
    client = begun(port)
    client.raw(wire.message(client.header, MessageCode.COMMIT)[:1000])
    client.close()


def closes_while_the_laboratory_moves(port: int) -> None:
    client = begun(port)
    client.say(MessageCode.TRIAL, NEXT)
    client.close()


def closes_as_it_waits_for_the_force(port: int) -> None:
    client = begun(port)
    client.say(MessageCode.TRIAL, NEXT)
    client.say(MessageCode.FORCE, NEXT)
    client.close()


def resets(port: int) -> None:
    client = begun(port)
    client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    client.close()


def is_killed(port: int) -> None:
    text = f"from tests.serve.client import Element; one = Element({port}); one.steps({STEPS}); "
    process = subprocess.Popen(
        [sys.executable, "-c", f"{text}print(1, flush=True); input()"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    with process:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(signal.SIGKILL)


def stalls(port: int) -> None:
    begun(port)


def stalls_within_a_message(port: int) -> None:
    client = begun(port)
    client.raw(wire.message(client.header, MessageCode.TRIAL)[:1000])


def stalls_while_the_laboratory_moves(port: int) -> None:
    begun(port).say(MessageCode.TRIAL, NEXT)


def stalls_behind_the_force(port: int) -> None:
    client = begun(port)
    client.say(MessageCode.TRIAL, NEXT)
    client.say(MessageCode.FORCE, NEXT)
    client.answer(1)


def asks_for_nothing_but_damping(port: int) -> None:
    client = begun(port)
    client.socket.settimeout(0.5)
    with contextlib.suppress(OSError):  # turned away, or its own buffer is full
        for _ in range(100_000):
            client.say(MessageCode.DAMPING)


def wants_something_unknown(port: int) -> None:
    client = begun(port)
    client.raw(struct.pack("=d", 42.0).ljust(client.header.size, b"\0"))


def has_no_code(port: int) -> None:
    client = begun(port)
    client.raw(struct.pack("=d", math.nan).ljust(client.header.size, b"\0"))


def diverges(port: int) -> None:
    begun(port).say(MessageCode.TRIAL, [math.nan])


def runs_away(port: int) -> None:
    begun(port).say(MessageCode.TRIAL, [math.inf])


def babbles(port: int) -> None:
    begun(port).raw(bytes(np.random.default_rng(1).integers(0, 256, 4096, dtype=np.uint8)))


def is_another_program(port: int) -> None:
    begun(port).raw(b"GET / HTTP/1.1\r\n\r\n".ljust(2048, b" "))


def revises(port: int) -> None:
    client = begun(port)
    client.say(MessageCode.TRIAL, NEXT)
    client.say(MessageCode.FORCE, NEXT)
    client.answer(1)
    client.say(MessageCode.TRIAL, [1.1 * NEXT[0]])


def goes_too_far(port: int) -> None:
    begun(port).say(MessageCode.TRIAL, [0.2])


def leaps(port: int) -> None:
    begun(port).say(MessageCode.TRIAL, [0.02])


CLOSED = "is lost: it closed the connection without saying that its analysis is over"
STALLED = r"No valid displacement from the client for 10 ms\."
NONSENSE = "was turned away: a message has the code"
CASES: list[tuple[Callable[[int], None], int, str]] = [
    (closes, 4, CLOSED),
    (closes_within_a_message, 4, CLOSED),
    (closes_while_the_laboratory_moves, 4, CLOSED),
    (closes_as_it_waits_for_the_force, 4, f"{CLOSED}|Broken pipe|Connection reset"),
    (resets, 4, "is lost: Connection reset by peer"),
    (is_killed, 4, f"{CLOSED}|Connection reset"),
    (stalls, 4, STALLED),
    (stalls_within_a_message, 4, STALLED),
    (stalls_while_the_laboratory_moves, 4, STALLED),
    (stalls_behind_the_force, 4, STALLED),
    (asks_for_nothing_but_damping, 4, "does not take its answers|No valid displacement"),
    (wants_something_unknown, 4, f"{NONSENSE} 42"),
    (has_no_code, 4, f"{NONSENSE} nan"),
    (diverges, 4, "not finite"),
    (runs_away, 4, "not finite"),
    (babbles, 4, NONSENSE),
    (is_another_program, 4, NONSENSE),
    (revises, 3, r"1\.3 mm to 1\.43 mm.*NewmarkExplicit, CentralDifference or AlphaOS"),
    (goes_too_far, 3, r"actuator_command is 0\.1, beyond its limit of 0\.05 m"),
    (leaps, 3, r"actuator_step is 0\.009"),
]


@pytest.mark.parametrize(("script", "code", "says"), CASES, ids=[case[0].__name__ for case in CASES])
def test_after_a_client_fails_the_laboratory_is_safe_and_the_recording_complete(
    script: Callable[[int], None], code: int, says: str, tmp_path: Path
) -> None:
    served = serve(script, tmp_path, pace=Ticking())
    for client in FOUND:
        client.close()
    FOUND.clear()
    assert served.error is not None
    assert served.error.exit_code == code
    text = str(served.error)
    assert re.search(says, text), text
    assert text.endswith(".")
    assert "\n" not in text
    assert safe_after(served) <= SAFE_S + 1e-9
    whole(served)
    assert served.client.error is None


def safe_after(served: Served) -> float:
    """The time from the last force that the client received to the beginning of the ramp to rest, s."""
    of, interval = served.run.columns["master"], 0.002
    handed = np.flatnonzero(np.isfinite(of["client_force"]))
    (ramp,) = [
        event["t"] for event in served.run.events if event["code"] == "mode" and "→ ramping" in event["text"]
    ]
    return float(ramp - interval * handed[-1])


def whole(served: Served) -> None:
    """Asserts that every tick and the ramp to rest with its end are recorded."""
    run = served.run
    count = len(run.columns["master"]["seq"])
    assert count >= STEPS
    assert run.columns["master"]["seq"].tolist() == list(range(count))
    ramp = run.ramps["master"]
    assert ramp["seq"].tolist() == list(range(int(ramp["seq"][0]), int(ramp["seq"][0]) + len(ramp["seq"])))
    assert int(ramp["seq"][0]) in (
        count,
        count - 1,
    )  # a limit trips within its tick, whose row is recorded too
    assert ramp["mode"][-1] == "safe"
    assert served.said("safe")
    assert run.metadata["summary"]["items_lost"] == "0"


# -- second clients, and those that nothing has moved for ---------------------------------------------------


def test_a_second_client_is_turned_away_and_the_first_goes_on(tmp_path: Path) -> None:
    def two(port: int) -> None:
        client = begun(port)
        other = socket.create_connection((HOST, port), timeout=PATIENCE_S)
        for i in range(STEPS, 3 * STEPS):
            client.step([1e-4 * (i + 1)])
        assert other.recv(1) == b""
        other.close()
        client.say(MessageCode.END)
        client.close()

    served = serve(two, tmp_path, pace=Ticking())
    assert served.error is None
    assert served.client.error is None
    assert served.run.columns["master"]["client_step"][-1] == 3 * STEPS
    (text,) = served.warned()
    assert re.fullmatch(
        r"A second client, from 127\.0\.0\.1:\d+, was turned away from .*: one at a time is served, and .* came "
        r"first\.",
        text,
    )


def test_a_flood_of_clients_is_turned_away_and_reported_at_most_ten_times(tmp_path: Path) -> None:
    def many(port: int) -> None:
        client = begun(port)
        others = [socket.create_connection((HOST, port), timeout=PATIENCE_S) for _ in range(7)]
        for i in range(STEPS, 6 * STEPS):
            client.step([1e-4 * (i + 1)])
            if i % 8 == 0:
                others += [socket.create_connection((HOST, port), timeout=PATIENCE_S) for _ in range(3)]
        client.say(MessageCode.END)
        for one in (*others, client.socket):
            one.close()

    served = serve(many, tmp_path, pace=Ticking())
    assert served.error is None
    assert served.client.error is None
    assert len(served.warned()) == 10


def test_a_client_that_never_pauses_does_not_hide_others(monkeypatch: pytest.MonkeyPatch) -> None:
    said = list[str]()
    port = ElementPort(f"{HOST}:{free_port()}", (1e6,), said.append)
    ports = Ports([port])
    with (
        contextlib.closing(ports),
        socket.create_connection(port.listener.getsockname()) as first,
        socket.create_connection(port.listener.getsockname()) as second,
    ):
        assert ports.serve(PATIENCE_S)
        assert port.peer == "{}:{}".format(*first.getsockname())
        monkeypatch.setattr(port, "read", lambda: True)
        for _ in range(2 * OTHERS):
            assert ports.serve(0.0)
        second.settimeout(PATIENCE_S)
        assert second.recv(1) == b""
    assert len(said) == 1


@pytest.mark.parametrize(
    ("header", "says"),
    [
        (wire.header_bytes(wire.element(3)), "3 degrees of freedom, but 1 of the laboratories answer here"),
        (struct.pack(">11i", 1, 1, 1, 0, 1, 0, 0, 0, 1, 0, 256), "order of bytes"),
        (b"GET / HTTP/1.1\r\nHost: 127.0.0.1:8090\r\n\r\n....", "no header"),
        (wire.header_bytes(ClientHeader(Sizes(force=1), Sizes(force=1), 256)), "0 degrees of freedom"),
    ],
    ids=["degrees of freedom", "order of bytes", "another program", "forces"],
)
def test_a_client_that_cannot_be_served_makes_room_for_the_next(
    header: bytes, says: str, tmp_path: Path
) -> None:
    def script(port: int) -> None:
        first = Element.__new__(Element)
        first.socket = socket.create_connection((HOST, port), timeout=PATIENCE_S)
        first.raw(header)
        assert first.socket.recv(1) == b""
        first.close()
        ends(port)

    served = serve(script, tmp_path)
    assert served.error is None
    assert served.client.error is None
    (text,) = served.warned()
    assert says in text
    assert text.endswith("Nothing had moved, and the next one is served.")


@pytest.mark.parametrize("early", ["looks", "ends", "dies"])
def test_a_client_that_leaves_before_it_moves_anything_makes_room_for_the_next(
    early: str, tmp_path: Path
) -> None:
    def script(port: int) -> None:
        if early == "looks":
            socket.create_connection((HOST, port), timeout=PATIENCE_S).close()
        else:
            client = Element(port)
            client.say(MessageCode.TRIAL, [0.0])
            client.say(MessageCode.FORCE, [0.0])
            client.answer(1)
            if early == "ends":
                client.say(MessageCode.END)
            client.close()
        ends(port)

    served = serve(script, tmp_path)
    assert served.error is None
    assert served.client.error is None
    assert len(served.warned()) == (early == "dies")


def ends(port: int) -> None:
    """A client whose test goes well; it calls again where another one has not been let go yet."""
    while True:
        client = Element(port)
        try:
            client.steps(STEPS)
        except OSError:
            client.close()
            continue
        client.say(MessageCode.END)
        client.close()
        return


def test_openfresco_is_served_at_the_same_port(tmp_path: Path) -> None:
    """GenericTCP: the first exchange at zero, a pause for its operator, then 3 and 6 a step, and never a commit."""
    found = []

    def script(port: int) -> None:
        client = Element(port, FRESCO)
        for i in range(STEPS):
            client.say(MessageCode.TRIAL, [1e-4 * i])
            client.say(MessageCode.ACQUIRE, [1e-4 * i])
            found.append(client.answer(3))
        client.say(MessageCode.END)
        client.close()

    served = serve(script, tmp_path)
    assert served.error is None
    assert served.client.error is None
    for i, (displacement, force, _) in enumerate(found):
        assert displacement == pytest.approx(1e-4 * i, rel=1e-12, abs=1e-18)
        assert force == pytest.approx(6.25e6 * 1e-4 * i, rel=1e-12, abs=1e-9)
    assert [t for *_, t in found[1:]] == pytest.approx([0.002 * (i + 1) for i in range(STEPS - 1)])
