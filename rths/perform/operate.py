"""An operator's order to a running test, and the answers to it: the way of `rths stop`, `rths reset` and the like.

The orders are those of `common.lab.operation.ORDERS`. To send one:

1. `chosen` gives the plan of the test and the endpoint of its master, on the machine of `rths run` from the account
   that the test keeps there;
2. `operator_link` opens the link to that endpoint. It may be kept for many orders; `endpoint.close` closes it;
3. `gathered` sends one order and returns an `Answer` by role, with `accepted` and a sentence in `text`. A role that is
   missing in the result was not heard.

Every press of a button has a number of its own, `new_press()`. An order is repeated under its number until all roles
that answer it have done so or `PATIENCE_S` is over. A laboratory carries out a number once and answers every
repetition of it with the same words, so that `gathered` may be called again with the same `press` where an answer is
missing: nothing moves twice.
"""

from __future__ import annotations

import argparse
import json
import secrets
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from common.errors import LostError
from common.host import running
from common.lab.operation import ORDERS
from common.link.endpoint import Endpoint
from common.plan.plan import Plan
from common.plan.read import parse
from common.protocol.messages import Answer, Message, Operator
from common.roles import OPERATOR, title
from common.terminal import cli
from common.terminal.printable import shown

REPEAT_S = 0.1  # s, after which an order is sent again: an answer takes a tick, a few milliseconds
PATIENCE_S = 3.0  # s for all answers: a laboratory reads its messages every tick, also while it ramps to rest


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options that name the test."""
    cli.plan_arguments(parser, optional=True)
    parser.add_argument(
        "--connect",
        default="",
        metavar="ENDPOINT",
        help="where the master listens (default: the test that runs on this machine)",
    )
    parser.add_argument(
        "--reason", default="", metavar="TEXT", help="the operator's reason, which is recorded"
    )
    cli.json_argument(parser, "write the answers as JSON on standard output")


def carry_out(args: argparse.Namespace, word: str) -> int:
    """Give an order to a test; 0 where all roles that answer it did it, 1 where one did not.

    Raises:
        LostError: a laboratory gave no answer.
    """
    plan, endpoint = chosen(args)
    answers = asked(plan, endpoint, word, args.reason)
    silent = [title(role) for role in ORDERS[word].answered_by(plan.roles) if role not in answers]
    show(answers, as_json=args.json)
    if silent:
        raise LostError(f"No answer came from the {' and the '.join(silent)} within {PATIENCE_S:g} s.")
    return 0 if all(answer.accepted for answer in answers.values()) else 1


def chosen(args: argparse.Namespace) -> tuple[Plan, str]:
    """The plan of the test, and where its master listens."""
    if args.connect:
        return cli.load_plan(args), args.connect
    name = cli.load_plan(args).test.name if args.plan else None
    here = running.only(name)
    return parse(here.plan, Path(here.folder)), here.endpoint


def asked(plan: Plan, connect: str, word: str, reason: str) -> dict[str, Answer]:
    """The answers by role to one order, over a link of its own."""
    link = operator_link(plan, connect)
    try:
        return gathered(link.endpoint, plan, word, reason)
    finally:
        link.endpoint.close()


class OperatorLink(NamedTuple):
    """The operator's link to a test: its messages, and whether the master is connected to it at present."""

    endpoint: Endpoint
    connected: Callable[[], bool]


def operator_link(plan: Plan, connect: str) -> OperatorLink:
    """The operator's link to the master that listens at `connect`.

    Raises:
        LostError: nobody listens there within `PATIENCE_S`.
    """
    from common.lab.process import join
    from common.link.endpoint import FrameEndpoint

    impatient = replace(plan, link=replace(plan.link, connect_timeout=PATIENCE_S))
    link = join(impatient, OPERATOR, str, cli.text_report, connect=connect)
    return OperatorLink(FrameEndpoint(link, plan.digest()), lambda: link.connected)


def new_press() -> int:
    """The number of a new press: drawn at random, so that no two operators and no two tests have the same."""
    return secrets.randbelow(2**62) + 1


def gathered(endpoint: Endpoint, plan: Plan, word: str, reason: str, press: int = 0) -> dict[str, Answer]:
    """The answers by role to one order, which is repeated until all roles that answer it have done so.

    `word` is one of `ORDERS`; `press` is the number of the press, by default a new one.
    """
    orders = Outstanding(endpoint, plan)
    orders.give(word, reason, press)
    while not (settled := orders.look(REPEAT_S / 10)):
        pass
    return settled[0].answers


class Given:
    """An order that was given: the roles whose answers are `due`, and the answers that have come."""

    def __init__(self, wish: Operator, due: Iterable[str]) -> None:
        self.wish = wish
        self.due = tuple(due)
        self.answers: dict[str, Answer] = {}
        self.again = 0.0  # when it is sent again
        self.deadline = time.monotonic() + PATIENCE_S

    @property
    def silent(self) -> list[str]:
        """The roles that have not answered."""
        return [role for role in self.due if role not in self.answers]

    @property
    def settled(self) -> bool:
        """Whether all have answered, or the time for it is over."""
        return not self.silent or time.monotonic() >= self.deadline


class Outstanding:
    """Orders over one link that are under way at the same time, so that none waits for the answers to another."""

    def __init__(self, endpoint: Endpoint, plan: Plan) -> None:
        self._endpoint, self._plan = endpoint, plan
        self._given: dict[int, Given] = {}

    def give(self, word: str, reason: str, press: int = 0) -> int:
        """Give an order, which the next look sends; returns the number of its press."""
        wish = Operator(0, self._plan.digest(), word, press or new_press(), reason)
        self._given[wish.press] = Given(wish, ORDERS[word].answered_by(self._plan.roles))
        return wish.press

    @property
    def unsettled(self) -> list[Given]:
        """The orders whose answers are awaited."""
        return list(self._given.values())

    def look(self, timeout: float) -> list[Given]:
        """Send what is due, take the answers that come within `timeout` s; returns the orders that are settled."""
        now = time.monotonic()
        for one in self._given.values():
            if now >= one.again:
                one.again = now + REPEAT_S
                self._endpoint.send(one.wish)
        received = self._endpoint.receive(timeout)
        while received is not None:
            self._take(received.role, received.message)
            received = self._endpoint.receive()
        settled = [one for one in self._given.values() if one.settled]
        for one in settled:
            del self._given[one.wish.press]
        return settled

    def _take(self, role: str, message: Message) -> None:
        if isinstance(message, Answer) and message.press in self._given:
            self._given[message.press].answers.setdefault(role, message)


def show(answers: dict[str, Answer], *, as_json: bool) -> None:
    """Write the answer of each laboratory."""
    if as_json:
        plain = {role: {"accepted": bool(one.accepted), "text": one.text} for role, one in answers.items()}
        sys.stdout.write(json.dumps(plain) + "\n")
        return
    for role, one in answers.items():
        sys.stdout.write(shown(f"{role}: {'done' if one.accepted else 'refused'}: {one.text}") + "\n")
