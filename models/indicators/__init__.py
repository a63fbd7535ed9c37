"""Indicators of a test for all reports: how well it tracks, what that costs, how near the loop is to instability."""

from __future__ import annotations

from models.indicators.damping import (
    apparent_damping,
    damping_equivalent,
    damping_points,
    free_vibration_damping,
)
from models.indicators.energy import hybrid_simulation_error_energy
from models.indicators.force_path import ForcePath, force_path
from models.indicators.stability import critical_delay, predictive_stability_indicator, sensitivity
from models.indicators.tracking import (
    FrequencyEvaluation,
    aligned_evaluation,
    correlation_delay,
    correlation_lag,
    frequency_evaluation_index,
    nrmse,
    peak_error,
    tracking_delay,
    tracking_indicator,
)

__all__ = [
    "ForcePath",
    "FrequencyEvaluation",
    "aligned_evaluation",
    "apparent_damping",
    "correlation_delay",
    "correlation_lag",
    "critical_delay",
    "damping_equivalent",
    "damping_points",
    "force_path",
    "free_vibration_damping",
    "frequency_evaluation_index",
    "hybrid_simulation_error_energy",
    "nrmse",
    "peak_error",
    "predictive_stability_indicator",
    "sensitivity",
    "tracking_delay",
    "tracking_indicator",
]
