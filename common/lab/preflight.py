"""Pre-flight: the checks of sensors and link before anything moves, and the risks that a user accepts by name.

`loop/nominal/preflight.py` judges the partition and the simulated peaks, the recorder judges the disk.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from datetime import date
from typing import NamedTuple

from common.errors import RigError
from common.lab.laboratory import Laboratory, Setting
from common.plan.calibration import overdue
from common.plan.plan import Plan
from common.safety.risks import Risk, known
from common.udp import probe
from common.udp.rig import UdpRig

# codes of the recording's events
PASSED, SENSORS, LINK, ACCEPTED = "preflight", "sensors", "link", "accepted_risk"
RIG = "rig_exchange"

NOISE_FACTOR = 10.0  # noise over the plan's rms: more of it points to a wrong range or a loose cable
OFFSET_SHARE = 0.1  # share of the limit that a rig at rest may read: a zeroed sensor stays far below it

NO_NOISE: Mapping[str, float] = {}

SENSORS_PASSED = "Sensor check at rest: passed"


class PreflightCheck(NamedTuple):
    """What was checked, in words with its figures, and the risk that was found; a `warning` refuses nothing."""

    text: str
    risk: Risk | None = None
    warning: bool = False


class RefusedError(RigError):
    """A test that must not begin because of a risk that was not accepted by name (exit 3)."""


def check(risks: Iterable[Risk], accepted: Collection[str]) -> tuple[list[Risk], list[Risk]]:
    """Risks that refuse the test, and those that are overruled because their name was accepted."""
    found = list(risks)
    return (
        [risk for risk in found if risk.name not in accepted],
        [risk for risk in found if risk.name in accepted],
    )


def refusal(risks: Sequence[Risk]) -> RefusedError:
    """The refusal for risks that were not accepted, as one sentence; `risks` is not empty."""
    names = dict.fromkeys(risk.name for risk in risks)
    options = " ".join(f"--accept-risk {name}" for name in names)
    return RefusedError(
        f"Pre-flight refuses the test: {'; '.join(risk.sentence for risk in risks)}; "
        f"to run it all the same, give {options}."
    )


class Gate:
    """The checks that one laboratory must pass before it moves, and their results.

    `accepted` are the names of the accepted risks. With `await_start` the armed laboratories wait for an operator's
    start, which the master's gate alone decides. Results are kept until `note` records them, since an event needs a
    test time, which exists once the start is agreed.
    """

    def __init__(self, accepted: Collection[str] = (), *, await_start: bool = False) -> None:
        self.accepted = known(accepted)
        self.await_start = await_start
        self.overruled: list[Risk] = []
        self.passed: list[tuple[str, str, str]] = []  # code of the event, its text and its level

    def judge(self, checks: Iterable[PreflightCheck], code: str = PASSED) -> None:
        """Take the results of checks; raises RefusedError where a risk was found that is not accepted."""
        made = list(checks)
        refusing, overruled = check([one.risk for one in made if one.risk], self.accepted)
        if refusing:
            raise refusal(refusing)
        self.overruled += overruled
        self.passed += [
            (code, f"pre-flight: {one.text}.", "warning" if one.warning else "info")
            for one in made
            if one.risk is None
        ]

    def note(self, lab: Laboratory) -> None:
        """Record and report each check that was passed and each risk that was accepted, once."""
        for code, text, level in self.passed:
            lab.note(code, text, level=level)
        for risk in self.overruled:
            lab.note(ACCEPTED, f"risk '{risk.name}' accepted: {risk.sentence}.", level="warning")
        self.passed, self.overruled = [], []


def calibration_checks(plan: Plan, today: date) -> list[PreflightCheck]:
    """A warning for each sensor of the plan whose calibration holds no longer on that day."""
    return [PreflightCheck(text, warning=True) for text in overdue(plan, today)]


# -- link -----------------------------------------------------------------------------------------


def link_risk(round_trips_s: Sequence[float], lost: int, plan: Plan) -> Risk | None:
    """The risk of a link that loses exchanges or delays too many beyond the interval; None where it is good enough.

    `round_trips_s` (n,) are those of the exchanges that came back, s; `lost` is how many did not.
    """
    interval, share = plan.test.interval, plan.preflight.late_share
    late = sum(trip > interval for trip in round_trips_s)
    if not round_trips_s:
        return Risk(
            "link", f"none of {lost} exchanges over the link came back, so check network and firewall"
        )
    if lost <= plan.preflight.lost and late <= share * len(round_trips_s):
        return None
    return Risk(
        "link",
        f"of {len(round_trips_s) + lost} exchanges over the link {lost} were lost and {late} took longer than the "
        f"interval of {interval * 1e3:g} ms ({share:.0%} of them may), {quantiles(round_trips_s)}, so quieten "
        "network and machines (`rths doctor` says what they lack) or lengthen interval in [test]",
    )


def link_text(round_trips_s: Sequence[float], lost: int, plan: Plan) -> str:
    """The result of a link's check that was passed, in words."""
    late = sum(trip > plan.test.interval for trip in round_trips_s)
    return f"Link check: {len(round_trips_s)} exchanges, {lost or 'none'} lost, {late} late, {quantiles(round_trips_s)}"


def link_check(round_trips_s: Sequence[float], lost: int, plan: Plan) -> PreflightCheck:
    """The check of a link by its round trips (s) and the number of lost exchanges."""
    risk = link_risk(round_trips_s, lost, plan)
    return PreflightCheck("" if risk else link_text(round_trips_s, lost, plan), risk)


def quantiles(round_trips_s: Sequence[float]) -> str:
    """Median and 99th percentile of round trips (s) in words, by the nearest-rank method."""
    ranked = sorted(round_trips_s)
    p50, p99 = (ranked[math.ceil(part * len(ranked)) - 1] for part in (0.5, 0.99))
    return f"round trip p50 {p50 * 1e3:.2f} ms, p99 {p99 * 1e3:.2f} ms"


# -- sensors --------------------------------------------------------------------------------------


def sensor_risk(
    readings: Sequence[Sequence[float]],
    names: Sequence[str],
    limits: Mapping[str, float],
    noise: Mapping[str, float] = NO_NOISE,
    *,
    hidden: bool = False,
    lab: str = "the laboratory",
) -> Risk | None:
    """The risk of the first channel that does not read like a sound sensor of a rig at rest; None where all do.

    `readings` (n, channels) at rest, `limits` by name, `noise` the plan's rms by name; all in the channels' units.
    Figures of a `hidden` rig are left out of the sentence.
    """
    for place, name in enumerate(names):
        values = [float(row[place]) for row in readings]
        complaint = unsound(values, limits.get(name, math.inf), noise.get(name, 0.0))
        if complaint:
            what, figures, remedy = complaint
            shown = "" if hidden else f" ({figures})"
            return Risk("sensors", f"{name} of {lab} {what}{shown} while nothing moves, so {remedy}")
    return None


def unsound(values: Sequence[float], limit: float, rms: float) -> tuple[str, str, str] | None:
    """What is wrong with one channel at rest, its figures and the remedy; None where it is sound.

    `rms` is the nominal noise, 0 for none, in the unit of `values` and `limit`.
    """
    if not all(map(math.isfinite, values)):
        return "is not finite", f"{values}"[:80], "look at its cable and its driver"
    offset, spread = mean_and_rms(values)
    largest = max(map(abs, values))
    if largest > limit:
        return "is beyond its limit", f"{largest:.6g} of {limit:g}", "unload the rig or zero the sensor"
    if rms > 0.0 and min(values) == max(values) and len(values) > 1:
        return (
            "is frozen",
            f"{len(values)} readings of {values[0]:.6g}, nominal noise {rms:g} rms",
            "look at its cable and its driver, or set its noise in [sensors] to 0",
        )
    if rms > 0.0 and spread > NOISE_FACTOR * rms:
        return (
            f"is noisier than {NOISE_FACTOR:g} × its nominal noise",
            f"{spread:.3g} of {rms:g} rms",
            "look at its cable and its range, or correct its noise in [sensors]",
        )
    if abs(offset) > OFFSET_SHARE * limit:
        return (
            f"is off zero by more than {OFFSET_SHARE:.0%} of its limit",
            f"{offset:.6g} of {limit:g}",
            "bring the rig to zero or zero the sensor",
        )
    return None


def mean_and_rms(values: Sequence[float]) -> tuple[float, float]:
    """Mean, and rms deviation from it."""
    mean = math.fsum(values) / len(values)
    return mean, math.sqrt(math.fsum((value - mean) ** 2 for value in values) / len(values))


class SensorsAtRest:
    """Judges the sensors of a rig when it is armed, by the `limits` and the nominal `noise` (rms) of each channel."""

    def __init__(
        self, gate: Gate, setting: Setting, limits: Mapping[str, float], noise: Mapping[str, float]
    ) -> None:
        self._gate = gate
        self._plan, self._limits, self._noise = setting.plan, limits, noise
        self._clock = setting.clock

    def judge(
        self,
        read: Callable[[], Sequence[float]],
        names: Sequence[str],
        lab: str,
        *,
        hidden: bool,
        paced: bool,
    ) -> None:
        """Read as often as the plan says, an interval apart where `paced`.

        Raises RefusedError where a sensor is unsound.
        """
        plan, readings = self._plan, []
        for _ in range(plan.preflight.readings):
            if paced:
                self._clock.sleep_until(self._clock.now() + round(plan.test.interval * 1e9))
            readings.append(read())
        risk = sensor_risk(readings, names, self._limits, self._noise, hidden=hidden, lab=lab)
        self._gate.judge([PreflightCheck(SENSORS_PASSED, risk)], SENSORS)

    def reach(self, rig: UdpRig, *, hidden: bool) -> None:
        """Judge the exchanges with a rig in another process; of a hidden one nothing is said where it serves."""
        terms, found = rig.terms, rig.echoes
        risk = probe.slow(terms, found.round_trips_s, found.lost, self._plan)
        if risk and hidden:
            risk = risk._replace(sentence="a rig does not answer as it must")
        if risk or not hidden:
            self._gate.judge([PreflightCheck(probe.text(terms, found.round_trips_s), risk)], RIG)

    def skip(self, kind: str, *, hidden: bool) -> None:
        """Take note of a rig of the class `kind` that cannot be read at rest.

        A hidden rig, one of a reality, is reported like one whose check passed, so that the recording does not show it.
        """
        why = (
            "the rig gives no readings in its answers to echoes"
            if kind == UdpRig.__name__
            else f"class {kind} does not set idle_readings = True"
        )
        skipped = f"Sensor check skipped: {why}"
        self._gate.judge([PreflightCheck(SENSORS_PASSED if hidden else skipped)], SENSORS)
