"""Late ticks of a recording: their number, the most in any window, their cause, and their meaning for the result."""

from __future__ import annotations

from typing import Any

import numpy as np

from common.host.lateness import MOST, WINDOW
from common.recording.run import Run, Values
from common.roles import LATENCY, MASTER, kind_of


def late_ticks(run: Run) -> dict[str, Any] | None:
    """Late ticks in the exchange with any slave, all ticks, and the most late ones in a window; None where unknown.

    The result is None on a virtual clock too, on which an effect may delay messages but the machine cannot be late.
    """
    tables = exchanges(run, "seq", "wake_lateness", "deadline_missed")
    if not any(columns["seq"].size for columns in tables):
        return None
    if not any(np.any(np.nan_to_num(columns["wake_lateness"])) for columns in tables):
        return None
    ticks = int(max(columns["seq"].max(initial=-1) for columns in tables)) + 1
    late = np.zeros(ticks, dtype=np.int64)
    for columns in tables:
        late[columns["seq"][columns["deadline_missed"].astype(bool)]] = 1
    counted = np.concatenate([[0], np.cumsum(late)])
    within = counted[1:] - counted[np.maximum(np.arange(1, ticks + 1) - WINDOW, 0)]
    return {"late": int(late.sum()), "ticks": ticks, "worst": int(within.max()), "window": WINDOW}


def exchanges(run: Run, *names: str) -> list[dict[str, Values]]:
    """The latencies of the exchange with each slave of which all signals of these names were recorded."""
    tables = [columns for topic, columns in run.columns.items() if kind_of(topic) == LATENCY]
    return [columns for columns in tables if columns.keys() >= set(names)]


def beside_client(run: Run) -> dict[str, int] | None:
    """The late ticks of a test in real time whose building is a client's, by cause; None for other tests.

    `client_late` of the `ticks` held the laboratories because the client's displacement had not come in time;
    `woke_late` began a whole interval or more after their time, which is the machine's lateness and not the client's.
    """
    columns = run.columns.get(MASTER, {})
    if not {"client_late", "wake_lateness"} <= columns.keys() or not np.any(columns["wake_lateness"]):
        return None
    t = columns["t"]
    interval = float(np.median(np.diff(t))) if t.size > 1 else np.inf
    return {
        "ticks": int(t.size),
        "client_late": int(np.count_nonzero(columns["client_late"])),
        "woke_late": int(np.count_nonzero(columns["wake_lateness"] >= interval)),
    }


def said_beside_client(found: dict[str, int] | None) -> str:
    """The sentence on late ticks beside a client; empty for other tests."""
    if found is None:
        return ""
    ticks = found["ticks"]
    held, woke = (f"{found[name]} ({found[name] / ticks:.2%})" for name in ("client_late", "woke_late"))
    return (
        f"Of {ticks} ticks {held} had no displacement of the client in time, and {woke} began late by an interval or "
        "more."
    )


def warning(found: dict[str, Any] | None) -> str:
    """The sentence that a test did not keep real time; empty where it did or where that is unknown."""
    if found is None or found["worst"] <= MOST:
        return ""
    return (
        f"The test did not keep real time: {found['late']} of {found['ticks']} ticks "
        f"({found['late'] / found['ticks']:.0%}) were late, up to {found['worst']} of {WINDOW} in a row, "
        f"while pre-flight allows {MOST}; the recording contains delays of this machine (see `rths doctor`)."
    )
