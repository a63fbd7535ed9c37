"""What an imported recording says of the data logger that its channels came through.

`rths import` writes a metadata record `import`, and `imported` reads it back with types:

    found = imported(run)                                # None: the test was recorded by rths itself
    if found is not None:
        stated = found.channel(MASTER, "column_force")   # topic and name of the signal, as in `run.columns`
        seen = stated.through(prediction, interval)      # what that logger would have recorded of a prediction
        step = stated.resolution                         # m, N, …: of a converter or of printed decimals
        gain = stated.calibration                        # relative tolerance of the channel's gain
        found.static, stated.interpolated, stated.rate

What a map does not state is zero or None: unknown, not absent. A recording whose `import` record holds the name of
its data alone states nothing of any channel.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError

if TYPE_CHECKING:
    from common.recording.reader import Run

IMPORT = "import"  # metadata of an imported recording
FILTERS = ("butterworth", "bessel")  # what stands before the converters of data loggers
Samples = NDArray[np.float64]


@dataclass(frozen=True)
class LoggerFilter:
    """The analogue low-pass filter before a converter."""

    type: str
    order: int
    cutoff: float  # Hz, at which 3 dB are lost

    @cached_property
    def transfer(self) -> tuple[Samples, Samples]:
        """Coefficients of numerator and denominator in s, the highest power first."""
        from scipy import signal

        omega = 2.0 * math.pi * self.cutoff
        if self.type == "bessel":
            above, below = signal.bessel(self.order, omega, analog=True, norm="mag")
        else:
            above, below = signal.butter(self.order, omega, analog=True)
        return np.asarray(above), np.asarray(below)

    def response(self, frequency: Samples) -> NDArray[np.complex128]:
        """Frequency response at `frequency` (Hz)."""
        above, below = self.transfer
        s = 2j * math.pi * np.asarray(frequency)
        return np.asarray(np.polyval(above, s) / np.polyval(below, s), dtype=np.complex128)

    def filtered(self, values: Samples, interval: float) -> Samples:
        """A signal (ticks,) behind the filter, ramped between ticks and at its first value before them."""
        from scipy import signal

        above, below, _ = signal.cont2discrete(self.transfer, interval, method="foh")
        return np.asarray(signal.lfilter(above[0], below, values - values[0]) + values[0])


@dataclass(frozen=True)
class ImportedChannel:
    """What is stated of one channel; SI units."""

    filter: LoggerFilter | None = None
    delay: float = 0.0  # s, by which it was recorded too late
    resolution: float = 0.0  # step, 0 where it is not stated
    calibration: float = 0.0  # relative tolerance of its gain
    interpolated: bool = False  # its samples did not stand on the ticks
    rate: float = 0.0  # Hz of the data, 0 where time has no meaning
    known: bool = False  # given as a value, not measured

    def through(self, values: Samples, interval: float) -> Samples:
        """What the logger would have recorded of true values (ticks,), without noise: behind its filter and delay."""
        seen = self.filter.filtered(values, interval) if self.filter else values
        if self.delay == 0.0:
            return seen
        ticks = np.arange(seen.size) * interval
        return np.asarray(np.interp(ticks - self.delay, ticks, seen))


NOTHING_STATED = ImportedChannel()


@dataclass(frozen=True)
class ImportedData:
    """What is stated of the whole file, and of its channels by topic and name."""

    data: str  # name of the file that was imported
    static: bool = False  # times have no meaning: nothing of rates or of the dynamics of sensors can be seen
    channels: Mapping[str, Mapping[str, ImportedChannel]] = field(default_factory=dict)
    as_is: bool = False  # its units and signs are the user's, whatever they look like

    def channel(self, topic: str, name: str) -> ImportedChannel:
        """What is stated of a signal; of one that the map does not name nothing."""
        return self.channels.get(topic, {}).get(name, NOTHING_STATED)

    def metadata(self) -> dict[str, str]:
        """As it stands in a recording."""
        tables = {
            topic: {name: _plain(row) for name, row in rows.items()} for topic, rows in self.channels.items()
        }
        flags = {"static": json.dumps(self.static), "as_is": json.dumps(self.as_is)}
        return {"data": self.data, **flags, "channels": json.dumps(tables)}


def imported(run: Run) -> ImportedData | None:
    """What an imported recording states, None where rths recorded the test itself.

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
        return ImportedData(values.get("data", ""), bool(static), channels, bool(as_is))
    except (ValueError, TypeError, AttributeError):
        raise InputError(
            f"{run.path} is damaged: its metadata '{IMPORT}' cannot be read; import the data again."
        ) from None


def exchange_known(run: Run) -> bool:
    """Whether a recording tells which message was used when: without numbers or stamps the link cannot be judged."""
    names = {name for columns in run.columns.values() for name in columns}
    return any(name.endswith("_seq") or name.endswith("_one_way") for name in names)


def _plain(channel: ImportedChannel) -> dict[str, Any]:
    """What differs from nothing stated."""
    empty = asdict(NOTHING_STATED)
    return {name: value for name, value in asdict(channel).items() if value != empty[name]}


def _channel(row: Mapping[str, Any]) -> ImportedChannel:
    stated = dict(row)
    low_pass = stated.pop("filter", None)
    return ImportedChannel(LoggerFilter(**low_pass) if low_pass else None, **stated)
