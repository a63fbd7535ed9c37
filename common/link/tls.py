"""Why a link over TLS fails: zenoh reports every failure as a timeout, so a TLS handshake finds the cause."""

from __future__ import annotations

import contextlib
import socket
import ssl
from pathlib import Path

from common.link.address import place

# s within which a listener says what it thinks of a certificate: several round trips even on a slow link
PROBE_S = 0.5


def mismatch(endpoint: str) -> str:
    """Why an end with certificates and one without cannot connect; empty where that is not so, or nothing listens."""
    speaks = speaks_tls(endpoint)
    if speaks and not endpoint.startswith("tls/"):
        return (
            f"What listens at {endpoint} speaks TLS and wants a certificate, but this plan has none: "
            "name the folder in [link.security]."
        )
    if speaks is False and endpoint.startswith("tls/"):
        return (
            f"What listens at {endpoint} does not speak TLS, but this plan asks for it: "
            "give the master the same plan, with its certificates."
        )
    return ""


def speaks_tls(endpoint: str) -> bool | None:
    """Whether TLS is spoken at an endpoint; None where nothing listens."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # only whether, not to whom
    try:
        plain = socket.create_connection(place(endpoint), timeout=PROBE_S)
    except OSError:
        return None
    with plain:
        try:
            context.wrap_socket(plain).close()
        except ssl.SSLError as error:
            return "ALERT" in (error.reason or "")
        except OSError:
            return False
    return True


def refused(context: ssl.SSLContext, endpoint: str, folder: Path) -> str:
    """What keeps the two ends of a connection apart, as far as TLS says; empty where it says nothing."""
    host, port = place(endpoint)
    try:
        with (
            socket.create_connection((host, port), timeout=PROBE_S) as plain,
            context.wrap_socket(plain, server_hostname=host) as link,
            contextlib.suppress(TimeoutError),
        ):
            link.recv(1)  # the verdict on one's own certificate comes after one's own on the other's
    except ssl.SSLCertVerificationError as error:
        return verdict_here(error, endpoint, folder)
    except ssl.SSLError as error:
        return verdict_there(error, endpoint, folder)
    except OSError:
        return ""
    return ""


EXPIRED, PURPOSE, OTHER_HOST, OTHER_ADDRESS = 10, 26, 62, 64  # X509_V_ERR_… of OpenSSL
OTHER_AUTHORITY = (7, 18, 19, 20, 21)


def verdict_here(error: ssl.SSLCertVerificationError, endpoint: str, folder: Path) -> str:
    """What this end has against the certificate that was shown to it."""
    host, code = place(endpoint)[0], error.verify_code
    if code == EXPIRED:
        return f"The master's certificate at {endpoint} has expired: make new ones with `rths keys`."
    if code in OTHER_AUTHORITY:
        return (
            f"The master's certificate at {endpoint} is of another authority than {folder}/authority.pem: "
            "take all files from one run of `rths keys`."
        )
    if code in (OTHER_HOST, OTHER_ADDRESS):
        return (
            f"The master's certificate is not made for {host}: make new ones with `rths keys --host {host}`."
        )
    if code == PURPOSE:
        return f"What listens at {endpoint} shows a certificate that is not the master's: see who that is."
    return f"The master's certificate at {endpoint} is not valid: {error.verify_message}."


THERE = {
    "CERTIFICATE_REQUIRED": "it got no certificate",
    "UNKNOWN_CA": "it is of another authority than the master's",
    "DECRYPT_ERROR": "it is of another authority than the master's",
    "CERTIFICATE_EXPIRED": "it has expired by the master's clock",
    "BAD_CERTIFICATE": "it cannot be read there",
    "UNSUPPORTED_CERTIFICATE": "it is not made for dialling",
}


def verdict_there(error: ssl.SSLError, endpoint: str, folder: Path) -> str:
    """What the other end has against this one's certificate, by the alert that it sent."""
    reason = error.reason or ""
    for alert, words in THERE.items():
        if reason.endswith(alert):
            return (
                f"The master at {endpoint} refused the certificate in {folder}: {words}; "
                "take all files from one run of `rths keys`."
            )
    if "ALERT" in reason:
        return f"The master at {endpoint} refused the certificate in {folder} ({reason.lower()})."
    return ""
