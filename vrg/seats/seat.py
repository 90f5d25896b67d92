"""The seats of a match: what a process may be, as far as the router can tell by its certificate.

A seat is more than a role on paper. Its certificate carries the seat's common name, and the router's rules, which are
made from the key map, say for each common name what it may publish and hear.
"""

import enum
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass

from vrg.names import chunk_of

LONGEST_COMMON_NAME = 64
"""The number of characters that X.509 allows in a common name (RFC 5280, ub-common-name)."""
_DIGEST = 16
"""The number of hexadecimal digits that stand for the rest of a name that is too long."""


class SeatKind(enum.StrEnum):
    """The kinds of seats.

    ROUTER serves the bus. WORLD, REFEREE and RECORDER are the processes of that name. LAUNCHER is the supervisor of the
    match, and HOST a supervisor on a further machine. OFFICIAL decides, and hears everything. WINDOW watches. TRACKER
    locates robots, as a motion-capture system and the fusion centre do. PLAYER is one player with its robot. COMMANDER
    commands one team. HUD is the head-up display of one player.

    No package adds a kind, though it may bring the program that takes a seat, as of HUD: the router's rules follow from
    the match and the key map alone, on each machine of a match, whatever is installed there.
    """

    ROUTER = "router"
    WORLD = "world"
    REFEREE = "referee"
    RECORDER = "recorder"
    LAUNCHER = "launcher"
    HOST = "host"
    OFFICIAL = "official"
    WINDOW = "window"
    TRACKER = "tracker"
    PLAYER = "player"
    COMMANDER = "commander"
    HUD = "hud"


NAMED = frozenset({SeatKind.HOST, SeatKind.PLAYER, SeatKind.COMMANDER, SeatKind.HUD})
"""The kinds of which a match has several seats, each with a name of its own."""


@dataclass(frozen=True, order=True)
class Seat:
    """One seat of a match.

    Args:
        kind: what it is.
        name: the name of the player (also for its display), of the commanded team or of the machine; empty for all
            other kinds.

    Raises:
        ValueError: the name is missing, or there is one where the kind has none.
    """

    kind: SeatKind
    name: str = ""

    def __post_init__(self) -> None:
        if bool(self.name) != (self.kind in NAMED):
            raise ValueError(f"a seat of the kind {self.kind}: expected {'a' if not self.name else 'no'} name")

    def __str__(self) -> str:
        return f"{self.kind}.{self.name}" if self.name else str(self.kind)

    @property
    def common_name(self) -> str:
        """The common name of its certificate, ASCII of at most 64 characters; also the name of its folder of keys.

        A name that is too long is cut, and ends in a digest of the whole, so that no two seats share one.
        """
        whole = f"{self.kind}.{chunk_of(self.name)}" if self.name else str(self.kind)
        if len(whole) <= LONGEST_COMMON_NAME:
            return whole
        digest = hashlib.sha256(whole.encode()).hexdigest()[:_DIGEST]
        return f"{whole[: LONGEST_COMMON_NAME - _DIGEST - 1]}~{digest}"


@dataclass(frozen=True)
class Roster:
    """The members of a match, as far as seats are concerned.

    Args:
        match: the name of the match, which is a part of every key.
        teams: the team of each player, by the player's name.
        fed: the players of whose robots another program, and not the player's device, measures where they are; and the
            passive bodies of which one does.
        hosts: the names of the further machines. linked: True if it has further routers.
    """

    match: str
    teams: dict[str, str]
    fed: tuple[str, ...] = ()
    hosts: tuple[str, ...] = ()
    linked: bool = False

    @property
    def seats(self) -> list[Seat]:
        """All seats of the match, the router's first."""
        return list(self._seats())

    def _seats(self) -> Iterator[Seat]:
        for kind in SeatKind:
            if kind not in NAMED and (kind is not SeatKind.TRACKER or self.fed):
                yield Seat(kind)
        yield from (Seat(SeatKind.HOST, name) for name in self.hosts)
        yield from (Seat(SeatKind.PLAYER, name) for name in self.teams)
        yield from (Seat(SeatKind.COMMANDER, team) for team in dict.fromkeys(self.teams.values()))
        yield from (Seat(SeatKind.HUD, name) for name in self.teams)

    def members(self, team: str) -> list[str]:
        """The players of a team."""
        return [name for name, its in self.teams.items() if its == team]
