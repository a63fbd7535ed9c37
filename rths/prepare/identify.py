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
    model = args.fit or planned_model(recording, [report["part"] for report in reports])
    tell(f"column, model {model}" if model else "", 0, 0)
    return reports + ([fitted(recording, model)] if model else [])


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


def fitted(recording: Any, model: str) -> dict[str, Any]:
    """A hysteretic model fitted to the column's force."""
    from models.specimens.fit import fit

    columns = recording.columns.get("master", {})
    if not {"column_displacement", "column_force"} <= columns.keys():
        raise InputError(f"{recording.path} has no column_displacement and column_force to fit '{model}' to.")
    found = fit(model, columns["column_displacement"], columns["column_force"])
    parameters = {
        name: {"value": value} | determined(*found.intervals[name]) | {"unit": unit_of(name)}
        for name, value in found.parameters.items()
    }
    return {"part": f"column, model {model}", "parameters": parameters, "nrmse": found.nrmse}


def determined(low: float, high: float) -> dict[str, float | None]:
    """The ends of an interval, none where the motion does not determine the parameter."""
    known = not 0.0 < low * UNDETERMINED < high
    return {"low": low if known else None, "high": high if known else None}


def unit_of(name: str) -> str:
    """The unit of a specimen model's parameter."""
    return "N/m" if name == "stiffness" else UNITS.get(name, "m" if name.endswith("displacement") else "")


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
        sys.stdout.write(remark(report["nrmse"]))
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


def remark(value: Any) -> str:
    """A sentence on a model that leaves much of a signal, empty for one that does not."""
    missed = value if isinstance(value, dict) else {"the signal": value}
    worst = max(missed, key=lambda name: missed[name])
    if missed[worst] < LARGE:
        return ""
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
