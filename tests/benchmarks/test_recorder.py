"""The recorder's benchmark: how a recording is counted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from benchmarks import recorder
from benchmarks.recorder import Burst
from common.recording.run import Run
from common.signals import TICK_TOPICS

WHOLE = Burst(1500.0, 1499.0, 1400.0, 3000, 0, 0, 0, 0, 0.2)


def test_missing_and_repeated_samples_are_counted() -> None:
    run = Run(Path("any"))
    run.sequences = {topic: np.arange(10) for topic in TICK_TOPICS}
    assert recorder.account(run, 10) == (0, 0)
    run.sequences["slave"] = np.array([0, 1, 1, 2, 3, 4, 5, 6, 9])
    assert recorder.account(run, 10) == (2, 1)
    assert recorder.account(Run(Path("any")), 10) == (10 * len(TICK_TOPICS), 0)


def test_a_recording_without_a_summary_reports_minus_one_lost_items() -> None:
    run = Run(Path("any"))
    assert recorder.reported(run) == -1
    run.metadata["summary"] = {"items_lost": "3", "items_dropped": "4"}
    assert recorder.reported(run) == 7


def test_the_figures_name_the_fastest_burst_without_loss_and_the_first_with_loss() -> None:
    faster = WHOLE._replace(offered=3000.0, sent_again=7)
    lossy = WHOLE._replace(offered=6000.0, missing=300)
    complete, easy, lost = recorder.figures([WHOLE, faster, lossy])
    assert (complete.best, complete.met) == (3000.0, False)
    assert easy.best == 1499.0
    assert lost.best == 0.1
    json.dumps([complete._asdict(), lost._asdict()], allow_nan=False)


def test_a_sample_of_the_pool_has_the_topics_fields() -> None:
    for topic in TICK_TOPICS:
        assert len(recorder.pool(topic)[0]) == len(recorder.values_of(topic)) - 1
