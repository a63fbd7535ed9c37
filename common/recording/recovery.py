"""A finished recording of all that is whole in a damaged one, with an account of what is lost."""

from __future__ import annotations

import io
import os
from bisect import bisect
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata, Schema, Statistics
from mcap.writer import CompressionType, Writer

from common.errors import InputError
from common.recording.checksums import CHECKSUMS, checksum, fits, opened, sealed
from common.recording.salvage import (
    HEAD,
    MESSAGE,
    Hole,
    Piece,
    Source,
    content,
    inner,
    judge,
    parsed,
    pieces,
    summary,
    written,
)
from common.recording.writer import CHUNK_SIZE
from common.roles import ramps_of
from common.terminal import outputs

RECOVERY = "recovery"  # metadata of a recovered recording
DAMAGED = " (damaged)"  # after the name of what is there, but not as it was written
SEEN_ELSEWHERE = 1_000_000  # weight of a definition under a checksum against those without
Place = tuple[int, int, int]  # opcode, begin and end


class Missing(NamedTuple):
    """Messages of a topic lost with a piece of the file: sequence numbers, log times (ns) of their neighbours."""

    first: int
    last: int
    after_ns: int | None
    before_ns: int | None


@dataclass
class Topic:
    """What is left of a topic; `unrecorded` counts messages that were not in the file before the damage either.

    The numbers of the ramp to rest of a laboratory, `ramp_of`, go on behind those of its ticks; all others begin at 0.
    """

    ramp_of: str = ""
    kept: int = 0
    first: tuple[int, int] | None = None  # sequence and log time, ns
    last: tuple[int, int] | None = None
    missing: list[Missing] = field(default_factory=list)
    unrecorded: int = 0
    holes: int = 0  # in the file before the last message

    def take(self, sequence: int, log_ns: int, holes: int) -> None:
        """Take note of a message behind so many holes of the file."""
        expected = self.last[0] + 1 if self.last else sequence if self.ramp_of else 0
        if sequence > expected and holes > self.holes:
            after = self.last[1] if self.last else None
            self.missing.append(Missing(expected, sequence - 1, after, log_ns))
        elif sequence > expected and self.last:
            self.unrecorded += sequence - expected
        self.kept += 1
        self.first = self.first or (sequence, log_ns)
        self.last = (sequence, log_ns)
        self.holes = holes

    def end(self, written_count: int, begin: int = 0) -> None:
        """Take note of how many messages the file held when it was finished, and of where those of a ramp may begin."""
        lacking = written_count - self.kept - self.lost
        if (
            self.ramp_of
            and self.first
            and lacking > 0
            and (before := min(lacking, self.first[0] - begin)) > 0
        ):
            self.missing.insert(0, Missing(self.first[0] - before, self.first[0] - 1, None, self.first[1]))
            lacking -= before
        if lacking > 0:
            first = self.last[0] + 1 if self.last else begin
            self.missing.append(
                Missing(first, first + lacking - 1, self.last[1] if self.last else None, None)
            )

    @property
    def until(self) -> int:
        """The sequence number behind the last that was written, as far as it is known."""
        last = self.last[0] if self.last else -1
        return max([last, *(hole.last for hole in self.missing)]) + 1

    @property
    def lost(self) -> int:
        """How many messages are known to be lost."""
        return sum(hole.last + 1 - hole.first for hole in self.missing)


@dataclass
class Recovery:
    """What was recovered and what is lost."""

    path: Path
    output: Path
    size: int
    finished: bool
    holes: list[Hole]
    chunks: int  # whole
    chunks_written: int | None  # by the summary of a finished file
    topics: dict[str, Topic]
    parts: list[str]  # metadata and attachments that are missing or damaged
    undefined: int  # messages of a channel that nothing in the file describes any more

    @property
    def lossy(self) -> list[Hole]:
        """Holes with which content may be lost."""
        return [hole for hole in self.holes if hole.lossy]

    @property
    def bytes_lost(self) -> int:
        """Bytes that could not be read, without those of indices."""
        return sum(hole.end - hole.offset for hole in self.lossy)

    @property
    def chunks_lost(self) -> int:
        """Chunks that are lost; of an unfinished file those whose beginning is still to be seen."""
        seen = sum(hole.chunks for hole in self.lossy)
        return seen if self.chunks_written is None else max(self.chunks_written - self.chunks, 0)

    @property
    def complete(self) -> bool:
        """Whether nothing is lost of what was in the file."""
        lost = any(topic.missing for topic in self.topics.values())
        return not (self.lossy or lost or self.parts or self.undefined)

    @property
    def origin_ns(self) -> int:
        """Log time of sequence 0, by the first topic that tells it."""
        for topic in self.topics.values():
            if topic.first and topic.last and topic.last[0] > topic.first[0]:
                (first, begin), (last, end) = topic.first, topic.last
                return round(begin - first * (end - begin) / (last - first))
        return min((topic.first[1] for topic in self.topics.values() if topic.first), default=0)

    def plain(self) -> dict[str, Any]:
        """The account as plain values."""
        return {
            "file": str(self.path),
            "output": str(self.output),
            "complete": self.complete,
            "finished": self.finished,
            "bytes": self.size,
            "bytes_lost": self.bytes_lost,
            "holes": [hole._asdict() for hole in self.holes],
            "chunks": self.chunks,
            "chunks_lost": self.chunks_lost,
            "topics": {name: self._plain_topic(topic) for name, topic in self.topics.items()},
            "parts_lost": self.parts,
            "undefined_messages": self.undefined,
        }

    def _plain_topic(self, topic: Topic) -> dict[str, Any]:
        origin = self.origin_ns
        times = ("after_ns", "before_ns")
        missing = [
            hole._asdict()
            | {
                name.replace("_ns", "_s"): None if at is None else (at - origin) * 1e-9
                for name, at in zip(times, hole[2:], strict=True)
            }
            for hole in topic.missing
        ]
        facts = {"recovered": topic.kept, "lost": topic.lost, "missing": missing}
        return facts | {
            "unrecorded": topic.unrecorded,
            "last": topic.last[0] if topic.last else None,
            "last_s": (topic.last[1] - origin) * 1e-9 if topic.last else None,
        }


class Definitions:
    """Schemas and channels by number: those under a checksum, else those most often found alike."""

    def __init__(self) -> None:
        self._votes: dict[tuple[int, int], Counter[bytes]] = {}

    def add(self, opcode: int, number: int, body: bytes, *, sure: bool) -> None:
        """One more copy."""
        votes = self._votes.setdefault((opcode, number), Counter())
        votes[body] += SEEN_ELSEWHERE if sure else 1

    def of(self, opcode: int) -> dict[int, Any]:
        """Those of one opcode, by number."""
        found = sorted((number, votes) for (kind, number), votes in self._votes.items() if kind == opcode)
        return {number: parsed(opcode, votes.most_common(1)[0][0]) for number, votes in found}


class Survey:
    """What a file holds: the places of what is whole, the holes, and all that describes its messages."""

    def __init__(self, source: Source) -> None:
        self.definitions = Definitions()
        self.places: list[Place] = []
        self.holes: list[Hole] = []
        self.header = Header("", "rths")
        self.checksums: dict[str, str] = {}
        self.statistics: Statistics | None = None
        self.promised: Counter[tuple[int, str]] = Counter()  # attachments, by the summary
        self.chunks = 0
        self._bounds = source.bounds
        found = summary(source)
        self.finished = found is not None
        for opcode, record in found.records if found else []:
            self._take_summary(opcode, record)
        for piece in pieces(source, found.start if found else source.size):
            if isinstance(piece, Hole):
                self.holes.append(piece)
            else:
                self._take(piece)

    def _take_summary(self, opcode: int, record: Any) -> None:
        if isinstance(record, Schema | Channel):
            self.definitions.add(opcode, record.id, written(record)[HEAD.size :], sure=True)
        elif isinstance(record, Statistics):
            self.statistics = record
        elif opcode == Opcode.ATTACHMENT_INDEX:
            self.promised[Opcode.ATTACHMENT, record.name] += 1

    def _take(self, piece: Piece) -> None:
        record = piece.record
        if piece.opcode in (Opcode.CHUNK, Opcode.METADATA, Opcode.ATTACHMENT):
            self.places.append((piece.opcode, piece.offset, piece.end))
        if piece.opcode == Opcode.CHUNK:
            self.chunks += 1
            for opcode, body in inner(content(record)):
                self._bounds.record()
                if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self.definitions.add(opcode, parsed(opcode, body).id, body, sure=True)
        elif isinstance(record, Schema | Channel):
            self.definitions.add(piece.opcode, record.id, written(record)[HEAD.size :], sure=False)
        elif isinstance(record, Metadata) and record.name == CHECKSUMS:
            self.checksums |= opened(record.metadata) or {}
        elif isinstance(record, Header):
            self.header = record


def recover(path: Path, output: Path, *, force: bool = False) -> Recovery:
    """Write all that is whole in a recording into a new, finished one; the account of it.

    A file that exists is replaced with `force` only.

    Memory does not grow with the file beyond a few hundred bytes per chunk.

    Raises:
        InputError: nothing can be recovered, a file cannot be read or written, or the output exists already.
    """
    outputs.checked(output, force, [path])
    try:
        with path.open("rb") as stream:
            source = Source(stream)
            survey = Survey(source)
            if not survey.chunks:
                raise InputError(
                    f"Nothing can be recovered from {path}: it holds no complete chunk of an MCAP recording."
                )
            return Salvage(path, output, source, survey, force=force).write()
    except OSError as error:
        raise InputError(f"Cannot read {path}: {error.strerror}.") from None


class Salvage:
    """The output being written."""

    def __init__(self, path: Path, output: Path, source: Source, survey: Survey, *, force: bool) -> None:
        self._force = force
        self._path, self._output, self._source, self._survey = path, output, source, survey
        self._topics: dict[str, Topic] = {}
        self._channels: dict[int, tuple[int, Topic]] = {}  # by the number in the damaged file
        self._parts: list[str] = []
        self._checksums: dict[str, str] = {}
        self._left = survey.promised.copy()
        self._named: set[str] = set()
        self._undefined = 0
        self._lossy = [hole.offset for hole in survey.holes if hole.lossy]

    def write(self) -> Recovery:
        """Write all; where that fails nothing is left behind."""
        with outputs.writing(self._output, self._force) as temporary, temporary.open("wb") as stream:
            return self._fill(stream)

    def _fill(self, stream: io.BufferedWriter) -> Recovery:
        self._writer = Writer(stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)
        self._writer.start(self._survey.header.profile, self._survey.header.library)
        self._define()
        for place in self._survey.places:
            self._copy(*place)
        self._close_accounts()
        recovery = self._account()
        if not any(topic.kept for topic in self._topics.values()):
            raise InputError(
                f"Nothing can be recovered from {self._path}: no schema of its messages is left whole."
            )
        facts = {"file": self._path.name, "complete": str(recovery.complete).lower()}
        lost = {"bytes_lost": str(recovery.bytes_lost), "chunks_lost": str(recovery.chunks_lost)}
        self._metadata(RECOVERY, facts | lost)
        self._writer.add_metadata(CHECKSUMS, sealed(self._checksums))
        self._writer.finish()  # type: ignore[no-untyped-call]
        stream.flush()
        os.fsync(stream.fileno())
        return recovery

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
                self._channels[number] = new, self._topics.setdefault(name, Topic(ramps_of(name)))

    def _copy(self, opcode: int, offset: int, end: int) -> None:
        piece = judge(self._source, offset, end)
        if piece is None or piece.opcode != opcode:
            raise InputError(
                f"{self._path} changes while it is read: recover it when its recorder has ended."
            )
        if opcode == Opcode.CHUNK:
            self._messages(content(piece.record), bisect(self._lossy, offset))
        elif opcode == Opcode.ATTACHMENT:
            record = piece.record
            self._left[opcode, record.name] -= 1
            self._writer.add_attachment(
                record.create_time, record.log_time, record.name, record.media_type, record.data
            )
        elif piece.record.name not in (CHECKSUMS, RECOVERY):
            self._metadata_found(piece.record)

    def _messages(self, data: bytes, holes: int) -> None:
        for opcode, body in inner(data):
            if opcode != Opcode.MESSAGE:
                continue
            number, sequence, log_ns, publish_ns = MESSAGE.unpack_from(body)
            if number not in self._channels:
                self._undefined += 1
                continue
            channel, topic = self._channels[number]
            topic.take(sequence, log_ns, holes)
            self._writer.add_message(channel, log_ns, body[MESSAGE.size :], publish_ns, sequence)

    def _metadata_found(self, record: Metadata) -> None:
        name = record.name
        if not fits(name, record.metadata, self._survey.checksums):
            self._parts.append(f"metadata '{name}' (damaged)")
            name += DAMAGED
        self._metadata(name, record.metadata)

    def _metadata(self, name: str, values: dict[str, str]) -> None:
        self._named.add(name.removesuffix(DAMAGED))
        self._checksums[name] = f"{self._checksums.get(name, '')} {checksum(name, values)}".strip()
        self._writer.add_metadata(name, values)

    def _close_accounts(self) -> None:
        absent = sorted(set(self._survey.checksums) - self._named - {RECOVERY})
        self._parts += [f"metadata '{name}'" for name in absent]
        self._parts += [f"attachment '{name}'" for (_, name), count in self._left.items() if count > 0]
        counts = self._survey.statistics.channel_message_counts if self._survey.statistics else {}
        held = [(topic, counts[number]) for number, (_, topic) in self._channels.items() if number in counts]
        for topic, count in sorted(
            held, key=lambda each: each[0].ramp_of != ""
        ):  # where ticks end comes first
            laboratory = self._topics.get(topic.ramp_of)
            topic.end(count, laboratory.until if laboratory else 0)

    def _account(self) -> Recovery:
        survey = self._survey
        return Recovery(
            self._path,
            self._output,
            self._source.size,
            survey.finished,
            survey.holes,
            survey.chunks,
            survey.statistics.chunk_count if survey.statistics else None,
            self._topics,
            self._parts,
            self._undefined,
        )
