"""Effects on a column's specimen as keys of the plan's table [column], where it has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from common.errors import InputError
from common.plan.laboratory_tables import Column
from laboratories.column.specimen import LAWS, yielding
from models import specimens
from models.registry import Array
from models.specimens import SPECIMENS
from models.system import ColumnEffects

LINEAR, CENTRING = "linear", "self_centring"  # models of a column
# Fields of `ColumnEffects` that describe one law in place of the linear column.
OF_YIELDING = (
    "yield_displacement",
    "hardening",
    "exponent",
    "law",
    "unloading",
    "first_bend",
    "second_stiffness",
    "pinch_force",
    "pinch_displacement",
    "damage",
    "yield_asymmetry",
    "concrete",
    "axial",
    "concrete_strength",
    "spalling",
    "shaft",
    "focus",
    "core",
    "rubbing",
    "eccentricity",
    "uncracked",
)
OF_CENTRING = ("centring", "centring_hardening", "centring_loop")


def as_table(column: Column, effects: ColumnEffects) -> tuple[Column, ColumnEffects]:
    """The table of a column with the effects that its keys can say, and the effects that are left."""
    linear = 0.0 if effects.viscous_law else effects.viscous  # a table has no other dashpot
    column = replace(column, damping=column.damping + linear, mass=column.mass + effects.inertia)
    left = replace(effects, viscous=effects.viscous - linear, inertia=0.0)
    yields, centres = np.isfinite(left.yield_displacement), np.isfinite(left.centring)
    if column.model != LINEAR or yields == centres:  # a column follows one law alone
        return column, left
    name, values = LAWS[int(left.law)], yielding(column.stiffness, left)
    if centres:
        name = CENTRING
        values = np.array([column.stiffness, left.centring, left.centring_hardening, left.centring_loop])
    given, stiffness = parameters(name, values), float(values[0])
    if stiffness != column.stiffness and (left.stiffening or left.slip_share != 1.0):
        return column, left  # which are over the stiffness of the table
    try:
        specimens.pack(name, stiffness=stiffness, **given)
    except InputError:  # a value that the effect may have and the model may not
        return column, left
    null = ColumnEffects()
    fields = OF_CENTRING if centres else OF_YIELDING
    left = replace(left, **{field: getattr(null, field) for field in fields})
    return replace(column, model=name, stiffness=stiffness, parameters=given), left


def parameters(name: str, values: Array) -> dict[str, float]:
    """The parameters of a specimen's model beside the stiffness by name, from its kernel's own order."""
    named = dict(zip(SPECIMENS[name].params._fields, values.tolist(), strict=True))
    return {key: value for key, value in named.items() if key != "stiffness"}
