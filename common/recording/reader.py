"""Reading a recording back, finished or cut off."""

from __future__ import annotations

import io
import json
import os
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from google.protobuf import descriptor_pb2
from google.protobuf.message import DecodeError
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Footer, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from numpy.typing import NDArray

from common import signals
from common.errors import InputError
from common.recording.bounds import Bounds
from common.recording.checksums import CHECKSUMS, fits, opened
from common.recording.salvage import DAMAGE, HEAD, KINDS, MESSAGE, RECORD_LIMIT, inner
from common.recording.schema import message_class
from common.recording.writer import SHARED, SIGNALS
from common.roles import LATENCY, MASTER, SLAVE, kind_of, latency_topic, ramps_of, title

Values = NDArray[Any]

GROUND = "ground_motion"
CLOCK = "clock"  # metadata: `kind`, virtual or real
MACHINES = (
    "real_time"  # metadata: real-time shape and time of the laboratories' machines, and the bare timing loop
)
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
    run = Run(path)
    contents = Contents()
    for record in _records(path, run):
        contents.take(record, run)
    contents.decode(run)
    if not run.columns and not run.events:
        raise InputError(f"{path} is an MCAP file, but holds no topic rths/<test>/<name>.")
    return run


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


def _records(path: Path, run: Run) -> Iterator[Any]:
    try:
        with path.open("rb") as stream:
            bounds = Bounds(path, os.fstat(stream.fileno()).st_size)
            yield from _up_to_damage(stream, run, bounds)
    except OSError as error:
        raise InputError(f"Cannot read the recording {path}: {error.strerror}.") from None
    except DAMAGE as error:
        raise InputError(
            f"{path} is not a readable MCAP recording: {str(error) or type(error).__name__}; "
            "if it was one, rths recover saves what is whole."
        ) from None


def _up_to_damage(stream: io.BufferedReader, run: Run, bounds: Bounds) -> Iterator[Any]:
    records = StreamReader(stream, emit_chunks=True, record_size_limit=RECORD_LIMIT).records
    place = 0  # behind the newest whole record
    while True:
        try:
            record = next(records)
            contents = list(unpacked(record, bounds))
        except StopIteration:
            return
        except DAMAGE:
            if not place:
                raise
            run.damage = "" if _torn(stream, place) else f"at byte {place}"
            return
        place = stream.tell()
        run.finished = isinstance(record, Footer)
        yield from contents


def _torn(stream: io.BufferedReader, place: int) -> bool:
    """Whether a file ends within the record at a place, as one does whose writer was cut off."""
    size = stream.seek(0, io.SEEK_END)
    stream.seek(place)
    head = stream.read(HEAD.size)
    return len(head) < HEAD.size or size - place - HEAD.size < HEAD.unpack(head)[1] <= RECORD_LIMIT


def unpacked(record: McapRecord, bounds: Bounds) -> Iterator[McapRecord]:
    """What counts of a record: definitions and messages are those of chunks, which have a checksum.

    Raises:
        ValueError: a chunk would unpack to more than any of a recording holds.
        InputError: the file holds more than any of its size does.
    """
    if isinstance(record, Chunk):
        for opcode, body in inner(_content(record, bounds)):
            bounds.record()
            if opcode == Opcode.MESSAGE:
                channel, sequence, log_ns, publish_ns = MESSAGE.unpack_from(body)
                yield Message(channel, log_ns, body[MESSAGE.size :], publish_ns, sequence)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                yield KINDS[opcode].read(ReadDataStream(io.BytesIO(body)))
    elif not isinstance(record, Schema | Channel | Message):
        yield record


def _content(chunk: Chunk, bounds: Bounds) -> bytes:
    """The records of a chunk, as any program may have packed them."""
    size = zstandard.frame_content_size(chunk.data) if chunk.compression == "zstd" else 0
    if max(size, chunk.uncompressed_size) > RECORD_LIMIT:
        raise ValueError("a chunk is larger than any of a recording")
    bounds.unpack(max(size, chunk.uncompressed_size))
    match chunk.compression:
        case "":
            data = chunk.data
        case "zstd":
            data = zstandard.decompress(chunk.data, chunk.uncompressed_size)
        case "lz4":  # which other programs write
            data = _lz4(chunk)
        case _:
            raise ValueError(f"a chunk is packed by '{chunk.compression}', which is not known here")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("a chunk does not have its checksum")
    return data


def _lz4(chunk: Chunk) -> bytes:
    """A chunk unpacked by LZ4, at most as large as it says itself."""
    from lz4.frame import LZ4FrameDecompressor

    try:
        return bytes(LZ4FrameDecompressor().decompress(chunk.data, max_length=chunk.uncompressed_size))
    except RuntimeError as error:  # which is how the library says it
        raise ValueError(str(error)) from None


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
    said = run.metadata.get(SIGNALS)
    if said is None:
        return {row.name: row.text for row in signals.TOPICS.get(kind_of(topic), ())}
    return {name: str(text) for name, (_, text) in json.loads(said.get(topic, "{}")).items()}


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
