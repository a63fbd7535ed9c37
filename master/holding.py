"""Hold and resumption of the running test at an operator's order: what is refused, what the others are told.

docs/decisions/0049-hold.md says how a test is held, and why a motion may be too fast for it.
"""

from __future__ import annotations

from typing import NamedTuple

from common.earthquake_time import EarthquakePace, EarthquakeTime
from common.lab.laboratory import REPEAT_NS, Laboratory
from common.protocol.messages import Extend
from common.recording.holds import HELD, HOLD, RESUME, RESUMED
from common.roles import MASTER
from laboratories import standstill
from laboratories.kind import Moving
from master.building import BuildingStep
from master.limits import MasterLimits
from master.partners import Partners

# Earthquake's time that must be left behind a hold, s: ten repetitions of the message by which a slave learns that the
# test has more ticks, so that none ends it too early.
LEAST_LEFT = 10 * REPEAT_NS * 1e-9
NOT_RUNNING = "The test is not running."

Decision = tuple[bool, str]  # whether an order is accepted, and a sentence


class LaboratoryMotion(NamedTuple):
    """What the master knows of its own laboratory at the newest tick."""

    measured: tuple[float, ...]
    before: tuple[float, ...]  # measured a tick earlier
    force: dict[str, float]  # by the name of its channel


class Holding:
    """The holds of one test, whose energies `limits` keeps."""

    def __init__(
        self, lab: Laboratory, building: BuildingStep, partners: Partners, limits: MasterLimits
    ) -> None:
        self.active = False  # whether there has been a hold
        self._lab, self._building, self._partners, self._limits = lab, building, partners, limits
        self._every = max(REPEAT_NS // lab.interval_ns, 1)  # ticks between repetitions
        self._pace = EarthquakePace.FULL
        self._forces: dict[str, float] = {}  # at standstill, N

    def hold(self, tick: int, motion: LaboratoryMotion) -> Decision:
        """Decide on a hold from a tick on, and begin it."""
        lab, time = self._lab, self._building.time
        if not lab.running or tick == 0:
            return False, NOT_RUNNING
        if time is None:
            return False, f"This test cannot be held: {self._building.unheld}."
        if refused := self._refused(time, tick):
            return False, refused
        energies = self._limits.energies
        judgement = standstill.judged(lab.plan, self._moving(motion, self._length(time)), energies.spare)
        if judgement.obstacle:
            return False, f"The test cannot be held at present: {judgement.obstacle}."
        self._building.hold(tick)
        self.active, self._pace = True, EarthquakePace.SLOWING
        still = self._seconds(time, tick + time.ramp)
        share = judgement.taken / energies.given
        text = (
            f"The earthquake's time slows down over {self._length(time):.3g} s and stands still at {still:.3f} s; "
            f"the motion that the laboratories lose is up to {share:.1%} of the energy put in."
        )
        values = {"ramp": float(time.ramp), "earthquake_time": self._seconds(time, tick)}
        values |= {"energy_lost": judgement.taken, "energy_put_in": energies.given}
        began = f"The earthquake's time slows down from {values['earthquake_time']:.3f} s on."
        lab.note(HOLD, began, tick=tick, values=values)
        self._extend(time, tick)
        return True, text

    def _refused(self, time: EarthquakeTime, tick: int) -> str:
        """Why the state of the test allows no hold, empty where it does."""
        plan, pace = self._lab.plan, time.pace(tick)
        if pace is EarthquakePace.RESUMING:
            return f"The test is resuming: order the hold again in {self._length(time):.2g} s."
        if pace is not EarthquakePace.FULL:
            return "The test is held already."
        left = plan.ticks - (tick - time.added(tick)) - time.ramp
        if left * plan.test.interval < LEAST_LEFT:
            needed = LEAST_LEFT + self._length(time)
            return f"The test is nearly over: a hold needs {needed:.2g} s of the earthquake after it."
        return ""

    def _moving(self, motion: LaboratoryMotion, duration: float) -> dict[str, Moving]:
        """The motion of every laboratory, by role."""
        interval = self._lab.plan.test.interval
        _, effort, velocity, *_ = self._building.told
        rates = tuple(
            (new - old) / interval for new, old in zip(motion.measured, motion.before, strict=False)
        )
        own = Moving(velocity, effort, motion.measured, rates, duration)
        return {MASTER: own} | {one.role: one.moving(duration, interval) for one in self._partners.all}

    def resume(self, tick: int, motion: LaboratoryMotion) -> Decision:
        """Decide on the resumption of a held test from a tick on, and begin it."""
        lab, time = self._lab, self._building.time
        if not lab.running:
            return False, NOT_RUNNING
        if time is None or time.pace(tick) is EarthquakePace.FULL:
            return False, "The test is not held."
        if time.resumed is not None:
            return False, "The test is resuming already."
        time.resume(tick)
        self._extend(time, tick)
        at = self._seconds(time, tick + time.ramp)
        return True, f"The earthquake's time speeds up over {self._length(time):.3g} s from {at:.3f} s on."

    def follow(self, tick: int, motion: LaboratoryMotion) -> None:
        """Take note of a tick that has been computed: say what has changed, and how long the test will be."""
        time = self._building.time
        if time is None:
            return
        pace = time.pace(tick + 1)
        if pace is not self._pace:
            self._changed(time, pace, tick + 1, motion)
            self._pace = pace
        self._lab.until = self._lab.plan.ticks + time.added(tick + 1)
        for partner in self._partners.all:
            partner.tally.extend(self._lab.until)
        if tick % self._every == 0:
            self._say()

    def _changed(
        self, time: EarthquakeTime, pace: EarthquakePace, tick: int, motion: LaboratoryMotion
    ) -> None:
        """Record that the earthquake's time passes in another way from a tick on."""
        lab = self._lab
        tick = time.resumed if pace is EarthquakePace.RESUMING and time.resumed is not None else tick
        at = self._seconds(time, tick)
        values = {"earthquake_time": at}
        if pace is EarthquakePace.RESUMING:
            if self._pace is EarthquakePace.SLOWING:  # there was no tick between the two ramps
                self._stood(time, tick, motion)
            changes = {name: new - self._forces.get(name, new) for name, new in self._felt(motion).items()}
            said = ", ".join(f"{name} by {change:+.3g} N" for name, change in changes.items())
            text = f"The earthquake's time goes on from {at:.3f} s; measured during the hold, forces changed: {said}."
            lab.note(RESUME, text, tick=tick, values=values | changes)
        elif pace is EarthquakePace.HELD:
            self._stood(time, tick, motion)
        elif pace is EarthquakePace.FULL:
            behind = time.added(tick) * lab.plan.test.interval
            text = f"The earthquake's time passes in real time again, {behind:.3f} s behind the test's time."
            lab.note(RESUMED, text, tick=tick, values=values | {"behind": behind})

    def _stood(self, time: EarthquakeTime, tick: int, motion: LaboratoryMotion) -> None:
        """Record that the earthquake's time stands still."""
        at = self._seconds(time, tick)
        self._forces = self._felt(motion)
        text = f"Held: the earthquake's time stands still at {at:.3f} s, and so do all transfer systems."
        self._lab.note(HELD, text, tick=tick, values={"earthquake_time": at})

    def _felt(self, motion: LaboratoryMotion) -> dict[str, float]:
        """The measured force (N) of every laboratory by its channel, with the slave's role where there are several."""
        several = len(self._partners.all) > 1
        return dict(motion.force) | {
            f"{partner.role}.{partner.force_name}" if several else partner.force_name: partner.force
            for partner in self._partners.all
        }

    def _extend(self, time: EarthquakeTime, tick: int) -> None:
        """Make the test as long as it will be if the hold ends as early as it can, and tell the others."""
        self._lab.until = self._lab.plan.ticks + time.added(tick)
        self._say()

    def _say(self) -> None:
        """Tell slaves and recorder how many ticks the test has at least."""
        self._lab.endpoint.send(Extend(self._lab.exchange.session, self._lab.until))

    @property
    def progress(self) -> dict[str, float]:
        """The earthquake's time (s) and its rate, for the progress report; empty before the first hold."""
        time = self._building.time
        if not self.active or time is None:
            return {}
        here = time.at(self._lab.tick)
        return {"earthquake_time": here.place * self._lab.plan.test.interval, "rate": here.rate}

    def _seconds(self, time: EarthquakeTime, tick: int) -> float:
        return time.at(tick).place * self._lab.plan.test.interval

    def _length(self, time: EarthquakeTime) -> float:
        """The duration of a ramp, s."""
        return time.ramp * self._lab.plan.test.interval
