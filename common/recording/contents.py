"""Collects the records of a recording's file and decodes its messages into a `Run`."""

from __future__ import annotations

import json
import tomllib
from functools import lru_cache
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2
from google.protobuf.message import DecodeError
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema

from common import signals
from common.errors import InputError
from common.recording.checksums import CHECKSUMS, fits, opened
from common.recording.run import Run
from common.recording.schema import message_class
from common.recording.writer import SHARED, SIGNALS
from common.roles import MASTER, SLAVE, kind_of, ramps_of

MISFIT = (DecodeError, TypeError, ValueError, KeyError, AttributeError)


class Contents:
    """Collects the records of a recording, and decodes its messages on request."""

    def __init__(self) -> None:
        self._channels: dict[int, Channel] = {}
        self._schemas: dict[int, Schema] = {}
        self._messages: dict[str, list[Message]] = {}  # by topic

    def take(self, record: McapRecord, run: Run) -> None:
        """Take one record from `unpacked`; metadata and attachments go to the run at once."""
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
        """Put the messages taken since the last call into a run, and check its metadata against their checksums.

        Raises:
            InputError: messages do not fit their schema.
        """
        _check(run)
        messages, self._messages = self._messages, {}
        for _, channel in sorted(self._channels.items()):  # in the order in which they were registered
            if channel.topic.startswith("rths/"):
                _take(run, channel, self._schemas, messages.get(channel.topic, []))
        named = any("slaves" in channel.metadata for channel in self._channels.values())
        if not named and _of_master_alone(run):
            run.roles = ()


def _of_master_alone(run: Run) -> bool:
    """Whether a recording holds the topic of a master alone, and a plan without a slave."""
    if set(run.columns) != {MASTER}:
        return False
    try:
        return bool(tomllib.loads(run.metadata["plan"]["toml"])["slave"]["kind"] == "none")
    except (KeyError, TypeError, tomllib.TOMLDecodeError):
        return False  # whoever needs the plan says what is wrong with it


def _check(run: Run) -> None:
    """Check the metadata against their checksums, and remove the record that holds these."""
    checksums = opened(run.metadata.pop(CHECKSUMS, {})) or {}
    wrong = [name for name, values in run.metadata.items() if not fits(name, values, checksums)]
    if wrong and not run.damage:
        run.damage = f"in its metadata '{wrong[0]}'"


def _take(run: Run, channel: Channel, schemas: dict[int, Schema], messages: list[Message]) -> None:
    """Decode a topic; raises InputError where its messages do not fit their schema."""
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
    """The meaning of a topic's signals as recorded; in a recording without it, that of the default topics."""
    said = run.metadata.get(SIGNALS, {}).get(topic, "")
    try:
        return {name: str(text) for name, (_, text) in json.loads(said).items()}
    except (ValueError, TypeError, AttributeError):  # not there, or no table of signals
        return {row.name: row.text for row in signals.TOPICS.get(kind_of(topic), ())}


def _shared(run: Run, channel: Channel) -> dict[str, tuple[str, ...]]:
    """The slaves' roles of the fields with a value each.

    A recording that does not state them has tables at all slaves.
    """
    if SHARED in channel.metadata:
        return {name: tuple(map(str, roles)) for name, roles in json.loads(channel.metadata[SHARED]).items()}
    return dict.fromkeys(signals.shared(signals.TOPICS[MASTER]), run.roles)


@lru_cache(maxsize=32)
def _described(description: bytes, name: str) -> type[Any]:
    """The class of a message that a schema describes, cached because a growing recording is decoded repeatedly."""
    return message_class(descriptor_pb2.FileDescriptorSet.FromString(description).file[0], name)


def _event(item: Any) -> dict[str, Any]:
    plain = {name: getattr(item, name) for name in ("t", "lab", "level", "code", "text")}
    return plain | {"values": dict(item.values)}
