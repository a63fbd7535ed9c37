"""Words for the contents of a report: names of effects and signals, status, equivalents."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from common.roles import MASTER, SLAVE, title
from diagnosis.report.evidence import Evidence
from diagnosis.report.records import Candidate, PartOfGap, Report, SignalGap, Status, Tolerance
from diagnosis.report.values import Value
from laboratories import effects as catalogue
from laboratories.effects import CATALOGUE
from report.text.force_path import sentence as force_sentence
from report.text.formats import percent, percent_interval, quantity

Named = TypeVar("Named", Candidate, Evidence)

FAULTS = {fault.name: fault for fault in catalogue.FAULTS}
STATUS = {
    "no_gap": "no gap",
    "within_tolerances": "within tolerances",
    "explained": "explained",
    "partly_explained": "partly explained",
    "ambiguous": "ambiguous",
    "unknown_effect": "unknown effect",
    "not_enough_data": "not enough data",
}
QUIET = ("no_gap", "within_tolerances")  # statuses that leave nothing to explain
JUDGED = {
    "interleaved (interpolation)": "On seconds between those used for fitting",
    "same seconds": "On the seconds used for fitting (too few show the gap to withhold any)",
    "other recordings": "On the recordings given for validation",
    "held-out time windows": "On data not used for fitting",
    "recordings given": "On the recordings given for validation",
}
LEARNED_ON = {
    "other recordings": "the recordings given for validation",
    "strongest part": "the strongest part of this recording, which was not used for it",
    "interleaved (interpolation)": "seconds between those used for it (interpolation)",
    "same seconds": "seconds of which some were used for it",
}
# Share of the gap from which a site is named in the verdict: it causes more than all others together.
DOMINANT = 0.5
LIKELY = 0.5  # probability from which the effects named are more likely the cause than not
NEAR = 0.1  # share of the first candidate's probability from which on another one is about as probable
NOTABLE = 1.0  # standard deviations of its tolerance that make a parameter's move worth a word


def joined(names: Sequence[str], last: str = "and") -> str:
    """A list in words: `a, b and c`."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} {last} {names[-1]}"


def plain(name: str) -> str:
    """A name as words: `column_force` is `column force`, `slave.column_force` is `column force at the slave`."""
    role, _, signal = name.rpartition(".")
    return f"{signal} at the {title(role)}".replace("_", " ") if role else name.replace("_", " ")


def placed(name: str, count: int = 1) -> tuple[str, str]:
    """A site, or with a count of 2 an effect, without the role that it may begin with, and that role, or nothing."""
    words = name.split(".")
    if words[0] not in (MASTER, SLAVE) or len(words) <= count:
        return name, ""
    first = len(words) - count
    first -= words[first - 1] == "sensor" and first > 1  # a reading has a name of two words
    return ".".join(words[first:]), ".".join(words[:first])


def site(name: str) -> str:
    """A site in words: `column`, `table acceleration sensor`, `column at the slave`."""
    bare, role = placed(name)
    kind, _, signal = bare.partition(".")
    words = f"{plain(signal)} sensor" if kind == "sensor" and signal else plain(bare)
    return f"{words} at the {title(role)}" if role else words


def effect(name: str) -> str:
    """An effect in words: `damper friction`, `gain of the column force sensor`, `column slip at the slave`."""
    bare, role = placed(name, 2)
    kind, _, rest = bare.partition(".")
    signal, _, fault = rest.partition(".")
    words = plain(bare.replace(".", " "))
    if kind == "sensor" and fault in FAULTS:
        words = f"{'added ' if FAULTS[fault].random else ''}{plain(fault)} of the {plain(signal)} sensor"
    return f"{words} at the {title(role)}" if role else words


def effects(names: Sequence[str]) -> str:
    """A candidate, one effect or several together."""
    return " + ".join(map(effect, names)) or "no effect"


def candidate(names: Sequence[str], status: Status) -> str:
    """A candidate in a report of a status: where a gap is left to explain, none is none of the catalogue."""
    return effects(names) if names or status in QUIET else "no effect of the catalogue"


def says(name: str) -> str:
    """The catalogue's sentence on an effect; empty for an effect that it does not list."""
    entry = CATALOGUE.get(placed(name, 2)[0])
    return entry.says if entry else ""


def ranked(candidates: Sequence[Named]) -> list[Named]:
    """Candidates, the most probable first."""
    return sorted(candidates, key=lambda item: -(item.probability or 0.0))


def sets(report: Report) -> list[tuple[str, ...]]:
    """Sets of effects that cannot be told apart, each once."""
    return list({frozenset(names): names for names in reversed(report.equivalent)}.values())[::-1]


def kind(candidate: Candidate | Evidence) -> str:
    """Whether a candidate is physics or measurement; a mixture counts as physics."""
    if isinstance(candidate, Evidence):
        return candidate.kind
    readings = [placed(name, 2)[0].startswith("sensor.") for name in candidate.effects]
    return "measurement" if readings and all(readings) else "physics"


def parameters(candidate: Candidate | Evidence) -> list[tuple[str, str, str]]:
    """A candidate's parameters: effect, parameter, value with interval and unit."""
    return [
        (name, parameter, parameter_value(name, parameter, given))
        for name, entries in candidate.parameters.items()
        for parameter, given in entries.items()
    ]


def parameter_value(name: str, parameter: str, given: Value) -> str:
    """A parameter's value with its interval and unit; of an effect with several formulas the name of the one chosen."""
    entry = CATALOGUE.get(placed(name, 2)[0])
    if parameter == "law" and entry and entry.laws and given.value is not None:
        return entry.laws[int(given.value)].name
    return quantity(given.value, given.unit, given.interval)


def called(effect: str, parameter: str) -> str:
    """A parameter behind its effect's words; empty where these say it already: `table delay` has but one."""
    return "" if effect.replace(".", "_").endswith(f"_{parameter}") else plain(parameter)


def equivalent(names: Sequence[str]) -> str:
    """A set of effects that cannot be told apart, as a sentence."""
    first, *others = map(effect, names)
    return f"These signals cannot separate {first} from {joined(others, 'or')}: the cause may be any of them."


def notable(report: Report) -> list[tuple[str, Tolerance]]:
    """Parameters that moved by more than one standard deviation of their tolerance, the farthest first."""
    return [(name, item) for name, item in by_move(report) if abs(item.z or 0.0) > NOTABLE]


def by_move(report: Report) -> list[tuple[str, Tolerance]]:
    """Parameters within tolerances, the one that moved farthest first."""
    return sorted(report.tolerances.items(), key=lambda entry: -abs(entry[1].z or 0.0))


def nominal_gap(report: Report) -> float | None:
    """The overall gap before parameters were moved inside their tolerances, None where it is not said."""
    steps = report.details.waterfall
    return steps[0].value if report.how_far.nominal is None and steps else report.how_far.nominal


def verdict(report: Report) -> str:
    """The verdict in one sentence, the report's own if it has one."""
    if report.verdict:
        return report.verdict
    size = f"{percent(report.gap.overall)} (noise floor {percent(report.gap.overall_noise_floor)})"
    sentences = {
        "no_gap": f"There is no gap beyond noise and tolerances: {size}.",
        "within_tolerances": f"There is no gap beyond tolerances: {size}; {within(report)}.",
        "partly_explained": f"The gap of {size}{place(report)}: {by_part(report) or cause(report)}.",
        "not_enough_data": "This recording holds too few data to locate a gap or to name its cause.",
        "unknown_effect": f"The gap of {size}{place(report)} has a cause that is not in the catalogue.",
        "ambiguous": f"Several causes explain the gap of {size}{place(report)} equally well: {rivals(report)}.",
    }
    fallback = f"The gap of {size}{place(report)}: {cause(report)}."
    return sentences.get(report.status, fallback)


def within(report: Report) -> str:
    """The parameters within their tolerances that explain a gap, the farthest moved by name."""
    moved = [f"{name} ×{item.factor:.4g}" for name, item in by_move(report)[:2] if item.factor is not None]
    return (
        f"parameters moved within them explain it, most of all {joined(moved)}"
        if moved
        else "nothing is left"
    )


def by_part(report: Report) -> str:
    """A sentence on each part with a gap; none for a report without parts."""
    left = [entry for entry in report.parts if entry.outcome in ("explained", "partly", "unknown")]
    named = {name for entry in left for name in entry.effects}
    likely = any((item.probability or 0.0) >= LIKELY for item in report.which[:1])
    texts = [f"in {entry.part} {of_part(entry, likely)}" for entry in left]
    further = [name for item in report.which[:1] for name in item.effects if name not in named]
    texts += [f"in addition {effects(further)}"] if further and texts else []
    return "; ".join(texts)


def of_part(entry: PartOfGap, likely: bool) -> str:
    """The sentence on one part; effects that are not `likely` to be the cause stand in for it."""
    if entry.outcome == "unknown":
        return "its cause is not in the catalogue"
    if entry.outcome == "explained":
        return f"{effects(entry.effects)} explains it"
    open_ = (entry.left or 0.0) + (entry.learned or 0.0)  # what was learned of it has no name
    names, rest = effects(entry.effects), f"leaves {percent(open_)} of {percent(entry.gap)}"
    return (
        f"{names} explains a part and {rest}"
        if likely
        else f"{names} may stand in for another cause and {rest}"
    )


def place(report: Report) -> str:
    """Where most of the gap lies, as a part of a sentence."""
    share = report.where[0].share if report.where else None
    if share is None or share < DOMINANT:
        return ""
    return f", {percent(share)} of it at the {site(report.where[0].site)}"


def rivals(report: Report) -> str:
    """The foremost candidates that are about as probable as the first."""
    first = (report.which[0].probability or 0.0) if report.which else 0.0
    near = [item for item in ranked(report.which)[:3] if (item.probability or 0.0) >= NEAR * first]
    names = [effects(item.effects) for item in near]
    if len(names) == 1:
        names.append("another cause")
    return joined(names, "or") or "none is named"


def cause(report: Report) -> str:
    """The first candidate and what it closes."""
    if not report.which:
        return "no cause is named"
    share = report.how_far.closed
    closes = " explains it" if share is None else f" closes {percent(min(share, 1.0))} of it"
    partly = " (only a part)" if report.status == "partly_explained" else ""
    return effects(report.which[0].effects) + closes + partly


def closed(report: Report) -> str:
    """The closed share with its interval; empty where it is unknown or there was no gap to close.

    By chance the rest may be below the noise floor; a share above 100 % is shown as 100 %.
    """
    share = report.how_far.closed
    if share is None or report.status in QUIET:
        return ""
    ends = [min(end, 1.0) for end in report.how_far.closed_interval or () if end is not None]
    interval = percent_interval(ends)
    return percent(min(share, 1.0)) + (f" ({interval})" if interval else "")


def judged_on(report: Report) -> str:
    """The data on which the gap before and after is compared, as the beginning of a sentence."""
    return in_rows(report, JUDGED.get(str(report.how_far.judged_on), "In this recording"))


def in_rows(report: Report, words: str) -> str:
    """Words on pieces of a recording, which are rows where times have no meaning."""
    return words.replace("seconds", "rows") if report.details.test.static else words


def learned(report: Report) -> str:
    """What was learned of what no effect explains and how far it closes the gap, as a sentence; empty without any."""
    far = report.how_far.learned
    if far is None:
        return ""
    places = joined([site(name) for name in far.sites])
    on = in_rows(report, LEARNED_ON.get(far.judged_on, far.judged_on))
    fall = f"from {percent(far.before)} to {percent(far.after)}"
    return (
        f"What no effect explains at the {places} was learned as a law of the motion there: the gap falls {fall} "
        f"({percent(far.named)} with the named effects alone), judged on {on}."
    )


def force_path(report: Report) -> str:
    """How late the column force is and its gain, as a sentence; empty where the report does not say."""
    found = report.details.force_path
    if found is None:
        return ""
    return force_sentence(found.delay, found.interval, found.gain)


def above_floor(item: SignalGap) -> float:
    """How many times its noise floor a signal's gap is; 0 where unknown."""
    if item.nrmse is None:
        return 0.0
    floor = item.noise_floor or 0.0
    return item.nrmse / floor if floor > 0.0 else item.nrmse


def by_floor(report: Report) -> list[tuple[str, SignalGap]]:
    """The gaps of the signals, the one farthest above its noise floor first."""
    return sorted(report.gap.signals.items(), key=lambda item: -above_floor(item[1]))
