"""Laws of the slave's laboratory: friction of the damper with presliding, and play behind the table's loop."""

from __future__ import annotations

import numpy as np
import pytest

from common.plan.plan import Plan
from diagnosis.fits import fitting, residuals
from diagnosis.fits.laws.best import in_best_laws
from diagnosis.fits.residuals import Data
from diagnosis.recorded.nuisances import Nuisance
from diagnosis.recorded.parts import Measured
from laboratories.effects import CATALOGUE
from laboratories.effects.effect import Effect
from laboratories.table.kind import TABLE
from loop import replay
from models.registry import Array
from models.system import System
from tests.diagnosis.cases import Cases, estimate, named
from tests.diagnosis.specimens import (
    INTERVAL,
)


class RubbingDamper(Measured):
    """A damper on a standing table whose carriage bends bristles before it slides, in 50 µs steps of its equation."""

    name, role, exact = "laboratory B", "slave", False
    signals: tuple[str, ...] = ("damper_stroke", "damper_force")
    nuisances: tuple[Nuisance, ...] = ()
    candidates: tuple[Effect, ...] = (CATALOGUE["damper.friction"],)
    TICKS, FORCE, PRESLIDING, STEPS = 2000, 3.0, 4e-4, 40

    def __init__(self) -> None:
        t = np.arange(self.TICKS) * INTERVAL
        push = 15.0 * np.sin(2.0 * np.pi * 0.8 * t) * np.sin(np.pi * t / t[-1])
        self.drive = np.stack([np.zeros(self.TICKS), push], axis=1)
        damper, h = Plan().damper, INTERVAL / self.STEPS
        stroke = rate = rubbing = motor = 0.0
        rows = [(0.0, 0.0)]
        for command in push[:-1].tolist():
            for _ in range(self.STEPS):
                motor += h * (command - motor) / damper.motor_time_constant
                rate -= (
                    h * (damper.stiffness * stroke + damper.damping * rate + rubbing - motor) / damper.mass
                )
                stroke += h * rate
                rubbing += h * (self.FORCE * rate - abs(rate) * rubbing) / self.PRESLIDING
            rows.append((stroke, damper.stiffness * stroke + damper.damping * rate + rubbing - motor))
        self.noise = np.array([2e-6, 0.02])
        noise = np.random.default_rng(3).standard_normal((self.TICKS, 2))
        self.measured = np.array(rows) + self.noise * noise
        self.present = np.ones((self.TICKS, 2), dtype=bool)

    def predict(self, system: System) -> Array:
        return replay.laboratory(TABLE, system, self.drive)[:, 2:]

    def first(self, ticks: int) -> RubbingDamper:
        raise NotImplementedError


def test_friction_with_presliding_is_found_with_its_distance() -> None:
    part = RubbingDamper()
    group, train = residuals.withheld(part.TICKS, INTERVAL)
    bare = Data(part, System(Plan()), part.noise, part.noise, group, train, np.zeros(2))
    data = residuals.measured_by(bare, part.noise)
    before = fitting.fit(data, {"damper.friction": {"force": 2.0, "velocity": 1e-6}})
    (found,) = in_best_laws([before])
    values = found.values["damper.friction"]
    assert CATALOGUE["damper.friction"].laws[int(values["law"])].name == "with presliding"
    np.testing.assert_allclose(values["force"], part.FORCE, rtol=0.01)
    np.testing.assert_allclose(values["presliding"], part.PRESLIDING, rtol=0.03)
    assert fitting.excess(found) < 0.1 * fitting.excess(before)


class LooseTable(Measured):
    """A table whose platform has play against its loop, in 20 µs steps of its equation; it carries no damper."""

    name, role, exact = "laboratory B", "slave", False
    signals: tuple[str, ...] = ("table_displacement",)
    nuisances: tuple[Nuisance, ...] = ()
    candidates: tuple[Effect, ...] = (CATALOGUE["table.backlash"],)
    TICKS, WIDTH, FLANKS, FLANK, GUIDE, STEPS = 1500, 8e-4, 60.0, 0.5, 150.0, 100

    def __init__(self) -> None:
        t = np.arange(self.TICKS) * INTERVAL
        command = 0.02 * np.sin(2.0 * np.pi * 1.5 * t) * np.sin(np.pi * t / t[-1]) ** 2
        self.drive = np.stack([command, np.zeros(self.TICKS)], axis=1)
        loop = np.zeros(2)
        table, h = Plan().table, INTERVAL / self.STEPS
        omega, flanks = 2.0 * np.pi * table.frequency, 2.0 * np.pi * self.FLANKS
        fine = np.arange(1, (self.TICKS - 1) * self.STEPS + 1) * h
        reached = np.interp(fine - table.delay, np.append(0.0, t + INTERVAL), np.append(0.0, command))
        place = rate = 0.0
        rows = [0.0]
        for step, wanted in enumerate(reached.tolist(), 1):
            loop[1] += h * (omega**2 * (wanted - loop[0]) - 2.0 * table.damping_ratio * omega * loop[1])
            loop[0] += h * loop[1]
            ahead, speed = loop[0] - place, loop[1] - rate
            beyond = ahead - min(max(ahead, -0.5 * self.WIDTH), 0.5 * self.WIDTH)
            drag = 2.0 * self.FLANK * flanks if beyond else self.GUIDE
            rate += h * (flanks**2 * beyond + drag * speed)
            place += h * rate
            if step % self.STEPS == 0:
                rows.append(place)
        self.noise = np.array([5e-6])
        noise = np.random.default_rng(5).standard_normal(self.TICKS)
        self.measured = (np.array(rows) + self.noise * noise)[:, None]
        self.present = np.ones((self.TICKS, 1), dtype=bool)

    def predict(self, system: System) -> Array:
        return replay.laboratory(TABLE, system, self.drive)[:, :1]

    def first(self, ticks: int) -> LooseTable:
        raise NotImplementedError


@pytest.mark.long
def test_play_behind_the_tables_loop_is_told_from_play_before_it() -> None:
    part = LooseTable()
    group, train = residuals.withheld(part.TICKS, INTERVAL)
    data = Data(part, System(Plan()), part.noise, part.noise, group, train, np.zeros(1))
    before = fitting.fit(data, {"table.backlash": {"width": 4e-4}})
    (found,) = in_best_laws([before])
    values = found.values["table.backlash"]
    assert CATALOGUE["table.backlash"].laws[int(values["law"])].name == "behind the loop"
    np.testing.assert_allclose(values["width"], part.WIDTH, rtol=0.05)
    assert fitting.excess(found) < 0.2 * fitting.excess(before)


@pytest.mark.long
@pytest.mark.parametrize("law", [0.0, 1.0])
def test_a_constant_force_needs_no_bias_of_its_reading(cases: Cases, law: float) -> None:
    report = cases.report({"damper.offset": {"force": 2.0, "law": law}})
    assert named(report) == ["damper.offset"]
    found = report["which"][0]["parameters"]["damper.offset"]
    assert found["force"]["value"] == pytest.approx(2.0, rel=0.02)
    assert ("law" in found and found["law"]["value"] == 1.0) == (law == 1.0)


@pytest.mark.long
def test_a_cable_chain_that_bends_over_millimetres_is_friction(cases: Cases) -> None:
    report = cases.report({"damper.friction": {"force": 2.0, "law": 2.0, "presliding": 8e-3}})
    assert named(report) == ["damper.friction"]
    assert estimate(report, "damper.friction", "presliding") == pytest.approx(8e-3, rel=0.1)
