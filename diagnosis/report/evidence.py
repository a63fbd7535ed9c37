"""The evidence behind a report, as pages draw it: every entry may be absent or empty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from diagnosis.report.fields import Absent, EffectName, Ends, Entry, Number, Series, Share, Site, noted
from diagnosis.report.values import Parameters

Coordinate = Literal["displacement", "velocity", "force", "acceleration", "time", "amplitude", "command"]


@dataclass(frozen=True, kw_only=True)
class TestFacts(Entry):
    """What was tested."""

    __test__ = False  # the class is no test of the test suite

    name: str = noted("Name of the test", default="")
    duration: Number = noted("Length of the recording", unit="s", default=None)
    interval: Number = noted("Time between two ticks", unit="s", default=None)
    ticks: int | None = noted("Number of ticks", default=None)
    static: bool = noted("Whether times have no meaning; all `t` are then numbers of rows", default=False)
    motion: str = noted("Ground motion and its scale", default="")
    outcome: str = noted("How the test ended", default="")
    file: str = noted("Name of the recording's file", default="")


@dataclass(frozen=True, kw_only=True)
class LaboratorySeen(Entry):
    """A laboratory of the test that the report is of."""

    role: str = noted("Role of the process that drives it")
    sites: tuple[Site, ...] = noted("Its sites, sensors apart, from the command to the force")
    sensors: tuple[Site, ...] = noted("The sites of its sensors")


@dataclass(frozen=True, kw_only=True)
class Reading(Entry):
    """A reading of a part, measured and predicted, in its strongest seconds."""

    signal: str = noted("Name of the signal")
    unit: str = noted("Unit of the samples")
    residual_rms: Number = noted(
        "Rms of measured less predicted without effects, in the signal's unit", default=None
    )
    noise_floor: Number = noted("Rms of the noise, in the signal's unit", default=None)
    t: Series = noted("Time", unit="s", default=())
    measured: Series = noted("As recorded", default=())
    nominal: Series = noted("Predicted without effects", default=())
    corrected: Series = noted("Predicted with the effects of the verdict", default=())


@dataclass(frozen=True, kw_only=True)
class OverTime(Entry):
    """A residual in windows of time."""

    t: Series = noted("Middle of each window", unit="s", default=())
    ratio: Series = noted("Rms of the residual over that of the noise", default=())


@dataclass(frozen=True, kw_only=True)
class OverFrequency(Entry):
    """Amplitude densities of a residual and of the noise, in the signal's unit per √Hz."""

    frequency: Series = noted("Frequency", unit="Hz", default=())
    residual: Series = noted("Density of the residual", default=())
    noise: Series = noted("Density of the noise", default=())


@dataclass(frozen=True, kw_only=True)
class OverAmplitude(Entry):
    """A residual by the amplitude of the motion."""

    amplitude: Series = noted("Mean amplitude of each class, in the signal's unit", default=())
    ratio: Series = noted("Rms of the residual over that of the noise", default=())


@dataclass(frozen=True, kw_only=True)
class PartSeen(Entry):
    """A site with the signal that shows it most, and its residual over time, frequency and amplitude."""

    site: Site = noted("The site")
    signals: tuple[Reading, ...] = noted("Its readings", default=())
    windows: OverTime = noted("The residual over time", default=OverTime)
    bands: OverFrequency = noted("The residual over frequency", default=OverFrequency)
    amplitudes: OverAmplitude = noted("The residual over the amplitude of the motion", default=OverAmplitude)


@dataclass(frozen=True, kw_only=True)
class LoopPath(Entry):
    """What one path of the loop costs, as recorded and in the simulation with nominal models."""

    delay: Number = noted("Delay", unit="s", default=None)
    amplitude: Number = noted("Ratio of amplitudes", default=None)
    damping_points: Number = noted(
        "What it adds to the first mode's damping, in points of a percent",
        default=None,
        absent=Absent.LEFT_OUT,
    )
    nominal_delay: Number = noted("Delay with nominal models", unit="s", default=None, absent=Absent.LEFT_OUT)
    nominal_damping_points: Number = noted(
        "Points of damping with nominal models", default=None, absent=Absent.LEFT_OUT
    )


@dataclass(frozen=True, kw_only=True)
class Paths(Entry):
    """The three paths of the loop, those that were recorded."""

    command: LoopPath | None = noted(
        "From the building's drift to the specimen's deformation", default=None, absent=Absent.LEFT_OUT
    )
    force: LoopPath | None = noted(
        "From the deformation to the force that the master used", default=None, absent=Absent.LEFT_OUT
    )
    exchange: LoopPath | None = noted(
        "From the damper's force in its laboratory to its use", default=None, absent=Absent.LEFT_OUT
    )


@dataclass(frozen=True, kw_only=True)
class ForcePathEntry(Entry):
    """The measured column force against that of the plan's specimen at the measured displacement."""

    delay: float = noted("Delay of the measured force", unit="s")
    interval: tuple[float, float] = noted("The delay's interval of 95 %", unit="s")
    gain: float = noted("Ratio of amplitudes")
    frequency: Number = noted("Frequency at which they are meant", unit="Hz")


@dataclass(frozen=True, kw_only=True)
class LoopShare(Entry):
    """What a site adds to the gap of the closed loop."""

    site: Site = noted("The site")
    shapley: Number = noted("Its Shapley value: its mean part over all orders of correcting the sites")
    interval: Ends | None = noted("Smallest and largest over thirds of the time", default=None)
    first_in: Number = noted("What correcting this site alone takes away", default=None)
    last_out: Number = noted("What correcting it after all others takes away", default=None)


@dataclass(frozen=True, kw_only=True)
class Evidence(Entry):
    """A candidate with what speaks for and against it."""

    effects: tuple[EffectName, ...] = noted("Names of the catalogue")
    kind: Literal["physics", "measurement"] = noted("Whether the machine or only a reading differs")
    probability: Share = noted("How likely they are among the candidates tried")
    explained: Number = noted("Share of the energy of its part's gap that it explains", default=None)
    score: Number = noted(
        "How much worse than the verdict on data not used for the fit, in nats", default=None
    )
    parameters: Parameters = noted("By effect, then by parameter", default={})
    for_: str = noted("What speaks for it", default="")
    against: str = noted("What speaks against it", default="")
    on_bound: tuple[str, ...] = noted("Parameters at the end of their range", default=())


@dataclass(frozen=True, kw_only=True)
class Ceiling(Entry):
    """What could be explained of a part's residual at all, as shares of its energy on withheld time."""

    site: Site = noted("The site")
    flexible: Number = noted("By a model that may be anything", default=None)
    catalogue: Number = noted("By the catalogue's best effects", default=None)


@dataclass(frozen=True, kw_only=True)
class Abscissa(Entry):
    """The abscissa of a curve."""

    label: str = noted("Name and unit")
    values: Series = noted("Values")


@dataclass(frozen=True, kw_only=True)
class Ordinate(Entry):
    """The ordinate of a curve."""

    label: str = noted("Name and unit")


@dataclass(frozen=True, kw_only=True)
class NaturalCurve(Entry):
    """A relation in the natural coordinates of a site."""

    title: str = noted("What it shows", default="")
    x: Abscissa = noted("Abscissa")
    y: Ordinate = noted("Ordinate")
    measured: Series = noted("As recorded", default=())
    before: Series = noted("Predicted without the site's effects", default=())
    after: Series = noted("Predicted with them", default=())
    low: Series = noted("Lower end of the band of 95 % of what is predicted with them", default=())
    high: Series = noted("Upper end of that band", default=())


@dataclass(frozen=True, kw_only=True)
class Step(Entry):
    """The overall gap after one step of correction."""

    label: str = noted("The step")
    value: Number = noted("The overall gap after it")


@dataclass(frozen=True, kw_only=True)
class History(Entry):
    """A response signal as recorded and simulated, in the seconds in which they differ most."""

    signal: str = noted("Name of the signal")
    unit: str = noted("Unit of the samples")
    t: Series = noted("Time", unit="s")
    recorded: Series = noted("As recorded", default=())
    before: Series = noted("Simulated without effects", default=())
    after: Series = noted("Simulated with the effects of the verdict", default=())


@dataclass(frozen=True, kw_only=True)
class Dependence(Entry):
    """How much of a residual one coordinate alone explains."""

    on: Coordinate = noted("The coordinate")
    share: Share = noted("Share of the residual's energy that a function of it explains")


@dataclass(frozen=True, kw_only=True)
class Unknown(Entry):
    """What a residual that no effect of the catalogue explains looks like."""

    site: Site = noted("Where it arises")
    depends_on: tuple[Dependence, ...] = noted("Coordinates that explain some of it", default=())
    frequency: Number = noted("Frequency at which it is strongest", unit="Hz", default=None)
    amplitude: Number = noted("Its size, rms times √2", default=None)
    unit: str = noted("Unit of the size", default="")
    curve: NaturalCurve | None = noted("The relation that is left over", default=None, absent=Absent.LEFT_OUT)


@dataclass(frozen=True, kw_only=True)
class LearnedRest(Entry):
    """What no effect explains at a site, learned as a force or a displacement over state and history."""

    site: Site = noted("Where it acts")
    quantity: str = noted("What it adds to: force or displacement")
    unit: str = noted("Unit of that")
    before: Number = noted("Rms of what the effects leave of it")
    after: Number = noted("Rms of what is left on time that the law has not seen")
    curve: NaturalCurve = noted("It over the motion of the site, in the seconds in which it is largest")
    law: Series = noted("The law as `models.preisach` takes it", default=())


@dataclass(frozen=True, kw_only=True)
class Left(Entry):
    """What is left at a site."""

    site: Site = noted("The site")
    residual_to_noise: Number = noted("Rms of what is left over that of the noise", default=None)


@dataclass(frozen=True, kw_only=True)
class Remaining(Entry):
    """What the verdict leaves."""

    overall: Number = noted("Overall gap with the effects of the verdict", default=None)
    where: tuple[Left, ...] = noted("Sites with something left", default=())


@dataclass(frozen=True, kw_only=True)
class NextTest(Entry):
    """A test and how well it tells two candidates apart."""

    test: str = noted("What to run")
    separation: Number = noted(
        "Distance of the two predictions in standard deviations of the noise", default=None
    )
    pair: tuple[str, str] | None = noted("The two effects", default=None)
    why: str = noted("Why it tells them apart", default="")


@dataclass(frozen=True, kw_only=True)
class Details(Entry):
    """Everything that a page shows beside the report itself."""

    test: TestFacts = noted("What was tested", default=TestFacts)
    laboratories: tuple[LaboratorySeen, ...] = noted("The laboratories of the test", default=())
    parts: tuple[PartSeen, ...] = noted("Sites with their residuals", default=())
    paths: Paths = noted("What the paths of the loop cost", default=Paths)
    force_path: ForcePathEntry | None = noted(
        "The measured column force beside that of the plan's specimen", default=None
    )
    loop_shares: tuple[LoopShare, ...] = noted(
        "Shares of the sites in the gap of the closed loop", default=()
    )
    candidates: tuple[Evidence, ...] = noted("The candidates with evidence", default=())
    signs: Mapping[str, Number] = noted(
        "What the verdict's probability was learned from, by name; empty where nothing is named", default=dict
    )
    ceiling: tuple[Ceiling, ...] = noted("What could be explained at all, by part", default=())
    curves: tuple[NaturalCurve, ...] = noted("Relations in natural coordinates", default=())
    waterfall: tuple[Step, ...] = noted("The overall gap, step by step", default=())
    histories: tuple[History, ...] = noted("Response signals before and after", default=())
    unknown: Unknown | None = noted(
        "What no effect of the catalogue explains", default=None, absent=Absent.EMPTY
    )
    unknowns: tuple[Unknown, ...] = noted(
        "The same of every part with something left, the largest over its noise first", default=()
    )
    learned: tuple[LearnedRest, ...] = noted("What no effect explains, learned", default=())
    remaining: Remaining | None = noted("What the verdict leaves", default=None, absent=Absent.EMPTY)
    next: tuple[NextTest, ...] = noted("Tests that would tell candidates apart, the best first", default=())
