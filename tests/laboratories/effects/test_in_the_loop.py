"""Every effect in the closed loop and in the rigs; effects of the building and of the ground motion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.plan.plan import Plan
from common.plan.read import with_test
from common.rig import ColumnCommand, TableCommand
from common.roles import SLAVE
from laboratories.column.kind import COLUMN
from laboratories.effects import CATALOGUE, lay
from laboratories.effects.effect import Effect, Parameter
from laboratories.emulated import EmulatedLab
from laboratories.table.kind import TABLE
from loop import substructure
from loop.closed_loop import Rollout, simulate
from loop.signals import signals
from models.system import System
from tests.laboratories.effects.distinct import DISTINCT
from tests.laboratories.effects.histories import DT, Array

EACH = pytest.mark.parametrize("effect", DISTINCT.values(), ids=list(DISTINCT))


@pytest.fixture(scope="module")
def plan(default_plan: Plan) -> Plan:
    return with_test(default_plan, duration=3.0)


def rollout(system: System, seed: int | None = 3) -> Rollout:
    motion = substructure.motion(system.plan)
    ground = substructure.ground_rows(system.plan, motion, system.effects.time_shift)
    return simulate(system.plan, ground, effects=system.effects, seed=seed)


def everything(found: Rollout) -> Array:
    return np.column_stack([*found.master.values(), *found.slaves[SLAVE].values()])


@pytest.fixture(scope="module")
def nominal(plan: Plan) -> Rollout:
    return rollout(System(plan))


def strength(effect: Effect) -> Parameter:
    return next(item for item in effect.parameters if not item.shape)


def rigs(system: System) -> list[tuple[float, ...]]:
    """Readings of both emulated laboratories under commands that do not depend on them."""
    result: list[tuple[float, ...]] = []
    lab_a, lab_b = EmulatedLab(COLUMN, system, 5), EmulatedLab(TABLE, system, 6)
    for tick in range(150):
        wave = math.sin(0.05 * tick) + 0.3 * math.sin(0.31 * tick)
        result.append((*lab_a.read(), *lab_b.read()))
        lab_a.write(ColumnCommand(2e-3 * wave))
        lab_b.write(TableCommand(10e-3 * wave, 40.0 * wave))
    return result


def test_an_effect_changes_only_the_readings_of_its_own_laboratory(plan: Plan) -> None:
    before = np.array(rigs(System(plan)))
    for effect in CATALOGUE.values():
        changed = lay(System(plan), [(effect.name, {strength(effect).name: ordered(effect)[-1]})])
        differs = np.any(np.array(rigs(changed)) != before, axis=0)
        part, _, signal = effect.site.partition(".")
        if part == "sensor":
            place = (*COLUMN.channels.names, *TABLE.channels.names).index(signal)
            assert np.flatnonzero(differs).tolist() == [place], effect.name
        else:
            in_a, in_b = part in ("actuator", "column"), part in ("table", "damper")
            assert (bool(differs[:2].any()), bool(differs[2:].any())) == (in_a, in_b), effect.name


def ordered(effect: Effect) -> list[float]:
    """The sizes of an effect, the weakest first."""
    item = strength(effect)
    return sorted(item.sizes, key=lambda size: -size if math.isinf(item.null) else abs(size - item.null))


@EACH
def test_a_millionth_of_an_effects_weakest_size_changes_at_most_a_thousandth_as_much(
    effect: Effect, plan: Plan, nominal: Rollout
) -> None:
    item = strength(effect)
    tiny = item.most if math.isinf(item.null) else item.null + 1e-6 * (ordered(effect)[0] - item.null)
    changes = []
    for size in (ordered(effect)[0], tiny):
        found = rollout(lay(System(plan), [(effect.name, {item.name: size})]))
        assert found.finite
        changes.append(np.max(np.abs(everything(found) - everything(nominal)), axis=0))
    weak, slight = changes
    if effect.site == "link":  # a matter of the exchange, not of the laboratories
        assert not weak.any()
        return
    scale = np.max(np.abs(everything(nominal)), axis=0)
    if not math.isinf(item.null):
        assert weak.any()
    share = (
        0.5 if math.isinf(item.null) else 1e-3
    )  # an infinite null is approached as far as the bound allows
    assert np.all(slight <= share * weak + 1e-9 * scale)


def test_p_delta_equals_a_change_of_stiffness(plan: Plan) -> None:
    gravity = -1.5e6
    leaning = lay(System(plan), [("structure.p_delta", {"stiffness": gravity})])
    # three of four columns are numerical, so their share of the storey's stiffness changes by all of it
    softer = System(plan).moved("structure", stiffness=(25e6 + gravity / 0.75,))
    left, right = everything(rollout(leaning, None)), everything(rollout(softer, None))
    assert np.allclose(left, right, rtol=1e-9, atol=1e-9 * np.max(np.abs(right), axis=0))
    assert not np.allclose(left, everything(rollout(System(plan), None)), rtol=1e-3)


def test_p_delta_acts_in_every_storey(plan: Plan) -> None:
    tables = {"mass": (1.6e5,) * 3, "stiffness": (9e7, 8e7, 6e7), "damping": (4e5,) * 3}
    tall = System(plan).moved("structure", **tables).moved("column", storey=2, stiffness=40e6)
    leaning = lay(tall, [("structure.p_delta", {"stiffness": -4e6})])
    softer = tall.moved("structure", stiffness=(9e7 - 4e6, 8e7 - 4e6 / 0.75, 6e7 - 4e6))
    left, right = everything(rollout(leaning, None)), everything(rollout(softer, None))
    assert np.allclose(left, right, rtol=1e-9, atol=1e-9 * np.max(np.abs(right), axis=0))


@pytest.mark.parametrize("ticks", [5, -5, 25])
def test_a_ground_motion_shifted_by_whole_ticks_shifts_every_response(plan: Plan, ticks: int) -> None:
    later = lay(System(plan), [("ground.time_shift", {"shift": ticks * DT})])
    shifted, plain = rollout(later, None), rollout(System(plan), None)
    motion = substructure.ground_rows(later.plan, substructure.motion(later.plan), ticks * DT)
    straight = substructure.ground_rows(plan, substructure.motion(plan))
    if ticks > 0:
        assert np.allclose(motion[:, ticks:], straight[:, :-ticks], atol=1e-12)
        assert not motion[:, :ticks].any()
        assert not shifted.master["table_target"][: ticks - 1].any()
        for name in ("displacement", "column_force", "table_displacement", "damper_force"):
            before, after = signals(plan, plain)[name], signals(plan, shifted)[name]
            assert np.allclose(after[ticks:], before[:-ticks], atol=1e-9 * np.max(np.abs(before))), name
    else:
        assert np.allclose(motion[:, :ticks], straight[:, -ticks:], atol=1e-12)


@given(shift=st.floats(-30.0, 30.0))
def test_a_shifted_ground_motion_is_interpolated_linearly(shift: float) -> None:
    t = np.arange(200.0)
    rows = np.stack([np.sin(0.05 * t), t])
    found = substructure.shifted(rows, shift)
    assert np.allclose(found[1], np.clip(t - shift, 0.0, 199.0), atol=1e-9)
    inside = (t - shift >= 0.0) & (t - shift <= 199.0)
    assert np.allclose(found[0][inside], np.sin(0.05 * (t - shift))[inside], atol=0.05**2 / 8 + 1e-9)
