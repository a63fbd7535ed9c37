"""Why a link over TLS fails: zenoh reports every failure as a timeout, so a TLS handshake finds the cause."""

from __future__ import annotations

import contextlib
import socket
import ssl
from pathlib import Path

from common.link.address import place

# s to wait for a listener's verdict on a certificate: several round trips even on a slow link (50 ms)
PROBE_S = 0.5


def mismatch(endpoint: str) -> str:
    """A sentence where one end uses certificates and the other does not; empty otherwise, or if nothing listens."""
    speaks = speaks_tls(endpoint)
    if speaks and not endpoint.startswith("tls/"):
        return (
            f"The process that listens at {endpoint} uses TLS and asks for a certificate, but this plan has none: "
            "name the folder in [link.security]."
        )
    if speaks is False and endpoint.startswith("tls/"):
        return (
            f"The process that listens at {endpoint} does not use TLS, but this plan asks for it: "
            "give the master the same plan, with its certificates."
        )
    return ""


def speaks_tls(endpoint: str) -> bool | None:
    """Whether the listener at an endpoint uses TLS; None where nothing listens."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = (
        False,
        ssl.CERT_NONE,
    )  # the peer's identity does not matter here
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
    """Why a TLS connection to an endpoint fails, as far as TLS reports it; empty where it reports nothing."""
    host, port = place(endpoint)
    try:
        with (
            socket.create_connection((host, port), timeout=PROBE_S) as plain,
            context.wrap_socket(plain, server_hostname=host) as link,
            contextlib.suppress(TimeoutError),
        ):
            link.recv(1)  # in TLS 1.3 the peer's verdict on this certificate comes after the handshake
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
    """Why this end refuses the master's certificate, in a sentence."""
    host, code = place(endpoint)[0], error.verify_code
    if code == EXPIRED:
        return f"The master's certificate at {endpoint} has expired: make new ones with `rths keys`."
    if code in OTHER_AUTHORITY:
        return (
            f"The master's certificate at {endpoint} was issued by another authority than {folder}/authority.pem: "
            "take all files from one run of `rths keys`."
        )
    if code in (OTHER_HOST, OTHER_ADDRESS):
        return (
            f"The master's certificate is not made for {host}: make new ones with `rths keys --host {host}`."
        )
    if code == PURPOSE:
        return f"The listener at {endpoint} shows another certificate than the master's: find out what it is."
    return f"The master's certificate at {endpoint} is not valid: {error.verify_message}."


THERE = {
    "CERTIFICATE_REQUIRED": "it got no certificate",
    "UNKNOWN_CA": "it was issued by another authority than the master's",
    "DECRYPT_ERROR": "it was issued by another authority than the master's",
    "CERTIFICATE_EXPIRED": "it has expired by the master's clock",
    "BAD_CERTIFICATE": "it cannot be read there",
    "UNSUPPORTED_CERTIFICATE": "it is not made for connecting to a master",
}


def verdict_there(error: ssl.SSLError, endpoint: str, folder: Path) -> str:
    """Why the master refused this end's certificate, by the TLS alert that it sent; empty where it did not."""
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
