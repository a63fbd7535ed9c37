"""Errors a user can act on: one sentence each that says what, where and what to do, with an exit code."""

from __future__ import annotations

EXIT_CODES = {
    0: "done",
    1: "a check of yours failed",
    2: "bad usage or input",
    3: "stopped by an interlock or by you, or refused before it began",
    4: "the other laboratory or the network was lost",
}


class RthsError(Exception):
    """Base of all errors shown to the user as one sentence; `exit_code` is the process's (0 is success)."""

    exit_code = 2
    said = False  # whether the user has read it already


class InputError(RthsError):
    """A file or value the user gave cannot be used (exit 2)."""


class PlanError(InputError):
    """The plan holds an unknown key, a wrong type or an impossible value (exit 2)."""


class RigError(RthsError):
    """A laboratory is not ready, has failed, or returned something else than a measurement (exit 3).

    `details` is the traceback of the rig's own exception, for the recording; empty where there is none to show.
    """

    exit_code = 3

    def __init__(self, text: str, details: str = "") -> None:
        super().__init__(text)
        self.details = details


class EmergencyStopError(RigError):
    """A laboratory's emergency stop was pressed: its rig is stopped at once, without a ramp (exit 3)."""


class InterlockError(RthsError):
    """The test was stopped by a limit, by another laboratory or by the user (exit 3)."""

    exit_code = 3


class IncompleteError(RthsError):
    """The test is done, but its recording is not whole though the plan requires it (exit 1).

    Both laboratories came to their end in order, so it is neither an interlock nor a loss of one of them.
    """

    exit_code = 1


class LostError(RthsError):
    """The other laboratory, the recorder or the network was lost or never came (exit 4)."""

    exit_code = 4


class ProtocolError(RthsError):
    """A message or an event that the protocol of the test does not allow in the present state."""


class LocalProtocolError(ProtocolError):
    """An event of this process itself is not allowed by the protocol in the present state."""


class RemoteProtocolError(ProtocolError):
    """Another process sent an event that the protocol does not allow in the present state."""
