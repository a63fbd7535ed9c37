"""Writes a recording as an MCAP file."""

from __future__ import annotations

import contextlib
import errno
import io
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from google.protobuf import descriptor_pb2
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, McapRecord, Schema
from mcap.writer import CompressionType, Writer

from common.errors import InputError
from common.recording.checksums import CHECKSUMS, checksum, sealed
from common.recording.chunks import Block, pack_messages
from common.recording.index import pack_index
from common.recording.logger.low_pass import Samples
from common.recording.run import GROUND
from common.recording.schema import message_class, message_name, schema_file
from common.roles import SLAVE
from common.signals import Signal, shared

CHUNK_SIZE = (
    64 * 1024
)  # bytes, unpacked: a damaged chunk loses a quarter of a second, and it still compresses well
REPEAT_BYTES = (
    1 << 20
)  # schemas and channels, some kilobytes, are repeated after this many bytes: less than a percent
SIGNALS = "signals"  # metadata: by topic, JSON of name -> [unit, text]
SHARED = "shared"  # of a channel: JSON of the fields that hold a value per slave -> the slaves' roles
SYNC = getattr(os, "fdatasync", os.fsync)  # fdatasync is cheaper, but not every system has it


class Spool:
    """The stream that the MCAP library writes into: it holds all bytes until `drain`, which reports a disk's errors."""

    def __init__(self, stream: io.FileIO) -> None:
        self._stream = stream
        self._held = bytearray()
        self._drained = 0

    def write(self, data: bytes) -> int:
        """Add bytes to those held."""
        self._held += data
        return len(data)

    def tell(self) -> int:
        """The offset in the file of the next byte."""
        return self._drained + len(self._held)

    def flush(self) -> None:
        """Do nothing: `drain` writes the bytes."""

    def drain(self) -> None:
        """Write the bytes held; on an OSError the part just written is cut off again, and the error is raised."""
        written = 0
        try:
            while written < len(self._held):
                written += self._stream.write(self._held[written:])
        except OSError:
            with contextlib.suppress(OSError):  # a device cannot be cut
                self._stream.truncate(self._drained)
            raise
        self._drained += written
        self._held.clear()


def packed(values: Mapping[str, Any]) -> str:
    """A table as JSON, as a recording's metadata hold it."""
    return json.dumps(values, ensure_ascii=False)


class Recording:
    """A recording being written.

    `topics` are its topics with their signals, `slaves` the roles of the test's slaves. Schemas and channels stand in
    the first chunk, and outside chunks at the beginning and once per `REPEAT_BYTES`, so that damage at one place does
    not make the rest unreadable. Metadata, which MCAP does not protect, have checksums in a record of their own.
    """

    def __init__(
        self,
        path: Path,
        test: str,
        storeys: int,
        topics: Mapping[str, tuple[Signal, ...]],
        slaves: Sequence[str] = (SLAVE,),
    ) -> None:
        self._path = path
        self.topics, self.storeys = topics, storeys
        try:
            self._stream = path.open("wb", buffering=0)
        except OSError as error:
            raise InputError(
                f"Cannot write the recording {path}: {error.strerror}; give a writable file with -o."
            ) from None
        self._spool = Spool(self._stream)
        self._writer = Writer(
            cast(io.BufferedWriter, self._spool), chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD
        )
        pack_index(self._writer)
        self._add_block = pack_messages(self._writer, CHUNK_SIZE)
        self._writer.start(profile="", library="rths")
        self._names = {topic: [row.name for row in rows] for topic, rows in topics.items()}
        self._classes: dict[str, type[Any]] = {}
        self.channels: dict[str, int] = {}  # the file's channel numbers by topic
        self._numbers = dict.fromkeys(topics, 0)
        self._checksums: dict[str, str] = {}
        self._sealed = True
        self._definitions: list[McapRecord] = []
        self._described_as: set[str] = set()  # names of messages
        self._schemas: dict[bytes, int] = {}
        for topic, rows in topics.items():
            units = {"units": packed({row.name: row.unit for row in rows})}
            named = {"slaves": " ".join(slaves)} if list(slaves) != [SLAVE] else {}
            several = len(slaves) > 1 or any(len(row.slaves) > 1 for row in rows)
            each = shared(rows) if several else {}
            about = units | named | ({SHARED: packed(each)} if each else {})
            self.channels[topic] = self._channel(
                f"rths/{test}/{topic}", self._described(topic, rows, storeys), about
            )
        self._define()
        self._meanings = {
            topic: packed({row.name: (row.unit, row.text) for row in rows}) for topic, rows in topics.items()
        }

    def _described(self, topic: str, rows: tuple[Signal, ...], storeys: int) -> int:
        """The schema of a topic; topics with the same fields share one, different ones of a kind are numbered."""
        number = 1
        while True:
            variant = str(number) if number > 1 else ""
            file, name = schema_file(topic, rows, storeys, variant), f"rths.{message_name(topic)}{variant}"
            description = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
            if description in self._schemas or name not in self._described_as:
                break
            number += 1
        self._classes[topic] = message_class(file, name)
        if description not in self._schemas:
            self._described_as.add(name)
            self._schemas[description] = self._schema(name, description)
        return self._schemas[description]

    def _schema(self, name: str, description: bytes) -> int:
        number: int = self._writer.register_schema(name, "protobuf", description)
        self._definitions.append(Schema(number, description, "protobuf", name))
        return number

    def _channel(self, topic: str, schema: int, metadata: dict[str, str]) -> int:
        number = self._writer.register_channel(topic, "protobuf", schema, metadata)
        self._definitions.append(Channel(number, topic, "protobuf", metadata, schema))
        return number

    def _define(self) -> None:
        """Write schemas and channels outside chunks."""
        builder = RecordBuilder()
        for record in self._definitions:
            record.write(builder)
        self._spool.write(builder.end())  # type: ignore[no-untyped-call]
        self._define_at = self._spool.tell() + REPEAT_BYTES

    def add(self, topic: str, log_ns: int, publish_ns: int, values: tuple[Any, ...] | list[Any]) -> None:
        """Write one message; `values` are in the order of the signal table.

        The sequence number is the value of `seq`.
        """
        names = self._names[topic]
        message = self._classes[topic](**dict(zip(names, values, strict=True)))
        sequence = values[0] if names[0] == "seq" else self._numbers[topic]
        self._numbers[topic] += 1
        self._writer.add_message(
            self.channels[topic],
            log_time=log_ns,
            publish_time=publish_ns,
            sequence=int(sequence) & 0xFFFFFFFF,
            data=message.SerializeToString(deterministic=True),  # an event's values in a fixed order
        )

    def add_block(self, block: Block) -> None:
        """Write encoded messages; the sequence number of each is the value of `seq`."""
        self._add_block(block)

    def describe(self) -> None:
        """Write the unit and the meaning of every signal."""
        self.metadata(SIGNALS, self._meanings)

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        self._writer.add_metadata(name, dict(values))
        self._checksums[name] = f"{self._checksums.get(name, '')} {checksum(name, values)}".strip()
        self._sealed = False

    def _seal(self) -> None:
        """Write the checksums of all metadata so far."""
        if not self._sealed:
            self._writer.add_metadata(CHECKSUMS, sealed(self._checksums))
            self._sealed = True

    def attach(self, name: str, data: bytes, media_type: str) -> None:
        """Write an attachment; its times are zero so that the same test gives the same file."""
        self._writer.add_attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)

    def ground(self, record: str, scale: float, rows: Samples) -> None:
        """Write the rows (2, ticks + 1) of a plan's ground motion, m/s² and m, and what its record is and its scale."""
        self.metadata(GROUND, {"record": record, "scale": repr(scale)})
        self.attach(GROUND, rows.astype("<f8").tobytes(), "application/octet-stream")

    def flush(self) -> None:
        """Hand everything to the operating system; raises OSError where the disk does not take it.

        What a failed write left half-done is cut off, so that the file stays readable up to there.
        """
        self._seal()
        self._writer.flush()  # type: ignore[no-untyped-call]
        if self._spool.tell() >= self._define_at:
            self._define()
        self._spool.drain()

    def sync(self) -> None:
        """Let the operating system write the file to the disk; nothing is done for a device without storage."""
        try:
            SYNC(self._stream.fileno())
        except OSError as error:
            if error.errno != errno.EINVAL:  # raised for a device without storage such as /dev/null
                raise

    def close(self, summary: Mapping[str, str]) -> None:
        """Write the summary and the index, and close."""
        self.metadata("summary", summary)
        self._seal()
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._spool.drain()
        self.sync()
        self._stream.close()

    def abandon(self) -> None:
        """Close without summary and index, after the disk has failed."""
        self._stream.close()
