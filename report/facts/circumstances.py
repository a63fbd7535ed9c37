"""The circumstances of a recording: its clock, and its rigs as far as the plan describes them.

A recording does not show what a laboratory really was, because a reality may replace the plan's rig. So the sentence is
about the plan's rigs, and says so.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from common.plan.plan import Plan
from common.recording.run import CLOCK, Run
from common.roles import LATENCY, MASTER, kind_of, title

VIRTUAL, REAL, SIMULATION, IMPORT, UNKNOWN = "virtual", "real", "simulation", "import", ""
SENTENCES = {
    VIRTUAL: "Virtual time in one process, in which computing takes no time and no latency is measured",
    REAL: "Real time, each laboratory in a process of its own on the network",
    SIMULATION: "A simulation of the closed loop, in which no laboratory took part",
    IMPORT: "Imported data, which no test of rths recorded",
}
NO_LATENCY = "The test ran in virtual time, where no latency is measured"


def clock_of(run: Run) -> str:
    """The clock of a recording; where the recording does not name it, the one that its latencies show, else UNKNOWN.

    In real time some tick takes longer than nothing to compute; in virtual time none does, whatever the link delays.
    """
    if "import" in run.metadata:
        return IMPORT
    if run.metadata.get("summary", {}).get("outcome") == "simulation":
        return SIMULATION
    clock = run.metadata.get(CLOCK, {}).get("kind", UNKNOWN)
    if clock in (VIRTUAL, REAL):
        return clock
    tables = (columns for topic, columns in run.columns.items() if kind_of(topic) == LATENCY)
    times = [columns["compute_time"] for columns in tables if "compute_time" in columns]
    known = np.concatenate([values[np.isfinite(values)] for values in times]) if times else np.array([])
    if not known.size:
        return UNKNOWN
    return REAL if known.max() > 0.0 else VIRTUAL


def sentence(run: Run, plan: Plan | None) -> str:
    """A sentence on the clock and the rigs; empty where the recording does not say."""
    clock = clock_of(run)
    part = run.metadata.get("bench", {}).get("part", "")
    if clock == REAL and part:
        return (
            f"Real time in one process; {of_part(run, plan, part)}." if plan else "Real time in one process."
        )
    if clock == UNKNOWN:
        return ""
    rigged = plan is not None and clock in (VIRTUAL, REAL)
    if not rigged or plan is None:
        return SENTENCES[clock] + "."
    return f"{SENTENCES[clock]}; {of_part(run, plan, part) if part else rigs(plan)}."


def of_part(run: Run, plan: Plan, part: str) -> str:
    """The rig that the plan names for the part of a bench test, whose topic alone the recording holds."""
    of = dict(classes(plan))
    role = next((name for name in of if kind_of(name) in run.columns), "")
    return f"the plan's rig of the {part}: {of.get(role) or 'emulated'}"


def rigs(plan: Plan) -> str:
    """The rigs that the plan names."""
    of = dict(classes(plan))
    if not any(of.values()):
        if len(of) == 1:
            return "by the plan its only laboratory is emulated"
        return "by the plan " + ("both" if len(of) == 2 else f"all {len(of)}") + " laboratories are emulated"
    named = (f"{title(role)} {name or 'emulated'}" for role, name in of.items())
    return f"the plan's rigs: {', '.join(named)}"


def classes(plan: Plan) -> Iterator[tuple[str, str]]:
    """Every laboratory and the class or address that the plan names for its rig, empty for the emulated one."""
    for role in plan.kinds:
        rig = (plan.master if role == MASTER else plan.of(role).slave).rig
        yield role, rig.class_ or rig.address
