"""Which effect causes the gap: physics and measurement separately, evidence for and against, pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from markupsafe import Markup

from diagnosis.report.evidence import Evidence, Reading, Unknown
from diagnosis.report.records import Candidate, Report
from report.gap import pictures, wording
from report.gap.blocks import Drawing, Rows, bar, drawings
from report.text.formats import as_float, known, nats, percent, probability, quantity

MOST_PICTURES = 6  # of readings with the largest residuals: three rows of the page
KINDS = (
    ("physics", "Physics effects", "The rig does something that its model leaves out."),
    ("measurement", "Measurement artefacts", "The rig behaves as modelled, but a reading is wrong."),
)


class Card(NamedTuple):
    """A candidate as the page shows it."""

    title: str
    names: tuple[str, ...]
    meaning: str
    probability: Markup
    worth: str
    parameters: Rows
    evidence: list[tuple[str, str]]  # label and text
    warnings: list[str]


def candidates(report: Report) -> Sequence[Candidate | Evidence]:
    """The candidates, ranked; those of the verdict where the report has no details."""
    detailed = report.details.candidates
    return wording.ranked(detailed) if detailed else wording.ranked(report.which)


def kinds(report: Report) -> list[tuple[str, str, list[Card]]]:
    """Title, words and candidates of each kind; none where there is no candidate."""
    found = candidates(report)
    return [
        (
            title,
            words,
            [
                card(place, item, report)
                for place, item in enumerate(found, start=1)
                if wording.kind(item) == kind
            ],
        )
        for kind, title, words in KINDS
        if found
    ]


def nothing(report: Report) -> str:
    """The sentence on why no effect is named."""
    reasons = {
        "within_tolerances": "Parameters within their tolerances explain the gap: no effect is needed.",
        "no_gap": "There is no gap to explain: no effect was searched for.",
        "not_enough_data": "No effect is named: the recording holds too few data to separate one from another.",
        "unknown_effect": "No effect of the catalogue explains the gap.",
    }
    return reasons.get(report.status, "No effect is named.")


def card(place: int, item: Candidate | Evidence, report: Report) -> Card:
    """One candidate."""
    return Card(
        f"{place}. {wording.candidate(item.effects, report.status)}",
        item.effects,
        "; ".join(filter(None, map(wording.says, item.effects))),
        bar(item.probability, probability(item.probability)),
        worth(item),
        parameters(item),
        evidence(item),
        warnings(item, report),
    )


def worth(item: Candidate | Evidence) -> str:
    """What a candidate explains and how it scores, both on data not used for the fit."""
    facts = []
    if isinstance(item, Evidence) and item.explained is not None:
        facts.append(f"explains {percent(item.explained)} of the gap at its part")
    score = item.score if isinstance(item, Evidence) else item.held_out_score
    if score is not None:
        how = "worse" if score > 0.0 else "better"
        facts.append("best score" if abs(score) < 0.05 else f"{nats(abs(score))} {how} than the verdict")
    return "; ".join(facts)


def setting(name: str, parameter: str, *, several: bool) -> str:
    """What a parameter is called, with its effect where they are `several`; no word twice."""
    if not several:
        return wording.plain(parameter)
    return ": ".join(filter(None, (wording.effect(name), wording.called(name, parameter))))


def parameters(item: Candidate | Evidence) -> Rows:
    """A candidate's parameters with intervals."""
    several = len(item.effects) > 1
    rows = [
        [setting(name, parameter, several=several), value]
        for name, parameter, value in wording.parameters(item)
    ]
    return Rows(("parameter", "value (interval)"), rows)


def evidence(item: Candidate | Evidence) -> list[tuple[str, str]]:
    """What speaks for and against."""
    if not isinstance(item, Evidence):
        return []
    return [(label, text) for label, text in (("For:", item.for_), ("Against:", item.against)) if text]


def warnings(item: Candidate | Evidence, report: Report) -> list[str]:
    """Parameters on their bounds, and effects that cannot be told from this one."""
    bounds = [wording.plain(name) for name in item.on_bound] if isinstance(item, Evidence) else []
    texts = [f"On the bound of its range: {wording.joined(bounds)}."] if bounds else []
    own = set(item.effects)
    twins = {other for group in report.equivalent if set(group) & own for other in set(group) - own}
    if twins:
        texts.append(f"Cannot be separated from {wording.joined(sorted(map(wording.effect, twins)), 'or')}.")
    return texts


class Strange(NamedTuple):
    """An effect that the catalogue lacks, as the page shows it."""

    text: str
    depends_on: Rows
    drawings: list[Drawing]


def unknown(found: Unknown, *, static: bool) -> Strange:
    """The residual of a part that no effect of the catalogue explains, as the page shows it.

    In `static` data, whose times have no meaning, only the order of the rows is left of them.
    """
    words = {"time": "order of the rows"} if static else {}
    facts = []
    if found.amplitude is not None:
        facts.append(f"size {quantity(found.amplitude, found.unit)}")
    if found.frequency is not None:
        facts.append(f"strongest at {quantity(found.frequency, 'Hz')}")
    text = f"At the {wording.site(found.site)} an effect acts that is not in the catalogue"
    rows = [[words.get(item.on, str(item.on)), bar(item.share)] for item in found.depends_on]
    names = ("the catalogue's best", "a flexible curve")
    drawn = pictures.curve(found.curve, names) if found.curve else ""
    return Strange(
        text + (f": {', '.join(facts)}." if facts else "."),
        Rows(("depends on", "share of the residual"), rows),
        drawings((drawn, "What the catalogue leaves over.")),
    )


def learned(report: Report) -> list[Drawing]:
    """What no effect explains, learned, each site in its natural coordinates with its band."""
    names = ("", "learned")
    return drawings(
        *(
            (
                pictures.curve(item.curve, names),
                f"{wording.site(item.site).capitalize()}: the {item.quantity} that no effect explains, over the "
                "motion there.",
                f"{quantity(item.before, item.unit)} rms, of which {quantity(item.after, item.unit)} remain on data "
                "not used for the law.",
            )
            for item in report.details.learned
        )
    )


def predictions(report: Report) -> list[Drawing]:
    """Measured against predicted, of the parts with the largest residuals first."""
    across = pictures.ROWS if report.details.test.static else pictures.TIME
    signals = [(part.site, signal) for part in report.details.parts for signal in part.signals]
    signals.sort(key=lambda item: -excess(item[1]))
    return drawings(
        *(
            (pictures.prediction(signal, across), caption(name, signal), noise(signal))
            for name, signal in signals[:MOST_PICTURES]
        )
    )


def caption(site: str, signal: Reading) -> str:
    """What a picture of one reading shows."""
    predicted = signal.nominal or signal.corrected
    words = "measured and predicted" if predicted else "measured; its prediction is not in this report"
    return f"{wording.site(site).capitalize()}: {wording.plain(signal.signal)}, {words}."


def excess(signal: Reading) -> float:
    """How far a signal's residual is above its noise."""
    floor = as_float(signal.noise_floor)
    return signal.residual_rms / floor if signal.residual_rms is not None and floor > 0.0 else 0.0


def noise(signal: Reading) -> str:
    """Residual beside noise in numbers."""
    if signal.residual_rms is None:
        return ""
    floor = f", noise floor {quantity(signal.noise_floor, signal.unit)}" if known(signal.noise_floor) else ""
    return f"Residual {quantity(signal.residual_rms, signal.unit)} rms{floor}."


def curves(report: Report) -> list[Drawing]:
    """The relations in which an effect shows."""
    return drawings(*((pictures.curve(item), item.title or "Relation.") for item in report.details.curves))
