"""The data loggers of the blind trial, between true values and recorded readings."""

from __future__ import annotations

from dataclasses import dataclass


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

    @property
    def distortions(self) -> tuple[str, ...]:
        """Effects on a reading that describe what the logger does to the signal: naming one is no false alarm."""
        lags = ("lag", "delay") if self.cutoff or self.late or self.rate else ()
        gains = ("gain",) if self.gain != 1.0 else ()
        return lags + gains


LOGGERS = {
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
