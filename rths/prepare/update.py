"""`rths update`: a plan with the nominal models that a diagnosis found, and the compensator that serves best there."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from common.terminal import cli, outputs
from report.text.progress import Progress

if TYPE_CHECKING:
    from common.plan.plan import Plan
    from simulation.updated.nominal import UpdatedPlan
    from simulation.updated.trials import Margins, Trial


FAR = 10.0  # times a limit from which on the loop is unstable, and the figure says nothing more


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `update`."""
    parser.add_argument(
        "plan", metavar="PLAN", help="the plan that was diagnosed, or the name of one that ships"
    )
    parser.add_argument(
        "--found", type=Path, required=True, metavar="FOUND", help="what rths diagnose --found wrote"
    )
    cli.output_argument(parser, "NEW", "the plan to write (TOML)", required=True)
    cli.force_argument(parser)
    cli.json_argument(parser, "write what changed as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Write the plan; 1 where no compensator keeps its margin and its limits on the laboratories found."""
    from common.plan import read as plans

    path = cli.plan_path(args.plan)
    plan = plans.load(path)
    outputs.checked(args.output, args.force, [path, args.found])
    with Progress("updating") as progress:
        from simulation.prediction import draws
        from simulation.updated import nominal, trials

        found = draws.load(args.found, plan)
        updated = nominal.update(found, plan)
        tried = trials.trials(found, updated.plan, progress.tell)
        both = trials.margins(plan), trials.margins(updated.plan)
        text = nominal.toml(updated, args.found.name, args.output.parent)
        plans.parse(text, args.output.parent)
        outputs.write_text(args.output, text, args.force)
    stream = outputs.aside(args.output)
    wanted = updated.plan.preflight.delay_margin
    if args.json:
        stream.write(json.dumps(plain(args.output, updated, both, tried)) + "\n")
    else:
        show(args.output, updated, both, tried, stream)
    return 1 if tried and not tried[0].serves(wanted) else 0


def plain(
    path: Path, updated: UpdatedPlan, both: tuple[Margins, Margins], tried: list[Trial]
) -> dict[str, Any]:
    """What changed, as JSON holds it."""
    from simulation.updated import trials

    return {
        "file": str(path),
        "said": list(updated.said),
        "unsaid": list(updated.unsaid),
        "before": trials.plain_margins(both[0]),
        "after": trials.plain_margins(both[1]),
        "compensators": [trials.plain(one) for one in tried],
        "best": tried[0].name if tried and tried[0].serves(updated.plan.preflight.delay_margin) else None,
    }


def show(
    path: Path, updated: UpdatedPlan, both: tuple[Margins, Margins], tried: list[Trial], stream: TextIO
) -> None:
    """The summary as text."""
    from report.text.terminal import table

    stream.write("\n".join(("nominal models as found:", *(f"  {row}" for row in updated.said))) + "\n")
    if not updated.said:
        stream.write("  nothing that a plan says differs\n")
    stream.write("".join(f"not in the plan: {sentence}\n" for sentence in updated.unsaid))
    stream.write("\n")
    rows = [["column's path", "critical delay", "expected", "margin", "damping lost"]]
    rows += [[name, *margin_cells(one)] for name, one in zip(("as planned", "as found"), both, strict=True)]
    table(rows, stream)
    if tried:
        stream.write("\n")
        head = [
            "compensator",
            "tracking error",
            "critical delay",
            "expected",
            "margin",
            "damping lost",
            "limits",
        ]
        table([head, *(trial_cells(one) for one in tried)], stream)
        stream.write("\n" + winner(updated.plan, tried) + "\n")
    stream.write(f"written to {path}\n")


def margin_cells(one: Margins) -> list[str]:
    """Critical delay, expected delay, margin, damping lost."""
    from math import isfinite

    stable = isfinite(one.expected) and isfinite(one.damping_points)
    return [
        f"{one.critical * 1e3:.1f} ms" if isfinite(one.critical) else "any",
        f"{one.expected * 1e3:.1f} ms" if isfinite(one.expected) else "unstable",
        f"{one.margin:.1f}" if isfinite(one.margin) and one.margin < 1e3 else "–",
        f"{100 * one.damping_points:z.2f} points" if stable else "unstable",
    ]


def trial_cells(one: Trial) -> list[str]:
    """One row of the table of compensators."""
    from math import isfinite

    error = f"{100 * one.error:.2f} %" if isfinite(one.error) else "unstable"
    share = f"{100 * one.limit:.0f} %" if one.limit < FAR else "–"
    return [one.name, error, *margin_cells(one.margins), share]


def winner(plan: Plan, tried: list[Trial]) -> str:
    """Which compensator serves best, with its figures."""
    wanted = plan.preflight.delay_margin
    best = tried[0]
    if not best.serves(wanted):
        return (
            f"No compensator keeps the plan's limits and a margin of {wanted:g} on the laboratories as found."
        )
    own = next(one for one in tried if one.name == "as planned")
    given = ", ".join(f"{name} = {value:.5g}" for name, value in best.chosen.parameters.items())
    beside = "" if best is own else f", against {trial_cells(own)[1]} as planned"
    return (
        f"Best on the laboratories as found: {best.name}, with a tracking error of {trial_cells(best)[1]}{beside}, and "
        f"a margin of {best.margins.margin:.1f} ({best.margins.critical * 1e3:.1f} ms of delay borne, "
        f"{best.margins.expected * 1e3:.1f} ms expected).\n"
        f'[compensator] kind = "{best.chosen.kind}"{", " + given if given else ""}'
    )
