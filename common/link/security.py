"""Certificates of the link: one role's own, checked before it connects, and why a connection was refused.

A role reads three files of the plan's `[link.security] folder` and no other: `authority.pem`, `ROLE.pem`, `ROLE.key`.
`rths keys` makes them.
"""

from __future__ import annotations

import ssl
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from cryptography.x509.oid import NameOID

from common.errors import InputError
from common.link import tls
from common.plan.plan import Plan, resolve
from common.roles import OBSERVER, OPERATOR, title

TLS = "transport/link/tls"


class Identity(NamedTuple):
    """The files by which a role authenticates itself and recognizes certificates of the same authority."""

    role: str
    authority: Path
    certificate: Path
    key: Path

    def settings(self) -> dict[str, object]:
        """Settings for zenoh.

        Both ends show a certificate, host names are verified, an expired certificate ends the link.
        """
        own = {
            f"{TLS}/{end}_{what}": str(path)
            for end in ("listen", "connect")
            for what, path in (("certificate", self.certificate), ("private_key", self.key))
        }
        return own | {
            f"{TLS}/root_ca_certificate": str(self.authority),
            f"{TLS}/enable_mtls": True,
            f"{TLS}/verify_name_on_connect": True,
            f"{TLS}/close_link_on_expiration": True,
        }

    def refusal(self, endpoint: str) -> str:
        """Why the master does not take this role's certificate, or this role the master's; empty where unknown.

        TLS knows no roles, so this does not show which routes the master's access control allows the certificate.
        """
        context = ssl.create_default_context(cafile=str(self.authority))
        context.load_cert_chain(self.certificate, self.key)
        return tls.refused(context, endpoint, self.certificate.parent)


def identity(plan: Plan, role: str, now: datetime | None = None) -> Identity:
    """A role's files in the folder that the plan names, after their check; without `now` the clock gives the time.

    Raises:
        InputError: a file is missing or unreadable, or the certificate is another role's, of another authority, or
            not valid until the test is over.
    """
    folder = resolve(plan, plan.link.security.folder)
    found = Identity(role, folder / "authority.pem", folder / f"{role}.pem", folder / f"{role}.key")
    seconds = 0.0 if role in (OPERATOR, OBSERVER) else plan.link.connect_timeout + plan.test.duration
    lasting = timedelta(seconds=seconds)
    check(found, now or datetime.now(UTC), lasting)
    return found


def check(found: Identity, now: datetime, lasting: timedelta) -> None:
    """Raises InputError where a role cannot authenticate itself with these files from `now` for the time `lasting`."""
    authority, own = certificate(found.authority), certificate(found.certificate)
    name = common_name(own)
    if name != found.role:
        raise InputError(
            f"{found.certificate} is a certificate of '{name}', but this is the {title(found.role)}: "
            "take the file that `rths keys` made for it."
        )
    try:
        own.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature):
        raise InputError(
            f"{found.certificate} was not issued by the authority in {found.authority}: "
            "take both from one run of `rths keys`."
        ) from None
    for path, one in ((found.authority, authority), (found.certificate, own)):
        check_time(path, one, now, lasting)
    check_key(found, own)


def check_time(path: Path, found: x509.Certificate, now: datetime, lasting: timedelta) -> None:
    """Raises InputError where a certificate is not valid from `now` for `lasting`."""
    begin, end = found.not_valid_before_utc, found.not_valid_after_utc
    if now < begin:
        raise InputError(f"{path} is valid from {begin:%Y-%m-%d %H:%M} UTC only: set this machine's clock.")
    if now > end:
        raise InputError(f"{path} expired on {end:%Y-%m-%d %H:%M} UTC: make new ones with `rths keys`.")
    if now + lasting > end:
        raise InputError(
            f"{path} expires on {end:%Y-%m-%d %H:%M:%S} UTC, before the test can be over: "
            "make new ones with `rths keys`."
        )


def check_key(found: Identity, own: x509.Certificate) -> None:
    """Raises InputError if the private key is not valid or belongs to another certificate."""
    try:
        key = load_pem_private_key(content(found.key), password=None)
    except (ValueError, TypeError, UnsupportedAlgorithm):
        raise InputError(f"{found.key} is not a private key in PEM without a password.") from None
    if key.public_key() != own.public_key():
        raise InputError(
            f"{found.key} is not the key of {found.certificate}: take both from one run of `rths keys`."
        )


def certificate(path: Path) -> x509.Certificate:
    """The certificate in a file; raises InputError."""
    try:
        return x509.load_pem_x509_certificate(content(path))
    except ValueError:
        raise InputError(f"{path} is not a certificate in PEM.") from None


def content(path: Path) -> bytes:
    """What is in a file; raises InputError."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(
            f"Cannot read {path}, which [link.security] asks for: {error.strerror}; make it with `rths keys`, "
            "or copy it from the machine where that was run."
        ) from None


def common_name(found: x509.Certificate) -> str:
    """The common name of a certificate's owner, empty where it has none."""
    names = found.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""
