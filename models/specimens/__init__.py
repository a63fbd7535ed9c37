"""Rate-independent force-deformation models of columns, one file each, listed here.

They serve for experimental columns and for the numerical columns of each storey. A model is a file with `Params`,
`RULES`, `STATE_SIZE` and `step`; a line in `SPECIMENS` and one in `step` add it. The three pinched ones share a file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from common.errors import InputError
from common.plan.schema import Rule, nearest
from models import registry
from models.compiled import jit
from models.registry import Array
from models.specimens import (
    bilinear,
    bouc_wen,
    bwbn,
    clough,
    layered,
    linear,
    menegotto_pinto,
    pinched,
    self_centring,
    slider,
    trilinear,
)


def no_fault(_params: Any) -> str:
    """An empty text: a model without conditions between its parameters."""
    return ""


@dataclass(frozen=True)
class SpecimenModel:
    """One model: its code in `step`, its parameters with their ranges, the length of its memory."""

    name: str
    code: int
    params: type[Any]
    rules: Mapping[str, Rule]
    state_size: int
    fault: Callable[[Any], str] = no_fault


SPECIMENS = {
    model.name: model
    for model in (
        SpecimenModel("linear", 0, linear.LinearParams, linear.RULES, linear.STATE_SIZE),
        SpecimenModel("bilinear", 1, bilinear.BilinearParams, bilinear.RULES, bilinear.STATE_SIZE),
        SpecimenModel(
            "bouc_wen", 2, bouc_wen.BoucWenParams, bouc_wen.RULES, bouc_wen.STATE_SIZE, bouc_wen.fault
        ),
        SpecimenModel("clough", 3, clough.CloughParams, clough.RULES, clough.STATE_SIZE, clough.fault),
        SpecimenModel("bwbn", 4, bwbn.BwbnParams, bwbn.RULES, bwbn.STATE_SIZE, bwbn.fault),
        SpecimenModel(
            "menegotto_pinto",
            5,
            menegotto_pinto.MenegottoPintoParams,
            menegotto_pinto.RULES,
            menegotto_pinto.STATE_SIZE,
        ),
        SpecimenModel("pinched", 6, pinched.PinchedParams, pinched.RULES, pinched.STATE_SIZE),
        SpecimenModel(
            "trilinear",
            7,
            trilinear.TrilinearParams,
            trilinear.RULES,
            trilinear.STATE_SIZE,
            trilinear.fault,
        ),
        SpecimenModel(
            "self_centring",
            8,
            self_centring.SelfCentringParams,
            self_centring.RULES,
            self_centring.STATE_SIZE,
        ),
        SpecimenModel("pinched_by_peak", 9, pinched.PinchedParams, pinched.RULES, pinched.STATE_SIZE),
        SpecimenModel("pinched_by_rest", 10, pinched.PinchedParams, pinched.RULES, pinched.STATE_SIZE),
        SpecimenModel("slider", 11, slider.SliderParams, slider.RULES, slider.STATE_SIZE),
        SpecimenModel("layered", 12, layered.LayeredParams, layered.RULES, layered.STATE_SIZE),
    )
}
CORNERS = 8  # by which the code of a further pinched model exceeds its corner of reloading in `pinched`
STATE_SIZE = max(model.state_size for model in SPECIMENS.values())


def pack(name: str, **params: float) -> tuple[int, Array, Array]:
    """Code, parameters (in the order of the model's `Params`) and memory at rest (STATE_SIZE,) of a model.

    Raises:
        InputError: the model or a parameter is unknown, missing, not finite or out of its range.
    """
    if name not in SPECIMENS:
        raise InputError(f"Unknown specimen model '{name}': {nearest(name, SPECIMENS)}")
    model = SPECIMENS[name]
    values = registry.pack(model.params, params, f"specimen model '{name}'")
    named = model.params(*values.tolist())
    for parameter, value in named._asdict().items():
        rule = model.rules[parameter]
        if not rule.admits(value):
            raise InputError(
                f"{parameter} of specimen model '{name}' is {value:g}, but must be {rule.allowed()}."
            )
    if fault := model.fault(named):
        raise InputError(f"In specimen model '{name}', {fault}.")
    return model.code, values, np.zeros(STATE_SIZE)


def admits(name: str, **params: float) -> bool:
    """Whether a model can have these parameters."""
    try:
        pack(name, **params)
    except InputError:
        return False
    return True


@jit
def step(kind: int, p: Array, s: Array, deformation: float) -> float:
    """Force (N) of the model with code `kind` at a deformation (m); its memory `s` moves on."""
    if kind == 1:
        force = bilinear.step(p, s, deformation)
    elif kind == 2:
        force = bouc_wen.step(p, s, deformation)
    elif kind == 3:
        force = clough.step(p, s, deformation)
    elif kind == 4:
        force = bwbn.step(p, s, deformation)
    elif kind == 5:
        force = menegotto_pinto.step(p, s, deformation)
    elif kind in (6, 9, 10):
        force = pinched.step(p, s, deformation, max(kind - CORNERS, pinched.ON_THE_WAY))
    elif kind == 7:
        force = trilinear.step(p, s, deformation)
    elif kind > 7:
        force = further_step(kind, p, s, deformation)
    else:
        force = linear.step(p, s, deformation)
    return force


@jit
def further_step(kind: int, p: Array, s: Array, deformation: float) -> float:
    """`step` for the models that centre, slide, or have layers."""
    if kind == 8:
        force = self_centring.step(p, s, deformation)
    elif kind == 11:
        force = slider.step(p, s, deformation)
    else:
        force = layered.step(p, s, deformation)
    return force
