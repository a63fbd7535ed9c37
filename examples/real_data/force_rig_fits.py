"""Fit simple linear models to the force rig without rths, for a comparison with the diagnosis.

python examples/real_data/force_rig_fits.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import lfilter

Array = NDArray[np.float64]

INTERVAL = 1.0 / 128.982  # s, see ORIGIN.md
FINE = 8  # steps per sample, 1 ms: a tenth of the lag of 10 ms
TAPS = 60  # of the finite impulse response: 0.47 s, longer than any lag of the rig
BLOCK = (
    258  # samples, 2 s: the residuals of blocks are taken as independent, because they are longer than TAPS
)
LEAST_LAG = 1e-4  # s: a tenth of a step, where a lag has no effect; avoids a division by 0


def response(r: Array, gain: float, delay: float, *lags: float) -> Array:
    """The response (samples,) of a gain, a dead time (s) and first-order lags (s) in series to the reference `r`."""
    samples = np.arange(r.size * FINE) / FINE
    u = np.interp(samples - delay / INTERVAL, np.arange(r.size), r)
    for lag in lags:
        pole = np.exp(-INTERVAL / FINE / max(abs(lag), LEAST_LAG))
        u = lfilter([1.0 - pole], [1.0, -pole], u)
    return np.asarray(gain * u[::FINE], dtype=np.float64)


def main() -> None:
    """Print the residual of every model over the measured force, and how it compares with that of a dead time."""
    data = np.loadtxt(Path(__file__).with_name("force_rig.csv"), delimiter=",", skiprows=1)
    r, y = data.T
    level = float(np.sqrt(np.mean(y**2)))
    models = {
        "dead time": lambda p: response(r, p[0], p[1]),
        "lag": lambda p: response(r, p[0], 0.0, p[1]),
        "interval and lag": lambda p: response(r, p[0], INTERVAL, p[1]),
        "interval, lag of 10 ms, another lag": lambda p: response(r, p[0], INTERVAL, 0.010, p[1]),
    }
    first: Array | None = None
    for name, model in models.items():
        found = least_squares(lambda p, f=model: f(p) - y, [1.0, 0.02], x_scale=[1.0, 0.01])
        rest = np.asarray(found.fun, dtype=np.float64)
        first = rest if first is None else first
        count = r.size // BLOCK
        gains = (first**2 - rest**2)[: count * BLOCK].reshape(count, BLOCK).sum(axis=1)
        better = gains.mean() / max(gains.std(ddof=1) / np.sqrt(count), 1e-300)
        share = float(np.sqrt(np.mean(rest**2))) / level
        sys.stdout.write(
            f"{name}: {1e3 * found.x[1]:.1f} ms, leaves {100 * share:.2f} %, "
            f"{better:+.1f} standard errors better than a dead time\n"
        )
    rows = np.column_stack([np.concatenate([np.zeros(k), r[: r.size - k]]) for k in range(TAPS)])
    half = r.size // 2
    taps = np.linalg.lstsq(rows[:half], y[:half], rcond=1e-8)[0]
    rest = y[half:] - rows[half:] @ taps
    share = float(np.sqrt(np.mean(rest**2) / np.mean(y[half:] ** 2)))
    sys.stdout.write(
        f"free filter of {TAPS} samples, fitted to one half: leaves {100 * share:.2f} % of the other\n"
    )


if __name__ == "__main__":
    main()
