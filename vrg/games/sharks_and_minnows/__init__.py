"""The description of Sharks and Minnows (thesis 4.3). Only processes that need the rules or the player import them."""

from vrg.colours import SKY_BLUE, VERMILLION
from vrg.games.game import Game, Marker, Moment, Role, RuleText

SHARK, MINNOW = "shark", "minnow"
SHARKS, MINNOWS = "sharks", "minnows"
"""The names of the teams. A player belongs to the team of its first role for the whole match."""
ACTIVE, INACTIVE = "active", "inactive"

GAME = Game(
    name="sharks-and-minnows",
    settings="vrg.games.sharks_and_minnows.settings:Settings",
    rules="vrg.games.sharks_and_minnows.rules:SharksAndMinnows",
    strategy="vrg.games.sharks_and_minnows.player:SharksAndMinnowsPlayer",
    about="Minnows cross to the safe zone, sharks tag them on the way. Minnows win if one is left after the last pass.",
    match="vrg.games.sharks_and_minnows/match.toml",
    roles=(
        Role(SHARK, SHARKS, VERMILLION, Marker.TRIANGLE),
        Role(MINNOW, MINNOWS, SKY_BLUE, Marker.CIRCLE),
    ),
    round_word="pass",
    score_words={SHARKS: "minnow{s} caught", MINNOWS: "safe crossing{s}"},
    won_words={
        SHARKS: "no minnow is left",
        MINNOWS: "a minnow is left after the last pass",
    },
    decisive=MINNOW,
    out_of_play=frozenset({INACTIVE}),
    moments={
        "tag": Moment("X", "tag", others="by", counts=True),
        "out_of_bounds": Moment("s", "out of bounds", counts=True),
        "pass_limit": Moment("D", "time is up", counts=True),
    },
    rule_texts={
        "tag": RuleText(
            "A minnow whose outline comes within the tag distance of an active shark's outline, and which is not in "
            "the safe zone, becomes inactive.",
            "thesis 4.3",
        ),
        "out_of_bounds": RuleText("A player whose centre leaves the field becomes inactive.", "thesis 4.3"),
        "pass_limit": RuleText(
            "A minnow that is not in the safe zone when the time of the pass is up becomes inactive.",
            "an extension of thesis 4.3",
        ),
        "pass_over": RuleText("A pass is over when every minnow that is left is in the safe zone.", "thesis 4.3"),
        "new_shark": RuleText("After a pass inactive players become sharks, and the sides swap ends.", "thesis 4.3"),
        "game_over": RuleText(
            "Sharks win when no minnow is left, minnows when one is left after the last pass.", "thesis 4.3"
        ),
    },
    prover="vrg.games.sharks_and_minnows.proof:prove",
)
