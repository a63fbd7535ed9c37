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

import cmath
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from common.roles import MASTER, SLAVE, kind_of

if TYPE_CHECKING:
    from common.recording.run import Run

IMPORT = "import"  # metadata of an imported recording
REST = "at_rest"  # attachment of readings from before the test
# The low-pass filters usual before the converters of data loggers, those with a ripple in what they pass last.
FILTERS = ("butterworth", "bessel", "chebyshev", "elliptic")
RIPPLING = FILTERS[2:]
HALF_POWER = 0.443  # at which frequency a mean over time loses 3 dB, times that time
ON_TICK = 1e-3  # of an interval, by which a row may come before the tick that it shows
TINY = 1e-12  # Hz, in place of no frequency, at which a high-pass lets nothing pass
NODES = (-2, -1, 0, 1)  # ticks of the samples around one, through which a cubic goes
Samples = NDArray[np.float64]


@dataclass(frozen=True)
class LoggerFilter:
    """The analogue low-pass filter before a converter; what stands still passes it unchanged."""

    type: str
    order: int
    cutoff: float  # Hz, at which 3 dB are lost, or at which the ripple of a filter ends
    ripple: float = 0.0  # dB, of what a Chebyshev filter of type I or an elliptic one passes
    attenuation: float = 0.0  # dB, at least, of what an elliptic one stops

    @cached_property
    def transfer(self) -> tuple[Samples, Samples]:
        """Coefficients of numerator and denominator in s (rad/s), the highest power first."""
        from scipy import signal

        zeros, poles, gain = _design(self.type, self.order, self.ripple, self.attenuation)
        scaled = gain * self.cutoff ** (poles.size - zeros.size)
        above, below = signal.zpk2tf(self.cutoff * zeros, self.cutoff * poles, scaled)
        return np.atleast_1d(above), np.asarray(below)

    def response(self, frequency: Samples) -> NDArray[np.complex128]:
        """Frequency response at `frequency` (Hz)."""
        above, below = self.transfer
        s = 2j * math.pi * np.asarray(frequency)
        return np.asarray(np.polyval(above, s) / np.polyval(below, s), dtype=np.complex128)

    @property
    def modes(self) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Poles p (1/s) with no negative imaginary part and weights w (1/s): the real part of Σ w/(s − p)."""
        poles, weights, _ = _modes(self.type, self.order, self.ripple, self.attenuation)
        return self.cutoff * poles, self.cutoff * weights

    def filtered(self, values: Samples, interval: float) -> Samples:
        """A signal (ticks,) after the filter, smooth between ticks and constant at its first value before them.

        Straight lines between ticks would take the share (ω·interval)²/12 of a wave of frequency ω away, which shows in
        a reading that moves 10,000 times its noise; a twelfth of the second differences gives that back.
        Pole by pole, because the coefficients of a high order lose all digits where the cutoff is far below the rate.
        """
        from scipy import signal

        moved = values - values[0]
        moved[1:-1] -= np.diff(moved, 2) / 12.0
        at_once = _modes(self.type, self.order, self.ripple, self.attenuation)[2]
        result = np.asarray(values[0] + at_once * (values - values[0]), dtype=np.float64)
        for pole, weight in zip(*self.modes, strict=True):
            result += signal.lfilter(*_section(complex(pole) * interval, complex(weight) / pole), moved)
        return result


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


def past_high_pass(values: Samples, interval: float, corner: float) -> Samples:
    """A signal (ticks,) after a high-pass of first order with a corner in Hz, linear between ticks.

    The signal stood at its first value before, which the amplifier had forgotten.
    """
    from scipy import signal

    step = 2.0 * math.pi * corner * interval
    kept = math.exp(-step)
    change = np.diff(values, prepend=values[0])
    return np.asarray(signal.lfilter([-math.expm1(-step) / step], [1.0, -kept], change))


def averaged(values: Samples, interval: float, length: float, means: int = 1) -> Samples:
    """Means of a signal (ticks,) over the last `length` s, smooth between ticks and constant before the first one.

    They are means of means, so many times. A twelfth of the second differences gives back what straight lines between
    ticks would take away.
    """
    for _ in range(means - 1):
        values = averaged(values, interval, length)
    moved = values - values[0]
    moved[1:-1] -= np.diff(moved, 2) / 12.0
    whole = np.append(0.0, np.cumsum(0.5 * (moved[1:] + moved[:-1])))
    begin = np.arange(values.size) - length / interval
    tick = np.clip(np.floor(begin).astype(np.int64), 0, values.size - 2)
    place = begin - tick
    before = whole[tick] + place * moved[tick] + 0.5 * place**2 * (moved[tick + 1] - moved[tick])
    return np.asarray(values[0] + (whole - np.where(begin > 0.0, before, 0.0)) * interval / length)


def later(values: Samples, ticks: float) -> Samples:
    """A signal (n,) that comes so many ticks later, on cubics through four samples; its ends stay constant.

    It is for what a model predicts, which is smooth; of noise near half the rate of the ticks it takes a part away.
    """
    whole = math.floor(ticks)
    part = ticks - whole
    weights = [
        math.prod((-part - other) / (node - other) for other in NODES if other != node) for node in NODES
    ]
    ahead, behind = max(whole, 0) + 2, max(-whole, 0) + 1
    padded = np.concatenate([np.full(ahead, values[0]), values, np.full(behind, values[-1])])
    first, result = ahead - whole, np.zeros(values.size)
    for weight, node in zip(weights, NODES, strict=True):
        result += weight * padded[first + node : first + node + values.size]
    return result


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


@cache
def _design(
    kind: str, order: int, ripple: float, attenuation: float
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], float]:
    """Zeros, poles and gain of a filter whose cutoff is 1 Hz, and whose gain at rest is one."""
    from scipy import signal

    shared: dict[str, Any] = {"Wn": 2.0 * math.pi, "analog": True, "output": "zpk"}
    if kind == "bessel":
        zeros, poles, gain = signal.bessel(order, norm="mag", **shared)
    elif kind == "chebyshev":
        zeros, poles, gain = signal.cheby1(order, ripple, **shared)
    elif kind == "elliptic":
        zeros, poles, gain = signal.ellip(order, ripple, attenuation, **shared)
    else:
        zeros, poles, gain = signal.butter(order, **shared)
    at_rest = gain * np.prod(-zeros) / np.prod(-poles)
    return zeros, poles, float(gain / at_rest.real)


@cache
def _modes(
    kind: str, order: int, ripple: float, attenuation: float
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], float]:
    """Poles and weights of a filter whose cutoff is 1 Hz, and its gain for what is infinitely fast."""
    zeros, poles, gain = _design(kind, order, ripple, attenuation)
    apart = poles[:, None] - poles[None, :] + np.eye(poles.size)
    weights = gain * np.prod(poles[:, None] - zeros[None, :], axis=1) / np.prod(apart, axis=1)
    upper = poles.imag >= 0.0
    paired = np.where(poles.imag > 0.0, 2.0, 1.0)[upper] * weights[upper]
    return poles[upper], paired, gain if zeros.size == poles.size else 0.0


def _section(step: complex, weight: complex) -> tuple[list[float], list[float]]:
    """Coefficients over ticks of the real part of weight·p/(s − p) with step = p·interval, for straight lines.

    With a = p·interval, k = eᵃ and z⁻¹ a tick before, weight·((k − 1 − a) + (1 + k·(a − 1))·z⁻¹)/(a·(1 − k·z⁻¹)).
    """
    kept = cmath.exp(step)
    now = weight / step * complex(np.expm1(step) - step)
    before = weight / step * (1.0 + kept * (step - 1.0))
    if step.imag == 0.0:
        return [now.real, before.real], [1.0, -kept.real]
    across = [now.real, (before - now * kept.conjugate()).real, -(before * kept.conjugate()).real]
    return across, [1.0, -2.0 * kept.real, abs(kept) ** 2]


def _plain(channel: ImportedChannel) -> dict[str, Any]:
    """The stated values of a channel, without those that equal `NOTHING_STATED`."""
    empty = asdict(NOTHING_STATED)
    return {name: value for name, value in asdict(channel).items() if value != empty[name]}


def _channel(row: Mapping[str, Any]) -> ImportedChannel:
    stated = dict(row)
    low_pass = stated.pop("filter", None)
    return ImportedChannel(LoggerFilter(**low_pass) if low_pass else None, **stated)
