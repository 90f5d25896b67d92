"""The [rules] table of a match of RoboFlag."""

from typing import Literal

from pydantic import Field as Setting

from vrg.games.settings import Coordinate, LineUp
from vrg.tables import Table


class TeamHalf(Table):
    """The [rules.red] or [rules.blue] table: what one team's half looks like.

    Args:
        home: the corner of its half in which its home zone is: the one with the `low` or the `high` y.
        flag: the place (x, y) of its flag, m from the centre of the field at scale 1.
    """

    home: Literal["low", "high"]
    flag: tuple[Coordinate, Coordinate]


class Settings(LineUp):
    """The [rules] table of a match file, with that of `LineUp`. Lengths in m at scale 1, times in s.

    Args:
        centre: the centre (x, y) of the field, m in the map's frame. `scale` does not change it.
        scale: the factor by which the field, its zones and all distances are larger than at Cornell, where robots were
            small. 2 is right for Pioneers.
        red, blue: where the teams' homes and flags are. Red has the half of low x, and blue that of high x.
        length, width: the size of the field along x and along y.
        tag_distance: an opponent so near tags. flag_reach: a player so near takes the flag.
        home_reach: a player so near to the corner of its home is at home. flag_zone: the radius of the flag zones.
        round_time: the time of play of each of the two rounds. sudden_death: the time of the round that decides a tie.
        captures: the number of captures that ends the game at once.
        epoch: the time after which the teams bid again for who attacks.
        bidding: the time for which bids are taken before the lowest one wins.
    """

    centre: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    scale: float = Setting(2.0, gt=0, le=1000)
    red: TeamHalf = TeamHalf(home="low", flag=(-2.0, 0.8))
    blue: TeamHalf = TeamHalf(home="high", flag=(2.0, -0.8))
    length: float = Setting(6.0, gt=0, le=1e4)
    width: float = Setting(4.0, gt=0, le=1e4)
    tag_distance: float = Setting(0.30, gt=0, le=1e3)
    flag_reach: float = Setting(0.30, gt=0, le=1e3)
    home_reach: float = Setting(0.60, gt=0, le=1e3)
    flag_zone: float = Setting(0.50, gt=0, le=1e3)
    round_time: float = Setting(600.0, gt=0, le=1e6)
    sudden_death: float = Setting(300.0, gt=0, le=1e6)
    captures: int = Setting(3, ge=1, le=1000)
    epoch: float = Setting(10.0, ge=1, le=1e6)
    bidding: float = Setting(0.3, ge=0.1, le=1e3)

    def side(self, team: str) -> TeamHalf:
        """The half of a team."""
        return self.red if team == "red" else self.blue
