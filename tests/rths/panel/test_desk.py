"""The panel's desk without a browser: numbered orders, replays, several pages, outdated orders, differing plans."""

from __future__ import annotations

from concurrent.futures import Future
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.host.clock import VirtualClock
from report.panel import desk as desks
from report.panel.desk import FRESH_S, NUMBER, Desk, OrderOutcome, PageOrder, Present, TakenOrder
from report.panel.words import WORDS

PLAN, OTHER = "a" * 64, "b" * 64
STOPS = [word for word, one in WORDS.items() if one.of_test and not one.moves]
MOVING = [word for word, one in WORDS.items() if one.moves]


class Recorded:
    """An executor that only records the orders that it is given."""

    def __init__(self) -> None:
        self.present = Present("a-1", PLAN, PLAN)
        self.did: list[str] = []

    def carry_out(self, word: str, digest: str, reason: str) -> Future[OrderOutcome]:
        del digest, reason
        self.did.append(word)
        settled: Future[OrderOutcome] = Future()
        settled.set_result(OrderOutcome("done", str(len(self.did))))
        return settled


class Counter:
    """A desk with a page, whose clock begins at 100 s."""

    def __init__(self) -> None:
        self.executor, self.clock = Recorded(), VirtualClock()
        self.clock.time = 100_000_000_000
        self.desk = Desk(self.executor, self.clock)
        self.page = self.desk.enter()

    @property
    def now(self) -> int:
        return self.clock.time // 1_000_000

    def give(self, word: str, number: int, **changed: object) -> TakenOrder:
        wish = PageOrder(self.page, number, word, self.executor.present.test, PLAN, self.now)
        return self.desk.take(wish._replace(**changed))  # type: ignore[arg-type]


@pytest.fixture
def counter() -> Counter:
    return Counter()


@pytest.mark.parametrize("word", WORDS)
def test_an_order_is_carried_out_once_whatever_its_repetition_contains(word: str, counter: Counter) -> None:
    first = counter.give(word, 1)
    assert counter.executor.did == [word]
    for other in WORDS:
        assert counter.give(other, 1, reason="again", seen=0) is first
    assert counter.executor.did == [word]
    assert first.outcome == OrderOutcome("done", "1")


def test_a_refused_order_stays_refused_when_repeated(counter: Counter) -> None:
    refused = counter.give("start", 1, digest=OTHER)
    assert refused.outcome.state == "refused"
    assert counter.give("start", 1) is refused
    assert counter.executor.did == []


@pytest.mark.parametrize("word", MOVING)
def test_an_order_that_moves_a_rig_must_be_recent_and_for_the_present_test(
    word: str, counter: Counter
) -> None:
    late = round(FRESH_S * 1e3) + 1
    assert "3 s old" in counter.give(word, 1, seen=counter.now - late).outcome.text
    assert counter.give(word, 2, seen=counter.now + 1).outcome.state == "refused"  # of another panel's clock
    assert "another test" in counter.give(word, 3, test="b-2").outcome.text
    counter.give("stop", 9)
    assert "after a later order" in counter.give(word, 8).outcome.text
    assert counter.executor.did == ["stop"]
    assert counter.give(word, 10).outcome.state == "done"


def test_a_start_and_arming_need_the_plan_that_was_shown(counter: Counter) -> None:
    for number, word in enumerate(("arm", "start"), start=1):
        for wrong in (OTHER, ""):
            assert "not the one that the page showed" in counter.give(word, number, digest=wrong).outcome.text
    counter.executor.present = Present(test="a-1", digest=PLAN)  # no plan was checked
    assert counter.give("arm", 5, digest="").outcome.state == "refused"
    assert counter.give("start", 6).outcome.state == "done"


@pytest.mark.parametrize("word", STOPS)
def test_a_stop_is_accepted_out_of_order_or_late_but_not_for_another_test(
    word: str, counter: Counter
) -> None:
    counter.give("stop", 9)
    assert counter.give(word, 3).outcome.state == "done"
    assert counter.give(word, 4, test="b-2").outcome.state == "done"  # the page is about to learn of this one
    assert counter.give(word, 5, seen=0).outcome.state == "done"
    assert counter.give(word, 6, seen=0, test="b-2").outcome.state == "refused"
    counter.executor.present = Present(armable=PLAN)
    assert counter.give(word, 7).outcome.text == "No test runs on this machine."


def test_orders_from_a_page_of_an_earlier_panel_are_refused(counter: Counter) -> None:
    gone = counter.give("stop", 1, session="somebody")
    assert gone.outcome.state == "refused"
    assert "load it anew" in gone.outcome.text
    assert counter.executor.did == []
    assert list(counter.desk.newest) == []


def test_two_pages_number_their_orders_independently_and_see_each_others(counter: Counter) -> None:
    other = counter.desk.enter()
    assert other != counter.page
    assert counter.give("stop", 1) is not counter.give("stop", 1, session=other)
    assert [entry.page for entry in counter.desk.newest] == [2, 1]


@pytest.mark.parametrize("number", [0, -1, NUMBER])
def test_an_order_with_an_impossible_number_is_refused(number: int, counter: Counter) -> None:
    assert counter.give("stop", number).outcome.state == "refused"
    assert counter.give("stop", 1).outcome.state == "done"


def test_an_order_that_is_no_longer_kept_is_not_carried_out_again(
    counter: Counter, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(desks, "KEPT", 5)
    for number in range(1, 10):
        counter.give("stop", number)
    assert counter.give("stop", 2).outcome.state == "refused"
    assert counter.executor.did == ["stop"] * 9


def test_active_pages_are_kept_and_the_page_that_was_silent_longest_is_dropped(
    counter: Counter, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(desks, "PAGES", 3)
    second = counter.desk.enter()
    for _ in range(5):
        assert counter.desk.page(counter.page)
        counter.desk.enter()
    assert counter.desk.page(counter.page)
    assert not counter.desk.page(second)


class Step(NamedTuple):
    page: int
    number: int
    word: str
    age_ms: int
    test: str
    digest: str
    there: bool  # whether a test runs


steps = st.builds(
    Step,
    st.integers(0, 2),
    st.integers(-1, 6),
    st.sampled_from([*WORDS, "nonsense"]),
    st.sampled_from([-1, 0, 2999, 3001, 60_000]),
    st.sampled_from(["a-1", "b-2", ""]),
    st.sampled_from([PLAN, OTHER, ""]),
    st.booleans(),
)


@given(st.lists(steps, max_size=60))
def test_no_sequence_of_orders_moves_a_rig_unasked_or_loses_a_stop(story: list[Step]) -> None:
    counter = Counter()
    pages = [counter.page, counter.desk.enter(), "nobody"]
    first: dict[tuple[str, int], TakenOrder] = {}
    highest: dict[str, int] = {}
    for step in story:
        counter.clock.time += 1_000_000
        counter.executor.present = Present("a-1", PLAN, PLAN) if step.there else Present(armable=PLAN)
        name, before = pages[step.page], len(counter.executor.did)
        entry = counter.give(
            step.word,
            step.number,
            session=name,
            seen=counter.now - step.age_ms,
            test=step.test,
            digest=step.digest,
        )
        did = counter.executor.did[before:]
        known = name != "nobody" and step.number > 0
        if (name, step.number) in first:
            assert entry is first[name, step.number]
            assert did == []
            continue
        if known:
            first[name, step.number] = entry
        assert did in ([], [step.word])
        word, fresh = WORDS.get(step.word), 0 <= step.age_ms <= FRESH_S * 1e3
        same = step.test == counter.executor.present.test
        if did and word is not None and word.moves:
            assert (known, fresh, same) == (True, True, True)
            assert step.number > highest.get(name, 0)
            assert step.digest == PLAN or not word.planned
        if word is not None and word.of_test and not word.moves and known and step.there:
            assert bool(did) == (fresh or same)
        if known:
            highest[name] = max(step.number, highest.get(name, 0))
