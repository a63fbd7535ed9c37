"""Periodic notes on how long a process has been waiting for another."""

from __future__ import annotations

SAY_NS = (
    10_000_000_000  # often enough to show that a process lives, seldom enough to keep the screen readable
)


class Waited:
    """A wait that began at `begun_ns`, on the clock of who waits."""

    def __init__(self, begun_ns: int) -> None:
        self._begun_ns = self._said_ns = begun_ns

    def news(self, whom: str, patience: float, now_ns: int) -> str:
        """A sentence if it is time for one, else empty; empty as well while no process is awaited."""
        if not whom:
            self._begun_ns = self._said_ns = now_ns
        if now_ns - self._said_ns < SAY_NS:
            return ""
        self._said_ns = now_ns
        return (
            f"still waits for {whom}: {(now_ns - self._begun_ns) * 1e-9:.0f} of {patience:g} s have passed."
        )
