"""The results of comparing a recording with its prediction, in sentences."""

from __future__ import annotations

from common.roles import title
from report.text.formats import quantity
from simulation.prediction.bands import HELD
from simulation.prediction.held import ENOUGH, Held, HeldSignal
from simulation.prediction.rest import BEYOND, OUTSIDE
from simulation.prediction.shape import ErrorShape

# Share of a signal's error that one shape must explain for the error to be named after it: more than half.
MOSTLY = 0.5
SEVERAL = 3  # peaks that a sentence names
NOISIER = "the sensor is noisier than in the diagnosed recording."


def every(found: Held) -> list[str]:
    """Whether the prediction held, what left its band first and how, what follows, and which peaks held."""
    other = (
        "The test and the prediction have different plans, so a part of what lies outside the band may come from that "
        "difference."
    )
    stood = (
        []
        if found.stood is None
        else [f"The test was held at {found.stood:.3f} s, and is compared up to there."]
    )
    return [*verdict(found), *peaks(found), *([] if found.same_plan else [other]), *stood]


def verdict(found: Held) -> list[str]:
    """Whether the prediction held, and where not, what left its band first."""
    share = f"{100 * found.inside:.0f} % of the time was inside its band"
    low = {name: one for name, one in found.signals.items() if one.inside < ENOUGH}
    if found.held:
        least = min(low, key=lambda name: low[name].inside, default="")
        rest = f", for {least} {100 * low[least].inside:.0f} %" if least else ""
        return [f"The prediction held: {share}{rest}."]
    failed = f"The prediction did not hold: {share}, instead of {100 * HELD:.0f} %."
    readings = {name: one for name, one in low.items() if is_reading(found, name, one)}
    first = min(
        (one for one in (readings or low).items() if one[1].departures),
        key=lambda one: one[1].departures[0].start,
        default=None,
    )
    if first is None:
        return [failed, f"{', '.join(low)} left the band for many short times, as noise does: {NOISIER}"]
    return [failed, *of_first(found, *first)]


def is_reading(found: Held, name: str, one: HeldSignal) -> bool:
    """Whether a signal is measured in a laboratory; if the prediction's file does not say so, every signal counts."""
    names = found.figures.get("readings", {}).get(one.topic)
    return names is None or name.rpartition(".")[2] in names


def of_first(found: Held, name: str, one: HeldSignal) -> list[str]:
    """How and when a signal left its band, and what follows."""
    start = one.departures[0].start
    left = (
        f"Of the laboratories' readings {name} left its band first, at t = {start:.2f} s, and was farthest outside at "
        f"t = {one.farthest_at:.2f} s, by {one.farthest:.2g} half widths of the band."
    )
    if one.shape.share <= MOSTLY:
        how = f"No offset, drift, wrong amplitude, delay or noise explains most of the error of {name}."
        return [left, how, what_it_says(found, one.topic, start)]
    share = f"{100.0 * one.shape.share:.0f} % of its error"
    how = f"Compared with the prediction, {in_words(one.shape, one.unit)}, which explains {share}."
    follows = f"So {NOISIER}" if one.shape.kind == "noise" else what_it_says(found, one.topic, start)
    return [left, how, follows]


def in_words(shape: ErrorShape, unit: str) -> str:
    """What explains most of an error."""
    match shape.kind:
        case "offset":
            return f"it is offset by {quantity(shape.factor, unit)}"
        case "drift":
            return f"it drifts by {quantity(shape.factor, unit)} per second"
        case "size":
            return f"it is {abs(100.0 * shape.factor):.2g} % {'larger' if shape.factor > 0.0 else 'smaller'}"
        case "delay":
            return (
                f"it comes {quantity(abs(shape.factor), 's')} {'later' if shape.factor > 0.0 else 'earlier'}"
            )
        case _:
            return f"it has noise of {quantity(shape.factor, unit)} rms"


def what_it_says(found: Held, role: str, start: float) -> str:
    """What follows from a reading of a role that leaves its band at a time `start` (s)."""
    lab, both = (
        f"The laboratory of the {title(role)}",
        "diagnose both recordings together, rths diagnose FIRST THIS.",
    )
    far = found.figures.get("beyond_seen", {}).get(role, {})
    ratio, since = float(far.get("ratio", 0.0)), far.get("since")
    if ratio > BEYOND and (since is None or start >= since):
        return (
            f"{lab} was then beyond the largest motion of the diagnosed recording, by up to {ratio:.2g} times, and the "
            f"findings do not hold there: {both}"
        )
    if float(far.get("energy_outside", 0.0)) > OUTSIDE:
        return (
            f"{lab} moved at other frequencies than in the diagnosed recording, and the findings do not hold there: "
            f"{both}"
        )
    return (
        f"{lab} was then still within the motion of the diagnosed recording, so it has changed since, or has an effect "
        "that the diagnosed recording does not show: diagnose this recording, rths diagnose THIS."
    )


def peaks(found: Held) -> list[str]:
    """Which peaks lie in their bands; nothing where the recording is shorter than the prediction."""
    known = {name: one for name, one in found.figures.get("peaks", {}).items() if name in found.signals}
    if not known or found.ticks < int(found.figures.get("ticks", 0)):
        return []
    away = {name: beyond(found.signals[name].peak, one["low"], one["high"]) for name, one in known.items()}
    outside = sorted((name for name, far in away.items() if far > 0.0), key=lambda name: -away[name])
    shown = [
        quantity(one.peak, one.unit)
        + " of "
        + name
        + " (predicted "
        + " to ".join(quantity(known[name][end], one.unit) for end in ("low", "high"))
        + ")"
        for name in outside[:SEVERAL]
        for one in (found.signals[name],)
    ]
    counted = f"{len(known) - len(outside)} of {len(known)} peaks lie in their bands"
    return [f"{counted}; farthest outside: {', '.join(shown)}." if shown else f"{counted}."]


def beyond(value: float, low: float, high: float) -> float:
    """Distance of a value from a band over the band's half width, 0 inside."""
    return max(value - high, low - value, 0.0) / max(0.5 * (high - low), 1e-300)
