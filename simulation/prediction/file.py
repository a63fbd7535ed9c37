"""A prediction as a recording: the predicted test on the topics of a test, its band on topics of their own."""

from __future__ import annotations

import json
from pathlib import Path

from common.errors import InputError
from common.recording.run import Run
from common.roles import MASTER
from common.signals import Signal
from laboratories import kinds
from loop import substructure
from loop.signals import rows
from recorder import files
from simulation.prediction.bands import HELD, Prediction, plain

LOWER, UPPER = "lower", "upper"  # prefixes of the topics for the ends of the band
ABOUT = (
    "prediction"  # metadata: the share of the time for which the band should hold, and the figures as JSON
)


def band_topic(end: str, topic: str) -> str:
    """The topic of one end of the band."""
    return f"{end}.{topic}"


def write(path: Path, found: Prediction, source: str) -> None:
    """Write a prediction that was made with the findings in the file `source`."""
    plan = found.plan
    more: dict[str, tuple[Signal, ...]] = {
        band_topic(end, topic): signals
        for end in (LOWER, UPPER)
        for topic, signals in kinds.topics(plan).items()
        if topic in (MASTER, *plan.roles)
    }
    ground = substructure.ground_rows(plan, found.motion)
    recording = files.begin(path, plan, (found.motion, ground), more=more)
    recording.metadata(
        ABOUT, {"band": repr(HELD), "found": source, "figures": json.dumps(plain(found), allow_nan=False)}
    )
    ends = {"": found.middle, LOWER: found.low, UPPER: found.high}
    for same_tick in zip(*(rows(plan, rollout) for rollout in ends.values()), strict=True):
        for end, (topic, values) in zip(ends, same_tick, strict=True):
            at = plan.tick_ns(values[0])
            recording.add(band_topic(end, topic) if end else topic, at, at, values)
    recording.close(
        {
            "outcome": "simulation",
            "cause": "prediction: laboratories as found, band of those drawn",
        }
    )


def about(run: Run) -> dict[str, object]:
    """The figures of a prediction that was read; raises InputError where the recording is not a prediction."""
    given = run.metadata.get(ABOUT, {})
    try:
        figures = json.loads(given["figures"])
        figures["band"] = float(given["band"])
    except (KeyError, ValueError, TypeError):
        raise InputError(f"{run.path} is no prediction: give a file that `rths predict -o` wrote.") from None
    return dict(figures)
