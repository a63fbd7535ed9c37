"""What the diagnosis cannot say, what to run next, warnings, and how to read the page."""

from __future__ import annotations

from report.gap import wording
from report.gap.blocks import absent, bullets, esc, heading, paragraph, section, table
from report.gap.wording import Report
from report.text.formats import MISSING, as_float, known

GLOSSARY = (
    ("gap", "recorded minus simulated; as a number, rms of the error over rms of the recorded signal"),
    (
        "overall",
        "rms over the response signals: column displacement and force, table acceleration, damper force",
    ),
    ("noise floor", "the gap that sensor noise alone makes; a gap at its floor cannot shrink"),
    ("nominal model", "what the plan says that a laboratory is"),
    (
        "residual",
        "recorded output of a part minus its model's prediction from the recorded input",
    ),
    ("share", "how much of the gap a site makes; shares sum to 100 % over sites with a gap"),
    ("effect", "something real that the nominal models leave out"),
    (
        "probability",
        "how likely a candidate is among those tried; causes that were not tried are not counted",
    ),
    ("nats", "logarithm of a ratio of likelihoods; 3 nats worse is about 20 times less likely"),
    ("closed", "(before − after) / (before − noise floor), on data that the fit has not seen"),
    ("tolerance", "how well a nominal parameter is known beforehand"),
    ("not exercised", "an effect that could be there, but that this motion would not have shown"),
    ("interval", "the range in which the value plausibly lies, given this recording"),
)


def equivalents(report: Report) -> str:
    """Effects that cannot be told apart."""
    found = [wording.equivalent(names) for names in wording.sets(report)]
    none = absent("No such set of effects is listed in this report.")
    return section("equivalent", "What cannot be told apart", bullets(found) or none)


def not_exercised(report: Report) -> str:
    """Effects that this recording could not have shown."""
    names = list(dict.fromkeys(report.get("not_exercised") or []))
    items = "".join(
        f"<li>{esc(wording.effect(name))} <code>{esc(name)}</code>"
        f"{': ' + esc(wording.says(name)) if wording.says(name) else ''}</li>"
        for name in names
    )
    text = paragraph("These effects may be there or not: this recording could not have shown them.")
    none = absent("No such effect is listed in this report.")
    return section("not-exercised", "Not exercised", text + f"<ul>{items}</ul>" if names else none)


def next_test(report: Report) -> str:
    """What to run next, and what it would tell apart."""
    rows = [
        [
            f"<b>{esc(item.get('test'))}</b>",
            esc(wording.joined([wording.effect(str(name)) for name in item.get("pair") or []], "from")),
            esc(f"{as_float(item['separation']):.1f} σ" if known(item.get("separation")) else MISSING),
            esc(item.get("why") or ""),
        ]
        for item in (report.get("details") or {}).get("next") or []
    ]
    text = paragraph(str(report.get("next_test") or "")) or absent("No further test is proposed.")
    menu = table(("test", "tells", "separation", "why"), rows)
    return section("next", "Next test", text, heading("Tests compared") + menu if rows else "")


def warnings(report: Report) -> str:
    """Warnings of the diagnosis."""
    found = bullets([str(text) for text in report.get("warnings") or []])
    return section("warnings", "Warnings", found or absent("No warnings."))


def how_to_read() -> str:
    """A short glossary."""
    words = "".join(f"<dt>{esc(word)}</dt><dd>{esc(meaning)}</dd>" for word, meaning in GLOSSARY)
    return section("reading", "How to read this", f'<dl class="glossary">{words}</dl>')
