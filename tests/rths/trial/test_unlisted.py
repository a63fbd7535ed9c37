"""Effects of no catalogue: each changes what it must, from its seed alone, and not at all at size zero."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.rths.trial.played_labs import Trace, changes, effect, play
from tests.rths.trial.test_scoring import answer, case, judged
from validation.blind.cases.basis import basis
from validation.blind.cases.case import Case, Laid, reality
from validation.blind.cases.computed import building
from validation.blind.draw import begin, draw
from validation.blind.labs.unlisted import every
from validation.blind.sets import HALVES

TRIAL = basis(duration=8.0)
IN_BUILDING = [name for name in every.EFFECTS if every.site(name) in ("ground", "structure")]
IN_LABS = [name for name in every.EFFECTS if name not in IN_BUILDING]


def sized(name: str, end: int) -> dict[str, float]:
    """The first parameter at an end of its range, or at zero before it; the others at their least."""
    ranges = every.EFFECTS[name].ranges
    values = {key: low for key, (low, _) in ranges.items()}
    first = next(iter(ranges))
    return values | {first: (ranges[first][end] if end >= 0 else 0.0)}


@pytest.mark.parametrize("name", IN_LABS)
def test_an_effect_changes_the_readings_of_its_laboratory_and_nothing_at_size_zero(name: str) -> None:
    strong, weak, none = (changes(play(effect(name, **sized(name, end)))) for end in (1, 0, -1))
    assert max(none.values()) == 0.0
    assert 0.0 < max(weak.values()) < max(strong.values()) < 2.0
    site = every.site(name)
    if site.startswith("sensor."):
        assert [signal for signal, change in strong.items() if change] == [site.removeprefix("sensor.")]
    if site == "column":
        assert strong["column_displacement"] == 0.0


@pytest.mark.parametrize("name", ["x.sensor.column_displacement.jumps", "x.table.rattle"])
def test_an_effect_is_the_same_each_time(name: str) -> None:
    one, other = (play(effect(name, **sized(name, 1))) for _ in range(2))
    assert all(np.array_equal(one[key], other[key]) for key in one)


def with_building(name: str, end: int) -> Case:
    first = draw(1, 3, "unlisted_tune", trial=TRIAL)[0]
    return replace(first, laid=(Laid(name, every.site(name), sized(name, end), {}),))


def computed(item: Case) -> Trace:
    """Target and ground acceleration of a case's building, fed with a column that follows at once."""
    step = building(reality(item, silent=True), item.laid)
    rows, place = [], 0.0
    for tick in range(3900):
        row = step(tick, place, 12.5e6 * place, [0.0])
        place = row.target
        rows.append((row.target, row.ground_acceleration))
    return np.array(rows).T


@pytest.mark.parametrize("name", IN_BUILDING)
def test_an_effect_changes_the_building_and_nothing_at_size_zero(name: str) -> None:
    plain = computed(replace(with_building(name, 1), laid=()))
    strong, again = (computed(with_building(name, 1)) for _ in range(2))
    assert np.array_equal(strong, again)
    assert np.array_equal(computed(with_building(name, -1)), plain)
    assert 1e-4 < np.std(strong[0] - plain[0]) / np.std(plain[0]) < 1.0
    assert np.array_equal(strong[1], plain[1]) == (every.site(name) == "structure")


def test_the_sets_share_no_effect_and_have_a_clean_laboratory_in_five() -> None:
    halves = [set(TRIAL.library.half(name)) for name in HALVES]
    assert set.union(*halves) == set(every.EFFECTS)
    assert not set.intersection(*halves)
    assert min(map(len, halves)) >= 15
    for set_, half in zip(("unlisted_tune", "unlisted"), halves, strict=True):
        begun = [begin(index, 7, set_, TRIAL.library) for index in range(len(half) * 5 // 4)]
        assert {name for item in begun for name in item.names} == half
        assert [item.index for item in begun if item.kind == "clean"] == list(range(4, len(begun), 5))


def test_an_effect_of_the_building_is_no_effect_of_the_catalogue_in_the_reality() -> None:
    assert "effect" not in with_building("x.structure.joints", 1).reality()


def test_an_effect_of_no_catalogue_may_be_named_by_its_mechanism() -> None:
    hose = Laid("x.actuator.soft_hose", "actuator", {"loss": 1e-4}, {}, role="master")
    hidden = case("unknown", hose)
    named = judged(hidden, answer("explained", "actuator.compliance", site="actuator"))
    assert (named.right, named.surplus) == (True, 0)
    wrong = judged(hidden, answer("explained", "actuator.gain", site="actuator"))
    assert (wrong.right, wrong.surplus) == (False, 1)
    assert judged(hidden, answer("unknown_effect", site="actuator")).right
