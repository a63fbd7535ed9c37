"""Periodic notes on how long a process has been waiting for another."""

from __future__ import annotations

SAY_NS = (
    10_000_000_000  # often enough to show that the process is alive, and three lines within `connect_timeout`
)


class Waited:
    """A wait that began at `begun_ns` on the clock of the process that waits."""

    def __init__(self, begun_ns: int) -> None:
        self._begun_ns = self._said_ns = begun_ns

    def news(self, whom: str, patience: float, now_ns: int) -> str:
        """A sentence on the wait for `whom` if the next one is due, else an empty text.

        The text is empty too while `whom` is empty, because no process is awaited. `patience` is the longest wait, s.
        """
        if not whom:
            self._begun_ns = self._said_ns = now_ns
        if now_ns - self._said_ns < SAY_NS:
            return ""
        self._said_ns = now_ns
        return (
            f"still waits for {whom}: {(now_ns - self._begun_ns) * 1e-9:.0f} of {patience:g} s have passed."
        )
