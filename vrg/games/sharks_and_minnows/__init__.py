"""The description of Sharks and Minnows (thesis 4.3). Only processes that need the rules or the player import them."""

from vrg.colours import SKY_BLUE, VERMILLION
from vrg.games.game import Game, Marker, Moment, Role

SHARK, MINNOW = "shark", "minnow"
SHARKS, MINNOWS = "sharks", "minnows"
"""The names of the teams. A player belongs to the team of its first role for the whole match."""
ACTIVE, INACTIVE = "active", "inactive"

GAME = Game(
    name="sharks-and-minnows",
    settings="vrg.games.sharks_and_minnows.settings:Settings",
    rules="vrg.games.sharks_and_minnows.rules:SharksAndMinnows",
    strategy="vrg.games.sharks_and_minnows.player:SharksAndMinnowsPlayer",
    match="vrg.games.sharks_and_minnows/match.toml",
    roles=(
        Role(SHARK, SHARKS, VERMILLION, Marker.TRIANGLE),
        Role(MINNOW, MINNOWS, SKY_BLUE, Marker.CIRCLE),
    ),
    round_word="pass",
    score_words={SHARKS: "minnows caught", MINNOWS: "safe crossings"},
    won_words={
        SHARKS: "no minnow is left; the score does not decide",
        MINNOWS: "a minnow is left after the last pass; the score does not decide",
    },
    out_of_play=frozenset({INACTIVE}),
    moments={
        "tag": Moment("X", "tag", others="by"),
        "out_of_bounds": Moment("s", "out of bounds"),
        "pass_limit": Moment("D", "time is up"),
    },
)
