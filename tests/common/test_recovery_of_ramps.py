"""Recovery of a recording whose ticks are followed by the ramps to rest."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest

from common.recording.recover.recovery import recover
from common.recording.writer import Recording
from common.signals import TICK_TOPICS, TOPICS
from tests.common.damaged import PER_FLUSH, RAMPS, TICKS, damaged, records_outside_chunks, values

RAMP = 100  # ticks, behind those of the test


@pytest.fixture(scope="module")
def with_ramp(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of ticks and then the ramps to rest, with a chunk for every 25."""
    path = tmp_path_factory.mktemp("ramp") / "a.mcap"
    recording, noise = Recording(path, "trial", 1, TOPICS), random.Random(1)
    for seq in range(TICKS + RAMP):
        for topic in TICK_TOPICS if seq < TICKS else RAMPS:
            recording.add(topic, seq * 2_000_000, seq * 2_000_000 + 5, values(topic, seq, noise))
        if seq % PER_FLUSH == PER_FLUSH - 1:
            recording.flush()
    recording.close({"outcome": "completed"})
    return path


def without(path: Path, folder: Path, places: slice, *, torn: bool = False) -> Any:
    """The result of recovery after some chunks were overwritten and, where `torn`, the summary was cut off."""
    chunks = [spot for spot in records_outside_chunks(path) if spot[0] == "Chunk"][places]

    def change(data: bytearray) -> None:
        for _, begin, end, _ in chunks:
            data[begin:end] = bytes(end - begin)
        if torn:
            del data[-30:]

    return recover(*damaged(path, folder, change))


@pytest.mark.parametrize("torn", [False, True])
def test_a_gap_among_the_ticks_costs_nothing_of_the_ramps_to_rest(
    with_ramp: Path, tmp_path: Path, torn: bool
) -> None:
    found = without(with_ramp, tmp_path, slice(3, 5), torn=torn)
    assert [hole[:2] for hole in found.topics["master"].missing] == [(75, 124)]
    for topic in RAMPS:
        assert (found.topics[topic].kept, found.topics[topic].missing) == (RAMP, [])


@pytest.mark.parametrize(
    ("chunks", "lost"),
    [
        ((24, 25), (600, 624)),  # the first quarter of the ramp to rest
        ((25, 26), (625, 649)),
        ((26, 28), (650, 699)),
        ((24, 28), (600, 699)),
    ],
)
def test_losses_of_a_ramp_to_rest_are_counted_separately_from_the_ticks(
    with_ramp: Path, tmp_path: Path, chunks: tuple[int, int], lost: tuple[int, int]
) -> None:
    found = without(with_ramp, tmp_path, slice(*chunks))
    assert found.topics["master"].missing == []
    for topic in RAMPS:
        assert [hole[:2] for hole in found.topics[topic].missing] == [lost]
        assert found.topics[topic].kept == RAMP - (lost[1] + 1 - lost[0])


def test_a_gap_across_the_end_of_the_ticks_counts_for_ticks_and_ramp(with_ramp: Path, tmp_path: Path) -> None:
    found = without(with_ramp, tmp_path, slice(23, 25))
    assert [hole[:2] for hole in found.topics["slave"].missing] == [(575, 599)]
    assert [hole[:2] for hole in found.topics["slave_ramp"].missing] == [(600, 624)]
