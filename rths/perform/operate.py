"""An operator's order to a running test, and the answers to it: the way of `rths stop`, `rths reset` and the like.

The orders are those of `common.lab.operation.ORDERS`. To send one:

1. `chosen` gives the plan of the test and the endpoint of its master, on the machine of `rths run` from the account
   that the test keeps there;
2. `line` opens the link to that endpoint as the operator. It may be kept for many orders, and is closed by `close`;
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
from dataclasses import replace
from pathlib import Path

from common.errors import LostError
from common.host import running
from common.lab.operation import ORDERS
from common.link.endpoint import Endpoint
from common.plan.plan import Plan
from common.plan.read import parse
from common.protocol.messages import Answer, Operator
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
    endpoint = line(plan, connect)
    try:
        return gathered(endpoint, plan, word, reason)
    finally:
        endpoint.close()


def line(plan: Plan, connect: str) -> Endpoint:
    """The operator's link to the master that listens at `connect`.

    Raises:
        LostError: nobody listens there within `PATIENCE_S`.
    """
    from common.lab.process import join
    from common.link.endpoint import FrameEndpoint

    impatient = replace(plan, link=replace(plan.link, connect_timeout=PATIENCE_S))
    return FrameEndpoint(join(impatient, OPERATOR, str, cli.text_report, connect=connect), plan.digest())


def new_press() -> int:
    """The number of a new press: drawn at random, so that no two operators and no two tests have the same."""
    return secrets.randbelow(2**62) + 1


def gathered(endpoint: Endpoint, plan: Plan, word: str, reason: str, press: int = 0) -> dict[str, Answer]:
    """The answers by role to one order, which is repeated until all roles that answer it have done so.

    `word` is one of `ORDERS`; `press` is the number of the press, by default a new one.
    """
    wish = Operator(0, plan.digest(), word, press or new_press(), reason)
    due = set(ORDERS[word].answered_by(plan.roles))
    answers: dict[str, Answer] = {}
    deadline, again = time.monotonic() + PATIENCE_S, 0.0
    while not due <= answers.keys() and time.monotonic() < deadline:
        if time.monotonic() >= again:
            again = time.monotonic() + REPEAT_S
            endpoint.send(wish)
        received = endpoint.receive(REPEAT_S / 10)
        if received and isinstance(received.message, Answer) and received.message.press == wish.press:
            answers[received.role] = received.message
    return answers


def show(answers: dict[str, Answer], *, as_json: bool) -> None:
    """Write the answer of each laboratory."""
    if as_json:
        plain = {role: {"accepted": bool(one.accepted), "text": one.text} for role, one in answers.items()}
        sys.stdout.write(json.dumps(plain) + "\n")
        return
    for role, one in answers.items():
        sys.stdout.write(shown(f"{role}: {'done' if one.accepted else 'refused'}: {one.text}") + "\n")
