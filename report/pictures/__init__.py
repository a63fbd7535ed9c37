"""The pictures of a recording, one module each: what `rths plot` can draw."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from common.recording.run import Run
from report.facts.circumstances import VIRTUAL, clock_of
from report.facts.machine import by_itself
from report.pictures import histories, hysteresis, latency, spectra, synchronisation, tracking
from report.pictures.figure import DOUBLE, SINGLE


class Picture(NamedTuple):
    """One picture: `draw` takes a recording with one slave at most, and an empty figure of one of the two sizes.

    It returns False and leaves the figure empty where the recording lacks the signals. Where the recording has some of
    them, the figure shrinks to these.
    """

    name: str
    text: str  # what it shows, and what to look for
    needs: str  # the signals without which there is none
    size: tuple[float, float]  # inches, for one column
    double: tuple[float, float]  # inches, across two columns
    draw: Callable[[Run, Any], bool]
    alone: str = ""  # what it shows of a machine by itself, where that is something else

    def on(self, recording: Run, canvas: Any) -> bool:
        """Draw; False where the recording lacks the signals, or holds numbers that cannot be drawn."""
        try:
            return self.draw(recording, canvas)
        except (ValueError, ArithmeticError, MemoryError):
            return False


def shows(recording: Run, picture: Picture) -> str:
    """What a picture of a recording shows: no building where none was recorded."""
    return (picture.alone if by_itself(recording) else "") or picture.text


def needs(recording: Run, picture: Picture) -> str:
    """The signals that a picture needs, and why a test in virtual time has no latency."""
    if picture.name == "histories" and by_itself(recording):
        return "a force, an acceleration, or a motion beside which a force is drawn"
    virtual = picture.name == "latency" and clock_of(recording) == VIRTUAL
    return picture.needs + (", and this one ran in virtual time" if virtual else "")


_ALL = (
    Picture(
        "histories",
        "ground, laboratories and floors over time, which show growing drift, clipped peaks and holes",
        "any motion or force of ground, floors or laboratories",
        (SINGLE, 5.6),
        (DOUBLE, 6.0),
        histories.draw,
        "the machine over time, which shows drift, clipped peaks and holes",
    ),
    Picture(
        "hysteresis",
        "force over motion in the laboratories, with the energy absorbed: a loop that turns the other way "
        "puts energy in",
        "the measured displacement or stroke and the force of a laboratory",
        (SINGLE, 4.6),
        (DOUBLE, 2.9),
        hysteresis.draw,
    ),
    Picture(
        "synchronisation",
        "measured over target of each transfer system: a delay opens the line to a loop, an amplitude error tilts it",
        "the target and the measured displacement of a laboratory",
        (SINGLE, 6.2),
        (DOUBLE, 3.8),
        synchronisation.draw,
        "measured over target of the machine: a delay opens the line to a loop, an amplitude error tilts it",
    ),
    Picture(
        "tracking",
        "target, measurement and error around the strongest motion: an error shaped like velocity means delay; "
        "shaped like the target, wrong amplitude",
        "the target and the measured displacement of a laboratory",
        (SINGLE, 5.2),
        (DOUBLE, 3.6),
        tracking.draw,
    ),
    Picture(
        "spectra",
        "amplitude density of ground, laboratories and tracking errors over frequency, which shows errors near the "
        "natural frequency and peaks that no model has",
        "ground_acceleration or the motion of a laboratory over 64 ticks or more",
        (SINGLE, 4.6),
        (DOUBLE, 4.6),
        spectra.draw,
        "amplitude density of the machine's motion and of its tracking error over frequency",
    ),
    Picture(
        "latency",
        "percentiles of every part of a tick, and the round trip over the test: what comes near the interval",
        "latency of a test in real time",
        (SINGLE, 4.8),
        (DOUBLE, 4.8),
        latency.draw,
    ),
)
PICTURES: dict[str, Picture] = {picture.name: picture for picture in _ALL}
