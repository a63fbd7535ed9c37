"""The limits of the diagnosis: effects not told apart or not exercised, the next test, how to read the page."""

from __future__ import annotations

from diagnosis.report.records import Report
from report.gap import wording
from report.gap.blocks import Rows, strong
from report.text.formats import MISSING

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
    ("share", "part of the gap that a site causes; shares sum to 100 % over sites with a gap"),
    ("effect", "a physical cause of a gap that the nominal models leave out"),
    (
        "probability",
        "how likely a candidate is among those tried; causes that were not tried are not counted",
    ),
    ("nats", "logarithm of a ratio of likelihoods; 3 nats worse is about 20 times less likely"),
    ("closed", "(before − after) / (before − noise floor), on data that the fit has not seen"),
    ("tolerance", "how well a nominal parameter is known beforehand"),
    ("not exercised", "an effect that may be present, but that this motion could not have shown"),
    ("interval", "the range in which the value plausibly lies, given this recording"),
)


def equivalents(report: Report) -> list[str]:
    """Sentences on effects that these signals cannot separate."""
    return [wording.equivalent(names) for names in wording.sets(report)]


def not_exercised(report: Report) -> list[tuple[str, str, str]]:
    """Effects that this recording could not have shown: in words, name, meaning."""
    names = dict.fromkeys(report.not_exercised)
    return [(wording.effect(name), name, wording.says(name)) for name in names]


def tests(report: Report) -> Rows:
    """Tests that could be run next, and the candidates that they would separate."""
    rows = [
        [
            strong(item.test),
            wording.joined(list(map(wording.effect, item.pair or ())), "from"),
            MISSING if item.separation is None else f"{item.separation:.1f} σ",
            item.why,
        ]
        for item in report.details.next
    ]
    return Rows(("test", "separates", "separation", "why"), rows)
