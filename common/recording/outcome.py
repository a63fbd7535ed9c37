"""How a recording says that its test ended: one word for every page and command."""

from __future__ import annotations

from collections.abc import Mapping

CUT_OFF = "cut off"  # no summary was written


def outcome(summary: Mapping[str, str]) -> str:
    """The cause in words (`completed` where the test had all its ticks), or else its code.

    The recorder writes the code of the ending event too, which is `stop` for a completed test as for one that somebody
    ended early: it is for programs, the cause for readers.
    """
    return summary.get("cause") or summary.get("outcome") or CUT_OFF
