"""Parts of realistic reports."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Report = dict[str, Any]
Values = NDArray[np.float64]

T = np.arange(2.0, 8.0, 0.004)
RNG = np.random.default_rng(3)


def listed(values: Values) -> list[float]:
    return [float(value) for value in values]


def noisy(values: Values, size: float) -> Values:
    return values + size * RNG.standard_normal(values.size)


def stroke(t: Values = T) -> Values:
    found: Values = 0.045 * np.sin(2 * np.pi * 1.9 * t) * np.sin(0.5 * t) ** 2
    return found


def velocity(t: Values = T) -> Values:
    found: Values = np.gradient(stroke(t), t)
    return found


def bare(status: str) -> Report:
    """A report whose diagnosis determined nothing."""
    return {
        "version": 1,
        "status": status,
        "tolerances": {},
        "gap": {"signals": {}, "overall": None, "overall_noise_floor": None},
        "where": [],
        "which": [],
        "equivalent": [],
        "how_far": far(None, None, None),
        "not_exercised": [],
        "next_test": "",
        "warnings": [],
    }


def path(
    delay: float, amplitude: float, points: float, nominal_delay: float, nominal_points: float
) -> Report:
    return {
        "delay": delay,
        "amplitude": amplitude,
        "damping_points": points,
        "nominal_delay": nominal_delay,
        "nominal_damping_points": nominal_points,
    }


def place(
    site: str,
    share: float,
    interval: list[float],
    ratio: float,
    when: list[list[float]],
    band: list[float] | None,
) -> Report:
    return {
        "site": site,
        "share": share,
        "share_interval": interval,
        "residual_to_noise": ratio,
        "when": when,
        "frequency_band": band,
    }


def far(before: float | None, after: float | None, closed: float | None, interval: Any = None) -> Report:
    """How far a gap closes on withheld windows; nothing was determined where no gap is given."""
    return {
        "before": before,
        "after": after,
        "closed": closed,
        "closed_interval": interval,
        "noise_floor": None if before is None else 0.0061,
        "judged_on": None if before is None else "interleaved (interpolation)",
    }


def history(name: str, unit: str, recorded: Values, before: Values, after: Values) -> Report:
    curves = {"t": T, "recorded": recorded, "before": before, "after": after}
    return {"signal": name, "unit": unit} | {key: listed(curve) for key, curve in curves.items()}


def gap(size: float) -> Report:
    floors = {
        "column_displacement": (0.3, 0.0021, 1.2e-4, "m"),
        "column_force": (0.35, 0.0030, 1400.0, "N"),
        "table_acceleration": (0.6, 0.0112, 0.11, "m/s²"),
        "damper_force": (1.0, 0.0042, 6.4, "N"),
        "damper_stroke": (0.8, 0.0001, 2.1e-3, "m"),
        "table_displacement": (0.2, 0.0012, 1.1e-4, "m"),
    }
    return {
        "signals": {
            name: {"nrmse": size * part, "noise_floor": floor, "peak_error": size * 10 * peak, "unit": unit}
            for name, (part, floor, peak, unit) in floors.items()
        },
        "overall": 0.7 * size,
        "overall_noise_floor": 0.0061,
    }


def facts_of_test() -> Report:
    return {
        "name": "el_centro_10",
        "duration": 40.0,
        "interval": 0.002,
        "ticks": 20000,
        "file": "el_centro_10-2026-11-21.mcap",
        "motion": "El Centro 1940 NS, 10 %",
        "outcome": "completed",
    }


def part(site: str, strength: float, signals: list[Report]) -> Report:
    centres = np.arange(0.5, 40.0, 1.0)
    frequency = np.linspace(0.2, 20.0, 120)
    peak = strength * np.exp(-(((frequency - 2.0) / 0.9) ** 2))
    return {
        "site": site,
        "signals": signals,
        "windows": {
            "t": listed(centres),
            "ratio": listed(1.0 + strength * np.exp(-centres / 8.0) * np.sin(centres) ** 2),
        },
        "bands": {
            "frequency": listed(frequency),
            "residual": listed(0.02 * (1.0 + peak) * (1.0 + 0.1 * RNG.random(frequency.size))),
            "noise": [0.02] * frequency.size,
        },
        "amplitudes": {
            "amplitude": [0.005, 0.01, 0.02, 0.03, 0.045],
            "ratio": listed(1.0 + strength * np.array([1.0, 0.9, 0.6, 0.5, 0.4])),
        },
    }


def signal(name: str, unit: str, true: Values, miss: Values, noise: float) -> Report:
    measured = noisy(true, noise)
    return {
        "signal": name,
        "unit": unit,
        "residual_rms": float(np.sqrt(np.mean((measured - true + miss) ** 2))),
        "noise_floor": noise,
        "t": listed(T),
        "measured": listed(measured),
        "nominal": listed(true - miss),
        "corrected": listed(true - 0.03 * miss),
    }


def parts() -> list[Report]:
    friction = 3.1 * np.tanh(velocity() / 0.01)
    force = 56.8 * stroke() + 60.0 * velocity() + friction
    column = 30e3 * np.sin(2 * np.pi * 2.0 * T) * np.exp(-0.1 * T)
    return [
        part("damper", 14.0, [signal("damper_force", "N", force, friction, 0.2)]),
        part("column", 0.5, [signal("column_force", "N", column, 0.002 * column, 100.0)]),
        part("table", 0.2, []),
    ]


def curve() -> Report:
    x = velocity()
    y = 60.0 * x
    friction = 3.1 * np.tanh(x / 0.01)
    return {
        "title": "Damper force against stroke velocity, spring force taken off",
        "x": {"label": "stroke velocity, m/s", "values": listed(x)},
        "y": {"label": "force, N"},
        "measured": listed(noisy(y + friction, 0.2)),
        "before": listed(y),
        "after": listed(y + friction),
    }


def candidate(names: list[str], probability: float, score: float, **more: Any) -> Report:
    return {
        "effects": names,
        "kind": "measurement" if all(name.startswith("sensor.") for name in names) else "physics",
        "probability": probability,
        "explained": 0.97 * probability**0.1,
        "score": score,
        "parameters": {},
        "for": "the residual keeps its size while the stroke grows, and turns its sign with the velocity",
        "against": "",
        "on_bound": [],
    } | more


def value(number: float, lower: float, upper: float, unit: str) -> Report:
    return {"value": number, "interval": [lower, upper], "unit": unit}


def details() -> Report:
    shape = np.sin(2 * np.pi * 2.0 * T) * np.exp(-0.1 * T)
    friction = {"damper.friction": {"force": value(3.1, 2.9, 3.3, "N")}}
    lag = {"damper.motor_lag": {"time_constant": value(0.0071, 0.0064, 0.0078, "s")}}
    falsified = {"sensor.damper_force.gain": {"factor": value(1.08, 1.071, 1.089, "–")}}
    return {
        "test": facts_of_test(),
        "laboratories": laboratories(),
        "parts": parts(),
        "paths": {
            "command": path(0.0012, 0.998, -0.19, 0.0004, -0.06),
            "force": path(0.0, 1.001, 0.0, 0.0, 0.0),
            "exchange": path(0.0021, 1.0, -0.03, 0.002, -0.03),
        },
        "loop_shares": [
            {"site": "damper", "shapley": 0.9, "interval": [0.85, 0.94], "first_in": 0.92, "last_out": 0.88},
            {
                "site": "actuator",
                "shapley": 0.1,
                "interval": [0.06, 0.15],
                "first_in": 0.12,
                "last_out": 0.08,
            },
        ],
        "candidates": [
            candidate(["damper.friction"], 0.97, 0.0, parameters=friction),
            candidate(
                ["damper.motor_lag", "damper.viscous"],
                0.02,
                8.3,
                parameters=lag | {"damper.viscous": {"factor": value(1.9, 1.6, 3.0, "–")}},
                against="would grow with the frequency, which the residual does not",
                on_bound=["factor"],
            ),
            candidate(["sensor.damper_force.gain"], 0.004, -31.0, parameters=falsified),
        ],
        "ceiling": [{"site": "damper", "flexible": 0.985, "catalogue": 0.971}],
        "curves": [curve()],
        "waterfall": [
            {"label": "nominal models", "value": 0.041},
            {"label": "parameters within tolerances", "value": 0.034},
            {"label": "+ damper.friction", "value": 0.0071},
            {"label": "noise floor", "value": 0.0061},
        ],
        "histories": [
            history("damper_force", "N", noisy(76.0 * shape, 0.2), 70.0 * np.roll(shape, 6), 75.6 * shape),
            history(
                "column_displacement", "m", noisy(2.4e-3 * shape, 5e-6), 2.3e-3 * shape, 2.398e-3 * shape
            ),
        ],
        "next": [
            {
                "test": "rths bench damper, sweep at a fifth of the force",
                "separation": 6.2,
                "pair": ["damper.friction", "damper.motor_lag"],
                "why": "friction is largest against the motion where the stroke is small",
            }
        ],
        "remaining": {"overall": 0.0071, "where": [{"site": "actuator", "residual_to_noise": 1.6}]},
    }


def laboratories() -> list[dict[str, Any]]:
    """The laboratories of the default test."""
    return [
        {
            "role": "master",
            "sites": ["actuator", "column"],
            "sensors": ["sensor.column_displacement", "sensor.column_force"],
        },
        {
            "role": "slave",
            "sites": ["table", "damper"],
            "sensors": [
                "sensor.table_displacement",
                "sensor.table_acceleration",
                "sensor.damper_stroke",
                "sensor.damper_force",
            ],
        },
    ]
