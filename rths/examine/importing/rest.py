"""Readings of sensors at rest before a test, which tell their noise whatever the machines then do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from common.errors import InputError
from common.roles import MASTER
from common.signals import FieldType
from models.registry import Array
from report.text.tabular import DataTable
from rths.examine.importing.import_map import ImportMap, lab_signals
from rths.examine.importing.onto_ticks import OnTicks, of_controller, on_ticks

SHORTEST, LONGEST = 2.0, 20.0  # s at rest that tell something of noise, and that are kept
AWAY = 0.05  # s before the test that are left out: its beginning is known to some milliseconds
STILL = 1e-3  # of what a command does in the test, by which it may change at rest


def readings_at_rest(mapping: ImportMap, table: DataTable, data: Path, found: OnTicks) -> dict[str, Array]:
    """Readings (ticks,) at the interval of the test from before it, by our name, where no command moved.

    `found` are the signals of the test. The result is empty where the data begin with the test, hold no command, or
    moved their machines shortly before it.
    """
    if mapping.static or mapping.start is None:
        return {}
    try:
        before = on_ticks(replace(mapping, start=None, stop=mapping.start - AWAY), table, data, as_is=True)
    except InputError:  # fewer rows than make a signal
        return {}
    computed, known = of_controller(mapping.plan), lab_signals(mapping.plan)
    commands = [name for name in before.values if name in computed and np.ptp(found.values[name]) > 0.0]
    interval = mapping.plan.test.interval
    count = before.t.size
    for name in commands:
        values = before.values[name]
        moved = np.abs(values - values[-1]) > STILL * np.max(np.abs(found.values[name] - values[-1]))
        count = min(count, values.size - 1 - int(np.max(np.flatnonzero(moved), initial=-1)))
    if not commands or count * interval < SHORTEST:
        return {}
    count = min(count, round(LONGEST / interval))
    topics = (MASTER, *mapping.plan.roles)
    return {
        name: values[-count:]
        for name, values in before.values.items()
        if name not in computed
        and known[name][0] in topics
        and known[name][1].kind is FieldType.NUMBER
        and not before.stated[name].known
    }
