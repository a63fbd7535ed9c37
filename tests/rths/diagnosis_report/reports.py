"""Realistic reports, in the form that a diagnosis writes."""

from __future__ import annotations

import json

import numpy as np

from tests.rths.diagnosis_report.pieces import (
    Report,
    T,
    bare,
    candidate,
    details,
    far,
    gap,
    listed,
    noisy,
    part,
    place,
    signal,
    value,
)


def explained() -> Report:
    return bare("explained") | {
        "verdict": (
            "91 % of the gap lies in the damper; best named cause: damper friction of 3.1 N (2.9 … 3.3), p > 99 %; "
            "adding it shrinks the gap from 3.4 % to 0.71 % on held-out windows (noise floor 0.61 %)."
        ),
        "tolerances": {
            "column.stiffness": {"factor": 1.011, "z": 0.55},
            "actuator.delay": {"factor": 1.034, "z": 1.7},
            "damper.mass": {"factor": 0.996, "z": -0.2},
        },
        "gap": gap(0.049),
        "where": [
            place("damper", 0.91, [0.86, 0.95], 14.2, [[2.1, 9.8], [14.0, 16.5]], [1.5, 3.0]),
            place("actuator", 0.06, [0.03, 0.09], 1.6, [], None),
            place("sensor.column_force", 0.03, [0.01, 0.05], 1.2, [], [0.0, 0.5]),
        ],
        "which": [
            {
                "effects": ["damper.friction"],
                "probability": 0.97,
                "parameters": {"damper.friction": {"force": value(3.1, 2.9, 3.3, "N")}},
                "held_out_score": 0.0,
            },
            {
                "effects": ["damper.motor_lag", "damper.viscous"],
                "probability": 0.02,
                "parameters": {
                    "damper.motor_lag": {"time_constant": value(0.0071, 0.0064, 0.0078, "s")},
                    "damper.viscous": {"factor": value(1.9, 1.6, 3.0, "–")},
                },
                "held_out_score": 8.3,
            },
        ],
        "equivalent": [["damper.friction", "table.friction"]],
        "how_far": far(0.034, 0.0071, 0.964, [0.94, 0.98]),
        "not_exercised": ["damper.stroke_stop", "actuator.velocity_limit", "column.pinching"],
        "next_test": "Run `rths bench damper` at a fifth of the force: friction then dominates, motor lag vanishes.",
        "warnings": ["3 of 20000 ticks are missing from the recording."],
        "details": details(),
    }


def no_gap() -> Report:
    found = details()
    kept = {name: found[name] for name in ("test", "laboratories", "paths")}
    kept["parts"] = [part("damper", 0.05, []), part("column", 0.04, [])]
    return bare("no_gap") | {
        "tolerances": {"column.stiffness": {"factor": 1.004, "z": 0.2}},
        "gap": gap(0.008),
        "how_far": far(0.0062, 0.0062, None),
        "details": kept,
    }


def unknown_effect() -> Report:
    found = details()
    spring = np.linspace(-0.04, 0.04, 200)
    bump = 2.0 * np.sin(2 * np.pi * spring / 0.016)
    found["candidates"] = [
        candidate(["damper.stiffness"], 0.6, 0.0),
        candidate(["damper.friction"], 0.4, -0.4),
    ]
    found["curves"], found["waterfall"] = [], found["waterfall"][:2] + found["waterfall"][-1:]
    found["ceiling"] = [{"site": "damper", "flexible": 0.96, "catalogue": 0.22}]
    found["unknown"] = {
        "site": "damper",
        "depends_on": [{"on": "displacement", "share": 0.83}, {"on": "velocity", "share": 0.09}],
        "frequency": 7.6,
        "amplitude": 2.0,
        "unit": "N",
        "curve": {
            "title": "",
            "x": {"label": "stroke, m", "values": listed(spring)},
            "y": {"label": "force left over, N"},
            "measured": listed(noisy(bump, 0.3)),
            "before": [0.0] * spring.size,
            "after": listed(bump),
        },
    }
    return explained() | {
        "status": "unknown_effect",
        "verdict": "",
        "which": [],
        "equivalent": [],
        "how_far": far(0.034, 0.029, 0.18) | {"judged_on": None},
        "details": found,
    }


def not_enough_data() -> Report:
    """A bench recording that holds the column's signals only."""
    column = signal("column_force", "N", 18e3 * np.sin(2 * np.pi * 0.5 * T), np.zeros(T.size), 100.0)
    return bare("not_enough_data") | {
        "gap": {
            "signals": {
                "column_force": {"nrmse": None, "noise_floor": 0.003, "peak_error": None, "unit": "N"},
            },
            "overall": None,
            "overall_noise_floor": None,
        },
        "warnings": [
            "The recording holds column_displacement and column_force only: 14 channels are absent."
        ],
        "next_test": "Record actuator_command too, or run `rths bench column`.",
        "details": {
            "test": {"name": "bench", "file": "column.mcap"},
            "parts": [{"site": "column", "signals": [{**column, "nominal": [], "corrected": []}]}],
        },
    }


def ambiguous() -> Report:
    stiffness = {"column.stiffness": {"factor": value(0.941, 0.936, 0.946, "–")}}
    compliance = {"actuator.compliance": {"compliance": value(4.7e-9, 4.1e-9, 5.3e-9, "m/N")}}
    falsified = {"sensor.column_force.gain": {"factor": value(0.941, 0.936, 0.946, "–")}}
    names = (
        ("column.stiffness", stiffness, 0.45),
        ("sensor.column_force.gain", falsified, 0.45),
        ("actuator.compliance", compliance, 0.1),
    )
    return explained() | {
        "status": "ambiguous",
        "verdict": "",
        "which": [
            {"effects": [name], "probability": share, "parameters": given, "held_out_score": 0.0}
            for name, given, share in names
        ],
        "where": [
            place(site, share, [share - 0.2, share + 0.2], 8.0, [[0.0, 40.0]], [0.5, 5.0])
            for site, share in (("column", 0.48), ("sensor.column_force", 0.42), ("actuator", 0.1))
        ],
        "equivalent": [["column.stiffness", "sensor.column_force.gain"]],
        "not_exercised": [f"damper.effect_{place}" for place in range(40)],
        "warnings": [
            f"Warning {place} that is long enough to fill a line or two. " * 3 for place in range(6)
        ],
        "next_test": "Hang a known weight on the load cell: "
        + "a static check tells gain from stiffness. " * 8,
        "details": {},
    }


REPORTS = {
    "explained": explained(),
    "no_gap": no_gap(),
    "unknown_effect": unknown_effect(),
    "not_enough_data": not_enough_data(),
    "ambiguous": ambiguous(),
}


def fresh(name: str) -> Report:
    """A report of its own, as parsed from JSON."""
    found: Report = json.loads(json.dumps(REPORTS[name]))
    return found
