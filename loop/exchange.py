"""The messages that each tick uses under a link plug-in, for all ticks at once, by the same rule as the mailboxes."""

from __future__ import annotations

import numpy as np

from common.link.mailbox import LinkModel, ticks_late
from loop.closed_loop import Index, MessagesUsed

COMMAND, FEEDBACK = ("command", 0), ("feedback", 1)  # direction, and after how many ticks a message is used


def exchange(ticks: int, interval: float, link: LinkModel) -> MessagesUsed:
    """Command and feedback used at each tick of a test in which no laboratory is late."""
    return MessagesUsed(used(ticks, interval, link, *COMMAND), used(ticks, interval, link, *FEEDBACK))


def used(ticks: int, interval: float, link: LinkModel, direction: str, nominal: int) -> Index:
    """The newest message available at each tick, −1 for none yet."""
    newest = np.full(ticks, -1, dtype=np.int64)
    for seq in range(ticks):
        extra = link.fate(direction, seq, seq * interval)
        if extra is not None and (due := seq + nominal + ticks_late(extra, interval)) < ticks:
            newest[due] = seq  # of two messages due at one tick the newer one stays
    return np.maximum.accumulate(newest)
