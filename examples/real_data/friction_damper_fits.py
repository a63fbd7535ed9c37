"""Fit the law of the friction damper to three of its thirteen sines, and predict all sines with it.

python examples/real_data/friction_damper_fits.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.plan import read as plans
from common.plan.plan import Plan
from common.roles import MASTER
from laboratories.device import Device
from laboratories.identification import device
from laboratories.kinds import kind_of
from loop import replay
from models.system import System

Array = NDArray[np.float64]

HERE = Path(__file__).parent
FITTED = (1, 6, 11)  # sines of the fit: one of each amplitude, at 0.25 and 0.5 Hz; their data are in `…_fit`
# frequency (Hz) and amplitude (mm) of the sines
SINES = [
    *((f, 19) for f in (0.1, 0.25, 0.5, 1.0, 2.0)),
    *((f, amplitude) for amplitude in (39, 59) for f in (0.1, 0.25, 0.5, 1.0)),
]


def sine(data: dict[str, Array], name: str | int) -> tuple[Array, Array]:
    """Displacement at the ends of the intervals (ticks,) in m, and the readings (ticks, 2) in m and N."""
    reached, displacement, resistance = (
        scale * data[f"{signal}_{name}"].astype(np.float64)
        for signal, scale in (("reached", 1e-6), ("displacement", 1e-6), ("force", 1.0))
    )
    return reached, np.column_stack([displacement, resistance])


def force(plan: Plan, reached: Array) -> Array:
    """Predicted force (ticks,) in N."""
    drive = np.column_stack([reached, np.zeros(reached.size)])
    return replay.laboratory(kind_of(plan, MASTER), System(plan), drive)[:, 1]


def main() -> None:
    """Print the parameters, and the error of every sine over its measured force."""
    plan = plans.load(HERE / "friction_damper.toml")
    kind = kind_of(plan, MASTER)
    assert isinstance(kind, Device)  # noqa: S101 - the plan names one
    data = dict(np.load(HERE / "friction_damper.npz"))
    reached, readings = sine(data, "fit")
    fit = device.least_squares(kind, plan, reached, np.zeros(reached.size), readings)
    print_out = sys.stdout.write
    for name, value in fit.parameters.items():
        print_out(f"{name:10s} {value.value:12.6g} {value.unit}\n")
    tables = plan.tables()
    tables["device"] = {"parameters": {name: value.value for name, value in fit.parameters.items()}}
    fitted = plans.from_tables(tables, plan.base)
    for number, (frequency, amplitude) in enumerate(SINES):
        reached, readings = sine(data, number)
        error = force(fitted, reached) - readings[:, 1]
        share = np.sqrt(np.mean(error**2) / np.mean(readings[:, 1] ** 2))
        how = "fitted" if number in FITTED else "predicted"
        print_out(f"{frequency:5.2f} Hz {amplitude} mm  {how:9s} {100.0 * share:5.1f} %\n")


if __name__ == "__main__":
    main()
