"""Plots of the rigs: each laboratory's motion beside its target, forces over motions or over time."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from common.roles import MASTER
from laboratories.kind import Hysteresis
from report.facts.laboratories import LaboratoryFacts, alike
from report.live.chart import ChartCurve, draw, history, plot
from report.live.stream import Stream, Streams
from report.pictures.figure import COLOURS


class Plot(NamedTuple):
    """A plot of a laboratory."""

    lab: LaboratoryFacts
    figure: Any


def motions(streams: Streams, labs: Iterable[LaboratoryFacts], window: float | None) -> dict[str, Plot]:
    """The plots of the laboratories by name, of the last `window` s, or of the whole test.

    Slaves whose laboratories have the same signals share their plots. What deforms by the motion that the laboratory
    imposes is shown by its loop; a motion of its own, as a damper's stroke, over time.
    """
    found: dict[str, Plot] = {}
    each = [labs[0] for labs in alike(labs)]
    for lab in each:
        add(found, lab.name, lab, beside_target(streams, lab, window))
    for lab in each:
        stream = stream_of(streams, lab)
        for loop in lab.pictured.loops:
            name, up = loop.name + lab.letter, f"force, {loop.unit}"
            if loop.motion == lab.channels.position:
                add(found, f"hysteresis{lab.letter}", lab, hysteresis(stream, name, loop, window))
                continue
            stroke = (ChartCurve(loop.motion, "measured", COLOURS[2]),)
            force = (ChartCurve(loop.force, "measured", COLOURS[3]),)
            title = f"{name}: {loop.across}"
            add(found, loop.across, lab, history(title, f"{loop.across}, mm", stream, stroke, window))
            add(found, "force", lab, history(f"{name}: force", up, stream, force, window))
        for signal in lab.channels.measured:
            if signal.name in lab.pictured.also:
                unit = "mm" if signal.unit == "m" else signal.unit
                curve = (ChartCurve(signal.name, "measured", COLOURS[4]),)
                title = signal.name.replace("_", " ") + lab.letter
                add(found, signal.name, lab, history(title, unit, stream, curve, window))
    return found


def looks(labs: Iterable[LaboratoryFacts]) -> list[Any]:
    """The properties of laboratories by which their plots differ."""
    return [(lab.topic == MASTER, lab.channels, lab.letter) for lab, *_ in alike(labs)]


def add(found: dict[str, Plot], name: str, lab: LaboratoryFacts, figure: Any) -> None:
    """Add a plot under a name that no other has."""
    while name in found:
        name = f"{name} of {lab.name}"
    found[name] = Plot(lab, figure)


def stream_of(streams: Streams, lab: LaboratoryFacts) -> Stream:
    """The stream that holds a laboratory's signals."""
    return streams.master if lab.topic == MASTER else streams.slave


def beside_target(streams: Streams, lab: LaboratoryFacts, window: float | None) -> Any:
    """A measured motion and its target, told apart by more than their colours."""
    curves = (
        ChartCurve(lab.channels.target.name, "target", COLOURS[1], "dashed", 2.0),
        ChartCurve(lab.channels.position, "measured", COLOURS[0]),
    )
    title, up = f"{lab.name}: target and measured", f"{lab.pictured.position}, mm"
    return history(title, up, stream_of(streams, lab), curves, window)


def hysteresis(stream: Stream, name: str, loop: Hysteresis, window: float | None) -> Any:
    """A force over its motion."""
    part = "" if window is None else f" of the last {window:g} s"
    found = plot(
        f"{name}: hysteresis{part}", f"{loop.across}, mm", f"force, {loop.unit}", ("linear", "linear")
    )
    draw(found, stream, loop.motion, (ChartCurve(loop.force, "measured", COLOURS[0], width=1.0),))
    return found
