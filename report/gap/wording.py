"""What a report says in words: names of effects and signals, status, equivalents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from models.effects import CATALOGUE
from report.text.force_path import sentence as force_sentence
from report.text.formats import as_float, known, percent, percent_interval, quantity

Report = Mapping[str, Any]

STATUS = {
    "no_gap": "no gap",
    "explained": "explained",
    "partly_explained": "partly explained",
    "ambiguous": "ambiguous",
    "unknown_effect": "unknown effect",
    "not_enough_data": "not enough data",
}
JUDGED = {
    "held-out time windows": "On data not used for fitting",
    "recordings given": "On the recordings given for validation",
}
DOMINANT = 0.5  # share of the gap from which one site is named as the place
NOTABLE = 1.0  # standard deviations of its tolerance that make a parameter's move worth a word


def joined(names: Sequence[str], last: str = "and") -> str:
    """A list in words: `a, b and c`."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} {last} {names[-1]}"


def plain(name: str) -> str:
    """A name as words: `column_force` is `column force`."""
    return name.replace("_", " ")


def site(name: str) -> str:
    """A site in words."""
    kind, _, signal = name.partition(".")
    return f"{plain(signal)} sensor" if kind == "sensor" and signal else plain(name)


def effect(name: str) -> str:
    """An effect in words: `damper friction`, `gain of the column force sensor`."""
    entry = CATALOGUE.get(name)
    if entry and entry.signal:
        return f"{'added ' if entry.random else ''}{plain(entry.fault)} of the {plain(entry.signal)} sensor"
    return plain(name.replace(".", " "))


def effects(names: Sequence[str]) -> str:
    """A candidate, one effect or several together."""
    return " + ".join(map(effect, names)) or "no effect"


def says(name: str) -> str:
    """What the catalogue says of an effect; nothing of one it does not list."""
    entry = CATALOGUE.get(name)
    return entry.says if entry else ""


def once(candidates: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Candidates, the most probable first; of those with the same effects the most probable one."""
    ordered = sorted(candidates, key=lambda item: -(item.get("probability") or 0.0))
    found: dict[tuple[str, ...], Mapping[str, Any]] = {}
    for item in ordered:
        found.setdefault(tuple(sorted(map(str, item.get("effects") or []))), item)
    return list(found.values())


def sets(report: Report) -> list[Sequence[str]]:
    """Sets of effects that cannot be told apart, each once."""
    groups = report.get("equivalent") or []
    return list({frozenset(names): names for names in reversed(groups)}.values())[::-1]


def kind(candidate: Mapping[str, Any]) -> str:
    """Whether a candidate is physics or measurement; a mixture counts as physics."""
    if candidate.get("kind"):
        return str(candidate["kind"])
    names = candidate.get("effects") or []
    kinds = {CATALOGUE[name].kind if name in CATALOGUE else "physics" for name in names}
    return "measurement" if kinds == {"measurement"} else "physics"


def parameters(candidate: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """A candidate's parameters: effect, parameter, value with interval and unit."""
    return [
        (name, parameter, quantity(given.get("value"), str(given.get("unit") or ""), given.get("interval")))
        for name, entries in (candidate.get("parameters") or {}).items()
        for parameter, given in entries.items()
    ]


def called(effect: str, parameter: str) -> str:
    """A parameter behind its effect's words; empty where these say it already: `table delay` has but one."""
    entry = CATALOGUE.get(effect)
    return "" if entry and entry.is_called_by(parameter) else plain(parameter)


def equivalent(names: Sequence[str]) -> str:
    """A set of effects that cannot be told apart, as a sentence."""
    first, *others = map(effect, names)
    return f"These signals cannot tell {first} from {joined(others, 'or')}: naming one of them is naming all."


def notable(report: Report) -> list[tuple[str, Mapping[str, Any]]]:
    """Parameters that moved by more than one standard deviation of their tolerance, the farthest first."""
    ordered = by_move(report)
    return [(name, item) for name, item in ordered if abs(item.get("z") or 0.0) > NOTABLE]


def by_move(report: Report) -> list[tuple[str, Mapping[str, Any]]]:
    """Parameters within tolerances, the one that moved farthest first."""
    entries = (report.get("tolerances") or {}).items()
    return sorted(entries, key=lambda entry: -abs(entry[1].get("z") or 0.0))


def nominal_gap(report: Report) -> Any:
    """The overall gap before parameters were moved inside their tolerances, None where it is not said."""
    steps = (report.get("details") or {}).get("waterfall") or []
    first = steps[0].get("value") if steps else None
    return (report.get("how_far") or {}).get("nominal", first)


def verdict(report: Report) -> str:
    """The verdict in one sentence, the report's own if it has one."""
    if report.get("verdict"):
        return str(report["verdict"])
    gap, status = report.get("gap") or {}, report.get("status")
    size = f"{percent(gap.get('overall'))} (noise floor {percent(gap.get('overall_noise_floor'))})"
    sentences = {
        "no_gap": f"No gap beyond noise and tolerances: {size}.",
        "not_enough_data": "This recording holds too little to place or name a gap.",
        "unknown_effect": f"The gap of {size}{place(report)} is made by something that the catalogue lacks.",
        "ambiguous": f"The gap of {size}{place(report)} has several causes that fit alike: {rivals(report)}.",
    }
    fallback = f"The gap of {size}{place(report)}: {cause(report)}."
    return sentences.get(str(status), fallback)


def place(report: Report) -> str:
    """Where most of the gap lies, as a part of a sentence."""
    sites = report.get("where") or []
    if not sites or not known(sites[0].get("share")) or sites[0]["share"] < DOMINANT:
        return ""
    return f", {percent(sites[0]['share'])} of it at the {site(sites[0]['site'])}"


def rivals(report: Report) -> str:
    """The foremost candidates."""
    names = [effects(item.get("effects") or []) for item in once(report.get("which") or [])[:3]]
    return joined(names, "or") or "none is named"


def cause(report: Report) -> str:
    """The first candidate and what it closes."""
    if not report.get("which"):
        return "no cause is named"
    share = (report.get("how_far") or {}).get("closed")
    closes = f" closes {percent(min(as_float(share), 1.0))} of it" if known(share) else " explains it"
    partly = " (only a part)" if report.get("status") == "partly_explained" else ""
    return effects(report["which"][0].get("effects") or []) + closes + partly


def closed(report: Report) -> str:
    """The closed share with its interval; empty where it is unknown or there was no gap to close.

    What is left may by chance be below the noise floor: no more than all of the gap is said to be closed.
    """
    far = report.get("how_far") or {}
    if not known(far.get("closed")) or report.get("status") == "no_gap":
        return ""
    ends = [min(as_float(end), 1.0) for end in far.get("closed_interval") or () if known(end)]
    interval = percent_interval(ends)
    return percent(min(as_float(far["closed"]), 1.0)) + (f" ({interval})" if interval else "")


def judged_on(report: Report) -> str:
    """The data on which the gap before and after is compared, as the beginning of a sentence."""
    said = (report.get("how_far") or {}).get("judged_on")
    return JUDGED.get(str(said), "In this recording")


def force_path(report: Report) -> str:
    """How late the column force is and its gain, as a sentence; empty where the report does not say."""
    found = (report.get("details") or {}).get("force_path")
    if not found:
        return ""
    return force_sentence(found["delay"], found["interval"], found["gain"])


def above_floor(item: Mapping[str, Any]) -> float:
    """How many times its noise floor a signal's gap is; 0 where unknown."""
    if not known(item.get("nrmse")):
        return 0.0
    floor = as_float(item.get("noise_floor"))
    return as_float(item["nrmse"]) / floor if floor > 0.0 else as_float(item["nrmse"])
