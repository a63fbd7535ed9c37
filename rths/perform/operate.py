"""The common part of `rths stop` and `rths reset`: an operator's order, and every laboratory's answer."""

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
from common.link.endpoint import Endpoint
from common.plan.plan import Plan
from common.plan.read import parse
from common.protocol.messages import Answer, Operator
from common.roles import MASTER, OPERATOR, title
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
    """Ask all laboratories of a test; 0 where all did it, 1 where one did not.

    Raises:
        LostError: a laboratory gave no answer.
    """
    plan, endpoint = chosen(args)
    answers = asked(plan, endpoint, word, args.reason)
    silent = [title(role) for role in (MASTER, *plan.roles) if role not in answers]
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
    """The answers by role; the order is repeated until all have answered or `PATIENCE_S` is over."""
    from common.lab.process import join
    from common.link.endpoint import FrameEndpoint

    impatient = replace(plan, link=replace(plan.link, connect_timeout=PATIENCE_S))
    link = join(impatient, OPERATOR, str, cli.text_report, connect=connect)
    try:
        return gathered(FrameEndpoint(link, plan.digest()), plan, word, reason)
    finally:
        link.close()


def gathered(endpoint: Endpoint, plan: Plan, word: str, reason: str) -> dict[str, Answer]:
    """The answers by role to one order, which is repeated until every laboratory has answered."""
    wish = Operator(0, plan.digest(), word, secrets.randbelow(2**62) + 1, reason)
    answers: dict[str, Answer] = {}
    deadline, again = time.monotonic() + PATIENCE_S, 0.0
    while len(answers) < 1 + len(plan.roles) and time.monotonic() < deadline:
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
