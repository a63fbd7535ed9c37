"""Protobuf descriptions of the recorded messages, derived from the table of signals."""

from __future__ import annotations

from typing import Any, cast

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from common.roles import kind_of
from common.signals import FieldType, Signal

_FIELD = descriptor_pb2.FieldDescriptorProto
_TYPES = {
    FieldType.NUMBER: _FIELD.TYPE_DOUBLE,
    FieldType.STOREYS: _FIELD.TYPE_DOUBLE,
    FieldType.COUNT: _FIELD.TYPE_UINT32,
    FieldType.INDEX: _FIELD.TYPE_INT32,
    FieldType.STAMP: _FIELD.TYPE_INT64,
    FieldType.FLAG: _FIELD.TYPE_BOOL,
    FieldType.TEXT: _FIELD.TYPE_STRING,
}


def message_name(topic: str) -> str:
    """The name of a topic's message type, without a slave's name: `SlaveRamp` of `slave_ramp.roof`."""
    return "".join(map(str.capitalize, kind_of(topic).split("_")))


def schema_file(
    topic: str, rows: tuple[Signal, ...], storeys: int, variant: str = ""
) -> descriptor_pb2.FileDescriptorProto:
    """Protobuf description of a topic's message, fields in the order of the signal table.

    `variant` ends the names of file and message where topics of the same kind hold different fields.
    """
    name = message_name(topic) + variant
    file = descriptor_pb2.FileDescriptorProto(
        name=f"rths/{kind_of(topic)}{variant}.proto", package="rths", syntax="proto3"
    )
    message = file.message_type.add(name=name)
    for number, row in enumerate(rows, start=1):
        if row.kind is FieldType.VALUES:
            entry = message.nested_type.add(name="ValuesEntry")
            entry.options.map_entry = True
            entry.field.add(name="key", number=1, type=_FIELD.TYPE_STRING, label=_FIELD.LABEL_OPTIONAL)
            entry.field.add(name="value", number=2, type=_FIELD.TYPE_DOUBLE, label=_FIELD.LABEL_OPTIONAL)
            message.field.add(
                name=row.name,
                number=number,
                type=_FIELD.TYPE_MESSAGE,
                type_name=f".rths.{name}.ValuesEntry",
                label=_FIELD.LABEL_REPEATED,
            )
            continue
        label = _FIELD.LABEL_REPEATED if row.count(storeys) > 1 else _FIELD.LABEL_OPTIONAL
        message.field.add(name=row.name, number=number, type=_TYPES[row.kind], label=label)
    return file


def message_class(file: descriptor_pb2.FileDescriptorProto, name: str) -> type[Any]:
    """The Python class of a described message."""
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return cast(type[Any], message_factory.GetMessageClass(pool.FindMessageTypeByName(name)))
