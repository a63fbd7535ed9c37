"""A mechanism that follows any of its laws is named as that mechanism, and the fit names the law."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from common.plan.plan import Plan
from common.roles import MASTER
from diagnosis.fits import fitting, hypothesis, laws, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.residuals import Data
from diagnosis.fits.trade import alone, simplest, under_others
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.nuisances import Nuisance
from diagnosis.recorded.parts import ColumnAlone, Part
from laboratories.effects import CATALOGUE
from laboratories.effects.effect import Effect
from laboratories.table.kind import TABLE
from loop import replay
from models.registry import Array
from models.specimens.fit import forces
from models.system import System

INTERVAL, TICKS, NOISE = 0.002, 4000, 100.0
K, LIMIT, HARDENING = Plan().column.stiffness, 1.2e-3, 0.05


def swelling() -> Array:
    """A motion whose cycles grow and then shrink."""
    t = np.arange(TICKS) * INTERVAL
    return np.asarray(2.6e-3 * np.sin(2.0 * np.pi * 1.3 * t) * np.sin(np.pi * t / t[-1]))


def slider(x: Array) -> Array:
    """A spring in parallel with a spring and slider in series, computed step by step."""
    held, result = 0.0, np.empty(x.size)
    for i, step in enumerate(np.diff(x, prepend=0.0)):
        held = min(max(held + step, -LIMIT), LIMIT)
        result[i] = K * (HARDENING * x[i] + (1.0 - HARDENING) * held)
    return result


class MadeSpecimen:
    """A column alone, whose forces follow another law than the catalogue's first one."""

    name, role, exact = "column", MASTER, False
    signals: tuple[str, ...] = ("column_force",)
    nuisances: tuple[Nuisance, ...] = ()
    candidates: tuple[Effect, ...] = (CATALOGUE["column.yielding"],)

    def __init__(self) -> None:
        self.motion = swelling()
        noise = NOISE * np.random.default_rng(1).standard_normal(TICKS)
        self.measured = (slider(self.motion) + noise)[:, None]
        self.present = np.ones((TICKS, 1), dtype=bool)

    def predict(self, system: System) -> Array:
        return replay.column(system, self.motion)[:, None]

    def first(self, ticks: int) -> MadeSpecimen:
        raise NotImplementedError


class Driven(ColumnAlone):
    """A column alone that yields by the pinched law, driven by its deformation."""

    TRUE: ClassVar = {
        "hardening": 0.03,
        "first_bend": 0.5,
        "second_stiffness": 0.6,
        "pinch_force": 0.3,
        "pinch_displacement": 0.5,
        "unloading": 0.3,
        "damage": 0.02,
    }

    def __init__(self) -> None:
        self.signals, self.nuisances, self.candidates = ("column_force",), (), MadeSpecimen.candidates
        self.role = MASTER
        self.inputs = swelling()
        force = forces("pinched", {"stiffness": K, "yield_displacement": LIMIT, **self.TRUE}, self.inputs)
        self.measured = (force + NOISE * np.random.default_rng(2).standard_normal(TICKS))[:, None]
        self.present = np.ones((TICKS, 1), dtype=bool)


def first_law(part: Part | None = None) -> Fit:
    group, train = residuals.withheld(TICKS, INTERVAL)
    level = np.array([NOISE])
    data = Data(part or MadeSpecimen(), System(Plan()), level, level, group, train, np.zeros(1))
    values = {"yield_displacement": 1e-3, "hardening": 0.1, "exponent": 2.0}
    return fitting.fit(data, {"column.yielding": values})


def test_a_pinched_law_with_damage_is_found_from_force_over_deformation() -> None:
    (found,) = laws.in_best_laws([first_law(Driven())])
    values = found.values["column.yielding"]
    effect = CATALOGUE["column.yielding"]
    assert effect.laws[int(values["law"])].name == "pinched trilinear"
    np.testing.assert_allclose(values["yield_displacement"], LIMIT, rtol=0.03)
    for name, true in Driven.TRUE.items():
        np.testing.assert_allclose(values[name], true, atol=0.05)
    assert found.chi < 1.2 * found.reduced.size


def test_the_recording_with_the_largest_deformation_starts_the_fit_of_a_law() -> None:
    near, far = Driven(), Driven()
    near.inputs = 0.5 * near.inputs
    found = laws.path(JoinedPart([near, far]))
    assert found is not None
    np.testing.assert_array_equal(found[0], far.inputs)
    assert laws.path(MadeSpecimen()) is None


def test_the_right_law_is_selected_with_the_columns_parameters() -> None:
    before = first_law()
    (found,) = laws.in_best_laws([before])
    values = found.values["column.yielding"]
    effect = CATALOGUE["column.yielding"]
    assert found.names == before.names
    assert effect.laws[int(values["law"])].name == "bilinear"
    np.testing.assert_allclose(values["yield_displacement"], LIMIT, rtol=0.01)
    np.testing.assert_allclose(values["hardening"], HARDENING, atol=0.01)
    assert fitting.excess(found) < 0.5 * fitting.excess(before)


def test_a_parameter_that_a_law_lacks_is_not_fitted() -> None:
    effect = CATALOGUE["column.yielding"]
    base = {"yield_displacement": 1e-3, "hardening": 0.1, "exponent": 2.0}
    names = {
        place: {item.parameter.name for item in hypothesis.free(effect, effect.under(place, base))}
        for place in range(len(effect.laws))
    }
    assert names == {
        0: {"yield_displacement", "hardening", "exponent"},
        1: {"yield_displacement", "hardening"},
        2: {"yield_displacement", "hardening", "exponent"},
        3: {"yield_displacement", "hardening", "unloading"},
        4: {"yield_displacement", "hardening", "first_bend", "second_stiffness"},
        **{
            place: {"yield_displacement", *Driven.TRUE} - {"first_bend", "second_stiffness"}
            for place in (5, 7, 9)
        },
        **{place: {"yield_displacement", *Driven.TRUE} for place in (6, 8, 10)},
    }


class Cracked(ColumnAlone):
    """A column alone whose force is low around the origin, by a bell that no law of the catalogue is."""

    def __init__(self) -> None:
        self.signals, self.nuisances = ("column_force",), ()
        self.candidates = tuple(CATALOGUE[f"column.{name}"] for name in ("pinching", "stiffness"))
        self.role = MASTER
        self.inputs = swelling()
        weight = 1.0 / np.cosh(self.inputs / 0.5e-3)
        force = K * self.inputs * (1.0 - 0.3 * weight + 0.2 * (1.0 - weight))
        self.measured = (force + NOISE * np.random.default_rng(4).standard_normal(TICKS))[:, None]
        self.present = np.ones((TICKS, 1), dtype=bool)


def cracked(values: Values) -> Fit:
    group, train = residuals.withheld(TICKS, INTERVAL)
    level = np.array([NOISE])
    data = Data(Cracked(), System(Plan()), level, level, group, train, np.zeros(1))
    return fitting.fit(data, values, rounds=3)


def test_cracks_that_close_by_an_unknown_bell_are_pinching_with_tails() -> None:
    first = {"factor": 0.3, "width": 0.001, "hardening": 0.1}
    (found,) = laws.in_best_laws([cracked({"column.pinching": first})])
    values = found.values["column.pinching"]
    assert CATALOGUE["column.pinching"].laws[int(values["law"])].name == "with tails"
    np.testing.assert_allclose(values["factor"], 0.3, atol=0.06)
    np.testing.assert_allclose(values["hardening"], 0.2, atol=0.06)
    assert found.chi < 1.2 * found.reduced.size


def test_an_effect_whose_left_out_shape_does_what_a_second_effect_does_stands_alone() -> None:
    pinching = {"factor": 0.4, "width": 0.5e-3, "hardening": 0.0, "tails": 2.0, "law": 1.0}
    both = cracked({"column.pinching": pinching, "column.stiffness": {"factor": 1.2}})
    (one,) = alone(both)
    assert one.names == ("column.pinching",)
    assert simplest([both, one])[0] is one


class RubbingDamper:
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
        self.level = np.array([2e-6, 0.02])
        noise = np.random.default_rng(3).standard_normal((self.TICKS, 2))
        self.measured = np.array(rows) + self.level * noise
        self.present = np.ones((self.TICKS, 2), dtype=bool)

    def predict(self, system: System) -> Array:
        return replay.laboratory(TABLE, system, self.drive)[:, 2:]

    def first(self, ticks: int) -> RubbingDamper:
        raise NotImplementedError


def test_friction_with_presliding_is_found_with_its_distance() -> None:
    part = RubbingDamper()
    group, train = residuals.withheld(part.TICKS, INTERVAL)
    data = Data(part, System(Plan()), part.level, part.level, group, train, np.zeros(2))
    before = fitting.fit(data, {"damper.friction": {"force": 2.0, "velocity": 1e-6}})
    (found,) = laws.in_best_laws([before])
    values = found.values["damper.friction"]
    assert CATALOGUE["damper.friction"].laws[int(values["law"])].name == "with presliding"
    np.testing.assert_allclose(values["force"], part.FORCE, rtol=0.01)
    np.testing.assert_allclose(values["presliding"], part.PRESLIDING, rtol=0.03)
    assert fitting.excess(found) < 0.1 * fitting.excess(before)


class LooseTable:
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
        self.level = np.array([5e-6])
        noise = np.random.default_rng(5).standard_normal(self.TICKS)
        self.measured = (np.array(rows) + self.level * noise)[:, None]
        self.present = np.ones((self.TICKS, 1), dtype=bool)

    def predict(self, system: System) -> Array:
        return replay.laboratory(TABLE, system, self.drive)[:, :1]

    def first(self, ticks: int) -> LooseTable:
        raise NotImplementedError


def test_play_behind_the_tables_loop_is_told_from_play_before_it() -> None:
    part = LooseTable()
    group, train = residuals.withheld(part.TICKS, INTERVAL)
    data = Data(part, System(Plan()), part.level, part.level, group, train, np.zeros(1))
    before = fitting.fit(data, {"table.backlash": {"width": 4e-4}})
    (found,) = laws.in_best_laws([before])
    values = found.values["table.backlash"]
    assert CATALOGUE["table.backlash"].laws[int(values["law"])].name == "behind the loop"
    np.testing.assert_allclose(values["width"], part.WIDTH, rtol=0.05)
    assert fitting.excess(found) < 0.2 * fitting.excess(before)


class FrictionDamper(ColumnAlone):
    """A column alone that is a friction damper behind a joint with play, written step by step."""

    PUSH, PULL, JOINT, PLAY = 6e3, 9e3, 20e6, 1e-3

    def __init__(self) -> None:
        self.signals, self.nuisances, self.role = ("column_force",), (), MASTER
        self.candidates = tuple(
            CATALOGUE[f"column.{name}"] for name in ("yielding", "slip", "friction", "viscous", "stiffness")
        )
        self.inputs = swelling()
        place, force = 0.0, np.empty(TICKS)
        for tick, x in enumerate(self.inputs):
            place = min(place, x + 0.5 * self.PLAY + self.PULL / self.JOINT)
            place = max(place, x - 0.5 * self.PLAY - self.PUSH / self.JOINT)
            stretch = x - place
            force[tick] = self.JOINT * (stretch - min(max(stretch, -0.5 * self.PLAY), 0.5 * self.PLAY))
        self.measured = (force + NOISE * np.random.default_rng(3).standard_normal(TICKS))[:, None]
        self.present = np.ones((TICKS, 1), dtype=bool)


def test_a_friction_damper_with_play_is_friction_and_slip_whatever_stiffness_is_planned() -> None:
    group, train = residuals.withheld(TICKS, INTERVAL)
    level = np.array([NOISE])
    part = FrictionDamper()
    data = Data(part, System(Plan()), level, level, group, train, np.zeros(1))
    bare = fitting.fit(data, {})
    found, *_ = laws.coupled(bare, bare)
    friction, slip = found.values["column.friction"], found.values["column.slip"]
    assert friction["force"] == pytest.approx(0.5 * (part.PUSH + part.PULL), rel=0.02)
    assert friction["asymmetry"] == pytest.approx(-0.2, abs=0.01)
    assert slip["gap"] == pytest.approx(part.PLAY, rel=0.05)
    assert found.chi < 1.2 * found.reduced.size


class FluidDamper(FrictionDamper):
    """A column alone that is a fluid damper on brackets: Maxwell's element, integrated in fine steps."""

    COEFFICIENT, EXPONENT, SPRING = 300e3, 0.5, 30e6  # N·s/m at 0.1 m/s

    def __init__(self) -> None:
        super().__init__()
        fine, f = 50, 0.0
        force = np.empty(TICKS)
        for tick, moved in enumerate(np.diff(self.inputs, prepend=0.0)):
            for _ in range(fine):
                given = 0.1 * (abs(f) / (0.1 * self.COEFFICIENT)) ** (1.0 / self.EXPONENT)
                f += self.SPRING * (moved - np.copysign(given, f) * INTERVAL) / fine
            force[tick] = f
        self.measured = (force + NOISE * np.random.default_rng(4).standard_normal(TICKS))[:, None]


def test_a_fluid_damper_is_viscous_with_its_exponent_whatever_stiffness_is_planned() -> None:
    group, train = residuals.withheld(TICKS, INTERVAL)
    level = np.array([NOISE])
    part = FluidDamper()
    data = Data(part, System(Plan()), level, level, group, train, np.zeros(1))
    first = fitting.fit(data, {"column.viscous": {"coefficient": 200e3}})
    (found,) = laws.in_best_laws([first])
    values = found.values["column.viscous"]
    assert values["law"] == 2
    assert values["exponent"] == pytest.approx(part.EXPONENT, rel=0.03)
    assert values["coefficient"] == pytest.approx(part.COEFFICIENT, rel=0.05)
    assert values["stiffness"] == pytest.approx(part.SPRING, rel=0.1)
    assert found.chi < 1.2 * found.reduced.size


class Relaxing(FrictionDamper):
    """A column alone that is a spring beside a spring and a dashpot in series, exact for a constant rate."""

    BRANCH, TIME = 0.25 * K, 0.03  # N/m, s

    def __init__(self) -> None:
        super().__init__()
        fade, f = np.exp(-INTERVAL / self.TIME), 0.0
        force = K * self.inputs
        for tick, moved in enumerate(np.diff(self.inputs, prepend=0.0)):
            f = fade * f + self.BRANCH * moved * self.TIME / INTERVAL * (1.0 - fade)
            force[tick] += f
        self.measured = (force + NOISE * np.random.default_rng(4).standard_normal(TICKS))[:, None]
        self.candidates = tuple(CATALOGUE[name] for name in ("column.viscous", "sensor.column_force.lag"))


def test_a_relaxing_part_is_one_effect_also_where_two_are_found_that_do_the_same() -> None:
    group, train = residuals.withheld(TICKS, INTERVAL)
    level, part = np.array([NOISE]), Relaxing()
    data = Data(part, System(Plan()), level, level, group, train, np.zeros(1))
    start = {"column.viscous": {"coefficient": 150e3}, "sensor.column_force.lag": {"time_constant": 0.01}}
    two = fitting.fit(data, start)
    assert two.chi < 1.2 * two.reduced.size
    stands, _ = simplest([two, *under_others(two)])
    values = stands.values["column.viscous"]
    assert stands.names == ("column.viscous",)
    assert values["law"] == 3
    assert values["stiffness"] == pytest.approx(part.BRANCH, rel=0.05)
    assert values["coefficient"] == pytest.approx(part.BRANCH * part.TIME, rel=0.05)


class SoftlyPlanned(Driven):
    """The column that yields by the pinched law, planned four times as soft as it is."""

    def __init__(self) -> None:
        super().__init__()
        self.candidates = (CATALOGUE["column.yielding"], CATALOGUE["column.stiffness"])


def test_a_column_that_yields_is_found_where_the_planned_stiffness_means_nothing() -> None:
    group, train = residuals.withheld(TICKS, INTERVAL)
    level = np.array([NOISE])
    system = System(Plan()).scaled("column", "stiffness", 0.25)
    data = Data(SoftlyPlanned(), system, level, level, group, train, np.zeros(1))
    bare = fitting.fit(data, {})
    found, *_ = laws.coupled(bare, bare)
    assert set(found.values) == {"column.stiffness", "column.yielding"}
    assert found.values["column.stiffness"]["factor"] == pytest.approx(4.0, rel=0.03)
    assert found.values["column.yielding"]["yield_displacement"] == pytest.approx(LIMIT, rel=0.05)
