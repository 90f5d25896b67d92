"""The look of a zone of the field: its colours and the words on it. This draws nothing."""

from dataclasses import dataclass

from vrg.bus.messages import LARGE_ZONES, Zone
from vrg.colours import Rgb
from vrg.games.game import Game
from vrg.regions import Circle, Region
from vrg.ui import palette


@dataclass(frozen=True)
class ZoneLook:
    """The look of a zone.

    Args:
        safe: it is striped and stands out. tint: of its ground. stripe: of its stripes. edge: of its border.
        words: what is written on it; empty for a large zone, whose name would lie below those of the zones in it.
        ink: of the words.
        below: the words stand below it, because there may be an object in its middle.
        team: it belongs to a team.
    """

    safe: bool
    tint: Rgb
    stripe: Rgb
    edge: Rgb
    words: str
    ink: Rgb
    below: bool
    team: bool


def zone_look(zone: Zone, game: Game) -> ZoneLook:
    """Return the look of a zone that is not the field itself."""
    safe = zone.kind == "safe"
    colour = palette.SAFE if safe else game.team_style(zone.team).colour if zone.team else palette.MUTED
    # A grey zone must not look like a wall.
    share = 0.2 if safe else 0.08 if zone.kind in LARGE_ZONES else 0.14 if zone.team else 0.06
    tint = palette.mix(palette.FIELD, colour, share)
    words = "" if zone.kind in LARGE_ZONES else zone.name.replace("_", " ").upper()
    if safe and "ZONE" not in words:
        words += " ZONE"
    return ZoneLook(
        safe=safe,
        tint=tint,
        stripe=palette.mix(tint, colour, 0.22),
        edge=palette.mix(colour, palette.FIELD, 0.25),
        words=words,
        ink=palette.mix(palette.SAFE, palette.TEXT, 0.45) if safe else palette.MUTED,
        below=bool(zone.team) and isinstance(zone.region, Circle),
        team=bool(zone.team),
    )


def room(region: Region) -> tuple[float, float]:
    """The room for something centred in the middle of a region: its length along x and along y, m."""
    x, y = region.middle
    x_min, y_min, x_max, y_max = region.bounds

    def reach(dx: float, dy: float) -> float:
        stretch = region.inside((x - dx, y - dy), (x + dx, y + dy))
        return 0.0 if stretch is None else 2 * min(0.5 - stretch[0], stretch[1] - 0.5)

    width, height = x_max - x_min, y_max - y_min
    return 2 * width * reach(width, 0.0), 2 * height * reach(0.0, height)
