"""What the master's and the slave's loop have in common: alarms of a tick, ramp to rest, closing messages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from common.errors import EmergencyStopError, RigError
from common.lab import preflight
from common.lab.descent import Descent, Resting
from common.lab.laboratory import REPEAT_NS, Laboratory
from common.protocol.exchange import Event
from common.rig import GuardedRig
from common.safety.modes import Mode, Turn
from common.safety.watchdog import WatchdogFinding

# Time between repetitions of a closing message. They are not requests that somebody answers, so they are repeated twice
# as often: the default `loss_timeout` of 1 s then has twenty of them.
SAY_NS = REPEAT_NS // 2

# names of their own for what every tick compares: an attribute of an enumeration takes 60 ns
RAMP, HOLD, HOLDING = WatchdogFinding.RAMP, WatchdogFinding.HOLD, Mode.HOLDING


class RigLoop:
    """A loop around one rig; the subclass defines a tick and the messages about the test's end.

    `standing` returns the reason why a measurement forbids the reset of a latched state, an empty text if it does not.
    """

    def __init__(
        self, lab: Laboratory, rig: GuardedRig, descent: Descent[Any], standing: Callable[[Any], str]
    ) -> None:
        self.lab = lab
        self.ticks = 0
        self._rig = rig
        lab.watch(rig)
        self._descent = descent
        self._standing = standing
        self._most_missed = lab.plan.safety.hold_after
        self._disarmed = False
        self._said_ns = -REPEAT_NS

    # -- what the subclass defines ------------------------------------------------------------------

    def _finding(self, tick: int) -> tuple[WatchdogFinding, str]:
        """The watchdog's finding at a tick that came in time, and the partner that it concerns."""
        raise NotImplementedError

    def _say_end(self) -> None:
        """Tell the other laboratories that the test ends, and why."""
        raise NotImplementedError

    @property
    def _ends(self) -> bool:
        """Whether the test ends and the other laboratories have to be told."""
        raise NotImplementedError

    # -- alarms -------------------------------------------------------------------------------------

    def _alarmed(self, tick: int, late_ns: int, *, late: bool) -> bool:
        """Trip if this loop is far too late or a partner was silent for too long; return whether it tripped.

        After a shorter silence the laboratory holds. `late_ns` is the lateness of the tick, `late` whether it counts as
        late.

        A rig in another process that does not answer in time makes it hold too, and trips by the error of `read`.
        """
        lab = self.lab
        if late_ns > 0 and lab.overrun(late_ns, tick):
            return True
        if late:  # the messages may have come while this loop was held up
            return False
        finding, who = self._finding(tick)
        if finding is RAMP:
            lab.silent(who, tick)
            return True
        if finding is HOLD or self._rig.missed >= self._most_missed:
            lab.safety.follow(Turn.HOLD)
        elif lab.safety.mode is HOLDING:
            lab.safety.take(Turn.RESUME)
        return False

    def _rig_failed(self, error: RigError, tick: int) -> None:
        if isinstance(error, EmergencyStopError):
            self.emergency(error)
        else:
            self.lab.fail(Event.TRIP, error, code="rig", tick=tick)

    # -- end ----------------------------------------------------------------------------------------

    def ease(self, tick: int) -> None:
        """One interval on the ramp to rest."""
        try:
            self._descent.ease(tick)
        except EmergencyStopError as error:
            self.emergency(error)

    def emergency(self, error: EmergencyStopError) -> None:
        """Stop the rig at once."""
        self.lab.emergency(error)
        self.disarm_rig()

    def disarm_rig(self) -> None:
        """Disarm the rig, once."""
        if not self._disarmed:
            self._disarmed = True
            if failure := self._rig.disarm():
                self.lab.note("disarm", str(failure), level="warning", tick=self.ticks)
                self.lab.explain(failure, tick=self.ticks)
            account = self._rig.exchanged
            if account is not None and (values := account.values()):
                text = f"{self._rig.name}: {account.sentence()}."
                self.lab.note(preflight.RIG, text, tick=self.ticks, values=values)

    def start(self) -> tuple[bool, str]:
        """Refuse the operator's start, which the master alone carries out."""
        return False, "The master starts the test."

    def end(self, reason: str) -> None:
        """Bring the test to an end in order: after its last tick, or earlier on request."""
        lab = self.lab
        if lab.exchange.allows(Event.STOP):
            lab.exchange.happen(Event.STOP, cause=reason)
            lab.note("stop", reason, tick=self.ticks)
            lab.safety.follow(Turn.END)
            self.tell()

    def hold(self) -> tuple[bool, str]:
        """Hold the test; the master alone can do so."""
        return False, "Only the master holds a test."

    def resume(self) -> tuple[bool, str]:
        """Resume a held test; the master alone can do so."""
        return False, "Only the master resumes a test."

    def standing(self) -> str:
        """Why the cause of a latched state persists, an empty text where it is gone."""
        try:
            return self._standing(self._rig.read())
        except RigError as error:
            return str(error)

    @property
    def resting(self) -> Resting:
        """How far the rig is on its ramp to rest."""
        return self._descent.resting

    def tell(self) -> None:
        """Tell the other laboratories of the end, again after a while; may be called at any time."""
        if self._ends and self._due():
            self._say_end()

    def _due(self, *, last: bool = False) -> bool:
        """Whether a closing message is due, which the `last` one always is; takes note of the time."""
        now = self.lab.clock.now()
        if not last and now - self._said_ns < SAY_NS:
            return False
        self._said_ns = now
        return True

    def _hand_over(self) -> None:
        """Send the recorder the rest of the stream and its length."""
        self.lab.send_samples(everything=True)
        self.lab.endpoint.send(self.lab.outlet.finished())
