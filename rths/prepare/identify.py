"""`rths identify`: a part's parameters from a bench recording, or from any that holds its inputs and outputs."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from common.errors import InputError
from common.roles import MASTER, name_of
from common.terminal import cli
from common.terminal.printable import all_shown
from common.terminal.telling import Tell
from report.text.progress import Progress

PARTS = ("column", "actuator", "table", "damper")
LAW = "column, model "  # what the part of a report on a fitted model begins with
OF_SLAVE = ("table", "damper")
LARGE = 0.05  # misfit of a model over its signal, from which on its parameters mean little
UNDETERMINED = 1e6  # times its lower end, from which on an interval says nothing
# of parameters of specimen models; those of others follow from their names
UNITS = {"push": "N", "pull": "N", "play": "m", "corner": "m"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `identify`."""
    cli.recording_argument(parser)
    parser.add_argument(
        "--part",
        choices=PARTS,
        help="the part (default: that of the bench test; in other recordings all that can be identified)",
    )
    parser.add_argument(
        "--fit",
        metavar="MODEL",
        help="fit this hysteretic model to the column too (clough, bwbn, …; default: the plan's)",
    )
    parser.add_argument(
        "--plan",
        metavar="PLAN",
        help="fit the parameters of your own kind of laboratory in this plan, whose class is run",
    )
    parser.add_argument(
        "--max-force",
        metavar="N",
        help="use only rows of the column whose force is at most so large, in newtons or with a unit as in '40 kN'",
    )
    cli.json_argument(parser, "write the report as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Identify, and report."""
    with Progress("identifying") as progress:
        reports = identified(args, progress.tell)
    if args.json:
        sys.stdout.write(json.dumps({"file": str(args.file), "parts": reports}) + "\n")
    else:
        lawful = any(is_law(report) for report in reports)
        for report in law_first(reports):
            show(report, beside_law=lawful and report["part"] == "column")
    return 0


def identified(args: argparse.Namespace, tell: Tell) -> list[dict[str, Any]]:
    """The reports on all parts that are asked for; raises InputError where there is none."""
    from common.recording.reader import read
    from report.facts.force_range import most_force
    from report.facts.identification import identify, part_of, possible

    recording, most = read(args.file), most_force(args.max_force)
    if args.plan:
        if args.max_force:
            raise InputError("--max-force is for the force of a column: leave it out, or leave out --plan.")
        return devices(recording, args.plan, tell)
    reports = []
    roles = recording.roles or (MASTER,)
    for role in roles:
        view = recording.of(role) if recording.roles else recording
        tested = args.part or part_of(view)
        parts = possible(view) if tested in ("", "target") else [tested]
        own = [part for part in parts if role == roles[0] or part in OF_SLAVE]
        for part in own:
            tell(part, 0, 0)
            reports.append(identify(view, part, most) | named(part, role))
    if not reports:
        raise InputError(
            f"{args.file} does not hold inputs and outputs of any part: see rths inspect {args.file}, and give "
            "--plan PLAN for a kind of laboratory of your own."
        )
    parts = [report["part"] for report in reports]
    if args.max_force and not (args.fit or "column" in parts):
        raise InputError(
            f"--max-force is for the force of a column, and none of {args.file} can be identified: leave it out."
        )
    model = args.fit or planned_model(recording, parts)
    tell(f"column, model {model}" if model else "", 0, 0)
    return reports + ([fitted(recording, model, most)] if model else [])


def law_first(reports: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The reports in the order in which they are printed: a law of the column before the spring beside it.

    A law that is a spring itself stays last: it says less than the spring's report.
    """
    laws = [report for report in reports if is_law(report)]
    others = [report for report in reports if not is_law(report)]
    place = next((k for k, report in enumerate(others) if report["part"] == "column"), len(others))
    return [*others[:place], *laws, *others[place:]]


def is_law(report: dict[str, Any]) -> bool:
    """Whether a report is on a law that is more than a spring."""
    part = str(report["part"])
    return part.startswith(LAW) and part != f"{LAW}linear"


def planned_model(recording: Any, parts: list[str]) -> str:
    """The model of a specimen that the plan has for the column, where that was identified and can be fitted."""
    from models.specimens.fit import FREE
    from report.facts.laboratories import plan_of

    plan = plan_of(recording)
    model = plan.column.model if plan is not None and "column" in parts else ""
    return model if model in FREE else ""


def devices(recording: Any, plan_name: str, tell: Tell) -> list[dict[str, Any]]:
    """The reports on the laboratories of the user's own kinds; raises InputError where the plan has none."""
    from common.plan import read as plans
    from laboratories.device import Device
    from laboratories.kinds import kinds_of
    from report.facts.identification import of_device

    plan = plans.load(cli.plan_path(plan_name))
    own = {role: kind for role, kind in kinds_of(plan).items() if isinstance(kind, Device)}
    if not own:
        raise InputError(f"The plan {plan_name} has no kind of laboratory of your own: leave out --plan.")
    reports = []
    for role, kind in own.items():
        tell(kind.says, 0, 0)
        if report := of_device(recording, plan.of(role), role, kind):
            reports.append(report)
    if not reports:
        raise InputError(
            f"{recording.path} lacks the inputs and outputs of the {', the '.join(k.says for k in own.values())}: "
            "record them with rths bench target."
        )
    return reports


def named(part: str, role: str) -> dict[str, str]:
    """The part under the name of its slave, where that has one."""
    return {"part": f"{part}.{name_of(role)}"} if name_of(role) and part in OF_SLAVE else {}


def fitted(recording: Any, model: str, most: float) -> dict[str, Any]:
    """A hysteretic model fitted to the column's force in rows where that is at most as large, N."""
    from models.specimens.fit import fit
    from report.facts.force_range import said, within

    columns = recording.columns.get("master", {})
    if not {"column_displacement", "column_force"} <= columns.keys():
        raise InputError(f"{recording.path} has no column_displacement and column_force to fit '{model}' to.")
    force = columns["column_force"]
    used = within(recording, force, most)
    found = fit(model, columns["column_displacement"], force, used=used)
    parameters = {
        name: {"value": value} | determined(*found.intervals[name]) | {"unit": unit_of(name)}
        for name, value in found.parameters.items()
    }
    return {
        "part": f"{LAW}{model}",
        "parameters": parameters,
        "nrmse": found.nrmse,
        **said(used, most),
    }


def determined(low: float, high: float) -> dict[str, float | None]:
    """The ends of an interval, none where the motion does not determine the parameter."""
    known = not 0.0 < low * UNDETERMINED < high
    return {"low": low if known else None, "high": high if known else None}


def unit_of(name: str) -> str:
    """The unit of a specimen model's parameter."""
    return "N/m" if name == "stiffness" else UNITS.get(name, "m" if name.endswith("displacement") else "")


def show(report: dict[str, Any], *, beside_law: bool) -> None:
    """One part's report as text; a spring `beside_law` leaves what the law describes."""
    report = all_shown(report)
    from report.text.terminal import table

    sys.stdout.write(f"\n{report['part']}\n")
    rows = [["parameter", "value", "95 % interval", "unit", "by"]]
    for method, key in (("least squares", "parameters"), ("tangent", "tangent")):
        rows += [
            [name, f"{item['value']:.6g}", ends(item["low"], item["high"]), item["unit"], method]
            for name, item in report.get(key, {}).items()
        ]
    table(rows)
    if "model" in report:
        sys.stdout.write(f"parameters are those of the {report['model']}\n")
    if left := report.get("left_out"):
        sys.stdout.write(
            f"left out, as their force is above {left['max_force']:g} N: {left['rows']} of {left['of']} rows\n"
        )
    if "nrmse" in report:
        sys.stdout.write(f"misfit (NRMSE): {misfit(report['nrmse'])}\n")
        sys.stdout.write(remark(report["nrmse"], beside_law=beside_law))
    if "bandwidth" in report:
        band = report["bandwidth"]
        sys.stdout.write(
            f"bandwidth: −3 dB at {band['half_power']:.2f} Hz, −90° at {band['quarter_turn']:.2f} Hz; "
            f"delay at low frequency {band['delay'] * 1e3:.2f} ms\n"
        )
    if "cycles" in report:
        show_cycles(report["cycles"])


def ends(low: float | None, high: float | None) -> str:
    """An interval, in words where the motion does not determine the parameter."""
    return "not determined" if low is None or high is None else f"{low:.6g} to {high:.6g}"


def misfit(value: Any) -> str:
    """One misfit, or one per signal."""
    if isinstance(value, dict):
        return ", ".join(f"{name} {number:.4f}" for name, number in value.items())
    return f"{value:.4f}"


def remark(value: Any, *, beside_law: bool) -> str:
    """A sentence on a model that leaves much of a signal, empty for one that does not."""
    missed = value if isinstance(value, dict) else {"the signal": value}
    worst = max(missed, key=lambda name: missed[name])
    if missed[worst] < LARGE:
        return ""
    if beside_law:
        return f"A spring leaves {100.0 * missed[worst]:.0f} % of {worst}, which the model above describes or leaves.\n"
    return (
        f"The model leaves {100.0 * missed[worst]:.0f} % of {worst}: the part does something else as well, so that the "
        "intervals do not hold; rths diagnose looks for what it is.\n"
    )


def show_cycles(cycles: list[dict[str, Any]]) -> None:
    """Secant stiffness, dissipated energy and equivalent damping of every cycle."""
    from report.text.terminal import table

    rows = [["cycle", "amplitude, mm", "secant, N/m", "area, J", "equivalent damping, %"]]
    rows += [
        [
            str(number),
            f"{cycle['amplitude'] * 1e3:.3f}",
            f"{cycle['stiffness']:.5g}",
            f"{cycle['area']:.3f}",
            f"{cycle['damping_ratio'] * 100:.3f}",
        ]
        for number, cycle in enumerate(cycles, 1)
    ]
    sys.stdout.write("\n")
    table(rows)
