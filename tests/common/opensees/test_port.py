"""The port of an element, with a client that is a plain socket."""

from __future__ import annotations

import socket
from threading import Timer

import pytest

from common.opensees import wire
from common.opensees.port import ElementPort, Ports
from tests.serve.client import free_port

SOON_S, LONG_NS = 0.02, 10**10


def test_the_message_of_a_busy_client_is_read_without_sleeping(monkeypatch: pytest.MonkeyPatch) -> None:
    number, said = free_port(), list[str]()
    ports = Ports([ElementPort(str(number), [1e6], said.append)], eager=LONG_NS)
    with socket.create_connection(("127.0.0.1", number)) as client:
        assert ports.serve(1.0)  # the connection

        def asleep(_: float) -> list[int]:
            pytest.fail("it slept")

        monkeypatch.setattr(ports, "_ready", asleep)
        sending = Timer(SOON_S, client.sendall, [wire.header_bytes(wire.element(1))])
        sending.start()
        assert ports.serve(1.0)
        sending.join()
        assert ports.servers[0].header is not None
        ports.close()
