"""The histories that the page of several recordings draws as its reader chooses: every signal, its units, its extremes.

The page loads nothing, so it holds all signals. Each is divided into as many columns as its drawing has pixels, and of
a column the smallest and the largest value are kept, so that no peak is lost; their number falls where there are many
signals and recordings, so that the page's size is bounded.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from decimal import Decimal
from typing import Any

import numpy as np

from common.plan.units import converted
from common.recording.run import Values
from report.several.pictures import colours
from report.several.runs import ChosenSignal, OneRun
from report.several.tables import peak
from report.text.formats import axis_scale

UNITS = {
    "m": ("m", "cm", "mm", "µm", "in"),
    "m/s": ("m/s", "cm/s", "mm/s", "in/s"),
    "m/s²": ("m/s²", "g", "cm/s²", "in/s²"),
    "N": ("N", "kN", "MN", "kip"),
}
"""Units that are offered for a signal, by its SI unit; others have their own unit alone."""

COLUMNS = 800  # pixels of a drawing on a screen of 1280 pixels
LEAST_COLUMNS = 40  # a peak can still be placed to 1/40 of the test
# bytes of all histories together; with the text around them, base64 and pictures a page of 50 recordings has some 5 MB
BUDGET = 3_000_000
FULL = (
    32_767  # the extremes are 16-bit integers, of which this is the signal's peak: a resolution of 3e-5 of it
)
NONE = -32_768  # a column without a value


def offered(runs: Sequence[OneRun], signals: Sequence[ChosenSignal]) -> dict[str, Any]:
    """What the page's script draws from, as plain values.

    `signals` are all of all recordings with `units` (name and SI units of one), the unit that is chosen at first, and
    whether the signal is; `peaks` (SI) and `histories` have an entry per recording, None where it lacks the signal. A
    history is base64 of little-endian 16-bit integers: the smallest and the largest value of each column of `span` s.
    """
    names = list(
        dict.fromkeys([*(one.name for one in signals), *(name for run in runs for name in run.signals)])
    )
    end = max(float(run.time[name][-1]) for run in runs for name in run.time)
    columns = int(np.clip(BUDGET // (4 * len(names) * len(runs)), LEAST_COLUMNS, COLUMNS))
    wanted = {one.name: one.unit for one in signals}
    return {
        "recordings": [run.label for run in runs],
        "colours": [hexadecimal(one) for one in colours(len(runs))],
        "end": end,
        "columns": columns,
        "signals": [one_signal(runs, name, wanted, (end, columns)) for name in names],
    }


def hexadecimal(colour: Any) -> str:
    """A colour of matplotlib as a page writes it."""
    from matplotlib.colors import to_hex

    return to_hex(colour)


def one_signal(
    runs: Sequence[OneRun], name: str, wanted: dict[str, str], span: tuple[float, int]
) -> dict[str, Any]:
    """A signal of all recordings; `span` is the end of the longest one (s) and the number of columns up to it."""
    peaks = [peak(run, name) for run in runs]
    unit = next(run.units[name] for run in runs if name in run.units)
    usual = axis_scale(max(value for value in peaks if value is not None), unit)[1]
    chosen = wanted.get(name) or usual
    units = dict.fromkeys((*UNITS.get(unit, (unit,)), chosen))
    return {
        "name": name,
        "chosen": name in wanted,
        "unit": chosen,
        "units": {one: factor(one, unit, name) for one in units},
        "peaks": peaks,
        "histories": [
            None if size is None else packed(extremes(run.time[name], run.signals[name], *span), size)
            for run, size in zip(runs, peaks, strict=True)
        ],
    }


def factor(given: str, unit: str, name: str) -> float:
    """SI units in one of a unit."""
    return 1.0 if given == unit else converted(Decimal(1), given, unit, name)


def extremes(time: Values, values: Values, end: float, columns: int) -> Values:
    """The smallest and the largest value (columns, 2) in each column of the time from 0 to `end` s; NaN without any."""
    found = np.full((columns, 2), np.nan)
    finite = np.isfinite(values)
    if not end:  # a recording of one tick
        time, end = np.zeros_like(time), 1.0
    place = np.minimum((time[finite] * (columns / end)).astype(int), columns - 1)
    least, most = np.full(columns, np.inf), np.full(columns, -np.inf)
    np.minimum.at(least, place, values[finite])
    np.maximum.at(most, place, values[finite])
    here = np.isfinite(least)
    found[here] = np.stack([least[here], most[here]], axis=1)
    return found


def packed(found: Values, size: float) -> str:
    """Extremes (columns, 2) as base64 of 16-bit integers, `FULL` at the `size`; columns without a value are `NONE`."""
    scaled = np.round(found * (FULL / size)) if size else 0.0 * found
    whole = np.where(np.isfinite(scaled), scaled, NONE).astype("<i2")
    return base64.b64encode(whole.tobytes()).decode()
