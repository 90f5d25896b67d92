"""A game for two teams: whoever first comes to the round finish has won the race."""

from vrg.colours import GREEN as SEA_GREEN
from vrg.colours import ORANGE
from vrg.games.game import Game, Marker, Moment, Role

RED, GREEN = "red", "green"

GAME = Game(
    name="race",
    settings="toys.race.rules:Settings",
    rules="toys.race.rules:Race",
    strategy="toys.race.player:Racer",
    match="toys.race/match.toml",
    roles=(Role(RED, RED, ORANGE, Marker.DIAMOND), Role(GREEN, GREEN, SEA_GREEN, Marker.SQUARE)),
    round_word="heat",
    score_words={RED: "heat{s} won", GREEN: "heat{s} won"},
    moments={"finish": Moment("*", "at the finish")},
)
