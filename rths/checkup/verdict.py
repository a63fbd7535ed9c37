"""Judgement of what `rths doctor` measured: each check passes or fails, and one sentence sums them up."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

# One tick in a thousand that uses a force one interval (2 ms) too old is 2 µs of delay on average, which costs
# a structure like the default one 0.0003 points of damping.
LATE_SHARE = 1e-3
ROOM = 1.0  # of the interval, for waking up and the round trip together, each at its 99.9th percentile
CLOCK_STEP = 0.01  # of the interval, a tenth of what the other checks of latency resolve
WORST_SYNC = 1.0  # s; a recording that is cut off may lose its last second, no more
RATE = 1e6  # bytes/s, more than a recorder writes
FREE = 1_000_000_000  # bytes, a quarter of an hour of recording at that rate
# Share of the processors' time that a host may take: ten times the share of late ticks that is judged, so that beyond
# it late ticks may be the host's.
STOLEN_SHARE = 0.01

TIMING = ("wake-up", "wake-up + round trip", "late exchanges", "clock")


class PlanCheck(NamedTuple):
    """One requirement of a test, and whether this machine meets it."""

    name: str
    found: str
    needed: str
    passed: bool
    advice: str  # a sentence that says what to do where it failed


class CheckVerdict(NamedTuple):
    """All checks in one sentence."""

    state: str  # holds, mostly, fails, not judged
    sentence: str
    passed: bool


def checks(report: dict[str, Any]) -> list[PlanCheck]:
    """Every check of what was measured; a measurement that failed is a check that failed."""
    parts: tuple[Callable[[dict[str, Any]], Iterator[PlanCheck]], ...] = (
        of_realtime,
        of_wake_up,
        of_round_trip,
        of_clock,
        of_disk,
        of_host,
    )
    return [check for part in parts for check in part(report)]


def of_realtime(report: dict[str, Any]) -> Iterator[PlanCheck]:
    """Whether everything that `--rt on` asks for was granted."""
    missing = report["realtime"].get("missing", [])
    if report["rt"] == "on":
        yield PlanCheck("real time", f"{len(missing)} missing", "all", not missing, " ".join(missing))


def judged(report: dict[str, Any]) -> tuple[str, dict[str, float]]:
    """The bare timing loop whose priority is that of a test's processes, and what it measured."""
    loops: dict[str, dict[str, float]] = report["wake_up"]
    name = "fifo" if "fifo" in loops else "ordinary"
    return name, loops[name]


def remedy(report: dict[str, Any]) -> str:
    """What to do where the timing does not suffice, the same sentence for every check of it."""
    steps = ["end other programs", "give this machine more processors", "or lengthen the interval"]
    if report["rt"] == "off":
        steps.insert(0, "try it with --rt auto")
    elif report["realtime"].get("missing"):
        steps.insert(0, "grant the real-time settings that are missing")
    text = f"The interval is not kept: {', '.join(steps)}."
    if "hypervisor" in report["facts"]:
        text += " A host that pauses this machine can cause this without any other sign."
    return text


def of_wake_up(report: dict[str, Any]) -> Iterator[PlanCheck]:
    """How many intervals a process that does nothing else misses."""
    name, found = judged(report)
    if not found:
        yield PlanCheck(
            "wake-up", "none", "a loop", False, "The bare timing loop did not run: check that python starts."
        )
        return
    share = found["late"] / max(found["ticks"] + found["late"], 1)
    yield PlanCheck(
        "wake-up",
        f"{share * 100:.3f} % late ({name})",
        f"< {LATE_SHARE * 100:g} %",
        share < LATE_SHARE,
        remedy(report),
    )


def of_round_trip(report: dict[str, Any]) -> Iterator[PlanCheck]:
    """Whether command and feedback fit into the interval."""
    found, interval = report["round_trip"], report["interval"]
    if "error" in found or not found["round_trip"]:
        reason = found.get("error", "no command was answered").rstrip(".")
        yield PlanCheck(
            "late exchanges", "none", "an exchange", False, f"The exchange over zenoh failed: {reason}."
        )
        return
    _, loop = judged(report)
    if loop:
        together = loop["p99.9"] + found["round_trip"]["p99.9"]
        yield PlanCheck(
            "wake-up + round trip",
            f"{together * 1e3:.3f} ms (p99.9)",
            f"< {ROOM * interval * 1e3:g} ms",
            together < ROOM * interval,
            remedy(report),
        )
    share = found["late"] / max(found["exchanges"], 1)
    yield PlanCheck(
        "late exchanges",
        f"{found['late']} of {found['exchanges']}",
        f"< {LATE_SHARE * 100:g} %",
        found["exchanges"] > 0 and share < LATE_SHARE,
        remedy(report),
    )


def of_clock(report: dict[str, Any]) -> Iterator[PlanCheck]:
    """Whether the clock resolves a hundredth of the interval."""
    step = max(report["clock"]["resolution"], report["clock"]["read_time"])
    source = report["facts"].get("clocksource", "unknown")
    yield PlanCheck(
        "clock",
        f"{step * 1e9:.0f} ns ({source})",
        f"< {CLOCK_STEP * report['interval'] * 1e6:g} µs",
        step < CLOCK_STEP * report["interval"],
        f"The clock '{source}' is too coarse or too slow: choose tsc or kvm-clock (kernel option clocksource=).",
    )


def of_disk(report: dict[str, Any]) -> Iterator[PlanCheck]:
    """Whether a recording can be written to its folder."""
    found = report["disk"]
    folder = found["folder"]
    if "error" in found:
        advice = f"Nothing can be written to '{folder}' ({found['error']}): choose another folder with -o."
        yield PlanCheck("disk", found["error"], "to be written", False, advice)
    else:
        slow = f"The disk of '{folder}' is too slow: choose another folder with -o, on a local disk."
        worst, rate = found["worst_sync"], found["rate"]
        yield PlanCheck("disk, worst sync", f"{worst:.3f} s", f"< {WORST_SYNC:g} s", worst < WORST_SYNC, slow)
        yield PlanCheck("disk, rate", f"{rate / 1e6:.1f} MB/s", f"> {RATE / 1e6:g} MB/s", rate > RATE, slow)
    if "free" in found:
        full = f"The disk of '{folder}' is nearly full: free some of it, or choose another folder with -o."
        free = found["free"]
        yield PlanCheck("disk, free", f"{free / 1e9:.1f} GB", f"> {FREE / 1e9:g} GB", free > FREE, full)


def of_host(report: dict[str, Any]) -> Iterator[PlanCheck]:
    """Whether the host left the processors to this machine while the check ran."""
    share = report["machine"].get("stolen_share")
    if share is not None:
        yield PlanCheck(
            "stolen time",
            f"{share * 100:.2f} %",
            f"< {STOLEN_SHARE * 100:g} %",
            share < STOLEN_SHARE,
            "The host gives the processors to others: try again later, or ask it for processors of your own.",
        )


def notes(report: dict[str, Any]) -> list[str]:
    """Notes on what does not fail a check but should be known."""
    found = list(report["realtime"].get("missing", [])) if report["rt"] == "auto" else []
    found += [
        f"Another program runs at a real-time priority: {rival}; end it, or give it a processor of its own."
        for rival in report["rivals"]
    ]
    if report["clock"].get("synchronised") is False:
        found.append(
            "The wall clock is not synchronised: dates in recordings may be off (a test keeps its own time); "
            "start chrony or ptp4l."
        )
    governor = report["facts"].get("governor", "performance")
    if governor != "performance":
        found.append(f"The processors' governor is '{governor}': 'cpupower frequency-set -g performance'.")
    if report["machine"].get("throttled"):
        found.append("A quota of the control group held processes back: lift it (docker --cpus, cpu.max).")
    return found


def verdict(report: dict[str, Any], found: list[PlanCheck]) -> CheckVerdict:
    """One sentence for all checks."""
    name = f"{report['interval'] * 1e3:g} ms"
    failed = [check for check in found if not check.passed]
    timing = [check for check in failed if check.name in TIMING]
    if any(check.name == "stolen time" for check in failed):
        share = report["machine"]["stolen_share"] * 100
        anyway = "was not kept" if timing else "was kept all the same"
        return CheckVerdict(
            "not judged",
            f"{name} is not judged: the host took {share:.1f} % of the processors' time, and the interval {anyway}.",
            False,
        )
    if timing:
        what = "; ".join(f"{check.name} {check.found}, needed {check.needed}" for check in timing)
        return CheckVerdict("fails", f"{name} will not hold here: {what}.", False)
    state, reason = outlook(report)
    held = "will hold" if state == "holds" else "will mostly hold"
    but = f"; but {failed[0].name} failed: {failed[0].found}, needed {failed[0].needed}" if failed else ""
    return CheckVerdict(state, f"{name} {held} here: {reason}{but}.", not failed)


def outlook(report: dict[str, Any]) -> tuple[str, str]:
    """State and reason of a machine whose timing suffices: it holds, or mostly holds."""
    found = report["round_trip"]
    together = judged(report)[1]["p99.9"] + found["round_trip"]["p99.9"]
    fits = f"waking up and the round trip take {together * 1e3:.2f} ms in all but one interval of a thousand"
    if found["late"]:
        return "mostly", f"{fits}, yet {found['late']} of {found['exchanges']} exchanges were late"
    if judged(report)[0] != "fifo":
        return "mostly", f"{fits}, but without a real-time priority any other load may break that"
    return "holds", fits
