"""The outcome of a test as its recording states it, the same for all pages and commands."""

from __future__ import annotations

from collections.abc import Mapping

CUT_OFF = "cut off"  # the outcome of a recording without a summary
COMPLETED = "completed"  # the cause of a test that ended as it was meant to


def outcome(summary: Mapping[str, str]) -> str:
    """The cause in words (`completed` where the test had all its ticks), or else its code.

    The cause is for readers. The recorder also writes the code of the event that ended the test, for programs; it is
    `stop` for a completed test as well as for one that was ended early.
    """
    return summary.get("cause") or summary.get("outcome") or CUT_OFF
