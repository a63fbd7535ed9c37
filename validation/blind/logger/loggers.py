"""The data loggers of the blind trial, between true values and recorded readings."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AnalogueFilter:
    """The low-pass filter before a converter."""

    type: str  # "butterworth" or "bessel"
    order: int
    cutoff: float  # Hz, at which 3 dB are lost
    stated: bool  # in the map of the import


@dataclass(frozen=True)
class OwnClock:
    """How a logger takes its rows that is not in step with the controllers, whose file `rths import` reads."""

    rate: float  # Hz
    fast: float = 0.0  # by how much its clock is fast
    filter: AnalogueFilter | None = None
    apart: float = 0.0  # s from channel to channel, of one converter that takes them in turn
    lost: int = 0  # rows


@dataclass(frozen=True)
class Logger:
    """A data logger; a number that is zero turns its part off."""

    text: str  # for a table
    colour: str = "white"  # of the sensors' noise
    hum: float = 0.0  # amplitude over the channel's peak
    cutoff: float = 0.0  # Hz, of the anti-alias filter
    bits: int = 0  # of the converter
    rate: float = 0.0  # Hz, where it is not the plan's
    late: int = 0  # delay of forces, samples
    gain: float = 1.0  # of all channels
    printed: bool = False  # with three decimals of mm and of kN
    clock: OwnClock | None = None  # None for one that is in step

    @property
    def distortions(self) -> tuple[str, ...]:
        """Effects on a reading that describe what the logger does to the signal: naming one is no false alarm."""
        lags = ("lag", "delay") if self.cutoff or self.late or self.rate or self._silent else ()
        gains = ("gain",) if self.gain != 1.0 else ()
        return lags + gains

    @property
    def _silent(self) -> bool:
        """Whether its map leaves out by how much some of its channels are late."""
        clock = self.clock
        return clock is not None and (clock.apart > 0.0 or bool(clock.filter and not clock.filter.stated))


IN_STEP = {
    "white": Logger("white noise"),
    "low_pass_50": Logger("noise low-passed at 50 Hz", "low_pass_50"),
    "low_pass_100": Logger("noise low-passed at 100 Hz", "low_pass_100"),
    "low_pass_200": Logger("noise low-passed at 200 Hz", "low_pass_200"),
    "ar1": Logger("noise AR(1), 0.95", "ar1"),
    "pink": Logger("pink noise", "pink"),
    "heavy_tailed": Logger("heavy-tailed noise, Student's t with 3 degrees of freedom", "heavy_tailed"),
    "hum": Logger("hum of 50 Hz, 1 % of the peak", hum=0.01),
    "converter": Logger("converter of 12 bit", bits=12),
    "anti_alias": Logger("anti-alias filter, Butterworth of order 4 at 100 Hz", cutoff=100.0),
    "resampled": Logger("logger of 1024 Hz, resampled", rate=1024.0),
    "late_forces": Logger("forces 2 samples late", late=2),
    "calibration": Logger("all channels + 1 %", gain=1.01),
    "printed": Logger("printed with 3 decimals of mm and of kN", printed=True),
    "all": Logger(
        "all of that, pink noise",
        colour="pink",
        hum=0.01,
        cutoff=100.0,
        bits=12,
        rate=1024.0,
        late=2,
        gain=1.01,
        printed=True,
    ),
}
"""The loggers of the set "loggers" by name: each has one property of real loggers at a usual size, the last all."""
OUT_OF_STEP = {
    "between_ticks": Logger("500 Hz, between the ticks", clock=OwnClock(500.0)),
    "drifting": Logger("500 Hz, 40 ppm fast", clock=OwnClock(500.0, fast=4e-5)),
    "600_hz": Logger("600 Hz, AR(1) noise", "ar1", clock=OwnClock(600.0)),
    "1024_hz": Logger("1024 Hz, 25 ppm slow, 16 bit", bits=16, clock=OwnClock(1024.0, fast=-2.5e-5)),
    "2000_hz": Logger("2000 Hz, hum", hum=0.005, clock=OwnClock(2000.0)),
    "250_hz": Logger(
        "250 Hz behind a stated Butterworth filter of order 6 at 80 Hz",
        clock=OwnClock(250.0, filter=AnalogueFilter("butterworth", 6, 80.0, stated=True)),
    ),
    "bessel": Logger(
        "1000 Hz behind a stated Bessel filter of order 4 at 100 Hz, noise low-passed at 200 Hz",
        "low_pass_200",
        clock=OwnClock(1000.0, filter=AnalogueFilter("bessel", 4, 100.0, stated=True)),
    ),
    "bessel_unstated": Logger(
        "600 Hz behind a Bessel filter of order 6 at 90 Hz of which nothing is stated",
        clock=OwnClock(600.0, filter=AnalogueFilter("bessel", 6, 90.0, stated=False)),
    ),
    "butterworth_unstated": Logger(
        "1000 Hz, 30 ppm fast, behind a Butterworth filter of order 8 at 70 Hz of which nothing is stated",
        clock=OwnClock(1000.0, fast=3e-5, filter=AnalogueFilter("butterworth", 8, 70.0, stated=False)),
    ),
    "in_turn": Logger("1000 Hz, channels 50 µs apart, 16 bit", bits=16, clock=OwnClock(1000.0, apart=5e-5)),
    "lost_rows": Logger(
        "800 Hz, pink noise, 3 decimals, 12 rows lost", "pink", printed=True, clock=OwnClock(800.0, lost=12)
    ),
}
"""The loggers of the set "out_of_step" by name: each has a clock of its own, and begins anywhere in its first row."""
LOGGERS = IN_STEP | OUT_OF_STEP
