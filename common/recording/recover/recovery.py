"""Writes the undamaged content of a damaged recording into a new finished one, with an account of the losses."""

from __future__ import annotations

import io
import os
from bisect import bisect
from collections import Counter
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, Header, Metadata, Schema, Statistics
from mcap.writer import CompressionType, Writer

from common.errors import InputError
from common.recording.account import Recovery, Topic
from common.recording.bounds import Bounds
from common.recording.checksums import CHECKSUMS, checksum, fits, opened, sealed
from common.recording.records import HEAD, MESSAGE, GrowingFile, inner, parsed, summary, written
from common.recording.recover.salvage import FileHole, WholeRecord, judge, survey
from common.recording.writer import CHUNK_SIZE
from common.roles import ramps_of
from common.terminal import outputs

RECOVERY = "recovery"  # metadata of a recovered recording
DAMAGED = " (damaged)"  # appended to the name of a metadata record that does not fit its checksum
# Weight of a definition under a checksum against one without. A file holds fewer copies of a definition than this (one
# per `REPEAT_BYTES`, so 1 TB), so that copies without a checksum never outvote one with it.
CHECKED_WEIGHT = 1_000_000
COPIED = (Opcode.CHUNK, Opcode.METADATA, Opcode.ATTACHMENT)


class Definitions:
    """Schemas and channels by number: of several copies the one under a checksum, else the most frequent one."""

    def __init__(self) -> None:
        self._votes: dict[tuple[int, int], Counter[bytes]] = {}

    def add(self, opcode: int, record: bytes, *, sure: bool) -> None:
        """Add a copy; `sure` if it was protected by a checksum."""
        votes = self._votes.setdefault((opcode, parsed(record).id), Counter())
        votes[record] += CHECKED_WEIGHT if sure else 1

    def of(self, opcode: int) -> dict[int, Any]:
        """The definitions of one opcode, by number."""
        found = sorted((number, votes) for (kind, number), votes in self._votes.items() if kind == opcode)
        return {number: parsed(votes.most_common(1)[0][0]) for number, votes in found}


class Survey:
    """The content of a file: the places of undamaged records, the holes, and the definitions of its messages."""

    def __init__(self, path: Path, source: GrowingFile) -> None:
        self.definitions = Definitions()
        self.places: list[tuple[int, int, int]] = []  # opcode, begin and end of each record to copy
        self.holes: list[FileHole] = []
        self.header = Header("", "rths")
        self.checksums: dict[str, str] = {}
        self.statistics: Statistics | None = None
        self.promised: Counter[str] = Counter()  # attachments that the summary lists, by name
        self._bounds = Bounds(path, source.size)
        end = summary(source)
        self.finished = end is not None
        for record in end.records if end else []:
            self._take_summary(record)
        for found in survey(source, end.start if end else source.size):
            if isinstance(found, FileHole):
                self.holes.append(found)
            else:
                self._take(found)

    def _take_summary(self, record: Any) -> None:
        if isinstance(record, Schema | Channel):
            self._define(record, sure=True)
        elif isinstance(record, Statistics):
            self.statistics = record
        elif isinstance(record, AttachmentIndex):
            self.promised[record.name] += 1

    def _take(self, found: WholeRecord) -> None:
        record = found.record
        if found.opcode in COPIED:
            self.places.append((found.opcode, found.offset, found.end))
        if found.opcode == Opcode.CHUNK:
            self._bounds.unpack(len(found.content))
            for opcode, inside in inner(found.content):
                self._bounds.record()
                if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self.definitions.add(opcode, inside, sure=True)
        elif isinstance(record, Schema | Channel):
            self._define(record, sure=False)
        elif isinstance(record, Metadata) and record.name == CHECKSUMS:
            self.checksums |= opened(record.metadata) or {}
        elif isinstance(record, Header):
            self.header = record

    def _define(self, record: Schema | Channel, *, sure: bool) -> None:
        opcode = Opcode.SCHEMA if isinstance(record, Schema) else Opcode.CHANNEL
        self.definitions.add(opcode, written(record), sure=sure)


def recover(path: Path, output: Path, *, force: bool = False) -> Recovery:
    """Write the undamaged content of a recording into a new, finished one, and return the account of it.

    An existing output is replaced only with `force`. Memory grows by a few hundred bytes per chunk of the file.

    Raises:
        InputError: nothing can be recovered, a file cannot be read or written, or the output exists already.
    """
    outputs.checked(output, force, [path])
    try:
        with path.open("rb") as stream:
            source = GrowingFile(stream)
            found = Survey(path, source)
            account = Recovery(path, output, source.size, found.finished, found.holes)
            account.chunks = [opcode for opcode, _, _ in found.places].count(Opcode.CHUNK)
            account.chunks_written = found.statistics.chunk_count if found.statistics else None
            if not account.chunks:
                raise InputError(
                    f"Nothing can be recovered from {path}: it holds no complete chunk of an MCAP recording."
                )
            with outputs.writing(output, force) as temporary, temporary.open("wb") as copy:
                Copy(source, found, account, copy).write()
            return account
    except OSError as error:
        raise InputError(f"Cannot read {path}: {error.strerror}.") from None


class Copy:
    """Writes the output, and completes the account of each topic."""

    def __init__(
        self, source: GrowingFile, found: Survey, account: Recovery, stream: io.BufferedWriter
    ) -> None:
        self._source, self._survey, self._account, self._stream = source, found, account, stream
        self._channels: dict[int, tuple[int, Topic]] = {}  # by the number in the damaged file
        self._checksums: dict[str, str] = {}
        self._left = found.promised.copy()
        self._named: set[str] = set()
        self._lossy = [hole.offset for hole in account.lossy]
        self._writer = Writer(stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)

    def write(self) -> None:
        """Write everything, and flush it to the disk.

        Raises:
            InputError: no definition of the messages is left, or the file changes while it is read.
        """
        account = self._account
        self._writer.start(self._survey.header.profile, self._survey.header.library)
        self._define()
        for place in self._survey.places:
            self._copy(*place)
        self._close_accounts()
        if not any(topic.kept for topic in account.topics.values()):
            raise InputError(
                f"Nothing can be recovered from {account.path}: no schema of its messages is left whole."
            )
        facts = {"file": account.path.name, "complete": str(account.complete).lower()}
        lost = {"bytes_lost": str(account.bytes_lost), "chunks_lost": str(account.chunks_lost)}
        self._metadata(RECOVERY, facts | lost)
        self._writer.add_metadata(CHECKSUMS, sealed(self._checksums))
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.flush()
        os.fsync(self._stream.fileno())

    def _define(self) -> None:
        schemas, channels = (self._survey.definitions.of(kind) for kind in (Opcode.SCHEMA, Opcode.CHANNEL))
        numbers = {0: 0} | {
            number: self._writer.register_schema(schema.name, schema.encoding, schema.data)
            for number, schema in schemas.items()
        }
        for number, channel in channels.items():
            if channel.schema_id in numbers:
                new = self._writer.register_channel(
                    channel.topic, channel.message_encoding, numbers[channel.schema_id], channel.metadata
                )
                name = channel.topic.split("/", 2)[-1]
                self._channels[number] = new, self._account.topics.setdefault(name, Topic(ramps_of(name)))

    def _copy(self, opcode: int, offset: int, end: int) -> None:
        found = judge(self._source, offset, end)
        if found is None or found.opcode != opcode:
            raise InputError(
                f"{self._account.path} changes while it is read: recover it after its recorder has ended."
            )
        record = found.record
        if opcode == Opcode.CHUNK:
            self._messages(found.content, bisect(self._lossy, offset))
        elif opcode == Opcode.ATTACHMENT:
            self._left[record.name] -= 1
            self._writer.add_attachment(
                record.create_time, record.log_time, record.name, record.media_type, record.data
            )
        elif record.name not in (CHECKSUMS, RECOVERY):
            whole = fits(record.name, record.metadata, self._survey.checksums)
            if not whole:
                self._account.parts.append(f"metadata '{record.name}'{DAMAGED}")
            self._metadata(record.name + ("" if whole else DAMAGED), record.metadata)

    def _messages(self, data: bytes, holes: int) -> None:
        for opcode, record in inner(data):
            if opcode != Opcode.MESSAGE:
                continue
            number, sequence, log_ns, publish_ns = MESSAGE.unpack_from(record, HEAD.size)
            if number not in self._channels:
                self._account.undefined += 1
                continue
            channel, topic = self._channels[number]
            topic.take(sequence, log_ns, holes)
            self._writer.add_message(
                channel, log_ns, record[HEAD.size + MESSAGE.size :], publish_ns, sequence
            )

    def _metadata(self, name: str, values: dict[str, str]) -> None:
        self._named.add(name.removesuffix(DAMAGED))
        self._checksums[name] = f"{self._checksums.get(name, '')} {checksum(name, values)}".strip()
        self._writer.add_metadata(name, values)

    def _close_accounts(self) -> None:
        absent = sorted(set(self._survey.checksums) - self._named - {RECOVERY})
        self._account.parts += [f"metadata '{name}'" for name in absent]
        self._account.parts += [f"attachment '{name}'" for name, count in self._left.items() if count > 0]
        counts = self._survey.statistics.channel_message_counts if self._survey.statistics else {}
        held = [(topic, counts[number]) for number, (_, topic) in self._channels.items() if number in counts]
        for topic, count in sorted(
            held, key=lambda each: each[0].ramp_of != ""
        ):  # ramps after the ticks before them
            laboratory = self._account.topics.get(topic.ramp_of)
            topic.end(count, laboratory.until if laboratory else 0)
