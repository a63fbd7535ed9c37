"""The port of an element, with a client that is a plain socket."""

from __future__ import annotations

import socket
from threading import Timer

import pytest

from common.errors import InputError
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


@pytest.mark.parametrize(
    ("host", "remedy"),
    [("192.0.2.1", "give an address of this machine"), ("127.0.0.1", "choose another port")],
)
def test_an_address_that_cannot_be_served_is_refused_with_the_remedy(host: str, remedy: str) -> None:
    number = free_port()
    with socket.create_server(("127.0.0.1", number)), pytest.raises(InputError) as refused:
        ElementPort(f"{host}:{number}", [1e6], list[str]().append)
    text = str(refused.value)
    assert text.startswith(f"Cannot serve OpenSees at {host}:{number}: ")
    assert text.endswith(f"; {remedy}.")
    assert text.count(str(number)) == 1
