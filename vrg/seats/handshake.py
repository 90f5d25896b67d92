"""Why a router does not let a process in. Zenoh itself only reports that it could not connect."""

import socket
import ssl

from vrg.seats.credentials import Credentials

_STEP_TIMEOUT = 2.0
"""The real time in s for each step of the handshake."""
_REASONS = (
    (
        "certificate has expired",
        "the router's certificate has expired, or the clock of this machine is wrong: renew the keys by "
        "`vrg keys renew`, or set the clock",
    ),
    # A router reports the same of a certificate that is not valid yet.
    (
        "CERTIFICATE_EXPIRED",
        "the certificate of this seat has expired, or the clock of the router's machine is wrong: renew the keys by "
        "`vrg keys renew`, or set that clock",
    ),
    (
        "not yet valid",
        "the router's certificate is not valid yet by the clock of this machine: set the clock, or make the keys again",
    ),
    ("Hostname mismatch", "the router's certificate is for other hosts: `vrg keys renew --host` adds this one"),
    ("IP address mismatch", "the router's certificate is for other addresses: `vrg keys renew --host` adds this one"),
    ("CERTIFICATE_VERIFY_FAILED", "the router's certificate is of another authority: these keys are for another match"),
    ("UNKNOWN_CA", "the router does not know the authority of this seat: these keys are for another match"),
    ("DECRYPT_ERROR", "the router does not know the authority of this seat: these keys are for another match"),
    ("CERTIFICATE_REQUIRED", "the router wants a certificate, and none was given"),
    ("BAD_CERTIFICATE", "the router does not accept the certificate of this seat"),
    ("WRONG_VERSION_NUMBER", "what answers there does not encrypt"),
)
"""Messages of OpenSSL, and what they mean here."""


def refusal(endpoint: str, credentials: Credentials) -> str | None:
    """The reason why no handshake with the router at `endpoint` succeeds; None if one does, or if there is no answer.

    A router without keys, and one that hangs, does not answer a handshake. It blocks for some seconds at most.
    """
    host, _, port = endpoint.partition("/")[2].partition("#")[0].rpartition(":")
    try:
        context = ssl.create_default_context(cafile=str(credentials.authority))
        context.load_cert_chain(credentials.certificate, credentials.private_key)
    except (OSError, ssl.SSLError) as error:
        return f"the keys in {credentials.folder} cannot be read: {error}"
    try:
        with (
            socket.create_connection((host.strip("[]"), int(port)), timeout=_STEP_TIMEOUT) as plain,
            context.wrap_socket(plain, server_hostname=host.strip("[]")) as secure,
        ):
            # A server refuses a client's certificate only after its own side of the handshake.
            secure.settimeout(_STEP_TIMEOUT / 4)
            secure.recv(1)
    except ssl.SSLError as error:
        return _meaning(str(error))
    except (OSError, ValueError):
        return None
    return None


def _meaning(message: str) -> str:
    folded = message.replace(" ", "_").upper()
    for words, meaning in _REASONS:
        if words.replace(" ", "_").upper() in folded:
            return meaning
    return f"the handshake fails: {message}"
