"""The server's side of an element of OpenSees, or of a control of OpenFresco, as a state machine without sockets.

It receives and returns bytes. The caller takes the displacements that are `wanted`, lets the laboratories move there,
and passes back the measurements. Every answer is measured: a request for forces waits until the laboratories have
reached the displacements that it belongs to.

A deformation of a specimen cannot be undone. Within one step, which ends with a commit or, for OpenFresco, which does
not commit, with an acquisition, displacements may therefore change once; further changes are refused.

Each step of the analysis is one step of the test, also where the structure is at rest. Only the commit tells that
a step leaves the displacements as they are: before it the integrator may still change them. Such a step is imposed at
its commit. Of OpenFresco an equal displacement may be a predictor or a step at rest, and nothing in its messages tells
which: it is acquired at once, and is no step of the test.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum, auto
from typing import NamedTuple

from common.errors import RemoteProtocolError
from common.opensees import wire
from common.opensees.wire import ClientHeader, MessageCode, Quantities

FITTING = "NewmarkExplicit, CentralDifference or AlphaOS"
"""Integrators of OpenSees that impose each displacement once."""


# relative: an iteration that goes on below the digits that count changes a displacement by some 1e-12, and no specimen
# feels a nanometre in a metre
ROUNDING = 1e-9


class RevisedError(RemoteProtocolError):
    """A client tries to change a displacement that was imposed in the same step."""


class Phase(Enum):
    """The state of the displacements that a client sent last."""

    GREETING = auto()  # the header has not arrived
    MEASURED = auto()  # imposed and measured
    WANTED = auto()  # received and not imposed yet
    MOVING = auto()  # imposed and not measured yet
    ENDED = auto()  # the client has ended


class Measurement(NamedTuple):
    """Measured displacements (m) and forces (N) of all degrees of freedom, and the time of the test (s)."""

    displacement: tuple[float, ...]
    force: tuple[float, ...]
    time: float


class ElementServer:
    """Serves one client; `stiffness` (N/m) of each degree of freedom is the diagonal of its stiffness matrices.

    Damping and mass matrices are zero, because the measured forces include damping and inertia: OpenSees would add
    them a second time.
    """

    def __init__(self, stiffness: Sequence[float]) -> None:
        n = len(stiffness)
        self.phase = Phase.GREETING
        self.header: ClientHeader | None = None
        self.steps = 0  # steps of the test in which this element takes part
        self.commits = 0
        self.wanted = Quantities(displacement=(0.0,) * n)
        self._diagonal = [
            k for row in range(n) for k in (0.0,) * row + (stiffness[row],) + (0.0,) * (n - row - 1)
        ]
        self._latest = b""  # the trial received last
        self._measured = Measurement((0.0,) * n, (0.0,) * n, 0.0)
        self._moved = False  # whether displacements have changed in the present step
        self._asked: MessageCode | None = None  # a request, or the end, that waits for the measurement
        self._next = b""  # a trial or commit that waits until the displacements before it are measured
        self._heard = False
        self._zeros = b""  # the answer for a matrix of zeros
        self._in = bytearray()
        self._out = bytearray()

    # -- bytes of the client -------------------------------------------------------------------------

    def take(self, data: bytes) -> None:
        """Process bytes of the client.

        Raises:
            RemoteProtocolError: they are not messages of such a client.
            RevisedError: the client changes a displacement that was imposed in the same step.
        """
        self._heard = True
        self._in += data
        self._read()

    def outgoing(self) -> bytes:
        """The bytes to be sent to the client; each is returned once."""
        data = bytes(self._out)
        self._out.clear()
        return data

    @property
    def waits(self) -> bool:
        """Whether the client waits for a measurement; until then it sends nothing."""
        return self._asked is not None

    @property
    def ending(self) -> bool:
        """Whether the client has ended, even if its last displacements are not measured yet."""
        return self.phase is Phase.ENDED or self._asked is MessageCode.END

    @property
    def untouched(self) -> bool:
        """Whether the client has not sent any byte."""
        return not self._heard

    @property
    def full(self) -> bool:
        """Whether the laboratories must move before more messages can be processed."""
        return self._asked is not None or bool(self._next)

    # -- laboratories ----------------------------------------------------------------------------------

    def impose(self) -> Quantities:
        """Mark the wanted displacements as being imposed, and return them."""
        self.phase = Phase.MOVING
        return self.wanted

    def rest(self) -> None:
        """Take part in a step of the test that other elements need, at the displacements imposed last."""
        self.phase = Phase.MOVING
        self.steps += 1

    def measured(self, found: Measurement) -> None:
        """Take the measurements at the displacements imposed last, and answer a waiting request; raises as `take`."""
        self._measured = found
        self.phase = Phase.MEASURED
        if (asked := self._asked) is not None:
            self._asked = None
            self._answer(asked)
        if kept := self._next:
            self._next = b""
            self._message(kept)
        self._read()

    # -- messages ----------------------------------------------------------------------------------------

    def _read(self) -> None:
        if self.header is None:
            if len(self._in) < wire.HEADER.size:
                return
            self._greet(wire.read_header(self._cut(wire.HEADER.size)))
        assert self.header is not None  # noqa: S101 - `_greet` has set it
        size = self.header.size
        while len(self._in) >= size and not self.full and self.phase is not Phase.ENDED:
            self._message(self._cut(size))

    def _cut(self, size: int) -> bytes:
        data = bytes(self._in[:size])
        del self._in[:size]
        return data

    def _greet(self, header: ClientHeader) -> None:
        """Take the header; raises RemoteProtocolError if it commands or acquires other quantities than there are."""
        n, control, acquired = len(self._measured.force), header.control, header.acquired
        if control.displacement != n:
            raise RemoteProtocolError(
                f"it has {control.displacement} degrees of freedom, but {n} of the laboratories answer here: "
                f"give the element {n} -dof."
            )
        if control.force or acquired.velocity or acquired.acceleration or acquired.displacement not in (0, n):
            raise RemoteProtocolError(
                "it commands forces or acquires velocities or accelerations, but displacements are imposed here, and "
                "displacements and forces measured (-daqModes 1 0 0 1 1)."
            )
        if acquired.force != n or max(control.time, acquired.time) > 1:
            raise RemoteProtocolError(f"it acquires {acquired.force} forces of {n} laboratories.")
        if header.data < n * n:
            raise RemoteProtocolError(
                f"its messages of {header.data} numbers hold no matrix of {n} times {n}."
            )
        self.header, self.phase = header, Phase.MEASURED
        self._zeros = wire.answer(header, ())

    def _message(self, data: bytes) -> None:
        code = wire.code_in(data)
        if code is MessageCode.TRIAL:
            self._trial(data)
        elif code is MessageCode.COMMIT:
            self._commit(data)
        elif code in wire.MATRICES or self.phase is Phase.MEASURED:
            self._answer(code)
        else:
            self._asked = code

    def _trial(self, data: bytes) -> None:
        """Take displacements; whether equal ones are a step of the test is decided by the commit."""
        assert self.header is not None  # noqa: S101 - messages follow the header
        n = self.header.control.displacement
        self._latest = data
        if wire.numbers_in(self.header, data, n, first=1) == self.wanted.displacement:
            return
        values = wire.commanded(self.header, data)
        if self._moved and rounded(values.displacement, self.wanted.displacement):
            return
        if self._moved:
            raise RevisedError(
                f"A trial revises displacements that were imposed in the same step ({shown(self.wanted)} to "
                f"{shown(values)}): choose an integrator that imposes each once, such as {FITTING}, with "
                "algorithm('Linear')."
            )
        if self.phase is not Phase.MEASURED:  # the previous ones must be measured first
            self._next = data
            return
        self._moved = True
        self._want(values)

    def _commit(self, data: bytes) -> None:
        """End a step of the analysis; one that has not been a step of the test yet becomes one at rest."""
        assert self.header is not None  # noqa: S101 - messages follow the header
        if self.steps <= self.commits:
            if self.phase is not Phase.MEASURED:  # the step before it must be measured first
                self._next = data
                return
            latest = wire.commanded(self.header, self._latest or data)
            self._want(latest._replace(displacement=self.wanted.displacement))
        self.commits += 1
        self._moved = False

    def _want(self, values: Quantities) -> None:
        self.wanted, self.phase = values, Phase.WANTED
        self.steps += 1

    def _answer(self, code: MessageCode) -> None:
        assert self.header is not None  # noqa: S101 - messages follow the header
        found, header = self._measured, self.header
        if code is MessageCode.END:
            self.phase = Phase.ENDED
            return
        if code is MessageCode.FORCE:
            values: Sequence[float] = found.force
        elif code is MessageCode.ACQUIRE:
            self._moved = False
            values = [
                *found.displacement[: header.acquired.displacement],
                *found.force,
                *(found.time,) * header.acquired.time,
            ]
        elif code in (MessageCode.STIFFNESS, MessageCode.INITIAL_STIFFNESS):
            values = self._diagonal
        else:
            self._out += self._zeros
            return
        self._out += wire.answer(header, values)


def rounded(given: Sequence[float], imposed: Sequence[float]) -> bool:
    """Whether displacements (m) differ from those imposed by the rounding of an iteration alone."""
    return all(abs(a - b) <= ROUNDING * abs(b) for a, b in zip(given, imposed, strict=True))


def shown(values: Quantities) -> str:
    """Displacements as text in mm."""
    return ", ".join(f"{1e3 * value:.6g}" for value in values.displacement) + " mm"
