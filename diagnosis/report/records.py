"""The report of a diagnosis (contract, section 8): verdict, gap, sites, candidates, shrinkage. SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from diagnosis.report.evidence import Details
from diagnosis.report.fields import Absent, EffectName, Ends, Entry, FieldRule, Number, Share, Site, noted
from diagnosis.report.values import Parameters

Status = Literal[
    "no_gap",
    "within_tolerances",
    "explained",
    "partly_explained",
    "ambiguous",
    "unknown_effect",
    "not_enough_data",
]
Outcome = Literal["none", "tolerances", "explained", "partly", "unknown"]


@dataclass(frozen=True, kw_only=True)
class Tolerance(Entry):
    """A nominal parameter moved inside its tolerance."""

    factor: Number = noted("Factor on the nominal value")
    z: Number = noted("Move in standard deviations of the tolerance")


@dataclass(frozen=True, kw_only=True)
class SignalGap(Entry):
    """The gap of one response signal."""

    nrmse: Number = noted("rms(recorded - simulated)/rms(recorded)")
    noise_floor: Number = noted("The gap that the sensors' noise alone makes")
    peak_error: Number = noted("Largest error, in the signal's unit")
    unit: str = noted("Unit of the signal")


@dataclass(frozen=True, kw_only=True)
class Gap(Entry):
    """The gap between the recording and the simulation with nominal models."""

    signals: Mapping[str, SignalGap] = noted("By response signal")
    overall: Number = noted("Rms of the gaps over the response signals")
    overall_noise_floor: Number = noted("The overall gap that the sensors' noise alone makes")


@dataclass(frozen=True, kw_only=True)
class Place(Entry):
    """A site with its share of the gap."""

    site: Site = noted("Part of the test, or sensor and the signal of a reading")
    residual_to_noise: Number = noted("Rms of what the site does to its signal, over that of the noise")
    when: tuple[Ends, ...] = noted("Windows of time in which it stands out of the noise", unit="s")
    frequency_band: Ends | None = noted("Band that holds most of it", unit="Hz")
    share: Share = noted("Share of the gap; shares sum to 1 over sites with a gap")
    share_interval: Ends = noted("Smallest and largest share over thirds of the time")


@dataclass(frozen=True, kw_only=True)
class Candidate(Entry):
    """Effects that may make the gap."""

    effects: tuple[EffectName, ...] = noted("Names of the catalogue; none: that nothing is there")
    probability: Share = noted("How likely they are among the candidates tried")
    parameters: Parameters = noted("By effect, then by parameter")
    held_out_score: Number = noted("How much worse than the verdict on data not used for the fit, in nats")


@dataclass(frozen=True, kw_only=True)
class NoiseEntry(Entry):
    """The noise of one sensor, as its part's residual shows it."""

    kind: Literal["white", "ar"] = noted("White, or coloured: an autoregression")
    order: int = noted("Order of the autoregression, 0 of white noise")
    rms: Number = noted("Rms in the signal's unit, lines aside")
    unit: str = noted("Unit of rms and resolution", default="")
    from_: Literal["at rest", "quiet part", "residual"] = noted(
        "Where it was found: readings at rest, the part's quiet time, or all that no model could explain"
    )
    lines: tuple[float, ...] = noted("Narrow lines that the sensor picks up", unit="Hz", default=())
    resolution: Number = noted("Step of the readings in the signal's unit, null for none", default=None)


@dataclass(frozen=True, kw_only=True)
class PartOfGap(Entry):
    """What the gap of one part is made of: tolerances + named + learned + left = gap, relative to its signals' rms."""

    part: str = noted("Ground, structure, or a laboratory")
    outcome: Outcome = noted("What is said of this part alone")
    effects: tuple[EffectName, ...] = noted("The effects named in it", default=())
    gap: Number = noted("The gap of nominal models above the noise")
    tolerances: Number = noted("What parameters moved within their tolerances take away")
    named: Number = noted("What the effects named take away")
    learned: Number = noted("What a model without a name takes away", default=0.0)
    left: Number = noted("What nothing takes away")
    noise: Number = noted("What the sensors' noise alone makes")
    adequate: bool | None = noted("Whether what is left is no more than was required, null where nothing was")
    noise_model: Mapping[str, NoiseEntry] = noted("The noise of its sensors, by signal", default={})


@dataclass(frozen=True, kw_only=True)
class LearnedGap(Entry):
    """How far the gap closes with what was learned beside the effects of the verdict."""

    before: Number = noted("Overall gap with parameters moved inside their tolerances, without effects")
    named: Number = noted("Overall gap with the effects of the verdict alone")
    after: Number = noted("Overall gap with the effects of the verdict and what was learned")
    closed: Number = noted("Share of the gap above the noise that closes with both")
    sites: tuple[Site, ...] = noted("Where something was learned")
    judged_on: str = noted(
        "Data not used: other recordings, the strongest part of this one, or pieces between those used "
        "(interpolation); or the same seconds, where a gap shows in too few to withhold any"
    )


@dataclass(frozen=True, kw_only=True)
class HowFar(Entry):
    """How far the gap closes: closed = (before - after)/(before - noise_floor)."""

    nominal: Number = noted(
        "Overall gap before parameters were moved inside their tolerances",
        default=None,
        absent=Absent.LEFT_OUT,
    )
    before: Number = noted("Overall gap with parameters moved inside their tolerances, without effects")
    after: Number = noted("Overall gap with the effects of the verdict")
    closed: Number = noted("Share of the gap above the noise that closes")
    closed_interval: Ends | None = noted("Its interval of 90 %, or its range over the recordings given")
    noise_floor: Number = noted("Overall gap that the sensors' noise alone makes")
    judged_on: str | None = noted(
        "The data, not used for the fit, on which this was judged, or the same seconds where a gap shows in few"
    )
    learned: LearnedGap | None = noted(
        "With what was learned of what no effect explains", default=None, absent=Absent.LEFT_OUT
    )


@dataclass(frozen=True, kw_only=True)
class Report(Entry):
    """Where the gap between a recorded test and its simulation arises, which effect makes it, how far it closes."""

    version: Literal[1, 2] = noted("Version of this format; the fields of version 1 are all in version 2")
    status: Status = noted("The outcome in one word")
    tolerances: Mapping[str, Tolerance] = noted("Nominal parameters moved inside their tolerances, by name")
    gap: Gap = noted("The gap between the recording and the simulation with nominal models")
    where: tuple[Place, ...] = noted("Sites with a gap, the largest share first")
    which: tuple[Candidate, ...] = noted("The verdict first, then the others by probability")
    equivalent: tuple[Annotated[tuple[EffectName, ...], FieldRule(fewest=2)], ...] = noted(
        "Sets of effects that these signals cannot tell apart: naming one of a set is naming all"
    )
    how_far: HowFar = noted("How far the gap closes once the effects are added")
    not_exercised: tuple[EffectName, ...] = noted("Effects that this recording could not have shown")
    next_test: str | None = noted("What to run to tell the remaining candidates apart, and why")
    warnings: tuple[str, ...] = noted("What a reader should know before believing this report")
    parts: tuple[PartOfGap, ...] = noted("What the gap of each part is made of", default=())
    found: str | None = noted(
        "The file with what was found as a reality, null where none was written", default=None
    )
    details: Details = noted(
        "The evidence: what the page draws; every entry may be absent or empty", default=Details
    )
    verdict: str = noted("The outcome in one sentence", default="")
