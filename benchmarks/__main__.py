"""`python -m benchmarks [NAME …] [--json FILE]`: run all benchmarks or some; print a table and write JSON."""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from pathlib import Path

from benchmarks import BENCHMARKS
from benchmarks.result import BenchmarkFigure
from report.text.terminal import table


def machine() -> dict[str, str]:
    """The machine on which the figures were measured."""
    info = Path("/proc/cpuinfo")  # exists on Linux only
    lines = info.read_text().splitlines() if info.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if "model name" in line]
    return {
        "processor": models[0] if models else platform.processor(),
        "cores": str(len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count()),
        "python": platform.python_version(),
        "load": " ".join(f"{value:.2f}" for value in os.getloadavg()),
    }


def number(value: object) -> str:
    """The text of a number in the tables."""
    return "–" if value is None else f"{value:,.4g}" if isinstance(value, float) else str(value)


def row(figure: BenchmarkFigure) -> list[str]:
    """One line of the table."""
    met = {None: "", True: "met", False: "missed"}[figure.met]
    ratio = "" if figure.ratio is None else f"{figure.ratio:.3g} × {figure.peer}"
    return [
        figure.name,
        number(figure.best),
        number(figure.median),
        figure.unit,
        figure.target,
        met,
        ratio,
    ]


def main() -> int:
    """Run the benchmarks of the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"one or more of {', '.join(BENCHMARKS)} (default: all)"
    )
    parser.add_argument(
        "--quick", action="store_true", help="do the least work, to see whether the benchmarks run"
    )
    parser.add_argument(
        "--json",
        type=Path,
        default=Path("runs/benchmarks.json"),
        metavar="FILE",
        help="file for the figures (default: %(default)s)",
    )
    args = parser.parse_args()
    unknown = [name for name in args.names if name not in BENCHMARKS]
    if unknown:
        parser.error(f"unknown benchmark '{unknown[0]}': choose from {', '.join(BENCHMARKS)}")
    host = machine()
    figures = {name: BENCHMARKS[name](quick=args.quick) for name in args.names or BENCHMARKS}
    sys.stdout.write(", ".join(f"{name} {value}" for name, value in host.items()) + "\n\n")
    rows = [["figure", "best", "median", "unit", "target", "", "ratio of medians"]]
    table(rows + [row(figure) for found in figures.values() for figure in found])
    for figure in (each for several in figures.values() for each in several if each.points):
        sys.stdout.write(f"\n{figure.name}, all points\n")
        table(
            [
                list(figure.points[0]),
                *([number(value) for value in point.values()] for point in figure.points),
            ]
        )
    args.json.parent.mkdir(parents=True, exist_ok=True)
    plain = {name: [figure._asdict() for figure in found] for name, found in figures.items()}
    args.json.write_text(json.dumps({"machine": host, "figures": plain}, indent=1, allow_nan=False))
    sys.stdout.write(f"\nwritten to {args.json}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
