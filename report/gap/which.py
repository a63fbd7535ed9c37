"""Which effect makes the gap: physics and measurement apart, evidence for and against, pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from report.gap import pictures, wording
from report.gap.blocks import absent, bar, esc, figure, gallery, heading, paragraph, section, table
from report.gap.wording import Report
from report.text.formats import as_float, known, nats, percent, probability, quantity

Candidate = Mapping[str, Any]
MOST_PICTURES = 6
KINDS = (
    ("physics", "Physics effects", "the rig does something that its model leaves out"),
    ("measurement", "Measurement artefacts", "the rig behaves as modelled, but a reading is wrong"),
)


def which(report: Report) -> str:
    """The section."""
    found = candidates(report)
    kinds = [of_kind(found, *item, report) for item in KINDS] if found else [nothing(report)]
    return section("which", "Which", *kinds, unknown(report), predictions(report), curves(report))


def candidates(report: Report) -> list[Candidate]:
    """The candidates, ranked; those of the verdict where the report has no details."""
    detailed = (report.get("details") or {}).get("candidates")
    return wording.once(detailed or report.get("which") or [])


def nothing(report: Report) -> str:
    """Why no effect is named."""
    reasons = {
        "no_gap": "There is no gap to explain: no effect was searched for.",
        "not_enough_data": "No effect is named: the recording does not hold enough to tell one from another.",
        "unknown_effect": "No effect of the catalogue explains the gap.",
    }
    return absent(reasons.get(str(report.get("status")), "No effect is named."))


def of_kind(found: Sequence[Candidate], kind: str, title: str, words: str, report: Report) -> str:
    """The candidates of one kind."""
    cards = [
        card(place, item, report) for place, item in enumerate(found, start=1) if wording.kind(item) == kind
    ]
    content = f'<div class="cards">{"".join(cards)}</div>' if cards else absent("No candidate of this kind.")
    return heading(title) + paragraph(words[0].upper() + words[1:] + ".", "note") + content


def card(place: int, item: Candidate, report: Report) -> str:
    """One candidate."""
    names = [str(name) for name in item.get("effects") or []]
    known_as = " ".join(f"<code>{esc(name)}</code>" for name in names)
    meaning = "; ".join(filter(None, map(wording.says, names)))
    return (
        f'<article class="card"><h4>{place}. {esc(wording.effects(names))}</h4>'
        f'<p class="note">{known_as}{" " + esc(meaning) if meaning else ""}</p>'
        f"<p>{bar(item.get('probability'), probability(item.get('probability')))} probability</p>"
        f"{worth(item)}{parameters(item)}{evidence(item)}{warnings(item, names, report)}</article>"
    )


def worth(item: Candidate) -> str:
    """What a candidate explains and how it scores, both on data not used for the fit."""
    facts = []
    if known(item.get("explained")):
        facts.append(f"explains {percent(item['explained'])} of the gap at its part")
    score = item.get("score", item.get("held_out_score"))
    if known(score):
        behind = abs(as_float(score))
        facts.append("best score" if behind < 0.05 else f"{nats(behind)} worse than the best")
    return paragraph("; ".join(facts))


def setting(name: str, parameter: str, *, several: bool) -> str:
    """What a parameter is called, with its effect where they are `several`; no word twice."""
    if not several:
        return wording.plain(parameter)
    return ": ".join(filter(None, (wording.effect(name), wording.called(name, parameter))))


def parameters(item: Candidate) -> str:
    """A candidate's parameters with intervals."""
    several = len(item.get("effects") or []) > 1
    rows = [
        [esc(setting(name, parameter, several=several)), esc(value)]
        for name, parameter, value in wording.parameters(item)
    ]
    return table(("parameter", "value (interval)"), rows)


def evidence(item: Candidate) -> str:
    """What speaks for and against."""
    texts = [
        f"<p><b>{label}</b> {esc(item[key])}</p>"
        for key, label in (("for", "For:"), ("against", "Against:"))
        if item.get(key)
    ]
    return "".join(texts)


def warnings(item: Candidate, names: Sequence[str], report: Report) -> str:
    """Parameters on their bounds, and effects that cannot be told from this one."""
    bounds = [wording.plain(str(name)) for name in item.get("on_bound") or []]
    texts = [f"On the bound of its range: {wording.joined(bounds)}."] if bounds else []
    twins = {
        other
        for group in report.get("equivalent") or []
        if set(group) & set(names)
        for other in group
        if other not in names
    }
    if twins:
        texts.append(f"Cannot be told apart from {wording.joined(sorted(map(wording.effect, twins)), 'or')}.")
    return "".join(paragraph(text, "warn") for text in texts)


def unknown(report: Report) -> str:
    """What an effect that the catalogue lacks looks like."""
    found = (report.get("details") or {}).get("unknown") or {}
    if not found:
        missing = report.get("status") == "unknown_effect"
        return absent("What the unknown effect depends on is not in this report.") if missing else ""
    rows = [[esc(item.get("on")), bar(item.get("share"))] for item in found.get("depends_on") or []]
    facts = []
    if known(found.get("amplitude")):
        facts.append(f"size {quantity(found['amplitude'], str(found.get('unit') or ''))}")
    if known(found.get("frequency")):
        facts.append(f"strongest at {quantity(found['frequency'], 'Hz')}")
    name = wording.site(str(found.get("site") or "an unknown part"))
    text = f"At the {name} an effect acts that is not in the catalogue"
    drawn = pictures.curve(found.get("curve") or {}, ("the catalogue's best", "a flexible curve"))
    picture = figure(drawn, "What the catalogue leaves over.")
    return (
        heading("An effect that the catalogue lacks")
        + paragraph(text + (f": {', '.join(facts)}." if facts else "."))
        + table(("depends on", "share of what is left over"), rows)
        + gallery([picture])
    )


def predictions(report: Report) -> str:
    """Measured against predicted, of the parts with the largest residuals first."""
    signals = [
        (str(part.get("site")), signal)
        for part in (report.get("details") or {}).get("parts") or []
        for signal in part.get("signals") or []
    ]
    signals.sort(key=lambda item: -excess(item[1]))
    drawn = [
        figure(pictures.prediction(signal), caption(name, signal), noise(signal))
        for name, signal in signals[:MOST_PICTURES]
    ]
    title = heading("Measured against predicted")
    return title + (gallery(drawn) or absent("The samples behind the residuals are not in this report."))


def caption(site: str, signal: Mapping[str, Any]) -> str:
    """What a picture of one reading shows."""
    predicted = signal.get("nominal") or signal.get("corrected")
    words = "measured and predicted" if predicted else "measured; its prediction is not in this report"
    return f"{wording.site(site).capitalize()}: {wording.plain(str(signal.get('signal')))}, {words}."


def excess(signal: Mapping[str, Any]) -> float:
    """How far a signal's residual is above its noise."""
    floor = as_float(signal.get("noise_floor"))
    return (
        as_float(signal["residual_rms"]) / floor if known(signal.get("residual_rms")) and floor > 0.0 else 0.0
    )


def noise(signal: Mapping[str, Any]) -> str:
    """Residual beside noise in numbers."""
    if not known(signal.get("residual_rms")):
        return ""
    unit = str(signal.get("unit") or "")
    floor = (
        f", noise floor {quantity(signal['noise_floor'], unit)}" if known(signal.get("noise_floor")) else ""
    )
    return f"Residual {quantity(signal['residual_rms'], unit)} rms{floor}."


def curves(report: Report) -> str:
    """The relations in which an effect shows."""
    drawn = [
        figure(pictures.curve(item), str(item.get("title") or "Relation."))
        for item in (report.get("details") or {}).get("curves") or []
    ]
    return heading("In the effect's own coordinates") + gallery(drawn) if any(drawn) else ""
