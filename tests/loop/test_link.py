"""The emulated network and the exchange that it leads to."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import InputError
from common.link.mailbox import Mailbox
from loop.closed_loop import on_time
from loop.exchange import exchange
from models.link.impaired import ImpairedLink

DT = 0.002
TICKS = 60_000


def fates(link: ImpairedLink, direction: str, count: int = TICKS) -> list[float | None]:
    return [link.fate(direction, seq, seq * DT) for seq in range(count)]


@pytest.mark.parametrize(
    ("jitter", "loss", "burst"), [(0.0002, 0.01, 1.0), (0.005, 0.05, 8.0), (0.001, 0.6, 1.0)]
)
def test_delays_and_losses_are_as_asked_for(jitter: float, loss: float, burst: float) -> None:
    found = fates(ImpairedLink(3, delay=0.004, jitter=jitter, loss=loss, burst=burst), "command")
    came = np.array([fate for fate in found if fate is not None])
    lost = np.array([fate is None for fate in found])
    starts = np.sum(lost[1:] & ~lost[:-1])
    assert came.min() == pytest.approx(0.004, abs=1e-3 * jitter)
    assert came.mean() - 0.004 == pytest.approx(jitter, rel=0.03)
    assert came.std() == pytest.approx(jitter, rel=0.04)
    assert lost.mean() == pytest.approx(loss, rel=0.15)
    assert lost.sum() / starts == pytest.approx(max(burst, loss / (1.0 - loss)), rel=0.15)


def test_without_parameters_nothing_happens() -> None:
    assert set(fates(ImpairedLink(5), "feedback", 2000)) == {0.0}


def test_what_becomes_of_a_message_depends_on_seed_direction_and_number_alone() -> None:
    options = {"delay": 0.001, "jitter": 0.001, "loss": 0.1, "burst": 3.0}
    whole = fates(ImpairedLink(1, **options), "command", 1000)
    other = ImpairedLink(1, **options)
    fates(other, "feedback", 700)
    assert [other.fate("command", seq, seq * DT) for seq in range(0, 1000, 7)] == whole[::7]
    assert other.fate("command", 3, 0.0) == whole[3]
    assert fates(other, "feedback", 1000) != whole
    assert fates(ImpairedLink(2, **options), "command", 1000) != whole


@pytest.mark.parametrize(
    "options", [{"delay": -1e-3}, {"jitter": float("nan")}, {"loss": 1.0}, {"loss": -0.1}, {"burst": 0.5}]
)
def test_impossible_networks_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(options))):
        ImpairedLink(1, **options)


def test_without_impairment_every_message_is_on_time() -> None:
    for found, wanted in zip(exchange(500, DT, ImpairedLink(1)), on_time(500), strict=True):
        assert np.array_equal(found, wanted)


@given(
    st.integers(0, 1000),
    st.one_of(st.floats(0.0, 0.03), st.integers(0, 10).map(lambda ticks: ticks * DT)),
    st.floats(0.0, 0.01),
    st.floats(0.0, 0.5),
    st.floats(1.0, 10.0),
)
def test_the_exchange_is_that_of_the_mailboxes(
    seed: int, delay: float, jitter: float, loss: float, burst: float
) -> None:
    def network() -> ImpairedLink:
        return ImpairedLink(seed, delay, jitter, loss, burst)

    ticks = 150
    commands: Mailbox[int] = Mailbox(network(), "command", DT, nominal=0)
    feedbacks: Mailbox[int] = Mailbox(network(), "feedback", DT, nominal=1)
    found = exchange(ticks, DT, network())
    command, feedback = -1, -1
    for tick in range(ticks):
        taken = feedbacks.take(tick)
        feedback = feedback if taken is None else taken
        commands.put(tick, tick)
        taken = commands.take(tick)
        command = command if taken is None else taken
        feedbacks.put(tick, tick)
        assert (found.command[tick], found.feedback[tick]) == (command, feedback)
