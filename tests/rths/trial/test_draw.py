"""The drawing of cases: reproducible by seed, different between sets, with truths and effects in their ranges."""

from __future__ import annotations

import hashlib
import json
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError
from common.plan import read as plans
from common.reality import reality as realities
from common.roles import MASTER, SLAVE
from laboratories.effects.effect import Effect, Parameter
from laboratories.effects.reading import SIGNALS
from laboratories.table.effects.damper.friction import EFFECT as FRICTION
from models.system import System
from validation.blind import lots
from validation.blind.cases.basis import TrialBasis, basis
from validation.blind.cases.case import Case
from validation.blind.cases.truths import NOISE, UNCERTAIN
from validation.blind.draw import (
    Beginning,
    begin,
    between,
    distances,
    draw_parameter,
    drawn,
    numbered,
    of_catalogue,
)
from validation.blind.draw import draw as draw_of
from validation.blind.library import Library, Stranger
from validation.blind.sets import SHARES


def softer(system: System, factor: float) -> System:
    return system.scaled("column", "stiffness", factor)


FACTOR = Parameter("factor", "", null=1.0, least=0.1, most=10.0, sizes=(1.01, 1.05, 1.3))
STIFFNESS = Effect("column.stiffness", "column", "physics", "", (FACTOR,), "", softer)
LIBRARY = Library(
    {"damper.friction": FRICTION, "column.stiffness": STIFFNESS},
    {"damper.friction": ("lugre", "dahl")},
    {"damper.cable": Stranger("damper", {"force": (1.0, 10.0)})},
    {"damper.friction": (SLAVE,), "column.stiffness": (MASTER,), "damper.cable": (SLAVE,)},
    (MASTER, SLAVE),
)
TRIAL = basis(library=LIBRARY)


@pytest.fixture(scope="module")
def shipped() -> TrialBasis:
    """The trial of the default test."""
    return basis()


def draw(count: int, seed: int, set_: str, *, duration: float = 30.0, **asked: Any) -> list[Case]:
    """Cases of the few effects here, or of `library`."""
    library = asked.pop("library", LIBRARY)
    return draw_of(count, seed, set_, trial=replace(TRIAL, library=library, duration=duration), **asked)


@pytest.mark.long
def test_a_case_does_not_depend_on_the_number_of_cases() -> None:
    few, many = draw(3, 5, "judge"), draw(12, 5, "judge")
    assert many[:3] == few
    assert draw(1, 6, "judge") != few[:1]


@pytest.mark.long
def test_cases_with_given_numbers_are_those_of_the_set() -> None:
    every = {case.index: case for case in draw(12, 5, "judge")}
    assert [case.index for case in every.values()] == list(range(12))
    assert numbered([7, 2, 7], 5, "judge", trial=TRIAL) == [every[2], every[7]]


def test_a_number_of_which_a_plan_has_no_case_is_refused() -> None:
    trial = replace(TRIAL, library=replace(LIBRARY, strangers={}))
    missing = next(case.index for case in draw(40, 5, "judge") if case.kind == "unknown")
    with pytest.raises(InputError, match=rf"Case {missing} does not exist: it is of the kind unknown"):
        numbered([missing], 5, "judge", trial=trial)


def test_the_sets_are_disjoint() -> None:
    judge, tune = draw(30, 5, "judge"), draw(30, 5, "tune")
    assert not {case.seed for case in judge} & {case.seed for case in tune}


def test_cases_that_are_not_asked_for_are_skipped() -> None:
    every = {case.index: case for case in draw(60, 2, "tune")}
    pairs = draw(2, 2, "tune", only=["pair"])
    assert pairs == [case for case in every.values() if case.kind == "pair"][:2]
    named = draw(4, 2, "tune", effects=["damper.friction"])
    assert {item.name for case in named for item in case.laid} == {"damper.friction"}
    assert all(case.laid for case in named)


def test_kinds_of_cases_are_drawn_in_their_shares() -> None:
    kinds = [begin(index, 0, "judge", LIBRARY).kind for index in range(4000)]
    for kind, share in SHARES.items():
        assert kinds.count(kind) / 4000 == pytest.approx(share, abs=0.025)


def test_truths_are_inside_the_tolerances_and_noise_is_common() -> None:
    for case in draw(20, 3, "judge"):
        for table, names in UNCERTAIN.items():
            for name in names:
                ratio = np.asarray(case.truths[table][name]) / np.asarray(case.plan[table][name])
                assert np.all(np.abs(ratio - 1.0) <= 0.02)
        factors = [level / case.plan["sensors"][name] for name, level in case.truths["sensors"].items()]
        assert np.ptp(factors) < 1e-12
        assert NOISE[0] <= factors[0] <= NOISE[1]


def test_every_case_makes_a_plan_and_a_reality() -> None:
    for case in draw(20, 4, "judge", duration=3.0):
        plan = plans.from_tables(case.plan, Path())
        truth = realities.from_reality(case.reality(), plan, Path())
        assert truth.seed == case.seed != plan.test.seed
        assert plan.test.duration == 3.0
        own = case.kind in ("formula", "unknown")
        assert bool(truth.hidden) == own
        silent = case.reality((), silent=True)
        assert not any(silent["sensors"].values())
        assert "effect" not in silent


def test_the_independent_laboratory_has_the_true_parameters() -> None:
    case = draw(1, 4, "judge", only=["formula"])[0]
    options = case.reality()["slave"]["rig"]["options"]
    assert options["damper"]["mass"] == case.truths["damper"]["mass"]
    assert options["damper"]["force_scale"] == case.plan["damper"]["force_scale"]
    assert options["sensors"] == case.truths["sensors"]
    assert options["effects"][0]["formula"] in ("lugre", "dahl")
    assert case.reality((), silent=True)["slave"]["rig"]["options"]["effects"] == []


def test_a_factor_is_drawn_above_and_below_one_between_its_sizes() -> None:
    generator = np.random.default_rng(0)
    values = np.array([draw_parameter(generator, FACTOR) for _ in range(500)])
    moves = np.abs(values - 1.0)
    assert 0.3 < np.mean(values > 1.0) < 0.7
    assert moves.min() >= 0.01 - 1e-9
    assert moves.max() <= 0.3 + 1e-9
    assert np.median(moves) == pytest.approx(math.sqrt(0.01 * 0.3), rel=0.25)
    strong = [abs(draw_parameter(generator, FACTOR, "strong") - 1.0) for _ in range(100)]
    assert min(strong) >= math.sqrt(0.01 * 0.3) - 1e-9


def test_a_force_is_drawn_on_one_side_and_a_limit_without_a_null_value() -> None:
    generator = np.random.default_rng(0)
    assert len(distances(FRICTION.parameters[0])) == 1
    limit = Parameter("force", "N", null=math.inf, least=1.0, most=1e6, sizes=(200.0, 50.0))
    values = [draw_parameter(generator, limit) for _ in range(100)]
    assert min(values) >= 50.0
    assert max(values) <= 200.0
    assert max(draw_parameter(generator, limit, "strong") for _ in range(100)) <= 100.0
    assert -3.0 <= between(generator, -1.0, -3.0) <= -1.0
    assert -1.0 <= between(generator, -1.0, 3.0) <= 3.0


def test_an_effect_within_the_tolerances_is_not_a_gap() -> None:
    cases = draw(150, 1, "judge", effects=["column.stiffness"], only=["catalogue"])
    assert {case.inside for case in cases} == {True, False}
    for case in cases:
        total = case.truths["column"]["stiffness"] * case.laid[0].parameters["factor"] / 12.5e6
        assert case.inside == (abs(total - 1.0) <= 0.02)


def test_unknown_names_and_empty_choices_are_refused() -> None:
    with pytest.raises(InputError, match="did you mean clean"):
        draw(1, 0, "judge", only=["cleen"])
    with pytest.raises(InputError, match=r"did you mean damper\.friction"):
        draw(1, 0, "judge", effects=["damper.fricton"])


def test_clean_cases_with_an_effect_asked_for_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("validation.blind.draw.PATIENCE", 200)
    with pytest.raises(InputError, match="There is no case of kind clean with damper"):
        draw(1, 0, "judge", only=["clean"], effects=["damper.friction"])


def test_the_drift_of_a_drawn_case_is_plausible() -> None:
    assert TRIAL.drift("el_centro_1940_ns", damper=True) == pytest.approx(0.0489, rel=0.02)
    for case in draw(10, 8, "judge"):
        motion = case.plan["ground_motion"]
        drift = motion["scale"] * TRIAL.drift(motion["record"], damper=case.plan["control"]["amd"])
        assert 2.9e-3 < drift < 10.1e-3


def magnet(system: System, rise: float) -> System:
    return system.laid("damper", gain=1.0 - rise)


RISE = Parameter("rise", "K", null=0.0, least=0.0, most=0.9, sizes=(0.02, 0.05, 0.1, 0.2))
MADE_UP = Effect("damper.magnet", "damper", "physics", "warm magnets", (RISE,), "none", magnet)
OF_READING = replace(
    MADE_UP, name="sensor.damper_force.hum", site="sensor.damper_force", signal="damper_force", fault="hum"
)


CASES, WHOLE = 600, 6  # cases that are begun, and those of them that are drawn to their end


@pytest.fixture(scope="module")
def begun(shipped: TrialBasis) -> list[Beginning]:
    """The first cases drawn from the present catalogue."""
    return [begin(index, 2026, "judge", shipped.library) for index in range(CASES)]


@pytest.mark.long
@pytest.mark.parametrize("added", [MADE_UP, OF_READING], ids=["physics", "reading"])
def test_an_added_effect_does_not_change_the_cases_of_other_effects(
    added: Effect, shipped: TrialBasis, begun: list[Beginning]
) -> None:
    old = shipped.library
    new = replace(old, catalogue={added.name: added, **old.catalogue})
    mine = whole = 0
    for index, before in enumerate(begun):
        after = begin(index, 2026, "judge", new)
        if added.name in after.names:
            mine += 1
            assert after.kind in ("catalogue", "pair")
            continue
        assert after == before
        if after.names and whole < WHOLE:
            whole += 1
            assert drawn(after, replace(shipped, library=new)) == drawn(before, shipped)
    assert whole == WHOLE
    families = len({effect.family for effect in new.catalogue.values()})
    expected = CASES * (SHARES["catalogue"] + 2.0 * SHARES["pair"]) / families
    assert expected / 2.0 < mine < expected * 2.0


def test_an_added_parameter_does_not_change_the_others() -> None:
    parameters = (replace(RISE, name="warmth"), *FRICTION.parameters)
    more = replace(FRICTION, parameters=parameters, apply=lambda system, **_: system)
    library = replace(LIBRARY, catalogue={**LIBRARY.catalogue, FRICTION.name: more})
    for old, new in zip(
        *(draw(5, 7, "judge", effects=[FRICTION.name], library=item) for item in (LIBRARY, library)),
        strict=True,
    ):
        assert new.laid[0].parameters.items() >= old.laid[0].parameters.items()
        assert (new.plan, new.truths, new.seed) == (old.plan, old.truths, old.seed)


def test_every_family_of_effects_is_drawn_equally_often_with_every_signal(shipped: TrialBasis) -> None:
    library = shipped.library
    names = [of_catalogue(library, 1, "judge", index, "effect") for index in range(3000)]
    families = Counter(library.catalogue[name].family for name in names)
    assert set(families) == {effect.family for effect in library.catalogue.values()}
    usual = 3000 / len(families)
    assert all(abs(count - usual) < 5.0 * math.sqrt(usual) for count in families.values())
    drawn = [library.catalogue[name] for name in names if library.catalogue[name].signal]
    having = Counter(effect.fault for effect in library.catalogue.values() if effect.signal)
    signals = Counter(one.signal for one in drawn if having[one.fault] == len(SIGNALS))
    assert len(signals) == len(SIGNALS)
    usual = signals.total() / len(signals)
    assert all(abs(count - usual) < 3.0 * math.sqrt(usual) for count in signals.values())


def test_a_pair_hides_two_different_effects() -> None:
    pairs = [begin(index, 4, "judge", LIBRARY).names for index in range(300)]
    assert {frozenset(names) for names in pairs if len(names) == 2} == {frozenset(LIBRARY.catalogue)}


def test_the_draw_is_the_same_on_every_machine() -> None:
    assert lots.number(1, "judge", 0, "kind") == 125882383115718818466265700442863281400
    assert lots.chosen(("a", "b", "c"), 1) == lots.chosen(("c", "b", "a"), 1)


def rounded(value: Any) -> Any:
    """Numbers to twelve digits: the last ones differ between processors."""
    if isinstance(value, float):
        return float(f"{value:.12g}")
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return [rounded(item) for item in value] if isinstance(value, list | tuple) else value


def test_the_cases_of_the_default_test_are_unchanged(shipped: TrialBasis) -> None:
    cases = draw_of(20, 2026, "judge", trial=shipped)
    facts = [(case.index, case.kind, case.truths, case.seed, case.inside) for case in cases]
    tests = [
        (case.plan["test"]["seed"], case.plan["ground_motion"], case.plan["control"]["amd"]) for case in cases
    ]
    laid = [[(item.name, item.parameters, item.formula) for item in case.laid] for case in cases]
    text = json.dumps(rounded([facts, tests, laid]), sort_keys=True)
    assert hashlib.blake2b(text.encode(), digest_size=8).hexdigest() == "ed0bcf4f278c8dce"
