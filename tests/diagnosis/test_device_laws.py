"""Laws of devices in a column's place: dampers, parts that relax, and columns whose planned stiffness means nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from common.plan.plan import Plan
from common.roles import MASTER
from diagnosis.fits import fitting
from diagnosis.fits.laws.best import in_best_laws
from diagnosis.fits.laws.coupled import coupled
from diagnosis.fits.trade import simplest, under_others
from diagnosis.recorded.column_alone import ColumnAlone
from laboratories.effects import CATALOGUE
from models.system import System
from tests.diagnosis.specimens import INTERVAL, LIMIT, NOISE, TICKS, Driven, K, data_of, swelling


class FrictionDamper(ColumnAlone):
    """A column alone that is a friction damper behind a joint with play, written step by step."""

    PUSH, PULL, JOINT, PLAY = 6e3, 9e3, 20e6, 1e-3

    def __init__(self, laboratory: str = "") -> None:
        self.signals, self.nuisances, self.role = ("column_force",), (), MASTER
        self.candidates = tuple(
            replace(
                CATALOGUE[f"column.{name}"], name=f"{laboratory}column.{name}", site=f"{laboratory}column"
            )
            for name in ("yielding", "slip", "friction", "viscous", "stiffness")
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


@pytest.mark.long
@pytest.mark.parametrize("laboratory", ["", "slave.above."])
def test_a_friction_damper_with_play_is_friction_and_slip_whatever_stiffness_is_planned(
    laboratory: str,
) -> None:
    part = FrictionDamper(laboratory)
    data = replace(data_of(part), catalogue={effect.name: effect for effect in part.candidates})
    bare = fitting.fit(data, {})
    found, *_ = coupled(bare, [bare])
    friction, slip = (found.values[f"{laboratory}column.{name}"] for name in ("friction", "slip"))
    assert friction["force"] == pytest.approx(0.5 * (part.PUSH + part.PULL), rel=0.02)
    assert friction["asymmetry"] == pytest.approx(-0.2, abs=0.01)
    assert slip["gap"] == pytest.approx(part.PLAY, rel=0.05)
    assert found.chi < 1.2 * found.reduced.size


def test_no_effects_of_one_model_are_tried_beside_a_fit_that_leaves_only_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data = data_of(FrictionDamper())
    bare = fitting.fit(data, {})
    quiet = replace(bare, reduced=np.random.default_rng(1).standard_normal(bare.reduced.shape))
    monkeypatch.setattr("diagnosis.fits.laws.coupled.follow", None)
    assert coupled(bare, [quiet]) == []


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


@pytest.mark.long
def test_a_fluid_damper_is_viscous_with_its_exponent_whatever_stiffness_is_planned() -> None:
    part = FluidDamper()
    data = data_of(part)
    first = fitting.fit(data, {"column.viscous": {"coefficient": 200e3}})
    (found,) = in_best_laws([first])
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


@pytest.mark.long
def test_a_relaxing_part_is_one_effect_also_where_two_are_found_that_do_the_same() -> None:
    part = Relaxing()
    data = data_of(part)
    start = {"column.viscous": {"coefficient": 150e3}, "sensor.column_force.lag": {"time_constant": 0.01}}
    two = fitting.fit(data, start)
    assert two.chi < 1.2 * two.reduced.size
    stands, _ = simplest([two, *under_others(two)])
    values = stands.values["column.viscous"]
    assert stands.names == ("column.viscous",)
    assert values["law"] == 3
    assert values["stiffness"] == pytest.approx(part.BRANCH, rel=0.05)
    assert values["coefficient"] == pytest.approx(part.BRANCH * part.TIME, rel=0.05)


@pytest.mark.slow
def test_a_specimen_that_no_first_law_is_like_is_found_by_its_force_over_deformation() -> None:
    data = data_of(Driven())
    bare = fitting.fit(data, {})
    found, *_ = coupled(bare, [bare])
    assert found.names == ("column.yielding",)
    assert found.values["column.yielding"]["asymmetry"] == pytest.approx(Driven.TRUE["asymmetry"], abs=0.01)
    tried = fitting.fit(
        data, {"column.yielding": CATALOGUE["column.yielding"].values({"yield_displacement": LIMIT})}
    )
    assert all(item.names != found.names for item in coupled(bare, [tried]))


class SoftlyPlanned(Driven):
    """The column that yields by the pinched law, planned four times as soft as it is."""

    def __init__(self) -> None:
        super().__init__()
        self.candidates = (CATALOGUE["column.yielding"], CATALOGUE["column.stiffness"])


@pytest.mark.long
def test_a_column_that_yields_is_found_where_the_planned_stiffness_means_nothing() -> None:
    data = data_of(SoftlyPlanned(), System(Plan()).scaled("column", "stiffness", 0.25))
    bare = fitting.fit(data, {})
    found, *_ = coupled(bare, [bare])
    assert set(found.values) == {"column.stiffness", "column.yielding"}
    assert found.values["column.stiffness"]["factor"] == pytest.approx(4.0, rel=0.03)
    assert found.values["column.yielding"]["yield_displacement"] == pytest.approx(LIMIT, rel=0.05)
