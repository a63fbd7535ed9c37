"""`rths simulate`: the closed loop of nominal models, or of the models of a reality, in one compiled rollout."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from common.plan.laboratory_tables import CompensatorTable, Control
from common.plan.plan import Plan, ideal
from common.terminal import cli, outputs
from report.text.progress import Progress

if TYPE_CHECKING:
    from loop.closed_loop import Rollout


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `simulate`."""
    cli.plan_arguments(parser)
    parser.add_argument(
        "--ideal", action="store_true", help="with transfer systems that follow at once, without compensation"
    )
    parser.add_argument("--uncompensated", action="store_true", help="without compensation of the actuator")
    parser.add_argument("--no-amd", action="store_true", help="without the damper")
    cli.reality_argument(parser)
    parser.add_argument("--noise", action="store_true", help="with the sensors' noise, from the plan's seed")
    cli.output_argument(parser, "FILE", "write the simulation as a recording")
    cli.force_argument(parser)
    cli.json_argument(parser, "write the summary as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Simulate; 1 where the loop left the plan's limits."""
    plan = adapted(cli.load_plan(args), args)
    if args.output:
        inputs = [cli.plan_path(args.plan), *([args.reality] if args.reality else [])]
        outputs.checked(args.output, args.force, inputs)
    with Progress("simulating") as progress:
        from loop import substructure

        motion = substructure.motion(plan)
        progress.tell(plan.test.name)
        columns, beyond_limit = rolled_out(plan, motion, args)
    summary = summarize(plan, columns, beyond_limit) | {"ground_motion": motion.describe()}
    if args.output:
        summary["file"] = str(args.output)
    stream = outputs.aside(args.output)
    if args.json:
        stream.write(json.dumps(summary) + "\n")
    else:
        show(plan, summary, stream)
    return 1 if summary["beyond_limit"] else 0


def rolled_out(plan: Plan, motion: Any, args: argparse.Namespace) -> tuple[dict[str, Any], str]:
    """Signals of the compiled rollout, which --output also writes, and a sentence on the first value beyond a limit."""
    from loop import substructure
    from loop.closed_loop import simulate
    from loop.of_reality import really
    from loop.signals import by_role, signals

    ground = substructure.ground_rows(plan, motion)
    if args.reality:
        rollout = really(cli.load_reality(args.reality, plan), noise=args.noise)
    else:
        rollout = simulate(plan, ground, seed=plan.test.seed if args.noise else None)
    if args.output:
        with outputs.writing(args.output, args.force) as path:
            write(path, plan, rollout, motion, ground)
    return signals(plan, rollout), beyond(plan, by_role(plan, rollout), rollout.ticks)


def adapted(plan: Plan, args: argparse.Namespace) -> Plan:
    """The plan with the options' changes."""
    if args.ideal:
        plan = ideal(plan)
    if args.uncompensated:
        plan = replace(plan, compensator=CompensatorTable("none", {}))
    if args.no_amd:
        plan = plan.everywhere(control=Control(amd=False, gain=plan.control.gain))
    return plan


def summarize(plan: Plan, columns: dict[str, Any], beyond_limit: str) -> dict[str, Any]:
    """Peaks, drifts of the storeys that laboratories follow, and a sentence on the first value beyond a limit."""
    import numpy as np

    from laboratories import kinds

    drifts = peak_drifts(plan, columns)
    rows = {row.name: row for topic in reversed(kinds.topics(plan).values()) for row in topic}
    peaks = {}
    for name, values in columns.items():
        unit = rows[name.rpartition(".")[2]].unit
        if unit not in ("", "s") and values.size:
            peaks[name] = {"peak": float(np.max(np.abs(values))), "unit": unit}
    return {
        "test": plan.test.name,
        "ticks": len(columns["t"]),
        "peak_drift": max(drifts.values(), default=None),
        "peak_drifts": drifts,
        "peaks": peaks,
        "beyond_limit": beyond_limit,
    }


def peak_drifts(plan: Plan, columns: dict[str, Any]) -> dict[int, float]:
    """Peak drift (m) of every storey whose drift a laboratory follows, by storey."""
    import numpy as np

    from loop.nominal import partition

    floors = columns["displacement"].reshape(len(columns["t"]), plan.storeys)
    return {
        coupling.place: float(np.max(np.abs(floors @ partition.drift_direction(plan, role)), initial=0.0))
        for role, coupling in partition.drifts(plan).items()
    }


def beyond(plan: Plan, columns: dict[str, dict[str, Any]], ticks: int) -> str:
    """A sentence on the first value beyond a limit of the plan, empty where there is none."""
    import numpy as np

    from loop.nominal import limited

    most = limited.most(plan)
    first = (ticks, "")
    for name, values in limited.magnitudes(plan, columns).items() if ticks else ():
        over = np.flatnonzero(~(values <= most[name]))
        if over.size and over[0] < first[0]:
            t = over[0] * plan.test.interval
            first = (
                int(over[0]),
                f"{name} is beyond its limit of {most[name]:g} from t = {t:.3f} s on: the loop is unstable.",
            )
    if not first[1] and ticks < plan.ticks:
        return f"the loop diverges: no finite number after t = {ticks * plan.test.interval:.3f} s."
    return first[1]


def show(plan: Plan, summary: dict[str, Any], stream: TextIO) -> None:
    """The summary as text."""
    from report.text.formats import reading
    from report.text.terminal import table

    stream.write(f"simulation of '{plan.test.name}', {summary['ticks']} ticks of {plan.test.interval:g} s\n")
    stream.write(f"ground motion: {summary['ground_motion']}, scaled by {plan.ground_motion.scale:g}\n\n")
    rows = [["signal", "peak"]]
    rows += [[name, reading(facts["peak"], facts["unit"])] for name, facts in summary["peaks"].items()]
    table(rows, stream)
    for storey, peak in summary["peak_drifts"].items():
        where = "the specimen's storey" if len(summary["peak_drifts"]) == 1 else f"storey {storey}"
        stream.write(f"peak drift of {where}: {reading(peak, 'm')}\n")
    if summary["beyond_limit"]:
        stream.write(summary["beyond_limit"][0].upper() + summary["beyond_limit"][1:] + "\n")
    if "file" in summary:
        stream.write(f"written to {summary['file']}\n")


def write(path: Path, plan: Plan, rollout: Rollout, motion: Any, ground: Any) -> None:
    """The simulation as a recording: the topics of master and slaves."""
    from loop.signals import rows
    from recorder import files

    recording = files.begin(path, plan, (motion, ground))
    for topic, values in rows(plan, rollout):
        at = plan.tick_ns(values[0])
        recording.add(topic, at, at, values)
    recording.close({"outcome": "simulation", "cause": "simulation of the closed loop"})
