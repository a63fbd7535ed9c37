"""Late ticks of a recording: their number, the most in any window, and their meaning for the result."""

from __future__ import annotations

from typing import Any

import numpy as np

from common.host.lateness import MOST, WINDOW
from common.recording.run import Run
from common.roles import LATENCY, kind_of


def late_ticks(run: Run) -> dict[str, Any] | None:
    """Late ticks in the exchange with any slave, all ticks, and the most late ones in a window; None where unknown.

    The result is None on a virtual clock too, on which an effect may delay messages but the machine cannot be late.
    """
    tables = [columns for topic, columns in run.columns.items() if kind_of(topic) == LATENCY]
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


def warning(found: dict[str, Any] | None) -> str:
    """The sentence that a test did not keep real time; empty where it did or where that is unknown."""
    if found is None or found["worst"] <= MOST:
        return ""
    return (
        f"The test did not keep real time: {found['late']} of {found['ticks']} ticks "
        f"({found['late'] / found['ticks']:.0%}) were late, up to {found['worst']} of {WINDOW} in a row, "
        f"while pre-flight allows {MOST}; the recording contains delays of this machine (see `rths doctor`)."
    )
