"""Which requests the panel answers: names, other sites, frames, tokens; and the requests that give orders."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from typing import Any

import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPResponse
from tornado.httpserver import HTTPServer
from tornado.testing import bind_unused_port
from tornado.web import Application

from common.errors import InputError
from common.host.clock import MonotonicClock
from report.panel.desk import Desk, OrderOutcome, Present
from report.panel.guard import Guard, checked, local
from report.panel.handlers import OrderHandler, StateHandler, guarded, understood

HERE = {"Host": "127.0.0.1:5006"}
JSON = {"Content-Type": "application/json"}


@pytest.mark.parametrize(
    ("headers", "answered"),
    [
        ({"Host": "127.0.0.1:5006"}, True),
        ({"Host": "LOCALHOST:5006"}, True),
        ({"Host": "127.0.0.1:5007"}, False),
        ({"Host": "127.0.0.1"}, False),
        ({"Host": "evil.example:5006"}, False),  # a name that was made to lead here
        ({}, False),
        (HERE | {"Origin": "http://127.0.0.1:5006"}, True),
        (HERE | {"Origin": "http://evil.example"}, False),
        (HERE | {"Origin": "null"}, False),
        (HERE | {"Origin": "https://127.0.0.1:5006"}, False),
        (HERE | {"Sec-Fetch-Site": "same-origin"}, True),
        (HERE | {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"}, False),
        (
            HERE | {"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "cors"},
            False,
        ),  # another port of this host
        (HERE | {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}, True),  # a link
        (HERE | {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"}, False),
    ],
)
def test_only_requests_of_the_panels_own_pages_are_answered(headers: dict[str, str], answered: bool) -> None:
    assert (Guard("127.0.0.1", 5006).stranger(headers) == "") is answered


@pytest.mark.parametrize(
    ("headers", "orderly"),
    [
        (JSON | {"Origin": "http://127.0.0.1:5006"}, True),
        (JSON, False),
        ({"Origin": "http://127.0.0.1:5006"}, False),
        ({"Origin": "http://127.0.0.1:5006", "Content-Type": "text/plain"}, False),
    ],
)
def test_an_order_must_have_the_headers_of_a_page_of_the_panel(
    headers: dict[str, str], orderly: bool
) -> None:
    assert (Guard("127.0.0.1", 5006).disorderly(headers) == "") is orderly


def test_a_panel_for_other_machines_answers_only_under_its_own_name_and_requires_the_token() -> None:
    guard = Guard("192.0.2.7", 80, "secret")
    assert guard.url == "http://192.0.2.7:80/?token=secret"
    assert guard.stranger({"Host": "192.0.2.7:80"}) == ""
    assert guard.stranger({"Host": "127.0.0.1:80"}) != ""
    assert [guard.admits(given) for given in ("secret", "", "secret2", "Secret", "sécret")] == [
        True,
        *[False] * 4,
    ]
    assert Guard("127.0.0.1", 80).admits("")


def test_an_ipv6_address_is_written_in_brackets() -> None:
    guard = Guard("2001:db8::1", 80)
    assert guard.url == "http://[2001:db8::1]:80/"
    assert guard.stranger({"Host": "[2001:db8::1]:80"}) == ""


def test_addresses_that_only_this_machine_reaches_are_recognized() -> None:
    assert [local(host) for host in ("localhost", "127.0.0.1", "127.0.1.1", "::1", "192.0.2.1", "lab")] == [
        *[True] * 4,
        False,
        False,
    ]


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "", "*", "a/b", "user@host", "two words"])
def test_an_address_that_stands_for_all_interfaces_is_refused(host: str) -> None:
    with pytest.raises(InputError, match="cannot be used: give the one name or address"):
        checked(host)


GIVEN: dict[str, Any] = {
    "session": "s",
    "number": 1,
    "word": "stop",
    "test": "a-1",
    "digest": "d",
    "seen": 5,
    "reason": "r",
}


@pytest.mark.parametrize(
    "changed",
    [{"number": "1"}, {"number": True}, {"seen": 1.5}, {"more": 1}, {"word": None}, {"session": ["s"]}],
)
def test_a_request_that_is_not_an_order_is_rejected(changed: dict[str, Any]) -> None:
    assert understood(json.dumps(GIVEN).encode()) is not None
    assert understood(json.dumps(GIVEN | changed).encode()) is None
    for body in (b"", b"[]", b"{", b"\xff", b"[" * 100_000):
        assert understood(body) is None


class Hand:
    """An executor that settles an order after a moment, as laboratories do."""

    present = Present("a-1", "d", "d")

    def __init__(self) -> None:
        self.did: list[str] = []

    def carry_out(self, word: str, digest: str, reason: str) -> Future[OrderOutcome]:
        del digest, reason
        self.did.append(word)
        settled: Future[OrderOutcome] = Future()
        asyncio.get_running_loop().call_later(0.01, settled.set_result, OrderOutcome("done", word))
        return settled


Story = Callable[[str, Desk, Hand], Awaitable[None]]


def served(story: Story, token: str = "") -> None:
    """Run a test's coroutine against a server of its own; it gets the address, the desk and the executor."""

    async def play() -> None:
        sockets, port = bind_unused_port()
        guard, hand = Guard("127.0.0.1", port, token), Hand()
        desk = Desk(hand, MonotonicClock())
        inner = Application(
            [
                ("/state", StateHandler, {"state": lambda session: {"page": desk.page(session)}}),
                ("/order", OrderHandler, {"guard": guard, "desk": desk}),
            ]
        )
        server = HTTPServer(guarded(guard, inner))
        server.add_socket(sockets)
        try:
            await story(f"http://127.0.0.1:{port}", desk, hand)
        finally:
            server.stop()
            await server.close_all_connections()

    asyncio.run(play())


async def ask(url: str, path: str, body: dict[str, Any] | None = None, **headers: str) -> HTTPResponse:
    """The answer to a request; an order has the headers of a page of the panel unless others are given."""
    own = {"Origin": url, **JSON} if body is not None else {}
    return await AsyncHTTPClient(force_instance=True).fetch(
        url + path,
        method="GET" if body is None else "POST",
        body=None if body is None else json.dumps(body),
        headers=own | {name.replace("_", "-"): text for name, text in headers.items()},
        raise_error=False,
        follow_redirects=False,
    )


def test_a_replayed_request_gets_the_first_answer_and_is_not_carried_out_again() -> None:
    async def story(url: str, desk: Desk, hand: Hand) -> None:
        wish = GIVEN | {"session": desk.enter()}
        answers = await asyncio.gather(*(ask(url, "/order", wish) for _ in range(5)))
        assert {answer.body for answer in answers} == {b'{"state": "done", "text": "stop"}'}
        assert hand.did == ["stop"]
        await ask(url, "/order", wish | {"number": 2})
        assert hand.did == ["stop", "stop"]

    served(story)


def test_requests_from_other_sites_can_neither_order_nor_read() -> None:
    async def story(url: str, desk: Desk, hand: Hand) -> None:
        wish = GIVEN | {"session": desk.enter()}
        for headers in (
            {"Host": "evil.example"},
            {"Origin": "http://evil.example"},
            {"Content_Type": "text/plain"},
            {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "cors"},
        ):
            assert (await ask(url, "/order", wish, **headers)).code == 403, headers
        assert (await ask(url, "/order", {"word": "stop"})).code == 400
        assert (await ask(url, "/state", Host="evil.example")).code == 403
        assert (await ask(url, f"/state?session={wish['session']}")).body == b'{"page": 1}'
        assert hand.did == []

    served(story)


def test_requests_without_the_token_are_refused_and_the_token_gives_a_cookie() -> None:
    async def story(url: str, desk: Desk, hand: Hand) -> None:
        wish = GIVEN | {"session": desk.enter()}
        for path in ("/state", "/?token=wrong", "/state?token=wrong"):
            assert (await ask(url, path)).code == 403
        assert (await ask(url, "/order", wish)).code == 403
        assert (await ask(url, "/?token=secret", Origin="http://evil.example")).code == 403
        first = await ask(url, "/?token=secret")
        assert first.code == 302
        cookie = first.headers["Set-Cookie"]
        assert "HttpOnly" in cookie
        assert "SameSite=Strict" in cookie
        own = cookie.partition(";")[0]
        assert (await ask(url, "/order", wish, Cookie=own)).code == 200
        assert (await ask(url, "/state", Cookie=own[:-1])).code == 403
        assert hand.did == ["stop"]

    served(story, "secret")
