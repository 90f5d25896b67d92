"""The Player HUD (thesis 4.1): robots without rules, each driven by a person at its head-up display."""

from vrg.colours import SKY_BLUE
from vrg.games.game import Game, Marker, Role
from vrg.games.practice import PLAYER, TEAM
from vrg_views.hud import KIND

GAME = Game(
    name="hud",
    label="Player HUD",
    settings="vrg.games.practice.rules:Settings",
    rules="vrg_views.hud.rules:PlayerHud",
    strategy="vrg_views.hud.player:Passenger",
    about="Sit in a robot: see what it sees, send it somewhere, or drive it by hand.",
    match="vrg_views.hud/match.toml",
    roles=(Role(PLAYER, TEAM, SKY_BLUE, Marker.CIRCLE),),
    competitive=False,
    window=KIND.name,
)
