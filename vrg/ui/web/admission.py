"""The rights on the page: tokens, and the links that carry them.

A link carries its token in the fragment, which browsers do not send with requests, so that it is in no server's log.
"""

import enum
import hmac
import secrets
import ssl
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from tempfile import NamedTemporaryFile

import msgspec

from vrg.hosts import netloc

TOKEN_BYTES = 16
"""The number of random bytes in a token."""
DEFAULT_HOST = "127.0.0.1"
DEFAULT_PORT = 8080


class VisitorKind(enum.StrEnum):
    """The rights of a visitor: a VIEWER watches, an OFFICIAL decides too, a SEAT drives one player too."""

    VIEWER = "viewer"
    OFFICIAL = "official"
    SEAT = "seat"


@dataclass(frozen=True)
class VisitorRole:
    """The role of a visitor.

    Args:
        kind: what it may do. player: whom it drives; empty for all but seats.
    """

    kind: VisitorKind
    player: str = ""

    @property
    def words(self) -> str:
        """The role for people and for the journal, such as `driver of ann (web)`."""
        return f"driver of {self.player} (web)"[-64:] if self.kind is VisitorKind.SEAT else f"{self.kind} (web)"


VIEWER = VisitorRole(VisitorKind.VIEWER)
OFFICIAL = VisitorRole(VisitorKind.OFFICIAL)


def is_token(offered: str, own: str) -> bool:
    """Whether a visitor offers a token, in a time that tells nothing about it; nobody has an empty one."""
    return bool(own) and hmac.compare_digest(offered.encode(errors="surrogateescape"), own.encode())


@dataclass(frozen=True)
class Admission:
    """The address of the page, and the tokens that admit to its roles. Without a token a visitor may watch.

    Args:
        host: the address that is listened on. port: its port.
        official: the token of the officials; empty if there is none. seats: the token of each player's seat.
        certificate, private_key: of the page, in PEM; empty if it is served without encryption.
    """

    host: str
    port: int
    official: str = field(default="", repr=False)
    seats: dict[str, str] = field(default_factory=dict, repr=False)
    certificate: str = field(default="", repr=False)
    private_key: str = field(default="", repr=False)

    def role_of(self, token: str) -> VisitorRole | None:
        """The role that a token admits to; None for a wrong one. An empty token is a viewer's."""
        if not token:
            return VIEWER
        seats = [(VisitorRole(VisitorKind.SEAT, name), own) for name, own in self.seats.items()]
        # All are compared, so that the time tells nothing about which of them it resembles.
        found = [role for role, own in ((OFFICIAL, self.official), *seats) if is_token(token, own)]
        return found[-1] if found else None

    def links(self, address: str) -> list[tuple[VisitorRole, str]]:
        """The links to hand out, the viewers' first.

        Args:
            address: of this machine, as browsers reach it.
        """
        scheme = "https" if self.certificate else "http"
        base = f"{scheme}://{netloc(address, self.port)}/"
        official = [(OFFICIAL, f"{base}#{self.official}")] if self.official else []
        seats = [(VisitorRole(VisitorKind.SEAT, name), f"{base}#{token}") for name, token in self.seats.items()]
        return [(VIEWER, base), *official, *seats]

    def encoded(self) -> str:
        """All of it in one line, for the process that serves the page. It holds the tokens: it is not to be logged."""
        return msgspec.json.encode(self).decode()


def admission(
    host: str, port: int, players: Sequence[str], *, deciding: bool = True, known: Admission | None = None
) -> Admission:
    """Make tokens.

    Args:
        players: those that may be driven. deciding: False makes a page on which everybody may only watch.
        known: what was made for this match before; its tokens and its certificate are kept.
    """
    known = known or Admission(host, port)
    page = replace(known, host=host, port=port, official="", seats={})
    if not deciding:
        return page
    return replace(
        page,
        official=known.official or secrets.token_urlsafe(TOKEN_BYTES),
        seats={player: known.seats.get(player) or secrets.token_urlsafe(TOKEN_BYTES) for player in players},
    )


def read_admission(line: str) -> Admission:
    """Return the admission that `Admission.encoded` has encoded.

    Raises:
        ValueError: it is something else. The message does not repeat it.
    """
    try:
        return msgspec.json.decode(line, type=Admission)
    except msgspec.MsgspecError:
        raise ValueError("expected the tokens of the page in one line of JSON, got something else") from None


def tls_context(certificate: str, private_key: str) -> ssl.SSLContext:
    """How a page is encrypted.

    Args:
        certificate, private_key: its own, in PEM.

    Raises:
        OSError: one of them is none, or they do not belong together.
    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    with NamedTemporaryFile("w", suffix=".pem") as file:  # OpenSSL reads files only; this one is its owner's
        file.write(certificate + private_key)
        file.flush()
        context.load_cert_chain(file.name)
    return context
