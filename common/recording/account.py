"""The account of a recovery: the recovered and the lost messages of a damaged recording, by topic and number."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from common.recording.recover.salvage import FileHole


class Missing(NamedTuple):
    """Messages of a topic lost with a part of the file: sequence numbers, and log times (ns) of the messages beside."""

    first: int
    last: int
    after_ns: int | None
    before_ns: int | None


@dataclass
class Topic:
    """What was recovered of a topic; `unrecorded` counts messages that were missing before the damage too.

    The sequence of a laboratory's ramp to rest, `ramp_of`, continues that of its ticks; all others begin at 0.
    """

    ramp_of: str = ""
    kept: int = 0
    first: tuple[int, int] | None = None  # sequence and log time, ns
    last: tuple[int, int] | None = None
    missing: list[Missing] = field(default_factory=list)
    unrecorded: int = 0
    holes: int = 0  # in the file before the last message

    def take(self, sequence: int, log_ns: int, holes: int) -> None:
        """Take note of a message; `holes` is the number of holes in the file before it."""
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
        """Take note of how many messages the finished file held, and of a ramp's first possible sequence number."""
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
        """The sequence number after the last one written, as far as it is known."""
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
    holes: list[FileHole]
    chunks: int = 0  # undamaged
    chunks_written: int | None = None  # by the summary of a finished file
    topics: dict[str, Topic] = field(default_factory=dict)
    parts: list[str] = field(default_factory=list)  # metadata and attachments that are missing or damaged
    undefined: int = 0  # messages of a channel whose schema or channel record is lost

    @property
    def lossy(self) -> list[FileHole]:
        """Holes with which content may be lost."""
        return [hole for hole in self.holes if hole.lossy]

    @property
    def bytes_lost(self) -> int:
        """Bytes that could not be read, without those of chunk indices and the summary."""
        return sum(hole.end - hole.offset for hole in self.lossy)

    @property
    def chunks_lost(self) -> int:
        """The number of lost chunks; for an unfinished file only those whose head is still readable."""
        seen = sum(hole.chunks for hole in self.lossy)
        return seen if self.chunks_written is None else max(self.chunks_written - self.chunks, 0)

    @property
    def complete(self) -> bool:
        """Whether nothing of the file's content is lost."""
        lost = any(topic.missing for topic in self.topics.values())
        return not (self.lossy or lost or self.parts or self.undefined)

    @property
    def origin_ns(self) -> int:
        """Log time (ns) of sequence 0, from the first topic with two messages."""
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
