"""How all readings of a laboratory follow from one unknown motion or force at a site.

A machine's effect changes its motion, and with it every reading downstream; an error of a reading changes that alone.
Laplace variable s, displacements of the transfer system x, stroke y relative to the table, m·s² and so on of the plan.

Table:    x, s²·x, y = −m·s²·x/(m·s² + c·s + k), force (k + c·s)·y; by what moves or tilts the ground under it all but
          x, which is measured from there
Damper:   y, force −m·s²·y by a force within the damper, (k + c·s)·y by what its mass carries along
Actuator: x, force (m·s² + c·s + k)·x;  column: force alone

A force that depends on the damper's stroke moves its mass by 1/(m·s² + c·s + k); one that depends on the column's
displacement is read as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.plan.kinds import COLUMN, TABLE
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.parts import LaboratoryPart
from laboratories.effects.sites import is_sensor
from models.registry import Array
from models.system import System

Spectrum = NDArray[np.complex128]
# Places of the damper's stroke, and of the column's displacement, among the readings of their laboratories.
STROKE, DISPLACEMENT = 2, 0


class Signature(NamedTuple):
    """The readings by one unknown series at a site, frequency by frequency."""

    site: str
    readings: Spectrum  # (frequencies, signals)
    rare: bool = False  # whether another site that explains as much is the likelier one
    motion: int | None = None  # place of the reading of the motion on which a force at the site depends
    receptance: Spectrum | None = None  # (frequencies,) of the series over that force


def signatures(part: LaboratoryPart, system: System, frequencies: Array) -> list[Signature]:
    """The signatures of the sites of a laboratory, machines first; none of a kind of the user's.

    A site has several where several kinds of effects at it differ.
    """
    kinds = {TABLE: of_table, COLUMN: of_column}
    if part.lab.kind.name not in kinds:
        return []
    lab: RecordedLaboratory = part.lab
    find: Callable[[System, Spectrum], list[Signature]] = kinds[lab.kind.name]
    s: Spectrum = np.asarray(2j * np.pi * frequencies, dtype=np.complex128)
    recorded = passed(part, frequencies)
    machines = [
        one._replace(site=lab.site(one.site), readings=one.readings * recorded) for one in find(system, s)
    ]
    alone_rows = np.eye(recorded.shape[1])
    sensors = [
        Signature(lab.site(f"sensor.{name}"), np.broadcast_to(row, recorded.shape).astype(np.complex128))
        for name, row in zip(lab.kind.channels.names, alone_rows, strict=True)
    ]
    return [*machines, *sensors]


def alone(part: LaboratoryPart, system: System, name: str) -> tuple[str, ...]:
    """The sites of what one reading alone shows: the machines that change no other one, then its sensor."""
    place = part.signals.index(name)
    rows = [(item.site, item.readings[0]) for item in signatures(part, system, np.ones(1))]
    machines = [
        site for site, row in rows if not is_sensor(site) and row[place] != 0.0 and np.count_nonzero(row) == 1
    ]
    return (*machines, part.lab.sensor(name))


def of_table(system: System, s: Spectrum) -> list[Signature]:
    """A damper on a table: displacement and acceleration of the table, stroke and force of the damper."""
    damper, none, one = system.plan.damper, np.zeros_like(s), np.ones_like(s)
    inertia = damper.mass * s**2
    spring = damper.stiffness + damper.damping * s
    moving = inertia + spring
    yields = np.divide(one, moving, out=np.zeros_like(s), where=moving != 0.0)
    return [
        Signature("table", side_by_side(moving, s**2 * moving, -inertia, -inertia * spring)),
        Signature("table", side_by_side(none, s**2 * moving, -inertia, -inertia * spring), rare=True),
        Signature("damper", side_by_side(none, none, one, -inertia), motion=STROKE, receptance=yields),
        Signature("damper", side_by_side(none, none, one, spring), motion=STROKE, receptance=yields),
    ]


def side_by_side(*readings: Spectrum) -> Spectrum:
    """The readings of a laboratory side by side, (frequencies, signals)."""
    return np.stack(readings, axis=1)


def of_column(system: System, s: Spectrum) -> list[Signature]:
    """A column under an actuator: displacement and force."""
    column, one = system.plan.column, np.ones_like(s)
    return [
        Signature("actuator", side_by_side(one, column.mass * s**2 + column.damping * s + column.stiffness)),
        Signature("column", side_by_side(0.0 * one, one), motion=DISPLACEMENT, receptance=one),
    ]


def passed(part: LaboratoryPart, frequencies: Array) -> Spectrum:
    """What the filters and delays stated for the recording's channels do to the readings, (frequencies, signals)."""
    result = np.ones((frequencies.size, len(part.signals)), dtype=np.complex128)
    for place, channel in enumerate(part.channels):
        if channel.filter is not None or channel.delay != 0.0:
            result[:, place] = channel.response(frequencies)
    return result
