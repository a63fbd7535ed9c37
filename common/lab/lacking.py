"""What a machine lacks for a rig of the user's, in sentences before anything moves.

The bare timing loop measures the lateness of wake-ups at the priority and on the processor that the process was given.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

from common.host.bare_loop import BareLoop
from common.host.realtime import Granted
from common.plan import patience
from common.plan.plan import Plan

MEASURED_S = 1.0  # 500 wake-ups at 2 ms: pauses that come every second or more often are seen


def lacks(plan: Plan, granted: Granted) -> list[str]:
    """One sentence for each thing that is missing; none where all laboratories are emulated and nothing can be damaged.

    The call takes `MEASURED_S`.
    """
    if plan.emulated:
        return []
    bare = BareLoop()
    bare.start(round(plan.test.interval * 1e9), granted)
    time.sleep(MEASURED_S)
    return [*granted.missing, *lateness(plan, bare.stop()), *looser(plan)]


def lateness(plan: Plan, found: Mapping[str, float]) -> list[str]:
    """A sentence on wake-ups that came late by a whole interval or more, if there were any."""
    if not found.get("late"):
        return []
    interval, most = plan.test.interval * 1e3, plan.safety.overrun
    return [
        f"Wake-ups are late: {found['late']:.0f} of {found['ticks'] + found['late']:.0f} by a whole interval of "
        f"{interval:g} ms or more, the worst by {found['max'] * 1e3:.1f} ms; at {most * interval:g} ms (overrun in "
        "[safety]) the test is stopped, so quieten the machine (`rths doctor`)."
    ]


def looser(plan: Plan) -> list[str]:
    """A sentence for each figure that the plan sets larger than its default."""
    found = []
    for name in patience.FIGURES:
        written, standard = patience.figure(plan, name), patience.standard(name)
        if written > standard and not name.startswith("limits."):  # limits are the rig's own
            table, _, key = name.partition(".")
            found.append(
                f"{key} in [{table}] is set to {written:g}, less strict than {standard:g}; leave it out "
                "unless this rig can bear it."
            )
    return found
