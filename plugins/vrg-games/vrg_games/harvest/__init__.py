"""Harvest: two alliances bring pieces of their colour into their depots, against the clock.

It is like the games of FIRST Tech Challenge (FTC), in which robots collect pieces of two colours in two and a half
minutes. Not taken: the autonomous period, pieces that are lifted or stacked, climbing, and human players.
"""

from typing import Final

from vrg.colours import SKY_BLUE, VERMILLION
from vrg.games.game import Game, Marker, Moment, Role, RuleText

REDS, BLUES = "reds", "blues"
RED, BLUE = "red", "blue"
TEAMS: Final = {RED: REDS, BLUE: BLUES}
OTHER: Final = {REDS: BLUES, BLUES: REDS}
KINDS: Final = {"red-piece": REDS, "blue-piece": BLUES}
"""The kinds of pieces, and whose colour they have."""
DEPOT: Final = "depot"
"""The kind of the zones into which pieces are brought."""

GAME = Game(
    name="harvest",
    settings="vrg_games.harvest.rules:Settings",
    rules="vrg_games.harvest.rules:Harvest",
    strategy="vrg_games.harvest.player:Harvester",
    match="vrg_games.harvest/match.toml",
    roles=(Role(RED, REDS, VERMILLION, Marker.TRIANGLE), Role(BLUE, BLUES, SKY_BLUE, Marker.SQUARE)),
    score_words={REDS: "point{s}", BLUES: "point{s}"},
    moments={
        "home": Moment("*", "home", counts=True),
        "taken": Moment("X", "taken", counts=True),
        "trespass": Moment("P", "trespass"),
        "out": Moment("o", "out"),
    },
    rule_texts={
        "home": RuleText("A piece that is wholly in a depot counts: 2 points if it has the depot's colour, or else 1."),
        "taken": RuleText("A piece that is not wholly in the depot any more does not count."),
        "trespass": RuleText("Who drives into the other alliance's depot gives it a point, every few seconds anew."),
        "out": RuleText("A piece whose middle leaves the field is put back where it was at the start."),
        "time_up": RuleText("The match ends with its time; the alliance with more points has won."),
        "all_home": RuleText("The match ends when all pieces are in depots; the alliance with more points has won."),
    },
    prover="vrg_games.harvest.proof:prove",
    about="Two alliances push pieces of their colour into their depots.",
)
