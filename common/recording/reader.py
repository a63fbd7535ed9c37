"""Reading a recording back, finished or cut off."""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from google.protobuf import descriptor_pb2
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Chunk, Footer, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from numpy.typing import NDArray

from common import signals
from common.errors import InputError
from common.recording.schema import message_class

Values = NDArray[Any]

RECORD_LIMIT = 64 << 20
GROUND = "ground_motion"
DAMAGE = (McapError, ValueError, struct.error, zstandard.ZstdError)  # what the libraries raise on it


@dataclass
class Run:
    """A recording read back: columns by topic and name, metadata, attachments."""

    path: Path
    test: str = ""
    columns: dict[str, dict[str, Values]] = field(default_factory=dict)
    sequences: dict[str, Values] = field(default_factory=dict)
    log_ns: dict[str, Values] = field(default_factory=dict)
    units: dict[str, dict[str, str]] = field(default_factory=dict)
    events: list[dict[str, Any]] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    finished: bool = False

    def has(self, topic: str) -> bool:
        """Whether the recording holds any message of a topic."""
        return bool(self.columns.get(topic)) and self.sequences[topic].size > 0

    def ticks(self, topic: str) -> int:
        """How many messages of a topic there are."""
        return int(self.sequences[topic].size) if topic in self.sequences else 0

    def signal(self, name: str) -> Values | None:
        """A signal by name from the laboratory that knows it at first hand, None where it is not recorded."""
        order = ("slave", "master", "latency") if name in signals.MEASURED["slave"] else signals.TICK_TOPICS
        for topic in order:
            if name in self.columns.get(topic, {}):
                return self.columns[topic][name]
        return None


def read(path: Path) -> Run:
    """Read a recording, finished or cut off.

    Raises:
        InputError: the file cannot be read, is no MCAP file, or holds nothing of a hybrid test.
    """
    run = Run(path)
    table: dict[str, list[Message]] = {}
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    for record in _records(path, run):
        match record:
            case Schema():
                schemas[record.id] = record
            case Channel():
                channels[record.id] = record
            case Message():
                table.setdefault(channels[record.channel_id].topic, []).append(record)
            case Metadata():
                run.metadata[record.name] = record.metadata
            case Attachment():
                run.attachments[record.name] = record.data
            case _:
                pass
    for channel in channels.values():
        if channel.topic.startswith("rths/"):
            _decode(run, channel, schemas[channel.schema_id], table.get(channel.topic, []))
    if not run.columns and not run.events:
        raise InputError(f"{path} is an MCAP file, but holds no topic rths/<test>/<name>.")
    return run


def _records(path: Path, run: Run) -> Iterator[Any]:
    try:
        with path.open("rb") as stream:
            yield from _up_to_damage(stream, run)
    except OSError as error:
        raise InputError(f"Cannot read the recording {path}: {error.strerror}.") from None
    except DAMAGE as error:
        raise InputError(
            f"{path} is not a readable MCAP recording: {error or type(error).__name__}."
        ) from None


def _up_to_damage(stream: io.BufferedReader, run: Run) -> Iterator[Any]:
    records = StreamReader(stream, emit_chunks=True, record_size_limit=RECORD_LIMIT).records
    first = True
    while True:
        try:
            record = next(records)
            inner = breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else [record]
        except StopIteration:
            return
        except DAMAGE:
            if first:
                raise
            return
        first = False
        run.finished = isinstance(record, Footer)
        yield from inner


def _decode(run: Run, channel: Channel, schema: Schema, messages: list[Message]) -> None:
    _, run.test, topic = channel.topic.split("/", 2)
    files = descriptor_pb2.FileDescriptorSet.FromString(schema.data)
    kind = message_class(files.file[0], schema.name)
    decoded = [kind.FromString(message.data) for message in messages]
    if topic == "event":
        run.events = [_event(item) for item in decoded]
        return
    names = [item.name for item in kind.DESCRIPTOR.fields]
    run.units[topic] = json.loads(channel.metadata.get("units", "{}"))
    run.columns[topic] = {name: np.array([getattr(item, name) for item in decoded]) for name in names}
    run.sequences[topic] = np.array([message.sequence for message in messages], dtype=np.int64)
    run.log_ns[topic] = np.array([message.log_time for message in messages], dtype=np.int64)


def _event(item: Any) -> dict[str, Any]:
    plain = {name: getattr(item, name) for name in ("t", "lab", "level", "code", "text")}
    return plain | {"values": dict(item.values)}
