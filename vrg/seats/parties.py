"""The parties that publish and receive on the lines of the key map, as data."""

from dataclasses import dataclass

from vrg.seats.seat import SeatKind


@dataclass(frozen=True)
class Party:
    """The seats of one kind, as speakers or listeners of a line.

    The names in a line's key are the seat's own: a player speaks on its own keys only. Kinds without a name of their
    own, such as the referee, speak on all keys of the line.

    Args:
        kind: the kind of the seats.
        others: True if of the names in the key only the team must be the seat's own, as a player hears what others of
            its team say.
        node: who that is, where it is not the seat itself, in words.
        fed: True for the robots only that another program locates, False for all others only.
    """

    kind: SeatKind
    others: bool = False
    node: str = ""
    fed: bool | None = None


WORLD, REFEREE, RECORDER = Party(SeatKind.WORLD), Party(SeatKind.REFEREE), Party(SeatKind.RECORDER)
LAUNCHER, HOST, OFFICIAL = Party(SeatKind.LAUNCHER), Party(SeatKind.HOST), Party(SeatKind.OFFICIAL)
WINDOW, TRACKER = Party(SeatKind.WINDOW), Party(SeatKind.TRACKER)
PLAYER, COMMANDER = Party(SeatKind.PLAYER), Party(SeatKind.COMMANDER)
HUD = Party(SeatKind.HUD, node="player's display")
# One party alone may publish where a robot is: no other may overrule the tracker, and the tracker no odometry.
LOCATING, TRACKING = Party(SeatKind.PLAYER, node="player's device", fed=False), Party(SeatKind.TRACKER, fed=True)
DEVICE, MATES = Party(SeatKind.PLAYER, node="player's device"), Party(SeatKind.PLAYER, others=True)
PLAYING = (WORLD, REFEREE, RECORDER, LAUNCHER, OFFICIAL, WINDOW, TRACKER, PLAYER, COMMANDER, HUD)
EVERYBODY = (*PLAYING, HOST)
"""All seats but the router's, whose process takes no part in the match."""
