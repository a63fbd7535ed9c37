"""The impaired link follows its parameters, is repeatable, and treats each direction independently."""

from __future__ import annotations

from itertools import groupby

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import InputError
from common.link.mailbox import Mailbox, PerfectLink
from loop.closed_loop import on_time
from loop.exchange import exchange
from models.link.impaired import ImpairedLink

MESSAGES = 40_000
INTERVAL = 0.002


def fates(link: ImpairedLink, direction: str = "command", count: int = MESSAGES) -> list[float | None]:
    """The fates of the first messages: their extra delay, None where lost."""
    return [link.fate(direction, seq, seq * INTERVAL) for seq in range(count)]


def runs(lost: list[bool]) -> list[int]:
    """Lengths of runs of lost messages."""
    return [len(list(group)) for gone, group in groupby(lost) if gone]


def test_without_impairment_no_message_is_delayed_or_lost() -> None:
    link = ImpairedLink(seed=3)
    assert set(fates(link)) == {0.0}
    found, planned = exchange(500, INTERVAL, link), on_time(500)
    assert np.array_equal(found.command, planned.command)
    assert np.array_equal(found.feedback, planned.feedback)
    assert np.array_equal(exchange(500, INTERVAL, PerfectLink()).feedback, planned.feedback)


@pytest.mark.parametrize(("delay", "jitter"), [(0.004, 0.0), (0.0, 0.002), (0.003, 0.001)])
def test_delays_have_the_mean_and_the_scatter_asked_for(delay: float, jitter: float) -> None:
    drawn = np.array(fates(ImpairedLink(1, delay=delay, jitter=jitter)), dtype=np.float64)
    assert drawn.min() >= delay
    assert drawn.mean() == pytest.approx(delay + jitter, rel=0.02)
    assert drawn.std() == pytest.approx(jitter, rel=0.03, abs=1e-12)


def test_delays_of_another_shape_have_the_mean_of_their_gamma_distribution() -> None:
    drawn = np.array(fates(ImpairedLink(1, delay=0.001, jitter=0.002, jitter_shape=2.25)), dtype=np.float64)
    assert drawn.mean() == pytest.approx(0.001 + 1.5 * 0.002, rel=0.02)
    assert drawn.std() == pytest.approx(0.002, rel=0.03)


@pytest.mark.parametrize(("loss", "burst"), [(0.01, 1.0), (0.05, 4.0), (0.3, 2.0), (0.02, 20.0)])
def test_losses_have_the_share_and_the_burst_length_asked_for(loss: float, burst: float) -> None:
    lost = [fate is None for seed in range(4) for fate in fates(ImpairedLink(seed, loss=loss, burst=burst))]
    assert np.mean(lost) == pytest.approx(loss, rel=0.15)
    assert np.mean(runs(lost)) == pytest.approx(burst, rel=0.15)


def test_heavy_losses_have_the_longer_bursts_that_their_share_requires() -> None:
    lost = [fate is None for fate in fates(ImpairedLink(0, loss=0.8, burst=1.0))]
    assert np.mean(lost) == pytest.approx(0.8, rel=0.03)
    assert np.mean(runs(lost)) == pytest.approx(4.0, rel=0.05)


def test_losses_do_not_depend_on_delays() -> None:
    one = fates(ImpairedLink(5, loss=0.1, burst=3.0))
    other = fates(ImpairedLink(5, delay=0.01, jitter=0.003, loss=0.1, burst=3.0))
    assert [fate is None for fate in one] == [fate is None for fate in other]


@given(st.integers(0, 2**32), st.lists(st.integers(0, 3000), min_size=1, max_size=30))
def test_the_fate_of_a_message_depends_on_its_number_only(seed: int, order: list[int]) -> None:
    one, other = (ImpairedLink(seed, delay=0.001, jitter=0.002, loss=0.2, burst=2.0) for _ in range(2))
    expected = fates(one, "feedback", 3001)
    for seq in order:
        other.fate("command", seq, 0.0)  # the other direction in between changes nothing
        assert other.fate("feedback", seq, 99.0) == expected[seq]
        assert other.fate("feedback", seq, 0.0) == expected[seq]


def test_directions_and_seeds_are_independent() -> None:
    link, again = (ImpairedLink(seed, jitter=0.002, loss=0.1) for seed in (1, 2))
    drawn = [
        np.array([np.nan if fate is None else fate for fate in fates(*which)])
        for which in ((link, "command"), (link, "feedback"), (again, "command"))
    ]
    for one, other in ((0, 1), (0, 2)):
        there = np.isfinite(drawn[one]) & np.isfinite(drawn[other])
        assert abs(np.corrcoef(drawn[one][there], drawn[other][there])[0, 1]) < 0.03
        both = np.isnan(drawn[one]) & np.isnan(drawn[other])
        assert np.mean(both) == pytest.approx(0.01, rel=0.3)


@pytest.mark.parametrize(
    "options",
    [
        {"delay": -0.001},
        {"delay": np.nan},
        {"delay": np.inf},
        {"jitter": -1.0},
        {"loss": 1.0},
        {"loss": -0.1},
        {"loss": np.nan},
        {"burst": 0.5},
        {"burst": np.inf},
        {"jitter_shape": 0.0},
    ],
)
def test_impossible_link_parameters_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(options))):
        ImpairedLink(0, **options)


@given(
    st.integers(0, 1000),
    st.one_of(st.floats(0.0, 0.03), st.integers(0, 10).map(lambda ticks: ticks * INTERVAL)),
    st.floats(0.0, 0.01),
    st.floats(0.0, 0.5),
    st.floats(1.0, 10.0),
)
def test_the_compiled_exchange_equals_that_of_mailboxes(
    seed: int, delay: float, jitter: float, loss: float, burst: float
) -> None:
    options = {"delay": delay, "jitter": jitter, "loss": loss, "burst": burst}
    ticks = 150
    found = exchange(ticks, INTERVAL, ImpairedLink(seed, **options))
    for direction, nominal, used in (("command", 0, found.command), ("feedback", 1, found.feedback)):
        box: Mailbox[int] = Mailbox(ImpairedLink(seed, **options), direction, INTERVAL, nominal)
        newest = -1
        for tick in range(ticks):
            if nominal == 0:
                box.put(tick, tick)
            taken = box.take(tick)
            newest = newest if taken is None else taken
            assert used[tick] == newest, (direction, tick)
            if nominal == 1:
                box.put(tick, tick)
