"""Checksums of metadata records, which MCAP does not protect: an additional metadata record holds them."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping

CHECKSUMS = "checksums"  # name of that record, and of the value in it that is its own checksum


def checksum(name: str, values: Mapping[str, str]) -> str:
    """CRC-32 of a metadata record's name and values, eight hex digits."""
    return f"{zlib.crc32(json.dumps([name, dict(values)], sort_keys=True).encode()):08x}"


def sealed(checksums: Mapping[str, str]) -> dict[str, str]:
    """The values of the record that holds `checksums` by name; several records of one name are separated by spaces."""
    return {**checksums, CHECKSUMS: checksum(CHECKSUMS, checksums)}


def opened(values: Mapping[str, str]) -> dict[str, str] | None:
    """The checksums in such a record, None where it is damaged itself."""
    others = {name: value for name, value in values.items() if name != CHECKSUMS}
    return others if sealed(others) == dict(values) else None


def fits(name: str, values: Mapping[str, str], checksums: Mapping[str, str]) -> bool:
    """Whether a metadata record fits its checksum; True where there is none."""
    return name not in checksums or checksum(name, values) in checksums[name].split()
