"""Long segments of the laboratory of the kind table say what short ones say, and are few."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from common.plan.laboratory_tables import Damper, ShakingTable
from laboratories.table import model, segments
from models.system import DamperEffects, TableEffects
from tests.laboratories.effects.histories import DT, STROKE, Array, Y, run_b, tones

TICKS = 1500
CASES: dict[str, dict[str, Any]] = {
    "dry": {"damper_effects": DamperEffects(friction=4.0)},
    "falling with speed": {
        "damper_effects": DamperEffects(friction=4.0, friction_drop=0.3, friction_speed=0.02)
    },
    "presliding": {"damper_effects": DamperEffects(friction=4.0, presliding=2e-5)},
    "end stop": {"damper_effects": DamperEffects(stop_stroke=0.005, stop_stiffness=2e4)},
    "guide": {"table_effects": TableEffects(friction=0.5, friction_velocity=1e-3)},
    "play": {"table_effects": TableEffects(backlash=1e-3)},
}


def played(effects: dict[str, Any]) -> Array:
    """Motion of table and damper (ticks, channels) under tones of the command and of the motor."""
    command, motor = tones(TICKS, size=0.005), tones(TICKS, size=20.0)
    return run_b(command, motor, table=ShakingTable(delay=5.3e-3), damper=Damper(), **effects)


@pytest.mark.parametrize("name", CASES)
def test_long_segments_say_what_short_ones_say(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    effects = CASES[name]
    usual = played(effects)
    monkeypatch.setattr(segments, "levels", lambda *given: (64,))
    short = played(effects)
    monkeypatch.setattr(segments, "levels", lambda *given: (1,))
    long = played(effects)
    moved = Y if "table_effects" in effects else STROKE
    error, without = (np.max(np.abs(motion - short)[:, moved]) for motion in (usual, long))
    assert error < 5e-4 * np.max(np.abs(short[:, moved]))
    assert error < 0.25 * without


@pytest.mark.parametrize(
    "effects",
    [{}, {"table_effects": TableEffects(backlash=1e-3)}, {"damper_effects": DamperEffects(friction=4.0)}],
)
@pytest.mark.parametrize("dead", [0.0, 4e-3, 5.3e-3])
def test_the_segments_of_every_level_cover_the_interval(effects: dict[str, Any], dead: float) -> None:
    lab = model.build(DT, ShakingTable(delay=dead), Damper(), **effects)
    for level in lab.walk:
        border, length = 0, 0.0
        while border < level.shape[0]:
            segment, end = level[border]
            assert segment >= 0
            assert end > border
            length += lab.lengths[segment]
            border = end
        assert length == pytest.approx(DT)
