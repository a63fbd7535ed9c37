"""What the rigs do: displacements beside their targets, the column's hysteresis loop, the damper's stroke and force."""

from __future__ import annotations

from typing import Any

from report.live.chart import Curve, draw, history, plot
from report.live.stream import Streams
from report.pictures.figure import COLOURS


def motions(streams: Streams, window: float | None) -> dict[str, Any]:
    """The plots of both laboratories by name, of the last `window` s, or of the whole test."""
    part = "" if window is None else f" of the last {window:g} s"
    loop = plot(f"column: hysteresis{part}", "displacement, mm", "force, kN", ("linear", "linear"))
    draw(
        loop,
        streams.master,
        "column_displacement",
        (Curve("column_force", "measured", COLOURS[0], width=1.0),),
    )
    stroke = (Curve("damper_stroke", "measured", COLOURS[2]),)
    force = (Curve("damper_force", "measured", COLOURS[3]),)
    return {
        "column": history(
            "column: target and measured",
            "displacement, mm",
            streams.master,
            beside_target("column_target", "column_displacement"),
            window,
        ),
        "table": history(
            "shaking table: target and measured",
            "displacement, mm",
            streams.slave,
            beside_target("table_target", "table_displacement"),
            window,
        ),
        "hysteresis": loop,
        "stroke": history("damper: stroke", "stroke, mm", streams.slave, stroke, window),
        "force": history("damper: force on the table", "force, N", streams.slave, force, window),
    }


def beside_target(target: str, measured: str) -> tuple[Curve, Curve]:
    """A measured signal and its target, told apart by more than their colours."""
    return Curve(target, "target", COLOURS[1], "dashed", 2.0), Curve(measured, "measured", COLOURS[0])
