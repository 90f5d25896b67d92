"""Practice: robots on a map, without a judge. For trying a player, a sensor or a robot."""

from vrg.colours import SKY_BLUE
from vrg.games.game import Game, Marker, Role

PLAYER, TEAM = "player", "team"
"""The one role, and the one team: all hear one another over the radio."""

GAME = Game(
    name="practice",
    settings="vrg.games.practice.rules:Settings",
    rules="vrg.games.practice.rules:Practice",
    strategy="vrg.games.practice.player:Waiting",
    about="A robot on a map without rules, to try a player, a sensor or a robot.",
    match="vrg.games.practice/match.toml",
    roles=(Role(PLAYER, TEAM, SKY_BLUE, Marker.CIRCLE),),
    competitive=False,
)
