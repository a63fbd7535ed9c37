"""Other causes that look the same as the effects named, to the last of what can be seen."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

import numpy as np

from diagnosis.findings.certainty.covariances import FOREIGN, between_solutions, spread
from diagnosis.findings.sensors.one_motion import one_place
from diagnosis.findings.sensors.own_reading import errors, gives_energy, of_column
from diagnosis.fits import hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Problem
from diagnosis.fits.search import Search
from diagnosis.fits.unexplained import foresees, model_error
from diagnosis.fits.worth import changes
from diagnosis.recorded.joined import column_of, laboratory_of
from diagnosis.recorded.parts import MODEL_ERROR

# Probability of several effects of which one unknown cause may look the same, over that without: half, as one cause is
# no less likely than two.
EITHER = 0.5
MANY = 5  # free parameters of an effect, from which on it may follow nearly anything
TOLD = 0.9  # share of a parameter's standard deviation without data that is left where these tell it
FAINT = 3.0  # trace over noise of an effect, below which its interval may hold none of it
FORGOTTEN = 3.0  # time constants, within which a high-pass has forgotten 95 %


def other_causes(search: Search) -> Iterator[str]:
    """A sentence for each cause that may look the same as the effects named; a small gap may have any cause.

    Any one of them makes the effects half as probable. They are found one by one, as they are asked for.
    """
    fit = search.chosen
    if small(search):
        yield (
            f"What {described(fit)} explains is so small that two good solutions of one model may differ by it. "
            "Something else as small may look the same."
        )
        return
    for name in of_no_size(fit):
        yield (
            f"The interval of {name} also holds none of it: what it explains may have another cause, or be an error of "
            "the model."
        )
    for name in errors(fit):
        yield (
            f"{name} stands beside an effect that shows in this reading alone. Another law of the machine may look the "
            "same: these signals cannot tell them apart."
        )
    if name := gives_energy(fit):
        yield (
            f"With {name} the column gives more energy than it ever took, since its force falls later than it rises. "
            "Hysteresis of its load cell looks the same: these signals cannot tell them apart."
        )
    if name := may_relax(fit):
        yield (
            f"With {name} the load cell has not forgotten a force by the end of the recording. A specimen that relaxes "
            "may look the same: these signals cannot tell them apart."
        )
    if name := told_by_little(fit):
        yield (
            f"Most parameters of {name} may have any value in their ranges, so that it follows nearly any force of its "
            "specimen. Another law may look the same: these signals cannot tell them apart."
        )
    if loop := loop_of_several(search):
        yield (
            f"Several effects of the {loop} are named. One other part of its loop, such as a filter in its "
            "feedback, may look the same: these signals cannot tell them apart."
        )
    if specimen := specimen_of_several(search):
        yield (
            f"Several effects of the {specimen} are named. One other law of this specimen may look the same: these "
            "signals cannot tell them apart."
        )
    if one_place(search):
        yield (
            f"The offsets of {described(fit)} follow from one another as where a machine stands elsewhere, such as "
            "behind a valve that opens later on one side: these signals cannot tell them apart."
        )


def of_no_size(fit: Fit) -> list[str]:
    """The effects of a fit that show for little and of which it cannot tell that there is any.

    Each of their parameters, shapes aside, is nearer to where it does nothing than its interval reaches.
    """
    sizes = zip(fit.names, changes(fit), strict=True)
    faint = [name for name, size in sizes if size.max() < FAINT**2 * fit.data.group]
    if not faint:
        return []
    problem, sure = Problem(fit.data, fit.values), spread(fit)
    places = problem.place(fit.values, fit.z)
    near: dict[str, list[bool]] = {}
    for place, item in enumerate(problem.frees, start=fit.z.size):
        parameter = item.parameter
        if item.effect in faint and not (parameter.shape or math.isinf(parameter.null)):
            half = math.hypot(FOREIGN * sure.half(place), between_solutions(fit))
            near.setdefault(item.effect, []).append(abs(places[place] - item.inward(parameter.null)) < half)
    return [name for name, yes in near.items() if all(yes)]


def may_relax(fit: Fit) -> str:
    """The high-pass of a specimen's force that is too slow for the recording to show how it ends, empty for none.

    A cell whose charge leaks forgets the whole of a force, and a specimen that relaxes a part of it.
    """
    part = column_of(fit.data.part)
    if part is None:
        return ""
    name = f"{part.lab.sensor(part.lab.kind.channels.force)}.high_pass"
    lasts = fit.data.system.plan.test.interval * len(part.measured)
    return name if name in fit.values and FORGOTTEN * fit.values[name]["time_constant"] > lasts else ""


def told_by_little(fit: Fit) -> str:
    """The effect with many free parameters of which the data tell fewer than half, empty for none.

    A parameter is told where its standard deviation, which is the range's over √12 before any data, shrinks by a
    tenth or more.
    """
    problem = Problem(fit.data, fit.values)
    counts = Counter(item.effect for item in problem.frees)
    many = [name for name, count in counts.items() if count >= MANY]
    if not many:
        return ""
    low, high = problem.bounds()
    known = np.square(high - low) / 12.0
    known[: fit.z.size] = 1.0
    scale = np.sqrt(known)
    slopes = fit.central * scale
    left = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes + np.eye(scale.size))))[fit.z.size :]
    told = Counter(item.effect for item, share in zip(problem.frees, left, strict=True) if share < TOLD)
    return next((name for name in many if 2 * told[name] < counts[name]), "")


def loop_of_several(search: Search) -> str:
    """The transfer system of which several effects are named, empty for none.

    Its loop has more parts than the plan has values of it: a filter in its feedback looks like a shorter time constant
    with a longer delay, and leaves nothing to be seen. So does what the formula of one effect leaves of another one.
    """
    data, part = search.data, laboratory_of(search.data.part)
    if part is None:
        return ""
    loop = part.lab.site(part.lab.kind.sites[0])
    return loop if sum(data.catalogue[name].site == loop for name in search.chosen.names) > 1 else ""


def specimen_of_several(search: Search) -> str:
    """The column of which several effects are named that are not all values of the plan, empty for none.

    Each of its effects is a force that follows from one motion, as is the law of any specimen that the catalogue lacks:
    two of them together imitate it.
    """
    site, values = of_column(search.chosen)
    laws = len(values) - len(hypothesis.values_of_plan(search.data, values))
    return site if len(values) > 1 and laws > 0 else ""


def small(search: Search) -> bool:
    """Whether a gap is so small that two good solutions of one model may differ by it: its cause may be anything."""
    return search.data.erring < MODEL_ERROR


def swings(search: Search) -> bool:
    """Whether effects leave a resonance that the inputs swing: another mechanism, as no law leaves one."""
    related, fit = search.data.related, search.chosen
    return related is not None and related.swings and foresees(fit, model_error(fit))


def described(fit: Fit) -> str:
    """The effects of a fit, with the law of each that has not the first of its laws."""
    laws = {name: fit.data.catalogue[name].law(values) for name, values in fit.values.items()}
    words = [
        f"{name} (law {law.name})" if law and fit.values[name].get("law") else name
        for name, law in laws.items()
    ]
    return " with ".join(words)
