"""Every message between the processes of a test, as frozen records of plain values.

Times are integers in ns on the sender's monotonic clock unless the name says otherwise. `session` is
the random number under which the master registered the slave; 0 before that.
"""

from __future__ import annotations

from typing import NamedTuple

MOST_CHANNELS = (
    6  # of a feedback: its frame then has fifteen items, the most that msgpack's shortest array head counts
)


class Register(NamedTuple):
    """Master to slave: take part in this test."""

    session: int
    protocol: int
    plan: str  # digest, and the keys that are not at their defaults: common/plan/plan_difference.py


class Waiting(NamedTuple):
    """Slave to master, until it is registered: it is there.

    `instance` is a random number that identifies the process.
    """

    session: int
    instance: int


class Registered(NamedTuple):
    """Slave to master: ready to be armed."""

    session: int
    instance: int


class Refused(NamedTuple):
    """Slave to master: it does not take part, and why."""

    session: int
    reason: str


class Arm(NamedTuple):
    """Master to slave: the process of this `instance` shall arm its rig; any other one shall leave."""

    session: int
    instance: int


class Armed(NamedTuple):
    """Slave to master: the rig is ready."""

    session: int


class Sync(NamedTuple):
    """Master to slave: one exchange of clock readings."""

    session: int
    seq: int
    sent_ns: int


class SyncReply(NamedTuple):
    """Slave to master: the answer, with the slave's own readings."""

    session: int
    seq: int
    received_ns: int
    sent_ns: int


class Start(NamedTuple):
    """Master to slave: tick 0 is at this time of the slave's clock."""

    session: int
    start_ns: int
    epoch_ns: int  # Unix time of tick 0, master's wall clock


class Scheduled(NamedTuple):
    """Slave to master: the start is agreed."""

    session: int


class Command(NamedTuple):
    """Master to slave, one per tick: the targets of the interval's end."""

    session: int
    seq: int
    sent_ns: int
    shift_ns: int  # how far the slave's clock has drifted from the master's since the start, estimated
    heard_seq: int  # newest feedback that came over the link, in use or not yet; -1 for none
    target: float  # of the laboratory's transfer system, m
    effort: float  # of its motor, N; 0 where it has none
    velocity: float  # of the target, m/s
    acceleration: float  # of the target, m/s²
    jerk: float  # of the target, m/s³


class Feedback(NamedTuple):
    """Slave to master, one per tick: the measurements at the tick, and the command they answer."""

    session: int
    seq: int
    command_seq: int  # in force
    command_received_ns: (
        int  # when it came, with a link plug-in's delay; in the first feedback only, 0 in later ones
    )
    heard_seq: int  # newest command that came over the link, in force or not yet; -1 for none
    heard_ns: int  # when that command came
    started_ns: int  # start of the tick: the measurements are of this moment
    sent_ns: int
    measured: tuple[float, ...]  # the channels of the laboratory's kind, in its order, 1 to `MOST_CHANNELS`


class Stop(NamedTuple):
    """Master to slave: the test ends after this many ticks."""

    session: int
    ticks: int
    reason: str


class Extend(NamedTuple):
    """Master to slaves and recorder: the test has at least this many ticks, because it was held."""

    session: int
    ticks: int


class Stopped(NamedTuple):
    """Slave to master: the rig is disarmed; after a trip this is the slave's last message."""

    session: int
    ticks: int


class Trip(NamedTuple):
    """Laboratory to laboratory: this one has stopped its rig, and why."""

    session: int
    lab: str
    code: str
    text: str


class Operator(NamedTuple):
    """Operator to the laboratories: an order of `common.lab.operation`; repetitions of one press have one `press`."""

    session: int
    plan: str  # digest
    word: str  # of the order
    press: int
    reason: str


class Answer(NamedTuple):
    """Laboratory to operator: whether a press was obeyed, and a sentence."""

    session: int
    press: int
    accepted: int  # 1 or 0
    text: str


class Samples(NamedTuple):
    """Laboratory to recorder: a piece of its stream, items numbered from `first`."""

    session: int
    lab: str
    first: int
    items: bytes


class Finished(NamedTuple):
    """Laboratory to recorder: its stream ends after this many items."""

    session: int
    lab: str
    total: int


class Recorder(NamedTuple):
    """Recorder to the laboratories, ten times a second: its state, and how far it has each stream."""

    session: int
    state: str  # ready, recording, stopping, failed, done
    plan: str  # as in Register
    reason: str
    nexts: bytes  # by role, the number of the next item that the recorder expects (common/lab/outlet.py)


class Resend(NamedTuple):
    """Recorder to a laboratory: send these items again."""

    session: int
    lab: str
    first: int
    last: int


Message = (
    Register
    | Waiting
    | Registered
    | Refused
    | Arm
    | Armed
    | Sync
    | SyncReply
    | Start
    | Scheduled
    | Command
    | Feedback
    | Stop
    | Extend
    | Stopped
    | Trip
    | Operator
    | Answer
    | Samples
    | Finished
    | Recorder
    | Resend
)
