"""Certificates for tests of the link."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

from common.link.security import Identity
from rths.prepare import keys

ROLES = ("master", "slave", "recorder", "operator", "observer")
NOW = datetime.now(UTC)
DAY = timedelta(days=1)


def made(folder: Path, *, begin: datetime = NOW - DAY, end: datetime = NOW + DAY) -> dict[str, keys.Owner]:
    """The files of a new authority, with one more certificate of that authority for a visitor outside the test."""
    owners = keys.certificates((*ROLES, "visitor"), (), begin, end)
    keys.write(folder, owners)
    return owners


def again(folder: Path, owners: dict[str, keys.Owner], role: str, begin: datetime, end: datetime) -> Path:
    """Another certificate of a role by the same authority, in a folder of its own beside the authority's."""
    owner = keys.issued(role, (), owners["authority"], begin, end)
    keys.write(folder, {"authority": owners["authority"], role: owner})
    return folder


def identity(folder: Path, role: str, *, authority: Path | None = None) -> Identity:
    """The files of a role, without any check."""
    return Identity(
        role, (authority or folder) / "authority.pem", folder / f"{role}.pem", folder / f"{role}.key"
    )
