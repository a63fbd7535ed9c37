"""`rths keys`: an authority for one test or one campaign, and a certificate with its private key for every role."""

from __future__ import annotations

import argparse
import ipaddress
import json
import os
import re
import sys
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from common.errors import InputError
from common.roles import MASTER, OBSERVER, OPERATOR, RECORDER, kind_of, slave_role
from common.terminal import cli

if TYPE_CHECKING:
    from cryptography import x509
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey

HERE = ("localhost", "127.0.0.1", "::1")
HOST = re.compile(r"[A-Za-z0-9]([A-Za-z0-9-]*[A-Za-z0-9])?(\.[A-Za-z0-9]([A-Za-z0-9-]*[A-Za-z0-9])?)*")
EARLIER = timedelta(
    hours=1
)  # by which a laboratory's clock may be behind, or an hour off for daylight saving time
LONGEST = 3650  # days, ten years: longer than any campaign
NAME_LENGTH = 64  # of a common name (RFC 5280, appendix A)
AUTHORITY = "authority"


class Owner(NamedTuple):
    """A certificate and its private key."""

    certificate: x509.Certificate
    key: EllipticCurvePrivateKey


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `keys`."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder for the files, new or empty")
    slaves = parser.add_mutually_exclusive_group()
    slaves.add_argument("--plan", metavar="PLAN", help="plan whose slaves get certificates")
    slaves.add_argument(
        "--slaves", nargs="+", metavar="NAME", default=[], help="names of the slaves, if they have names"
    )
    parser.add_argument("--days", type=int, default=30, metavar="N", help="validity in days (30)")
    parser.add_argument(
        "--host",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME",
        help=f"name or address under which slaves connect to the master, beside {', '.join(HERE)}",
    )
    cli.json_argument(parser, "say what was written as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Make the files."""
    if not 1 <= args.days <= LONGEST:
        raise InputError(f"--days {args.days} cannot be used: give 1 to {LONGEST}.")
    now = datetime.now(UTC)
    roles = (MASTER, *slave_roles(args), RECORDER, OPERATOR, OBSERVER)
    owners = certificates(roles, args.host, now - EARLIER, now + timedelta(days=args.days))
    write(args.folder, owners)
    end = now + timedelta(days=args.days)
    if args.json:
        sys.stdout.write(json.dumps(plain(args.folder, roles, end)) + "\n")
    else:
        sys.stdout.write(instructions(args.folder, roles, end))
    return 0


def slave_roles(args: argparse.Namespace) -> tuple[str, ...]:
    """The slaves' roles that the command line asks for; raises InputError."""
    from common.plan import read as plans

    if args.plan is not None:
        args.slaves = plans.load(cli.plan_path(args.plan)).slaves
    for name in args.slaves:
        if not plans.SLAVE_NAME.fullmatch(name):
            raise InputError(
                f"The slave's name '{name}' cannot be used: begin with a lower-case letter, go on with lower-case "
                "letters, digits and _."
            )
        if len(slave_role(name)) > NAME_LENGTH:
            raise InputError(f"The slave's name '{name}' is too long for a certificate: shorten it.")
    if len(set(args.slaves)) < len(args.slaves):
        raise InputError(
            f"--slaves {' '.join(args.slaves)} has a name twice: give each slave a name of its own."
        )
    return tuple(map(slave_role, args.slaves or [""]))


def certificates(
    roles: Sequence[str], hosts: Sequence[str], begin: datetime, end: datetime
) -> dict[str, Owner]:
    """An authority and the certificates that it signs, by role, valid from `begin` to `end`; new keys every time.

    Keys are ECDSA on P-256. The authority signs no others of its kind. The master's certificate serves to listen,
    under the names of its host, the others' to dial: no holder of one can take the master's place.

    Raises:
        InputError: a host is neither a name nor an address.
    """
    authority = authorized(begin, end)
    return {AUTHORITY: authority} | {role: issued(role, hosts, authority, begin, end) for role in roles}


def authorized(begin: datetime, end: datetime) -> Owner:
    """An authority with a unique name, so that a certificate of another authority is recognised by its issuer."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec

    key, number = ec.generate_private_key(ec.SECP256R1()), x509.random_serial_number()
    name = named(f"rths {AUTHORITY} {number:x}"[:60])
    builder = x509.CertificateBuilder(name, name, key.public_key(), number, begin, end)
    builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
    builder = builder.add_extension(usage(signs_certificates=True), critical=True)
    builder = builder.add_extension(
        x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False
    )
    return Owner(builder.sign(key, hashes.SHA256()), key)


def issued(role: str, hosts: Sequence[str], authority: Owner, begin: datetime, end: datetime) -> Owner:
    """The certificate of a role, whose common name it is."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.x509.oid import ExtendedKeyUsageOID as Purpose

    key, above = ec.generate_private_key(ec.SECP256R1()), authority.certificate
    number = x509.random_serial_number()
    builder = x509.CertificateBuilder(above.subject, named(role), key.public_key(), number, begin, end)
    purpose = Purpose.SERVER_AUTH if role == MASTER else Purpose.CLIENT_AUTH
    signer = x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.key.public_key())
    builder = builder.add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
    builder = builder.add_extension(usage(signs_certificates=False), critical=True)
    builder = builder.add_extension(x509.ExtendedKeyUsage([purpose]), critical=True)
    builder = builder.add_extension(signer, critical=False)
    if role == MASTER:
        names = x509.SubjectAlternativeName([general_name(host) for host in (*HERE, *hosts)])
        builder = builder.add_extension(names, critical=False)
    return Owner(builder.sign(authority.key, hashes.SHA256()), key)


def named(common_name: str) -> x509.Name:
    """A distinguished name of a common name alone."""
    from cryptography import x509
    from cryptography.x509.oid import NameOID

    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def usage(*, signs_certificates: bool) -> x509.KeyUsage:
    """What a key may do: sign certificates, or prove that its owner is there."""
    from cryptography import x509

    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def general_name(host: str) -> x509.GeneralName:
    """A host in the form of a certificate; raises InputError."""
    from cryptography import x509

    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        if HOST.fullmatch(host):
            return x509.DNSName(host)
    raise InputError(
        f"--host {host} is neither a host's name nor its address: give it without protocol and port."
    )


def write(folder: Path, owners: dict[str, Owner]) -> None:
    """Certificates and private keys into a folder that only its owner may enter; nothing is overwritten.

    Raises:
        InputError: something is there already, or the folder cannot be written.
    """
    from cryptography.hazmat.primitives import serialization

    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise InputError(f"{folder} is not empty, and keys are never overwritten: name a new folder.")
        folder.chmod(0o700)
        for name, owner in owners.items():
            secret = owner.key.private_bytes(
                serialization.Encoding.PEM,
                serialization.PrivateFormat.PKCS8,
                serialization.NoEncryption(),
            )
            create(folder / f"{name}.pem", owner.certificate.public_bytes(serialization.Encoding.PEM), 0o644)
            create(folder / f"{name}.key", secret, 0o600)
    except OSError as error:
        raise InputError(f"Cannot write keys to {folder}: {error.strerror}; name another folder.") from None


def create(path: Path, content: bytes, mode: int) -> None:
    """A new file that never had more rights than `mode`."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
        file.write(content)


PLACES = {
    MASTER: "the master's machine",
    "slave": "the machine of that slave",
    RECORDER: "the recorder's machine",
    OPERATOR: "people who may stop and reset a test",
    OBSERVER: "people who may watch a test",
}


def plain(folder: Path, roles: Sequence[str], end: datetime) -> dict[str, Any]:
    """The files, and until when they are valid, as plain values."""
    return {
        "folder": str(folder),
        "valid_until": end.isoformat(timespec="seconds"),
        "authority": f"{AUTHORITY}.pem",
        "authority_key": f"{AUTHORITY}.key",
        "roles": {role: {"certificate": f"{role}.pem", "key": f"{role}.key"} for role in roles},
    }


def instructions(folder: Path, roles: Sequence[str], end: datetime) -> str:
    """Which files go where."""
    width = max(map(len, roles)) * 2 + 11
    rows = [f"  {f'{role}.pem, {role}.key':<{width}}  {PLACES[kind_of(role)]}" for role in roles]
    return "\n".join(
        (
            f"{folder}: an authority and {len(roles)} certificates, valid until {end:%Y-%m-%d %H:%M} UTC.",
            f"  {f'{AUTHORITY}.pem':<{width}}  everybody",
            *rows,
            f"Keep {folder / AUTHORITY}.key away from the laboratories: "
            "whoever has it can make certificates of any role.",
            f'In the plan: [link.security] folder = "{folder.name}", relative to the plan\'s own folder.\n',
        )
    )
