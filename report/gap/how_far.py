"""How far the gap closes: the waterfall, the worst seconds, the paths of the loop, the tolerances."""

from __future__ import annotations

from diagnosis.report.evidence import LoopPath
from diagnosis.report.records import Report
from report.gap import pictures, wording
from report.gap.blocks import Drawing, Rows, bar, code, drawings, strong
from report.text.formats import MISSING, percent, quantity, signed, times

MOST_HISTORIES = 4  # pictures: one for each of the usual response signals
OUTCOMES = {
    "none": "noise only",
    "tolerances": "within tolerances",
    "explained": "explained",
    "partly": "partly explained",
    "unknown": "unknown cause",
}
ADEQUATE = {None: MISSING, True: "yes", False: "no"}


def steps(report: Report) -> list[Drawing]:
    """The waterfall and the worst seconds."""
    details = report.details
    across = pictures.ROWS if details.test.static else pictures.TIME
    return drawings(
        (pictures.waterfall(details.waterfall), "The overall gap, step by step down to the noise floor."),
        *(
            (
                pictures.history(item, across),
                f"{wording.plain(item.signal).capitalize()} where its gap is largest, closed loop.",
            )
            for item in details.histories[:MOST_HISTORIES]
        ),
    )


def numbers(report: Report) -> Rows:
    """The gaps before and after, the share closed and the noise floor; no row where they were not determined."""
    far, nominal = report.how_far, wording.nominal_gap(report)
    head = ("", "overall gap")
    if far.before is None or far.after is None:
        return Rows(head, [])
    rows: list[list[str]] = [["nominal models", percent(nominal)]] if nominal is not None else []
    rows += [
        ["parameters moved inside their tolerances (before)", percent(far.before)],
        ["with the effects named (after)", strong(percent(far.after))],
        *learned(report),
        ["noise floor", percent(far.noise_floor)],
    ]
    closed = wording.closed(report)
    rows += [["closed, of the gap above the noise", bar(far.closed, closed)]] if closed else []
    return Rows(head, rows)


def learned(report: Report) -> list[list[str]]:
    """The gap with what was learned beside the effects; no row where nothing was."""
    far = report.how_far.learned
    return [] if far is None else [["with what was learned as well", strong(percent(far.after))]]


def remaining(report: Report) -> str:
    """The gap that is left, and its sites."""
    found = report.details.remaining
    if found is None:
        return ""
    sites = [f"{wording.site(item.site)} {times(item.residual_to_noise)} its noise" for item in found.where]
    place = f", at: {', '.join(sites)}" if sites else ""
    return f"What remains: {percent(found.overall)} overall{place}."


def made_of(report: Report) -> Rows:
    """Every part's gap as the sum of tolerances, named effects, learned laws and the rest; the noise beside it."""
    judged = any(part.adequate is not None for part in report.parts)
    head = ("part", "gap", "tolerances", "named", "learned", "left", "noise", "finding")
    rows = [
        [
            wording.plain(part.part),
            *map(percent, (part.gap, part.tolerances, part.named, part.learned, part.left, part.noise)),
            OUTCOMES[part.outcome] + (f": {wording.effects(part.effects)}" if part.effects else ""),
            *([ADEQUATE[part.adequate]] if judged else []),
        ]
        for part in report.parts
    ]
    return Rows((*head, "good enough") if judged else head, rows)


def noises(report: Report) -> Rows:
    """The noise of every sensor: its rms and colour, lines that it picks up, resolution, and where it was found."""
    head = ("signal", "rms", "colour", "lines", "resolution", "found in")
    rows = [
        [
            wording.plain(name),
            quantity(noise.rms, noise.unit),
            "white" if noise.kind == "white" else f"coloured, order {noise.order}",
            ", ".join(f"{line:g} Hz" for line in noise.lines) or MISSING,
            quantity(noise.resolution, noise.unit),
            {"at rest": "samples at rest", "quiet part": "quiet part"}.get(noise.from_, "whole residual"),
        ]
        for part in report.parts
        for name, noise in part.noise_model.items()
    ]
    return Rows(head, rows)


def paths(report: Report) -> Rows:
    """Delay and damping equivalents of the loop's paths."""
    found = report.details.paths
    named = (
        ("command path", found.command),
        ("force path", found.force),
        ("exchange with the other lab", found.exchange),
    )
    rows = [[name, *costs(item)] for name, item in named if item is not None]
    return Rows(("path", "delay", "nominal", "gain", "damping, points", "nominal"), rows)


def costs(item: LoopPath) -> list[str]:
    """The cells of a path: delay, gain and damping."""
    return [
        quantity(item.delay, "s"),
        quantity(item.nominal_delay, "s"),
        MISSING if item.amplitude is None else f"{item.amplitude:.3f}",
        points(item.damping_points),
        points(item.nominal_damping_points),
    ]


def points(value: float | None) -> str:
    """Points of damping with their sign."""
    return MISSING if value is None else signed(value, 2)


def tolerances(report: Report) -> Rows:
    """Nominal parameters moved inside their tolerances."""
    rows = [
        [
            code(name),
            MISSING if item.factor is None else f"{item.factor:.4f}",
            points(item.z),
            "notable" if abs(item.z or 0.0) > wording.NOTABLE else "",
        ]
        for name, item in wording.by_move(report)
    ]
    return Rows(("parameter", "factor", "z", ""), rows)


def moves(report: Report) -> list[Drawing]:
    """The picture of these moves."""
    picture = pictures.tolerance_moves(wording.by_move(report))
    return drawings((picture, "Moves of the nominal parameters."))
