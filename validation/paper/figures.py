"""Counterparts of the paper's figures, from the recordings of the experiments."""

from __future__ import annotations

from typing import Any

from common.recording.run import Run
from report.facts.identification import identify, segments, step_ticks
from report.pictures.figure import TEXT
from report.pictures.layout import legend_above
from validation.paper.experiments import DELAYS, PaperEvidence
from validation.proof import ProofFigure


def window(run: Run, word: str, begin: float, end: float, interval: float) -> tuple[Any, dict[str, Any]]:
    """Times (s) since the beginning of a segment, and the master's columns, between `begin` and `end` s of it."""
    start = next(segment.begin for segment in segments(run) if segment.name.startswith(word))
    part = slice(start + round(begin / interval), start + round(end / interval))
    columns = {name: values[part] for name, values in run.columns["master"].items()}
    return columns["t"] - start * interval, columns


def hysteresis(evidence: PaperEvidence, canvas: Any) -> None:
    """Fig. 4: force against drift angle."""
    axes = canvas.subplots(1, 2, sharey=True)
    for axis, name, title in zip(axes, ("column", "rc-column"), ("linear", "Clough, cracking"), strict=True):
        columns = evidence.benches[name].columns["master"]
        axis.plot(columns["column_displacement"] / 0.75 * 1e3, columns["column_force"] * 1e-3, linewidth=0.6)
        axis.set(xlabel="drift angle, 10⁻³ rad")
        axis.set_title(title, fontsize=TEXT)
    axes[0].set_ylabel("force, kN")


def delay(evidence: PaperEvidence, canvas: Any) -> None:
    """Fig. 6: commanded and measured displacement without compensation."""
    t, columns = window(evidence.benches["actuator"], "sine 2 Hz", 2.0, 3.5, evidence.default.test.interval)
    axis = canvas.subplots()
    axis.plot(t, columns["column_target"] * 1e3, label="commanded")
    axis.plot(t, columns["column_displacement"] * 1e3, "--", label="measured")
    axis.set(xlabel="time, s", ylabel="displacement, mm")
    legend_above(axis)


def step_response(evidence: PaperEvidence, canvas: Any) -> None:
    """Fig. 7: the step response and its tangent."""
    run, interval = evidence.benches["actuator"], evidence.default.test.interval
    piece = next(segment for segment in segments(run) if segment.name == "step")
    columns = run.columns["master"]
    begin = step_ticks(columns["actuator_command"], piece)[0]
    part = slice(begin - 25, begin + 125)
    t = (columns["t"][part] - begin * interval - 0.5 * interval) * 1e3
    height = piece.values["height"] * 1e3
    found = identify(run)["tangent"]
    dead, constant = found["delay"]["value"] * 1e3, found["time_constant"]["value"] * 1e3
    axis = canvas.subplots()
    axis.plot(t + 1e3 * interval, columns["actuator_command"][part] * 1e3, color="0.5", label="commanded")
    axis.plot(t, columns["column_displacement"][part] * 1e3, ".", markersize=3, label="measured")
    axis.plot([dead, dead + constant], [0.0, height], "k-", label="tangent, mean of all steps")
    axis.annotate(f"L {dead:.1f} ms", (dead, 0.0), (dead + 8, 0.35), arrowprops={"arrowstyle": "-"})
    axis.annotate(
        f"T {constant:.1f} ms",
        (dead + constant, height),
        (dead + constant + 55, height - 1.2),
        arrowprops={"arrowstyle": "-"},
    )
    axis.set(xlabel="time after the step, ms", ylabel="displacement, mm")
    legend_above(axis)


def sine(evidence: PaperEvidence, canvas: Any) -> None:
    """Fig. 10: a sine with and without compensation."""
    interval = evidence.default.test.interval
    t, raw = window(evidence.benches["actuator"], "sine 1 Hz", 2.0, 4.0, interval)
    _, better = window(evidence.benches["actuator-paper"], "sine 1 Hz", 2.0, 4.0, interval)
    axis = canvas.subplots()
    axis.plot(t, raw["column_target"] * 1e3, "k-", label="target")
    axis.plot(t, better["column_displacement"] * 1e3, "--", label="PID + Taylor")
    axis.plot(t, raw["column_displacement"] * 1e3, ":", label="uncompensated")
    axis.set(xlabel="time, s", ylabel="displacement, mm")
    legend_above(axis)


def random_wave(evidence: PaperEvidence, canvas: Any) -> None:
    """Fig. 11: a random wave behind PID."""
    t, columns = window(evidence.benches["actuator-pid"], "random", 5.0, 10.0, evidence.default.test.interval)
    axis = canvas.subplots()
    axis.plot(t, columns["column_target"] * 1e3, label="target")
    axis.plot(t, columns["column_displacement"] * 1e3, "--", label="measured, PID")
    axis.set(xlabel="time, s", ylabel="displacement, mm")
    legend_above(axis)


def two_histories(canvas: Any, curves: list[tuple[str, Any, Any, Any]], end: float) -> None:
    """Floor acceleration above, drift below; one curve each per (label, t, acceleration, drift)."""
    upper, lower = canvas.subplots(2, 1, sharex=True)
    for style, (label, t, acceleration, drift) in zip(("-", "--"), curves, strict=True):
        upper.plot(t, acceleration, style, label=label, linewidth=0.8)
        lower.plot(t, drift * 1e3, style, label=label, linewidth=0.8)
    upper.set(ylabel="floor acceleration\nm/s²", xlim=(0.0, end))
    lower.set(xlabel="time, s", ylabel="storey drift\nmm")
    legend_above(upper)


def test_and_simulation(evidence: PaperEvidence, canvas: Any) -> None:
    """Fig. 12: the test and the pure simulation at 10 %."""
    run, ideal = evidence.tests["pid-taylor"], evidence.simulations["ideal"]
    ratio = evidence.default.column.deformation_ratio
    measured = run.columns["master"]["column_displacement"] / ratio
    curves = [
        ("test", run.columns["slave"]["t"], run.columns["slave"]["table_acceleration"], measured),
        ("pure simulation", ideal["t"], ideal["absolute_acceleration"], ideal["displacement"]),
    ]
    two_histories(canvas, curves, 15.0)


def control(evidence: PaperEvidence, canvas: Any) -> None:
    """Fig. 13: with and without AMD at 20 %."""
    curves = []
    ratio = evidence.default.column.deformation_ratio
    for name, label in (("without-amd-20", "without AMD"), ("with-amd-20", "with AMD")):
        run = evidence.tests[name]
        drift = run.columns["master"]["column_displacement"] / ratio
        curves.append((label, run.columns["slave"]["t"], run.columns["slave"]["table_acceleration"], drift))
    two_histories(canvas, curves, 20.0)


def instability(evidence: PaperEvidence, canvas: Any) -> None:
    """The uncompensated loop until its limits stop it."""
    columns = evidence.tests["uncompensated"].columns["master"]
    axis = canvas.subplots()
    axis.plot(columns["t"], columns["displacement"] * 1e3, linewidth=0.7)
    axis.set(xlabel="time, s", ylabel="storey drift, mm")


def damping(evidence: PaperEvidence, canvas: Any) -> None:
    """Loss of damping by a delay."""
    axis = canvas.subplots()
    axis.plot(DELAYS * 1e3, evidence.damping_by_delay * 100.0, "o-", label="closed loop, free vibration")
    axis.plot(DELAYS * 1e3, 5.0 - 0.156 * DELAYS * 1e3, "k:", label="5.0 − 0.156 points per ms")
    axis.set(xlabel="delay of the actuator, ms", ylabel="apparent damping, %")
    legend_above(axis, columns=1)


FIGURES = (
    ProofFigure(
        "fig04-column.png",
        "Counterpart of Fig. 4: static loading of ±1.5 to ±7.5 mm, three cycles each; nominal and realistic column.",
        hysteresis,
    ),
    ProofFigure(
        "fig06-delay.png",
        "Counterpart of Fig. 6: commanded and measured displacement of the bare actuator, 2 Hz.",
        delay,
    ),
    ProofFigure(
        "fig07-step.png",
        "Counterpart of Fig. 7: step of 5 mm with the tangent at the inflection.",
        step_response,
    ),
    ProofFigure(
        "fig10-sine.png",
        "Counterpart of Fig. 10: sine of 1 Hz, with PID + Taylor (τ = 8.8 ms) and without compensation.",
        sine,
    ),
    ProofFigure("fig11-random.png", "Counterpart of Fig. 11: random wave below 3 Hz with PID.", random_wave),
    ProofFigure(
        "fig12-test-simulation.png",
        "Counterpart of Fig. 12: test and pure simulation, El Centro 10 %, AMD on, τ = 8.8 ms.",
        test_and_simulation,
    ),
    ProofFigure(
        "fig13-amd.png",
        "Counterpart of Fig. 13: test with and without AMD, El Centro 20 %, τ = 8.8 ms.",
        control,
    ),
    ProofFigure(
        "uncompensated.png",
        "Uncompensated closed loop without AMD, El Centro 10 %: it diverges until a limit stops it.",
        instability,
    ),
    ProofFigure(
        "damping-delay.png", "Apparent damping against a delay in the path of the actuator.", damping
    ),
)
