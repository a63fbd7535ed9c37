"""Reader of K-NET and KiK-net ASCII files of the Japanese institute NIED.

The format: NIED, "About K-NET ASCII format", www.kyoshin.bosai.go.jp/kyoshin/man/knetform_en.html.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from common.errors import InputError
from models.ground_motion.record import GAL, GroundMotion
from models.ground_motion.source import MotionFile, number, numbers, read_source

HEADER = 17  # lines
ORIGIN, STATION = "Origin Time", "Station Code"
FREQUENCY, DURATION, DIRECTION, SCALE = "Sampling Freq(Hz)", "Duration Time(s)", "Dir.", "Scale Factor"
LAST = "Memo."
LINES = {ORIGIN: 0, STATION: 5, FREQUENCY: 10, DURATION: 11, DIRECTION: 12, SCALE: 13, LAST: 16}

KIK_NET_CHANNELS = {
    "1": "N-S borehole",
    "2": "E-W borehole",
    "3": "U-D borehole",
    "4": "N-S surface",
    "5": "E-W surface",
    "6": "U-D surface",
}
RATIO = re.compile(r"([^\s(]+)\s*\(gal\)\s*/\s*(\S+)", re.IGNORECASE)
HERTZ = re.compile(r"(\S+?)\s*(?:Hz)?", re.IGNORECASE)
EXAMPLES = {FREQUENCY: "100Hz", SCALE: "3920(gal)/6170270"}


def read_knet(path: Path) -> GroundMotion:
    """A motion from 17 header lines and integer counts, with the mean of the whole record removed.

    The counts carry the sensor's offset. NIED takes off the mean of the whole record where it gives
    `Max. Acc.`, and so does this reader: a mean of the part before the event would need the
    arrival of the first wave, which the format does not tell.

    Raises:
        InputError: a header line is missing or impossible, a value is not a finite number, or the number
            of values is not frequency times duration.
    """
    source = read_source(path)
    header = {name: field(source, name) for name in LINES}
    (frequency,) = positive(source, FREQUENCY, HERTZ.fullmatch(header[FREQUENCY]))
    gal, count = positive(source, SCALE, RATIO.fullmatch(header[SCALE]))
    points = announced(frequency * number(header[DURATION], source.at(LINES[DURATION])))
    counts = numbers(source, HEADER)
    if counts.size != points or points < 2:
        raise InputError(
            f"{path} announces {header[DURATION]} s at {frequency:g} Hz, {points} values, in lines 11 and 12"
            f" but holds {counts.size}: get the whole file."
        )
    direction = KIK_NET_CHANNELS.get(header[DIRECTION], header[DIRECTION])
    name = f"{header[STATION]} {direction}, {header[ORIGIN]}"
    return GroundMotion(name, source.version, 1.0 / frequency, GAL * gal / count * (counts - counts.mean()))


def announced(points: float) -> int:
    """A number of points as a whole one; −1, which no file holds, where it is beyond all numbers."""
    return round(points) if math.isfinite(points) else -1


def field(source: MotionFile, name: str) -> str:
    """Value of one header line; raises InputError where the line is not the one of that name."""
    index = LINES[name]
    line = source.lines[index] if index < len(source.lines) else ""
    if not line.startswith(name):
        raise InputError(
            f"Line {source.at(index)} does not begin with '{name}' as in a K-NET file: get the original file,"
            " with its 17 header lines."
        )
    return line.removeprefix(name).strip()


def positive(source: MotionFile, name: str, match: re.Match[str] | None) -> list[float]:
    """The numbers of a matched header value; raises InputError where nothing matched or one is not above 0."""
    where = source.at(LINES[name])
    values = [number(word, where) for word in match.groups()] if match else [0.0]
    if min(values) <= 0.0:
        raise InputError(
            f"{name} at {where} must be above 0 and written as {EXAMPLES[name]}: correct the file."
        )
    return values
