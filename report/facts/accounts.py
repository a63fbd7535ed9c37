"""The fate of every message between the laboratories, by direction: sent = used + rejected + lost.

A message that the other laboratory did not send is counted apart, as foreign. A frame does not say who made it, so a
foreign one is recognised by its number: the sender never reached it, it came before, or it is far ahead.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from common.protocol.tally import AHEAD, REPEATED
from common.recording.run import Run, Values
from common.roles import MASTER, SLAVE
from report.facts.laboratories import laboratories


class MessageAccount(NamedTuple):
    """Messages of one direction: those of the sender by their fate, and the least number of foreign ones."""

    sent: int
    used: int
    rejected: int  # too late, overtaken or not fresh
    lost: int
    foreign: int


def account(sent: int, used: int, rejected: int, beyond: int, extra: int) -> MessageAccount:
    """The account of what a sender has sent and a receiver reports as used and rejected.

    `beyond` of the numbers used were higher than any number sent, and `extra` frames had a number that had come before
    or was too far ahead. Messages beyond the number sent cannot come from the sender; up to it they are taken for its
    own.
    """
    own = min(max(used - beyond, 0), sent)
    late = min(rejected, sent - own)
    return MessageAccount(sent, own, late, sent - own - late, (used - own) + (rejected - late) + extra)


def accounts(run: Run) -> dict[str, dict[str, int]]:
    """The accounts by `<slave's role>/<direction>`.

    Each end counts what it sent, and the fate of what it received. A direction is left out where one of its ends has
    not reported its counts, because it was killed or cut off.
    """
    counts: dict[str, dict[str, float]] = {}  # by laboratory; the master reports each slave separately
    for event in run.events:
        if event["code"] == "exchange":
            counts.setdefault(event["lab"], {}).update(event["values"])
    found = {}
    answered = {lab.role: lab.channels.used_seq for lab in laboratories(run)}
    for role in run.roles:
        master, slave = counts.get(MASTER, {}), counts.get(role, {})
        part = run.of(role)
        commands = beyond(part, SLAVE, "command_seq", MASTER)
        feedbacks = beyond(part, MASTER, answered.get(role, ""), SLAVE)
        ends = {
            "commands": (master.get(f"{role}.commands_sent"), slave, "commands", commands),
            "feedbacks": (slave.get("feedbacks_sent"), master, f"{role}.feedbacks", feedbacks),
        }
        for direction, (sent, receiver, prefix, above) in ends.items():
            if sent is not None and f"{prefix}.used" in receiver:
                used, rejected = int(receiver[f"{prefix}.used"]), int(receiver[f"{prefix}.rejected"])
                one = account(int(sent), used, rejected, above, extra(receiver, prefix))
                found[f"{role}/{direction}"] = one._asdict()
    return found


def extra(counts: Mapping[str, float], prefix: str) -> int:
    """Frames that a receiver rejected because the sender cannot have sent them."""
    return sum(int(counts.get(f"{prefix}.turned_away.{reason}", 0)) for reason in (AHEAD, REPEATED))


def beyond(run: Run, receiver: str, name: str, sender: str) -> int:
    """How many messages a receiver used under numbers higher than any of its sender's ticks."""
    used: Values | None = run.columns.get(receiver, {}).get(name)
    if used is None or not run.has(sender):
        return 0
    return int(np.count_nonzero(np.unique(used) > run.sequences[sender].max()))
