"""The evidence behind a report: series, spectra, curves and tables that pages draw."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from common.recording.outcome import outcome
from diagnosis.findings import where
from diagnosis.fits import fitting
from diagnosis.fits.ceilings import ceilings, unknown
from diagnosis.fits.search import remaining
from diagnosis.paths import force_path, paths
from diagnosis.signals import windows
from models.effects import CATALOGUE
from models.loop import closed_loop
from models.registry import Array

if TYPE_CHECKING:
    from diagnosis.diagnose import Diagnosis
    from diagnosis.findings.how_far import HowFar
    from diagnosis.findings.verdict import Verdict
    from diagnosis.findings.where import Trace

SHOWN = 6.0  # s of a history
POINTS = 1500  # of a series at most
COORDINATES = {  # natural coordinates of a site: abscissa and ordinate
    "actuator": ("actuator_command", "column_displacement"),
    "column": ("column_displacement", "column_force"),
    "table": ("table_command", "table_displacement"),
    "damper": ("damper_stroke", "damper_force"),
}
UNITS = {
    "actuator_command": "m",
    "column_displacement": "m",
    "column_force": "N",
    "table_command": "m",
    "table_displacement": "m",
    "table_acceleration": "m/s²",
    "damper_stroke": "m",
    "damper_force": "N",
    "ground_acceleration": "m/s²",
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s²",
}


def details(found: Diagnosis, far: HowFar, which: list[dict[str, Any]]) -> dict[str, Any]:
    """Everything that a page shows beside the report itself."""
    record = found.record
    summary = record.run.metadata.get("summary", {})
    motion = record.run.metadata.get("ground_motion", {})
    return {
        "test": {
            "name": record.plan.test.name,
            "duration": record.ticks * record.plan.test.interval,
            "interval": record.plan.test.interval,
            "ticks": record.ticks,
            "motion": (
                f"{motion['record']}, scaled by {motion.get('scale', '?')}"
                if "record" in motion
                else "no ground motion recorded"
            ),
            "outcome": outcome(summary),
        },
        "parts": [part(found, trace) for trace in far.traces if trace.series.size],
        "paths": paths(record, nominal_signals(found)),
        "force_path": force_path(record),
        "loop_shares": far.loop_shares,
        "candidates": [candidate(found, entry) for entry in which if entry["effects"]],
        "ceiling": ceilings(found),
        "curves": [item for verdict in found.verdicts for item in curves(found, verdict)],
        "waterfall": far.waterfall,
        "histories": far.histories,
        "unknown": unknown(found),
        "remaining": {
            "overall": far.summary["after"],
            "where": [
                {
                    "site": where.unexplained(item.search.data, item.search.chosen).site,
                    "residual_to_noise": remaining(item.search.chosen),
                }
                for item in found.verdicts
                if remaining(item.search.chosen) > 0.0
            ],
        },
    }


def nominal_signals(found: Diagnosis) -> dict[str, Array] | None:
    """Signals of the closed loop of nominal models, None where there is no loop."""
    record = found.record
    if record.ground is None or not record.has("displacement", "column_target"):
        return None
    plan = record.plan.with_ticks(record.ticks)
    rollout = closed_loop.simulate(plan, record.ground)
    return closed_loop.signals(plan, rollout) if rollout.finite else None


def strongest(series: Array, interval: float) -> slice:
    """The few seconds in which a series is largest."""
    length = min(series.size, max(2, round(SHOWN / interval)))
    energy = np.cumsum(np.append(0.0, series**2))
    start = int(np.argmax(energy[length:] - energy[:-length]))
    return slice(start, start + length, max(1, length // POINTS))


def numbers(values: Array) -> list[float]:
    """Values for JSON, five digits each."""
    return [float(f"{value:.5g}") for value in values]


def part(found: Diagnosis, trace: Trace) -> dict[str, Any]:
    """Signals of the part that shows a site, measured and predicted, and its residual over time and frequency."""
    interval = found.record.plan.test.interval
    verdict = next(item for item in found.verdicts if trace.signal in item.search.data.part.signals)
    data, fit = verdict.search.data, verdict.search.chosen
    place = data.part.signals.index(trace.signal)
    shown = strongest(trace.series, interval)
    bare = data.part.predict(fitting.lay(data, fit.z, {}))[:, place]
    whole = data.part.predict(fitting.lay(data, fit.z, fit.values))[:, place]
    measured = data.part.measured[:, place]
    over = windows.windows(trace.series, 1.0, interval)
    spectrum = windows.bands(trace.series * trace.sigma, float(data.white[place]), interval)
    keep = spectrum.frequency <= 60.0
    amplitude, ratio = windows.by_amplitude(trace.series, measured, 1.0, 8)
    return {
        "site": trace.site,
        "signals": [
            {
                "signal": trace.signal,
                "unit": UNITS.get(trace.signal, ""),
                "residual_rms": float(np.sqrt(np.mean((measured - bare) ** 2))),
                "noise_floor": trace.sigma,
                "t": numbers(found.record.time[shown]),
                "measured": numbers(measured[shown]),
                "nominal": numbers(bare[shown]),
                "corrected": numbers(whole[shown]),
            }
        ],
        "windows": {"t": numbers(over.t), "ratio": numbers(over.ratio)},
        "bands": {
            "frequency": numbers(spectrum.frequency[keep]),
            "residual": numbers(spectrum.residual[keep]),
            "noise": numbers(np.broadcast_to(spectrum.noise, spectrum.residual.shape)[keep]),
        },
        "amplitudes": {"amplitude": numbers(amplitude), "ratio": numbers(ratio)},
    }


def candidate(found: Diagnosis, entry: dict[str, Any]) -> dict[str, Any]:
    """A line of `which` with the evidence for and against it."""
    names = tuple(entry["effects"])
    kinds = {CATALOGUE[name].kind for name in names}
    explained, against = [], []
    for verdict in found.verdicts:
        own = {name for name in names if name in {item.name for item in verdict.search.data.part.candidates}}
        for fit in (verdict.search.chosen, *verdict.search.alternatives):
            if set(fit.names) == own and own:
                before = fitting.excess(verdict.search.commissioned)
                explained.append(1.0 - fitting.excess(fit) / before if before else 0.0)
                if (left := remaining(fit)) > 0.3:
                    against.append(
                        f"leaves a residual of {left:.1f} times the noise in {verdict.search.data.part.name}"
                    )
                break
    share = float(np.mean(explained)) if explained else 1.0
    return {
        "effects": list(names),
        "kind": "measurement" if kinds == {"measurement"} else "physics",
        "probability": entry["probability"],
        "explained": share,
        "score": entry["held_out_score"],
        "parameters": entry["parameters"],
        "for": f"explains {100 * share:.1f} % of the energy of its part's gap",
        "against": "; ".join(against),
        "on_bound": [],
    }


def curves(found: Diagnosis, verdict: Verdict) -> list[dict[str, Any]]:
    """Hysteresis or scatter of each site found, in its natural coordinates."""
    data, fit = verdict.search.data, verdict.search.chosen
    interval, result = found.record.plan.test.interval, []
    for trace in where.traces(data, fit):
        pair = COORDINATES.get(trace.site)
        if pair is None or not found.record.has(*pair) or pair[1] not in data.part.signals:
            continue
        place = data.part.signals.index(pair[1])
        shown = strongest(trace.series, interval)
        own = {name: values for name, values in fit.values.items() if CATALOGUE[name].site != trace.site}
        before = data.part.predict(fitting.lay(data, fit.z, own))[:, place]
        after = data.part.predict(fitting.lay(data, fit.z, fit.values))[:, place]
        result.append(
            {
                "title": f"{trace.site}: {pair[1].replace('_', ' ')} over {pair[0].replace('_', ' ')}",
                "x": {
                    "label": f"{pair[0].replace('_', ' ')} ({UNITS[pair[0]]})",
                    "values": numbers(found.record.signals[pair[0]][shown]),
                },
                "y": {"label": f"{pair[1].replace('_', ' ')} ({UNITS[pair[1]]})"},
                "measured": numbers(data.part.measured[shown, place]),
                "before": numbers(before[shown]),
                "after": numbers(after[shown]),
            }
        )
    return result
