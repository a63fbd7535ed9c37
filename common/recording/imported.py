"""What an imported recording states about the data logger that recorded its channels.

`rths import` writes a metadata record `import`, and `imported` reads it into typed records:

    found = imported(run)                                # None: the test was recorded by rths itself
    if found is not None:
        stated = found.channel(MASTER, "column_force")   # topic and name of the signal, as in `run.columns`
        seen = stated.through(prediction, interval)      # as that logger would have recorded of a prediction
        step = stated.resolution                         # m, N, …: of a converter or of printed decimals
        gain = stated.calibration                        # relative tolerance of the channel's gain
        found.static, found.gaps, stated.interpolated, stated.rate

Values that the import map does not state are zero or None, which means that they are unknown. A recording whose
`import` record holds only the name of its data states nothing about any channel.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from common.recording.logger.low_pass import LoggerFilter, Samples
from common.recording.logger.passing import averaged, later, past_high_pass
from common.roles import MASTER, SLAVE, kind_of

if TYPE_CHECKING:
    from common.recording.run import Run

IMPORT = "import"  # metadata of an imported recording
REST = "at_rest"  # attachment of readings from before the test
HALF_POWER = 0.443  # at which frequency a mean over time loses 3 dB, times that time
ON_TICK = 1e-3  # of an interval, by which a row may come before the tick that it shows
TINY = 1e-12  # Hz, in place of no frequency, at which a high-pass lets nothing pass


@dataclass(frozen=True)
class ImportedChannel:
    """What is stated about one channel; SI units."""

    filter: LoggerFilter | None = None
    delay: float = 0.0  # s by which its samples are late
    resolution: float = 0.0  # quantization step, 0 where it is not stated
    calibration: float = 0.0  # relative tolerance of its gain
    high_pass: float = 0.0  # Hz, corner of an amplifier that is coupled to alternating current; 0 for none
    interpolated: bool = False  # whether its samples were interpolated to the ticks
    rate: float = 0.0  # sampling rate of the data, Hz; 0 where times have no meaning
    known: bool = False  # whether it was given as a constant rather than measured
    first: float = 0.0  # s after the first tick, of the first of its samples that were interpolated
    average: float = 0.0  # s, up to which each of its samples is a mean
    delay_stated: bool = False  # whether its delay is, which may be none
    followed: bool = False  # whether it is the plan's own motion between the ticks that its rows showed
    means: int = 1  # how many such means follow one another: three in a converter with a sinc³ filter
    smooth: bool = False  # whether a filter without any other trace took away what is faster than the ticks
    printed: float = 0.0  # step of its decimals in a text that has as many in each row, 0 for any other data
    at_ticks: bool = False  # whether its filter was given the readings at the ticks alone, as a digital one

    @property
    def chain(self) -> ImportedChannel:
        """What its signal passed, its filters, means and delay, and nothing else that is stated."""
        return ImportedChannel(
            self.filter,
            self.delay,
            high_pass=self.high_pass,
            average=self.average,
            means=self.means,
            smooth=self.smooth,
        )

    @property
    def blunt(self) -> bool:
        """Whether a filter or mean takes away what a reading does between two ticks."""
        return self.filter is not None or self.average > 0.0 or self.smooth

    @property
    def between(self) -> bool:
        """Whether its samples lie between ticks, and show what a reading does there."""
        return self.interpolated and self.rate > 0.0 and not self.blunt

    def samples(self, ticks: int, interval: float) -> Samples:
        """When the samples that were interpolated at `ticks` were taken, in ticks."""
        count = int((ticks - 1 - self.first / interval) * interval * self.rate) + 1
        return np.asarray((self.first + np.arange(count) / self.rate) / interval)

    def seen(self, ticks: int, interval: float) -> NDArray[np.int64]:
        """The ticks of `ticks` whose numbers the rows showed, each the last one before a row."""
        last = np.floor(self.samples(ticks, interval) + ON_TICK).astype(np.int64)
        return np.unique(last[last >= 0])

    @property
    def passes(self) -> float:
        """Frequency up to which the channel passes a signal and its noise, Hz: its cutoff, or half its own rate."""
        own = 0.5 * self.rate if self.interpolated and self.rate > 0.0 else math.inf
        mean = HALF_POWER / (self.average * math.sqrt(self.means)) if self.average > 0.0 else math.inf
        return min(own, mean, self.filter.cutoff if self.filter else math.inf)

    @property
    def late(self) -> float:
        """By how much the channel comes late, s: its delay and what filter and mean delay slow motion by."""
        late = self.delay + 0.5 * self.means * self.average
        if self.filter is None:
            return late
        above, below = (np.append(0.0, row)[-2:] / row[-1] for row in self.filter.transfer)
        return late + float(below[0] - above[0])

    def response(self, frequency: Samples) -> NDArray[np.complex128]:
        """Frequency response of its filters, mean and delay at `frequency` (Hz)."""
        late = self.delay + 0.5 * self.means * self.average
        turned = np.exp(-2j * math.pi * late * np.asarray(frequency))
        turned *= np.sinc(self.average * np.asarray(frequency)) ** self.means
        if self.high_pass:
            turned /= 1.0 + self.high_pass / (1j * np.maximum(frequency, TINY))
        return np.asarray(turned if self.filter is None else turned * self.filter.response(frequency))

    def through(self, values: Samples, interval: float, more: float = 0.0) -> Samples:
        """True values (ticks,) as the logger would have recorded them without noise: after its filters, mean and delay.

        They come `more` s later than stated.
        """
        seen = past_high_pass(values, interval, self.high_pass) if self.high_pass else values
        seen = self.filter.filtered(seen, interval) if self.filter else seen
        seen = averaged(seen, interval, self.average, self.means) if self.average else seen
        late = self.delay + more
        return seen if late == 0.0 else later(seen, late / interval)


NOTHING_STATED = ImportedChannel()


@dataclass(frozen=True)
class ImportedData:
    """What is stated about the whole file, and about its channels by topic and name."""

    data: str  # name of the file that was imported
    static: bool = False  # times have no meaning, so the data show no rates and no dynamics of sensors
    channels: Mapping[str, Mapping[str, ImportedChannel]] = field(default_factory=dict)
    as_is: bool = False  # units and signs are not checked for plausibility, at the user's request
    gaps: tuple[tuple[float, float], ...] = ()  # s of the test, between which rows are missing
    # topics and names of the readings at rest that are kept from before the test
    rest: tuple[tuple[str, str], ...] = ()

    def channel(self, topic: str, name: str) -> ImportedChannel:
        """What is stated about a signal; `NOTHING_STATED` for one that the map does not name."""
        return self.channels.get(topic, {}).get(name, NOTHING_STATED)

    def behind(self, topic: str, name: str, one: ImportedChannel) -> ImportedData:
        """The same with the filter or mean of `one` in a signal's channel, of which no more than a delay is stated.

        That delay is the one of filter or mean then.
        """
        said = self.channel(topic, name)
        delay = said.delay - replace(one, delay=0.0).late if said.delay else 0.0
        found = replace(
            said, filter=one.filter, average=one.average, means=one.means, smooth=one.smooth, delay=delay
        )
        return replace(self, channels={**self.channels, topic: {**self.channels.get(topic, {}), name: found}})

    def given_ticks(self, topic: str, name: str) -> ImportedData:
        """The same with a signal's channel whose filter was given the readings at the ticks alone."""
        rows = {**self.channels.get(topic, {}), name: replace(self.channel(topic, name), at_ticks=True)}
        return replace(self, channels={**self.channels, topic: rows})

    def with_delay(self, topic: str, name: str, delay: float) -> ImportedData:
        """The same with a signal's channel that is later by some s."""
        said = self.channel(topic, name)
        rows = {**self.channels.get(topic, {}), name: replace(said, delay=said.delay + delay)}
        return replace(self, channels={**self.channels, topic: rows})

    def metadata(self) -> dict[str, str]:
        """The values of the metadata record."""
        tables = {
            topic: {name: _plain(row) for name, row in rows.items()} for topic, rows in self.channels.items()
        }
        flags = {"static": json.dumps(self.static), "as_is": json.dumps(self.as_is)}
        gaps = {"gaps": json.dumps(self.gaps)} if self.gaps else {}
        rest = {REST: json.dumps(self.rest)} if self.rest else {}
        return {"data": self.data, **flags, **gaps, **rest, "channels": json.dumps(tables)}


def is_static(run: Run) -> bool:
    """Whether a recording holds imported rows whose times have no meaning."""
    return run.metadata.get(IMPORT, {}).get("static") == "true"


def imported(run: Run) -> ImportedData | None:
    """What an imported recording states, None for a recording of a test by rths itself.

    Raises:
        InputError: the metadata record is damaged.
    """
    if IMPORT not in run.metadata:
        return None
    values = run.metadata[IMPORT]
    try:
        channels = {
            topic: {name: _channel(row) for name, row in rows.items()}
            for topic, rows in json.loads(values.get("channels", "{}")).items()
        }
        static, as_is = (json.loads(values.get(name, "false")) for name in ("static", "as_is"))
        gaps = tuple((float(begin), float(end)) for begin, end in json.loads(values.get("gaps", "[]")))
        rest = tuple((str(topic), str(name)) for topic, name in json.loads(values.get(REST, "[]")))
        return ImportedData(values.get("data", ""), bool(static), channels, bool(as_is), gaps, rest)
    except (ValueError, TypeError, AttributeError):
        raise InputError(
            f"{run.path} is damaged: its metadata '{IMPORT}' cannot be read; import the data again."
        ) from None


def at_rest(run: Run) -> dict[tuple[str, str], Samples]:
    """Readings (ticks,) at the interval of the test from before it, by topic and name; empty where none are kept.

    Raises:
        InputError: they are damaged.
    """
    stated = imported(run)
    names = stated.rest if stated is not None else ()
    if not names or REST not in run.attachments:
        return {}
    try:
        values = np.frombuffer(run.attachments[REST], dtype="<f8").reshape(len(names), -1)
    except ValueError:
        raise InputError(
            f"{run.path} is damaged: its attachment '{REST}' cannot be read; import the data again."
        ) from None
    return dict(zip(names, values, strict=True))


def logged_alone(run: Run) -> bool:
    """Whether a logger recorded a laboratory without the test around it, command and reading of a moment in one row.

    A command is reached in its row then, while rths writes one that is reached at the end of its interval. So do the
    controllers of a test, of which a recording shows the building's motion, or signals of master and slave.
    """
    stated = imported(run)
    topics = [topic for topic in run.columns if kind_of(topic) in (MASTER, SLAVE)]
    around = len(topics) > 1 or any("displacement" in columns for columns in run.columns.values())
    return stated is not None and not stated.static and not around


def exchange_known(run: Run) -> bool:
    """Whether a recording tells which message was used when; without numbers or stamps the link cannot be judged."""
    names = {name for columns in run.columns.values() for name in columns}
    return any(name.endswith("_seq") or name.endswith("_one_way") for name in names)


def _plain(channel: ImportedChannel) -> dict[str, Any]:
    """The stated values of a channel, without those that equal `NOTHING_STATED`."""
    empty = asdict(NOTHING_STATED)
    return {name: value for name, value in asdict(channel).items() if value != empty[name]}


def _channel(row: Mapping[str, Any]) -> ImportedChannel:
    stated = dict(row)
    low_pass = stated.pop("filter", None)
    return ImportedChannel(LoggerFilter(**low_pass) if low_pass else None, **stated)
