"""Reading a recording back, finished, cut off, or still being written.

The recorder hands whole records to the operating system some twenty times a second, so the file itself is the stream
of a test that runs: the writer neither knows its readers nor waits for them.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import inf
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from google.protobuf import descriptor_pb2
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Metadata, Schema, Statistics
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from common import signals
from common.errors import InputError
from common.recording.bounds import Bounds
from common.recording.checksums import CHECKSUMS, fits, opened
from common.recording.records import (
    DAMAGE,
    HEAD,
    MESSAGE,
    GrowingFile,
    content,
    framed,
    inner,
    parsed,
    summary,
)
from common.recording.schema import message_class
from common.recording.writer import SHARED, SIGNALS
from common.roles import LATENCY, MASTER, SLAVE, kind_of, latency_topic, ramps_of, title

Values = NDArray[Any]

GROUND = "ground_motion"
CLOCK = "clock"  # metadata: `kind`, virtual or real
MACHINES = (
    "real_time"  # metadata: real-time shape and time of the laboratories' machines, and the bare timing loop
)
LOOK_BYTES = 1 << 20  # of the file per look: some seconds of a test, decoded in a few tens of milliseconds
WANTED = frozenset({Opcode.CHUNK, Opcode.METADATA, Opcode.ATTACHMENT})  # of the rest the place alone matters
MISFIT = (DecodeError, TypeError, ValueError, KeyError, AttributeError)


@dataclass
class Run:
    """A recording read back: columns by topic and name, metadata, attachments; `roles` are those of its slaves.

    The ramps to rest after the last tick are in `ramps`, by role. `part_of` is the role of the slave of several whose
    part of the recording it is, empty for a whole one; `damage` says where the file is damaged, which is read up to
    there only.
    """

    path: Path
    test: str = ""
    roles: tuple[str, ...] = (SLAVE,)
    part_of: str = ""
    columns: dict[str, dict[str, Values]] = field(default_factory=dict)
    ramps: dict[str, dict[str, Values]] = field(default_factory=dict)
    sequences: dict[str, Values] = field(default_factory=dict)
    log_ns: dict[str, Values] = field(default_factory=dict)
    units: dict[str, dict[str, str]] = field(default_factory=dict)
    texts: dict[str, dict[str, str]] = field(
        default_factory=dict
    )  # meaning of each signal, by topic and name
    shared: dict[str, tuple[str, ...]] = field(
        default_factory=dict
    )  # the master's of a value per slave: roles
    events: list[dict[str, Any]] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    finished: bool = False
    damage: str = ""

    def has(self, topic: str) -> bool:
        """Whether the recording holds any message of a topic."""
        return bool(self.columns.get(topic)) and self.sequences[topic].size > 0

    def ticks(self, topic: str) -> int:
        """How many messages of a topic there are."""
        return int(self.sequences[topic].size) if topic in self.sequences else 0

    def of(self, role: str) -> Run:
        """The recording as one of one slave: its topics under the usual names, its share of the master's columns.

        Raises:
            InputError: the test has no such slave.
        """
        if role not in self.roles:
            there = ", ".join(map(title, self.roles)) or "no slave"
            raise InputError(f"{self.path} has no {title(role)}; it has {there}.")
        if self.roles == (SLAVE,):
            return self
        own = {MASTER: MASTER, SLAVE: role, LATENCY: latency_topic(role)}
        here = {kind: topic for kind, topic in own.items() if topic in self.columns}
        columns = {kind: self.columns[topic] for kind, topic in here.items()}
        if MASTER in columns and len(self.roles) > 1:
            columns[MASTER] = share(columns[MASTER], self.shared, role)
        return replace(
            self,
            roles=(SLAVE,),
            part_of=role,
            columns=columns,
            sequences={kind: self.sequences[topic] for kind, topic in here.items()},
            log_ns={kind: self.log_ns[topic] for kind, topic in here.items()},
            units={kind: self.units[topic] for kind, topic in here.items()},
            texts={kind: self.texts[topic] for kind, topic in here.items()},
            shared={},
        )

    def signal(self, name: str) -> Values | None:
        """A signal by name from the laboratory that knows it at first hand, None where it is not recorded."""
        for topic in signals.TICK_TOPICS:  # what a slave measures stands in no other topic
            if name in self.columns.get(topic, {}):
                return self.columns[topic][name]
        return None


def share(
    columns: Mapping[str, Values], shared: Mapping[str, tuple[str, ...]], role: str
) -> dict[str, Values]:
    """The master's columns as of one slave: of those that hold a value per slave its own, without others' alone.

    `shared` are the roles of the slaves by the name of such a column.
    """
    mine = {name: roles.index(role) for name, roles in shared.items() if role in roles and len(roles) > 1}
    return {
        name: column[:, mine[name]] if name in mine and column.size else column
        for name, column in columns.items()
        if name not in shared or role in shared[name]
    }


def read(path: Path) -> Run:
    """Read a recording, finished or cut off.

    Raises:
        InputError: the file cannot be read, is no MCAP file, or holds nothing of a hybrid test.
    """
    with Tail(path) as tail:
        tail.open()
        run = tail.look(inf)
    if tail.place <= len(MCAP0_MAGIC) and (tail.damage or not tail.place):
        raise _unreadable(path, tail.cause or "it is too short")
    if tail.misfit:
        raise tail.misfit
    if not run.columns and not run.events:
        raise InputError(f"{path} is an MCAP file, but holds no topic rths/<test>/<name>.")
    return run


def length(path: Path) -> float:
    """Seconds from the first to the last message of a finished recording, by its summary; 0 where it has none."""
    try:
        with path.open("rb") as stream:
            found = summary(GrowingFile(stream))
    except (OSError, *DAMAGE):
        return 0.0
    times = [
        (record.message_end_time - record.message_start_time) * 1e-9
        for record in (found.records if found else ())
        if isinstance(record, Statistics)
    ]
    return max(times, default=0.0)


def _unreadable(path: Path, cause: str) -> InputError:
    return InputError(
        f"{path} is not a readable MCAP recording: {cause}; if it was one, rths recover saves what is whole."
    )


class Tail:
    """A recording that may still grow, read on from look to look; a context that closes the file.

    `place` is the byte behind the newest whole record. `damage` says why reading has ended before the file's end, empty
    while it has not, and `cause` what is wrong there; `behind` says whether there is more to be had at once, and
    `finished` whether the recorder has closed the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.place = 0
        self.finished = self.behind = False
        self.damage = self.cause = ""
        self.misfit: InputError | None = None  # messages that do not fit what describes them
        self._stream: io.BufferedReader | None = None
        self._contents = Contents()
        self._bounds = Bounds(path, 0)
        self._metadata: dict[str, dict[str, str]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._stream is not None:
            self._stream.close()

    def open(self) -> None:
        """Open the file; raises InputError where that cannot be done."""
        try:
            self._stream = self.path.open("rb")
        except OSError as error:
            raise InputError(f"Cannot read the recording {self.path}: {error.strerror}.") from None

    def look(self, most: float = LOOK_BYTES) -> Run:
        """What is new, of at most `most` bytes of the file and one record more; its metadata are all so far.

        A record that is not whole yet is left for the next look, and so is a file that does not exist yet.

        Raises:
            InputError: the file cannot be read, is no MCAP file, or holds more than any recording of its size does.
        """
        run = Run(self.path, metadata=dict(self._metadata))
        if self._stream is None and self.path.exists():
            self.open()
        try:
            if self._stream is not None:
                self._read(GrowingFile(self._stream), most, run)
        except OSError as error:
            raise InputError(f"Cannot read the recording {self.path}: {error.strerror}.") from None
        try:
            self._contents.decode(run)
        except InputError as error:
            self.misfit = error
            self._end(str(error))
        if run.damage and not self.damage:
            self._end(run.damage)
        run.finished, run.damage = self.finished, self.damage
        self._metadata = dict(run.metadata)
        return run

    def _end(self, damage: str) -> None:
        self.damage, self.behind = damage, False

    def _read(self, source: GrowingFile, most: float, run: Run) -> None:
        self._bounds.size = source.size
        if source.size < self.place:
            self._end("it was cut off or begun anew while it was read")
        if not self._begun(source):
            return
        try:
            for found in self._wanted(source, self.place + most):
                for record in list(unpacked(parsed(found), self._bounds)):
                    self._contents.take(record, run)
        except DAMAGE as error:
            self._end(f"at byte {self.place}")
            self.cause = str(error) or type(error).__name__

    def _begun(self, source: GrowingFile) -> bool:
        """Whether the file is written beyond the bytes with which every MCAP file begins."""
        if not self.place:
            begin = source.at(0, len(MCAP0_MAGIC))
            if begin != MCAP0_MAGIC[: len(begin)]:
                raise _unreadable(self.path, "it does not begin as one")
            self.place = len(begin) if begin == MCAP0_MAGIC else 0
        return self.place > 0

    def _wanted(self, source: GrowingFile, limit: float) -> Iterator[bytes]:
        """Whole records that count, up to a place; each counts as read when the next one is asked for."""
        self.behind = False
        while not (self.finished or self.damage) and (frame := framed(source, self.place, source.size)):
            opcode, after = frame
            if self.place >= limit:
                self.behind = True
                return
            if opcode in WANTED:
                yield source.at(self.place, after - self.place)
            self.place = after
            self.finished = opcode == Opcode.FOOTER


def unpacked(record: McapRecord, bounds: Bounds) -> Iterator[McapRecord]:
    """What counts of a record: definitions and messages are those of chunks, which have a checksum.

    Raises:
        ValueError: a chunk is damaged.
        InputError: the file holds more than any of its size does.
    """
    if not isinstance(record, Chunk):
        yield record
        return
    data = content(record)
    bounds.unpack(len(data))
    for opcode, found in inner(data):
        bounds.record()
        if opcode == Opcode.MESSAGE:
            channel, sequence, log_ns, publish_ns = MESSAGE.unpack_from(found, HEAD.size)
            yield Message(channel, log_ns, found[HEAD.size + MESSAGE.size :], publish_ns, sequence)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            yield parsed(found)


class Contents:
    """The records of a recording, taken as they come and decoded when they are wanted."""

    def __init__(self) -> None:
        self._channels: dict[int, Channel] = {}
        self._schemas: dict[int, Schema] = {}
        self._messages: dict[str, list[Message]] = {}  # by topic

    def take(self, record: McapRecord, run: Run) -> None:
        """One record as `unpacked` gives it; metadata and attachments go to the run at once."""
        match record:
            case Schema():
                self._schemas[record.id] = record
            case Channel():
                self._channels[record.id] = record
            case Message() if record.channel_id in self._channels:
                self._messages.setdefault(self._channels[record.channel_id].topic, []).append(record)
            case Metadata():
                run.metadata[record.name] = record.metadata
            case Attachment():
                run.attachments[record.name] = record.data
            case _:
                pass

    def decode(self, run: Run) -> None:
        """Give a run the messages taken since the last call, and hold its metadata against their checksums.

        Raises:
            InputError: messages and what describes them do not belong together.
        """
        _check(run)
        messages, self._messages = self._messages, {}
        for _, channel in sorted(self._channels.items()):  # in the order in which they were registered
            if channel.topic.startswith("rths/"):
                _take(run, channel, self._schemas, messages.get(channel.topic, []))


def _check(run: Run) -> None:
    """Hold the metadata against their checksums, which are none of the user's."""
    checksums = opened(run.metadata.pop(CHECKSUMS, {})) or {}
    wrong = [name for name, values in run.metadata.items() if not fits(name, values, checksums)]
    if wrong and not run.damage:
        run.damage = f"in its metadata '{wrong[0]}'"


def _take(run: Run, channel: Channel, schemas: dict[int, Schema], messages: list[Message]) -> None:
    """Decode a topic; raises InputError where its messages and what describes them do not belong together."""
    try:
        _decode(run, channel, schemas[channel.schema_id], messages)
    except MISFIT:
        raise InputError(
            f"{run.path} is damaged: its messages on {channel.topic} do not fit their description."
        ) from None


def _decode(run: Run, channel: Channel, schema: Schema, messages: list[Message]) -> None:
    _, run.test, topic = channel.topic.split("/", 2)
    run.roles = tuple(channel.metadata.get("slaves", SLAVE).split())
    kind = _described(schema.data, schema.name)
    decoded = [kind.FromString(message.data) for message in messages]
    if topic == "event":
        run.events = [_event(item) for item in decoded]
        return
    names = [item.name for item in kind.DESCRIPTOR.fields]
    columns = {name: np.array([getattr(item, name) for item in decoded]) for name in names}
    if ramps_of(topic) in (MASTER, *run.roles):
        run.ramps[ramps_of(topic)] = columns
        return
    run.units[topic] = json.loads(channel.metadata.get("units", "{}"))
    run.texts[topic] = _texts(run, topic)
    if topic == MASTER:
        run.shared = _shared(run, channel)
    run.columns[topic] = columns
    run.sequences[topic] = np.array([message.sequence for message in messages], dtype=np.int64)
    run.log_ns[topic] = np.array([message.log_time for message in messages], dtype=np.int64)


def _texts(run: Run, topic: str) -> dict[str, str]:
    """The meaning of a topic's signals, as the recording has it; of one that says nothing, as kinds that ship do."""
    said = run.metadata.get(SIGNALS, {}).get(topic, "")
    try:
        return {name: str(text) for name, (_, text) in json.loads(said).items()}
    except (ValueError, TypeError, AttributeError):  # not there, or no table of signals
        return {row.name: row.text for row in signals.TOPICS.get(kind_of(topic), ())}


def _shared(run: Run, channel: Channel) -> dict[str, tuple[str, ...]]:
    """The fields with a value per slave; a recording that does not say it has tables at all slaves."""
    if SHARED in channel.metadata:
        return {name: tuple(map(str, roles)) for name, roles in json.loads(channel.metadata[SHARED]).items()}
    return dict.fromkeys(signals.shared(signals.TOPICS[MASTER]), run.roles)


@lru_cache(maxsize=32)
def _described(description: bytes, name: str) -> type[Any]:
    """The class of a message that a schema describes, made once: a recording that grows is decoded again and again."""
    return message_class(descriptor_pb2.FileDescriptorSet.FromString(description).file[0], name)


def _event(item: Any) -> dict[str, Any]:
    plain = {name: getattr(item, name) for name in ("t", "lab", "level", "code", "text")}
    return plain | {"values": dict(item.values)}
