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
OF_SLAVE = ("table", "damper")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `identify`."""
    cli.recording_argument(parser)
    parser.add_argument(
        "--part",
        choices=PARTS,
        help="the part (default: that of the bench test; in other recordings all that can be identified)",
    )
    parser.add_argument(
        "--fit", metavar="MODEL", help="fit this hysteretic model to the column too (clough, bwbn, …)"
    )
    parser.add_argument(
        "--plan",
        metavar="PLAN",
        help="fit the parameters of your own kind of laboratory in this plan, whose class is run",
    )
    cli.json_argument(parser, "write the report as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Identify, and report."""
    with Progress("identifying") as progress:
        reports = identified(args, progress.tell)
    if args.json:
        sys.stdout.write(json.dumps({"file": str(args.file), "parts": reports}) + "\n")
    else:
        for report in reports:
            show(report)
    return 0


def identified(args: argparse.Namespace, tell: Tell) -> list[dict[str, Any]]:
    """The reports on all parts that are asked for; raises InputError where there is none."""
    from common.recording.reader import read
    from report.facts.identification import identify, part_of, possible

    recording = read(args.file)
    if args.plan:
        return devices(recording, args.plan, tell)
    tell(f"column, model {args.fit}" if args.fit else "", 0, 0)
    models = [fitted(recording, args.fit)] if args.fit else []
    reports = []
    roles = recording.roles or (MASTER,)
    for role in roles:
        view = recording.of(role) if recording.roles else recording
        tested = args.part or part_of(view)
        parts = possible(view) if tested in ("", "target") else [tested]
        own = [part for part in parts if role == roles[0] or part in OF_SLAVE]
        for part in own:
            tell(part, 0, 0)
            reports.append(identify(view, part) | named(part, role))
    if not reports:
        raise InputError(
            f"{args.file} does not hold inputs and outputs of any part: see rths inspect {args.file}, and give "
            "--plan PLAN for a kind of laboratory of your own."
        )
    return reports + models


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


def fitted(recording: Any, model: str) -> dict[str, Any]:
    """A hysteretic model fitted to the column's force."""
    from models.specimens.fit import fit

    columns = recording.columns.get("master", {})
    if not {"column_displacement", "column_force"} <= columns.keys():
        raise InputError(f"{recording.path} has no column_displacement and column_force to fit '{model}' to.")
    found = fit(model, columns["column_displacement"], columns["column_force"])
    parameters = {
        name: {"value": value, "low": found.intervals[name][0], "high": found.intervals[name][1], "unit": ""}
        for name, value in found.parameters.items()
    }
    return {"part": f"column, model {model}", "parameters": parameters, "nrmse": found.nrmse}


def show(report: dict[str, Any]) -> None:
    """One part's report as text."""
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
    if "nrmse" in report:
        sys.stdout.write(f"misfit (NRMSE): {misfit(report['nrmse'])}\n")
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
