"""Made-up recordings whose content is known in closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from common.recording.run import CLOCK, Run
from common.roles import SLAVE
from report.facts.circumstances import REAL
from report.facts.summary import SEGMENTS

RECORD = "El Centro 1940 NS (1,559-point version after a zero at t = 0), dt 0.02 s, 1560 points, PGA 0.3188 g"
INTERVAL = 2e-3


def made_up(storeys: int = 1, role: str = SLAVE, record: str = RECORD) -> Run:
    """A second of a test whose targets have their peak in the upper right corner of the picture."""
    t = np.arange(500) * INTERVAL
    rising = 1e-3 * t * np.sin(20.0 * t)
    floors = np.outer(rising, np.arange(1, storeys + 1))
    run = Run(Path("made_up.mcap"), "test", (role,))
    run.columns = {
        "master": {
            "t": t,
            "absolute_acceleration": floors if storeys > 1 else rising,
            "column_target": rising,
            "column_displacement": rising,
        },
        role: {"t": t, "table_target": t, "table_displacement": t},
    }
    for topic in run.columns:
        run.sequences[topic], run.log_ns[topic] = np.arange(t.size), np.arange(t.size)
        run.units[topic], run.texts[topic] = {}, {}
    run.metadata["ground_motion"] = {"record": record, "scale": "0.1"}
    return run


def sinusoid(frequency: float, amplitude: float, delay: float = 0.0, gain: float = 1.0) -> Run:
    """Forty seconds of both transfer systems at one frequency (Hz) and amplitude (m), delayed by `delay` (s).

    The column's target belongs to its own tick, the table's is to be reached one tick later.
    """
    t = np.arange(20_000) * INTERVAL
    omega = 2.0 * np.pi * frequency
    wanted = amplitude * np.sin(omega * t)
    got = gain * amplitude * np.sin(omega * (t - delay))
    to_be_reached = amplitude * np.sin(omega * (t + INTERVAL))
    run = Run(Path("sinusoid.mcap"), "sinusoid")
    run.columns = {
        "master": {"t": t, "column_target": wanted, "column_displacement": got},
        "slave": {"t": t, "table_target": to_be_reached, "table_displacement": got},
    }
    run.sequences = dict.fromkeys(run.columns, np.arange(t.size))
    return run


def with_latency(run: Run, seed: int = 1) -> Run:
    """The recording with every segment of its ticks, some of them late."""
    spread = np.random.default_rng(seed).lognormal(-8.5, 0.8, run.columns["master"]["t"].size)
    run.columns["latency"] = dict.fromkeys(SEGMENTS, spread) | {
        "seq": np.arange(spread.size),
        "deadline_missed": spread > INTERVAL,
    }
    run.metadata[CLOCK] = {"kind": REAL}
    return run
