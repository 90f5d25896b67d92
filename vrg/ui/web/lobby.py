"""The visitors of the page: their number is bounded, a seat holds one of them, and each one's rate is limited.

This knows no network and no clock.
"""

from collections import Counter
from dataclasses import dataclass, field
from math import inf
from typing import Final

from vrg.ui.web.admission import VIEWER, Admission, VisitorKind, VisitorRole
from vrg.ui.web.requests import Hello

GUESTS_LIMIT: Final = 64
"""The limit of connected viewers, and that of officials."""
PER_SECOND: Final = 60.0
"""The limit of a page's requests per second over a long time."""
AT_ONCE: Final = 120.0
"""The limit of a page's requests at once."""


@dataclass(frozen=True)
class Refused:
    """A page is not admitted.

    Args:
        why: in words. reason: `token`, `taken` or `full`, by which the page offers what can be done.
    """

    why: str
    reason: str


@dataclass(frozen=True)
class Admitted:
    """A page is admitted.

    Args:
        role: what it may do. displaced: the number of the connection whose seat it has taken; None if there was none.
        evicted: the number of the connection that must go for this one to have a place; None if there is one.
    """

    role: VisitorRole
    displaced: int | None = None
    evicted: int | None = None


@dataclass
class Lobby:
    """Keeps the roles of the connections, which are known by numbers.

    Args:
        admission: the tokens. limit: how many viewers are admitted at most, and how many officials.

    Attributes:
        roles: of the connections that are admitted. wrong_tokens: how many wrong tokens were offered.
    """

    admission: Admission
    limit: int = GUESTS_LIMIT
    roles: dict[int, VisitorRole] = field(default_factory=dict)
    wrong_tokens: int = 0
    _tabs: dict[int, str] = field(default_factory=dict)
    _addresses: dict[int, str] = field(default_factory=dict)

    def admit(self, guest: int, hello: Hello, address: str = "") -> Admitted | Refused:
        """Let a connection in, or say why not. A person whose seat is taken over becomes a viewer.

        Where there is no place left, the newest connection of the address that most come from must go, so that one
        computer cannot take all places.
        """
        role = self.admission.role_of(hello.token)
        if role is None:
            self.wrong_tokens += 1
            return Refused("This link's token does not belong to this match: it may be of an earlier one.", "token")
        holder = self.holder(role)
        if holder is not None and not hello.takeover and not (hello.tab and self._tabs.get(holder) == hello.tab):
            return Refused(f"Another page drives {role.player} already: the seat has one driver at a time.", "taken")
        if holder is not None:
            del self.roles[holder]
            self.roles[holder] = VIEWER  # it is the newest viewer
        self.roles[guest], self._tabs[guest], self._addresses[guest] = role, hello.tab, address
        evicted = self._excess(VisitorKind.VIEWER) or self._excess(VisitorKind.OFFICIAL)
        if evicted == guest:
            self.leave(guest)
            return Refused(self.full, "full")
        if evicted is not None:
            self.leave(evicted)
        return Admitted(role, holder, evicted)

    @property
    def full(self) -> str:
        """The message for those that get no place."""
        return f"{self.limit} pages are open already, and this is the limit: close one."

    def _excess(self, kind: VisitorKind) -> int | None:
        """The connection that has no place, because there are too many of a kind; None if there are not."""
        those = [guest for guest, role in self.roles.items() if role.kind is kind]
        if len(those) <= self.limit:
            return None
        own, crowds = self._addresses[those[-1]], Counter(self._addresses[guest] for guest in those)
        largest = max(crowds, key=lambda address: (crowds[address], address == own))
        return next(guest for guest in reversed(those) if self._addresses[guest] == largest)

    def holder(self, role: VisitorRole) -> int | None:
        """The connection that has a seat; None if none has, or the role is no seat."""
        if role.kind is not VisitorKind.SEAT:
            return None
        return next((guest for guest, its in self.roles.items() if its == role), None)

    def leave(self, guest: int) -> VisitorRole | None:
        """Forget a connection, and return the role that it had; None if it was not admitted."""
        self._tabs.pop(guest, None)
        self._addresses.pop(guest, None)
        return self.roles.pop(guest, None)


@dataclass
class Allowance:
    """Bounds how fast requests come: a bucket of tokens that fills at a steady rate; by default those of a connection.

    Args:
        at_once: the number of requests that are within bounds at once. per_second: those of each s after them.
    """

    at_once: float = AT_ONCE
    per_second: float = PER_SECOND
    _left: float = inf
    _before: float = 0.0

    def spend(self, now: float) -> bool:
        """True if one more request is within bounds at the monotonic time `now`, s."""
        self._left = min(self.at_once, self._left + (now - self._before) * self.per_second)
        self._before = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
