"""Checksums of metadata, which have none in the format: one more metadata record that holds those of the others."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping

CHECKSUMS = "checksums"  # name of that record, and in it of the checksum of its other values


def checksum(name: str, values: Mapping[str, str]) -> str:
    """CRC-32 of a metadata record's name and values, eight hex digits."""
    return f"{zlib.crc32(json.dumps([name, dict(values)], sort_keys=True).encode()):08x}"


def sealed(checksums: Mapping[str, str]) -> dict[str, str]:
    """The values of the record that holds the checksums of others by name, several of a name with a space between."""
    return {**checksums, CHECKSUMS: checksum(CHECKSUMS, checksums)}


def opened(values: Mapping[str, str]) -> dict[str, str] | None:
    """The checksums in a record of them, None where it is damaged itself."""
    others = {name: value for name, value in values.items() if name != CHECKSUMS}
    return others if sealed(others) == dict(values) else None


def fits(name: str, values: Mapping[str, str], checksums: Mapping[str, str]) -> bool:
    """Whether a metadata record is as it was written, as far as there is a checksum of it."""
    return name not in checksums or checksum(name, values) in checksums[name].split()
