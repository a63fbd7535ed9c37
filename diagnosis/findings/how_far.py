"""How far the gap shrinks once the effects are added, judged on data that no fit has seen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.findings import where
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.gaps import RecordingGaps, judging
from diagnosis.findings.series import numbers, strongest
from diagnosis.findings.sites.shares import shares
from diagnosis.findings.verdict import UNNAMED, PartVerdict
from diagnosis.findings.where import SiteTrace
from diagnosis.fits import hypothesis
from diagnosis.recorded import loop
from diagnosis.recorded.loop import closed_share, overall
from diagnosis.recorded.record import Record
from diagnosis.report.evidence import History, LoopShare, Step
from diagnosis.report.records import Gap, HowFar, SignalGap
from models.registry import Array

# Machines to which a search ascribes the residual of a sensor that misses samples.
LIKE_MISSED = ("damper", "column", "table", "device")
# Times what a sensor's repeated samples can make up to which a residual may be theirs: several samples in a row err by
# as many intervals' motion.
MISSED = 10.0
OTHERS = "other recordings"  # data on which the gap was judged
# Share of the gap that an explanation must close: what closes less leaves the larger part of the gap open.
SHRUNK = 0.5
ELSEWHERE = 0.8  # the same on other recordings: 1 less the share of a gap that may be an error of the models
# Share of the noise floor by which an effect must raise the gap above it for the response to show it: the floor rests
# on two noisy simulations, so that a smaller excess may be chance.
ROOM = 0.1
# Times the noise floor up to which a gap that no effect changes may be that of nominal parameters, which are known
# within noise only. An effect of this size counts as visible in a trial.
VISIBLE = 2.0
NOT_SHOWN = (
    "The response of the test hardly shows the effects, so the share that closes is that of the readings of the part "
    "with the effect."
)
DRAWS = 200  # of the bootstrap: its 5 % and 95 % points then rest on ten draws each
BLOCK = 2.0  # s, blocks of the bootstrap: two withheld pieces of 1 s lie side by side, and errors within are correlated


@dataclass(frozen=True)
class Response:
    """The response gap without and with the effects found, and each site's share in it."""

    gap: Gap
    how_far: HowFar
    traces: list[SiteTrace]
    shares: dict[str, tuple[float, float, float]]
    loop_shares: tuple[LoopShare, ...]
    waterfall: tuple[Step, ...]
    histories: tuple[History, ...]
    warnings: tuple[str, ...]


def judge(found: Diagnosis, validation: Sequence[Record]) -> Response:
    """The response gap of a recording without and with the effects found, on time that no fit has seen."""
    record = found.record
    mask, where_judged = judging(found)
    own = RecordingGaps(found, record, mask)
    nominal = own.nominal()
    before, after = own.signals(frozenset()), own.signals(None)
    floors = own.floor()
    gap_before, gap_after = own.gap(before), own.gap(after)
    if not gap_after:
        return unjudged()
    floor = overall({name: floors.get(name, 0.0) for name in gap_after})
    traces = all_traces(found)
    summary = HowFar(
        nominal=overall(own.gap(nominal)),
        before=overall(gap_before),
        after=overall(gap_after),
        closed=closed_share(overall(gap_before), overall(gap_after), floor),
        closed_interval=closed_interval(own, before, after, floor),
        noise_floor=floor,
        judged_on=where_judged,
    )
    hidden = hardly_shown(found, summary, own.between(before, after))
    told = by_readings(own, summary) if hidden else summary
    others = validated(found, validation, summary) if validation else told
    share, rows = shares(own, traces)
    return Response(
        gap_entry(record, own, nominal, floors),
        others or told,
        traces,
        share,
        rows,
        waterfall(own, traces, summary),
        histories(own, before, after),
        (
            *([] if others else ["The recordings given for validation hold no part that was judged."]),
            *([NOT_SHOWN] if hidden else []),
        ),
    )


def unjudged() -> Response:
    """What is said of a recording of which no signal was judged."""
    nothing = HowFar(
        before=None, after=None, closed=None, closed_interval=None, noise_floor=None, judged_on=None
    )
    return Response(Gap(signals={}, overall=None, overall_noise_floor=None), nothing, [], {}, (), (), (), ())


def hardly_shown(found: Diagnosis, summary: HowFar, changed: float) -> bool:
    """Whether effects were named that the response of the test hardly shows beside its noise.

    They have `changed` it by less than the noise hides, as a share of its rms, and what is left may be noise and an
    error of nominal parameters.
    """
    before, after, floor = summary.before or 0.0, summary.after or 0.0, summary.noise_floor or 0.0
    if not any(verdict.effects for verdict in found.verdicts):
        return False
    shown = min(before, math.hypot(floor, changed)) if after < VISIBLE * floor else before
    return shown - floor < ROOM * floor


def shrinks(found: Diagnosis, far: HowFar) -> bool:
    """Whether the effects of the parts really close the gap; noise of a sensor and a link alone need not.

    Another motion than the one that they were fitted to must be explained nearly as well.
    """
    named = any(verdict.effects for verdict in found.verdicts)
    least = ELSEWHERE if far.judged_on == OTHERS else SHRUNK
    return not named or far.closed is None or far.closed >= least


def by_readings(own: RecordingGaps, summary: HowFar) -> HowFar:
    """How far the gap of the readings closes in the parts with effects, each replayed by itself."""
    plans = own.record.plans
    systems = (own.record.systems, own.found.systems(frozenset(), plans), own.found.systems(plans=plans))
    nominal, *known = (own.open(one) for one in systems)
    names = [
        name
        for verdict in own.found.verdicts
        if verdict.effects and not verdict.search.data.part.exact
        for name in verdict.search.data.part.signals
        if name in known[0] and own.record.has(name) and own.moves(name)
    ]
    names = [name for name in names if own.changes(name, known)] or names
    if not names:
        return summary
    rows = []
    for name in names:
        there = own.record.present[name] & own.mask
        recorded = own.record.signals[name][there]
        level = float(np.sqrt(np.mean(recorded**2)))
        errors = [
            float(np.sqrt(np.mean((recorded - one[name][there]) ** 2))) / level for one in (nominal, *known)
        ]
        rows.append((*errors, own.found.noise(name) / level))
    bare, before, after, floor = (
        float(np.sqrt(np.mean(np.square(column)))) for column in zip(*rows, strict=True)
    )
    return replace(
        summary,
        nominal=bare,
        before=before,
        after=after,
        closed=closed_share(before, after, floor),
        closed_interval=None,
        noise_floor=floor,
    )


def waterfall(own: RecordingGaps, traces: Sequence[SiteTrace], summary: HowFar) -> tuple[Step, ...]:
    """The overall gap on withheld time after each correction: the tolerances, then one site after the other."""
    steps = [
        Step(label="nominal models", value=summary.nominal),
        Step(label="parameters within tolerances", value=summary.before),
    ]
    taken: set[str] = set()
    for trace in sorted(traces, key=lambda item: -item.ratio):
        names = own.found.named(trace.site)
        if names:
            taken.add(trace.site)
            value = overall(own.gap(own.signals(frozenset(taken))))
            steps.append(Step(label="+ " + ", ".join(names), value=value))
    return (*steps, Step(label="noise floor", value=summary.noise_floor))


def histories(
    own: RecordingGaps, before: Mapping[str, Array] | None, after: Mapping[str, Array] | None
) -> tuple[History, ...]:
    """Response signals recorded and simulated, in the seconds in which they differ most."""
    if before is None or after is None:
        return ()
    result = []
    for name in own.gap(after):
        recorded = own.record.signals[name]
        shown = strongest(recorded - before[name], own.record.plan.test.interval)
        result.append(
            History(
                signal=name,
                unit=own.record.unit(name),
                t=numbers(own.record.time[shown]),
                recorded=numbers(recorded[shown]),
                before=numbers(before[name][shown]),
                after=numbers(after[name][shown]),
            )
        )
    return tuple(result)


def gap_entry(
    record: Record, own: RecordingGaps, nominal: Mapping[str, Array] | None, floors: Mapping[str, float]
) -> Gap:
    """The gap between recording and nominal simulation, per signal and overall."""
    everywhere = np.ones(record.ticks, dtype=bool)
    gaps = own.gap(nominal, everywhere)
    signals = {}
    for name, value in gaps.items():
        peak = None
        if nominal is not None:
            peak = float(np.max(np.abs(record.signals[name] - nominal[name])[record.present[name]]))
        signals[name] = SignalGap(
            nrmse=value,
            noise_floor=floors.get(name, 0.0),
            peak_error=peak,
            unit=record.unit(name),
        )
    floor = overall({name: floors.get(name, 0.0) for name in gaps})
    return Gap(signals=signals, overall=overall(gaps), overall_noise_floor=floor)


def closed_interval(
    own: RecordingGaps, before: Mapping[str, Array] | None, after: Mapping[str, Array] | None, floor: float
) -> tuple[float, float]:
    """90 % interval of the share closed, by a bootstrap over blocks of the withheld time."""
    interval = own.record.plan.test.interval
    length = max(1, round(BLOCK / interval))
    places = np.arange(own.record.ticks) // length
    ids = np.unique(places[own.mask])
    energy = []
    for block in ids:
        mask = own.mask & (places == block)
        there = {name: mask & own.record.present[name] for name in own.gap(after)}
        row = []
        for simulated in (before, after):
            apart = [
                own.record.signals[name][seen] - simulated[name][seen]
                if simulated is not None
                else own.record.signals[name][seen] * loop.DIVERGED
                for name, seen in there.items()
            ]
            row += [float(np.sum(np.square(error))) for error in apart]
        row += [float(np.sum(np.square(own.record.signals[name][seen]))) for name, seen in there.items()]
        energy.append(row)
    table = np.array(energy)
    random = np.random.default_rng(0)
    values = []
    count = table.shape[1] // 3
    for _ in range(DRAWS):
        sums = table[random.integers(0, len(table), len(table))].sum(axis=0)
        errors, level = sums[: 2 * count].reshape(2, count), sums[2 * count :]
        # A reading with coarse steps may have stood still all the time: it has no gap then.
        shares = np.divide(errors, level, where=level > 0.0, out=np.zeros((2, count)))
        b, a = np.sqrt(shares.mean(axis=1)).tolist()
        values.append(closed_share(b, a, floor))
    return float(np.percentile(values, 5)), float(np.percentile(values, 95))


def validated(found: Diagnosis, validation: Sequence[Record], own: HowFar) -> HowFar | None:
    """The same on other recordings of the laboratories, None where none of them holds a part that was judged."""
    nominal, before, after, floor, alone = [], [], [], [], []
    for record in validation:
        gaps = RecordingGaps(found, record, np.ones(record.ticks, dtype=bool))
        if not gaps.judges:
            continue
        bare_, whole = gaps.signals(frozenset()), gaps.signals(None)
        nominal.append(overall(gaps.gap(gaps.nominal())))
        before.append(overall(gaps.gap(bare_)))
        after.append(overall(gaps.gap(whole)))
        floor.append(overall(gaps.floor()))
        alone.append(closed_interval(gaps, bare_, whole, floor[-1]))
    if not before:
        return None
    n, b, a, f = (float(np.mean(values)) for values in (nominal, before, after, floor))
    spread = [closed_share(*item) for item in zip(before, after, floor, strict=True)]
    return replace(
        own,
        nominal=n,
        before=b,
        after=a,
        closed=closed_share(b, a, f),
        closed_interval=(min(spread), max(spread)) if len(spread) > 1 else alone[0],
        noise_floor=f,
        judged_on=OTHERS,
    )


def all_traces(found: Diagnosis) -> list[SiteTrace]:
    """Trace of every site with a gap, in standard deviations of the noise."""
    result: list[SiteTrace] = []
    for verdict in found.verdicts:
        result += where.traces(verdict.search.data, verdict.search.chosen)
        if verdict.outcome in UNNAMED:
            extra = where.unexplained(verdict)
            # Beside a name that is doubted nothing may be left, and a named site keeps the trace of its effects.
            seen = extra.ratio > 0.0 or not verdict.effects
            if seen and all(item.site != extra.site for item in result):
                result.append(extra)
    for reading in found.readings:
        site = found.record.catalogue[reading.effect].site
        result = [
            *(item for item in result if item.site != site),
            SiteTrace(site, np.zeros(0), reading.ratio, "", 1.0),
        ]
    for name, share in found.held.items():
        lab = next(lab for lab in found.record.labs if name in lab.measured)
        if not any(may_be_missed(item, name, share) for item in found.verdicts):
            continue
        site = lab.sensor(name)
        gone = {site, *(one.site(place) for one in found.record.labs for place in LIKE_MISSED)}
        result = [
            *(item for item in result if item.site not in gone),
            SiteTrace(site, np.zeros(0), share, "", 1.0),
        ]
    if found.link:
        result.append(SiteTrace("link", np.zeros(0), max(item.z for item in found.link), "", 1.0))
    return result


def may_be_missed(verdict: PartVerdict, name: str, share: float) -> bool:
    """Whether what is left of a reading may come from the share of its samples that repeat the one before.

    A repeated sample errs by the motion of an interval, and so makes no gap that is much larger.
    """
    search = verdict.search
    data, fit = search.data, search.commissioned
    if verdict.outcome not in UNNAMED or name not in data.part.signals:
        return False
    place = data.part.signals.index(name)
    left = data.residual(hypothesis.lay(data, fit.z, fit.values))[:, place]
    moved = np.diff(data.part.measured[:, place])
    caused = share * float(np.mean(moved**2))
    return bool(np.mean(left**2) < MISSED**2 * caused)
