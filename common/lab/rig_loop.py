"""What the loops of both laboratories do alike: alarms of a tick, the ramp to rest, the last words."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from common.errors import EmergencyStopError, RigError
from common.lab.descent import Descent, Resting
from common.lab.laboratory import REPEAT_NS, Laboratory
from common.protocol.exchange import Event
from common.rig import GuardedRig
from common.safety.modes import Mode, Turn
from common.safety.watchdog import WatchdogFinding

SAY_NS = REPEAT_NS // 2  # between two times that a laboratory says the same of its end


class RigLoop:
    """A loop around one rig; what it does in a tick, and what it says of its end, is the subclass's.

    `standing` says of a measurement why it keeps a latched state from being reset, empty where it does not.
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
        self._disarmed = False
        self._said_ns = -REPEAT_NS

    # -- what the subclass says ---------------------------------------------------------------------

    def _finding(self, tick: int) -> tuple[WatchdogFinding, str]:
        """What the watchdog says at a tick that came in time, and of whom."""
        raise NotImplementedError

    def _say_end(self) -> None:
        """Tell the other laboratories that the test ends, and why."""
        raise NotImplementedError

    @property
    def _ends(self) -> bool:
        """Whether there is an end that they have to be told of."""
        raise NotImplementedError

    # -- alarms -------------------------------------------------------------------------------------

    def _alarmed(self, tick: int, late_ns: int, *, late: bool) -> bool:
        """Trip where this loop came far too late, or a partner has been silent for too long; hold before that."""
        lab = self.lab
        if lab.overrun(late_ns, tick):
            return True
        if late:  # the silence may be this loop's own
            return False
        finding, who = self._finding(tick)
        if finding is WatchdogFinding.RAMP:
            lab.silent(who, tick)
            return True
        if finding is WatchdogFinding.HOLD:
            lab.safety.follow(Turn.HOLD)
        elif lab.safety.mode is Mode.HOLDING:
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

    def end(self, reason: str) -> None:
        """Bring the test to an end in order: after its last tick, or earlier because somebody wants it so."""
        lab = self.lab
        if lab.exchange.allows(Event.STOP):
            lab.exchange.happen(Event.STOP, cause=reason)
            lab.note("stop", reason, tick=self.ticks)
            lab.safety.follow(Turn.END)
            self.tell()

    def standing(self) -> str:
        """Why the cause of a latched state persists, empty where it is gone."""
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
        """Whether it is time to say something again, or the `last` time, and takes note of it."""
        now = self.lab.clock.now()
        if not last and now - self._said_ns < SAY_NS:
            return False
        self._said_ns = now
        return True

    def _hand_over(self) -> None:
        """Give the recorder the rest, and say how much there is."""
        self.lab.send_samples(everything=True)
        self.lab.endpoint.send(self.lab.outlet.finished())
