"""The building that another program computes, in the master's loop.

The forces measured at a tick complete the building's step at that time; the program answers with its motion and with
the displacements for the end of the interval, which the laboratories are told. In real time a tick waits for the answer
within the plan's share of the interval. If it comes later, the laboratories keep their commands, the building's time
stands still for those intervals, and the watchdog counts them as it counts a slave's silence.
"""

from __future__ import annotations

from collections.abc import Sequence

from common.foreign import FloorMotion, ForeignModel
from common.lab.laboratory import Laboratory
from common.plan.plan import Plan
from common.roles import BUILDING, MASTER
from common.safety.watchdog import Watchdog, WatchdogFinding
from common.signals import OF_STOREYS
from common.udp.account import quantile
from laboratories.kind import Follows
from loop.substructure import SENT_VALUES
from master.building import Answering, BuildingStep, Outputs
from master.client.building import compensator
from master.client.coupled import CoupledLaboratory, couplings_of
from master.client.pace import Pace
from models.registry import Array


class ForeignBuilding(BuildingStep):
    """The building `model` under the ground motion `rows` (2, ticks + 1), as `substructure.ground_rows` gives them."""

    who = BUILDING

    def __init__(self, plan: Plan, model: ForeignModel, rows: Array, pace: Pace) -> None:
        self._model, self._pace, self._interval = model, pace, plan.test.interval
        couplings = couplings_of(plan)
        self._labs = [CoupledLaboratory(one, self._interval, 1) for one in couplings.values()]
        self._own = self._labs[0] if MASTER in couplings else None
        self._compensator = compensator(plan)
        self._mass = plan.structure.mass
        self._acceleration, self._displacement = rows.tolist()
        self._watchdog = Watchdog(plan.safety, self._interval)
        self._lab: Laboratory | None = None
        self._step = 0  # of the building; it is behind the tick by the intervals in which no answer came
        self._asked, self._heard = False, -1
        self._exerted = [0.0] * plan.storeys  # on the floors by the laboratories, N
        self._waits: list[float] = []  # s, from handing over the forces to the answer
        self._handed_ns = self._late = 0
        none = [(0.0,) * SENT_VALUES for _ in plan.roles]
        self._outputs = Outputs(0.0, 0.0, 0.0, 0.0, none, [0.0] * (len(OF_STOREYS) * plan.storeys))

    def join(self, lab: Laboratory, partners: Sequence[Answering]) -> None:
        """Receive the master's laboratory."""
        self._lab = lab

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """Compute a tick; a step that the program has not finished in time leaves all commands as they are."""
        assert self._lab is not None  # noqa: S101 - `join` comes first
        if not self._asked:
            self._exerted = self._on_floors([force, *forces] if self._own else list(forces))
            self._handed_ns, self._asked = self._lab.clock.now(), True
            self._model.advance(self._exerted)
        motion = self._answer(self._lab, tick)
        if motion is None:
            self._late += 1
            present = self._own.target if self._own else 0.0
            self._outputs = self._outputs._replace(target=present, held=True)
            return self._outputs
        self._waits.append((self._lab.clock.now() - self._handed_ns) * 1e-9)
        self._asked, self._heard = False, tick
        return self._told(motion, position)

    def _answer(self, lab: Laboratory, tick: int) -> FloorMotion | None:
        left = self._pace.until(lab, tick)
        while (motion := self._model.motion(max(left(), 0.0))) is None:
            if left() <= 0.0:
                self._pace.over()
                return None
        return motion

    def _on_floors(self, measured: Sequence[float]) -> list[float]:
        """The laboratories' forces on the floors, N, from the measured ones."""
        found = [0.0] * len(self._mass)
        for lab, force in zip(self._labs, measured, strict=True):
            resisting, place = lab.resists(force), lab.coupling.place - 1
            found[place] -= resisting
            if lab.coupling.follows is Follows.DRIFT and place > 0:
                found[place - 1] += resisting
        return found

    def _told(self, motion: FloorMotion, position: float) -> Outputs:
        """The values of the building at this tick, and those for the laboratories at the end of the interval."""
        here = self._acceleration[self._step]
        self._step += 1
        present = self._own.target if self._own else 0.0
        told = [self._follow(lab, motion) for lab in self._labs]
        command = effort = 0.0
        if self._own:
            target, effort, *rates = told.pop(0)
            command = self._compensator(target, *rates, present, position, self._interval)
        absolute = [a + here for a in motion.acceleration]
        storeys = [*motion.displacement, *motion.velocity, *motion.acceleration, *absolute]
        storeys += self._storey_forces(absolute)
        self._outputs = Outputs(here, present, command, effort, told, storeys)
        return self._outputs

    def _follow(self, lab: CoupledLaboratory, motion: FloorMotion) -> tuple[float, ...]:
        """The values for one laboratory at the end of the interval, its motor's force by the building's velocity."""
        coupling, place = lab.coupling, lab.coupling.place - 1
        moved, speed = motion.ahead[place], motion.velocity_ahead[place]
        if coupling.follows is Follows.FLOOR:
            moved += self._displacement[self._step]
        elif place > 0:
            moved, speed = moved - motion.ahead[place - 1], speed - motion.velocity_ahead[place - 1]
        target, _, *rates = lab.follow(moved)
        return target, coupling.effort * speed, *rates

    def _storey_forces(self, absolute: Sequence[float]) -> list[float]:
        """Forces (N) that the model's storeys carry, from the plan's masses and the forces of the laboratories."""
        found, above = [], 0.0
        for mass, a, force in zip(self._mass[::-1], absolute[::-1], self._exerted[::-1], strict=True):
            above += force - mass * a
            found.append(above)
        return found[::-1]

    def look(self, tick: int) -> WatchdogFinding:
        """The watchdog's finding on the program's answers; none in virtual time or before the first one."""
        if not self._pace.settles or self._heard < 0:
            return WatchdogFinding.FINE
        return self._watchdog.look(tick - 1, self._heard, self._heard)

    def leave(self) -> None:
        """In real time record how long the steps took, and end the program."""
        if self._lab is not None and self._waits and self._pace.settles:
            ranked = sorted(self._waits)
            values = {
                "steps": float(len(ranked)),
                "late": float(self._late),
                "waited_p50": quantile(ranked, 0.5),
                "waited_p99": quantile(ranked, 0.99),
                "waited_max": ranked[-1],
            }
            times = ", ".join(
                f"{name} {values[f'waited_{name}'] * 1e3:.2f} ms" for name in ("p50", "p99", "max")
            )
            text = f"{len(ranked)} steps of '{self._model.name}', {self._late} ticks without one; a tick waited {times}"
            self._lab.note(BUILDING, text, tick=self._lab.tick, values=values)
        self._model.close()
