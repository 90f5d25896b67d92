"""Robot sumo: two robots on a round ring, and who leaves it has lost the bout.

The rules follow those of the All Japan Robot-Sumo Tournament as the Unified Sumo Robot Rules of RoboGames have them. In
its class of 3 kg a robot is 20 cm long and the ring is 154 cm wide; here both are 2.5 times as large.
"""

from vrg.colours import SKY_BLUE, VERMILLION
from vrg.games.game import Game, Marker, Moment, Role, RuleText

EAST, WEST = "east", "west"

GAME = Game(
    name="sumo",
    settings="vrg_games.sumo.rules:Settings",
    rules="vrg_games.sumo.rules:Sumo",
    strategy="vrg_games.sumo.players:Bull",
    match="vrg_games.sumo/match.toml",
    roles=(
        Role(EAST, EAST, VERMILLION, Marker.TRIANGLE, strategy="vrg_games.sumo.players:Bull"),
        Role(WEST, WEST, SKY_BLUE, Marker.CIRCLE, strategy="vrg_games.sumo.players:Matador"),
    ),
    round_word="bout",
    score_words={EAST: "bout{s} won", WEST: "bout{s} won"},
    moments={
        "out": Moment("X", "out", counts=True),
        "standstill": Moment("s", "stands still", counts=True),
        "yusei": Moment("D", "is behind", others="after a push in vain with", counts=True),
        "locked": Moment("P", "drawn"),
    },
    rule_texts={
        "out": RuleText("A robot whose centre leaves the ring has lost the bout.", "robot sumo: it falls off the ring"),
        "standstill": RuleText(
            "Who stops first and stands for some time has lost the bout, even if the other one then stands too.",
            "robot sumo: no will to fight",
        ),
        "yusei": RuleText(
            "If both stop at once and stand for that time, who is nearer the middle has won the bout.",
            "robot sumo: the judges decide by who is the better",
        ),
        "locked": RuleText("If neither is nearer the middle, the bout is drawn."),
        "forfeit": RuleText("Who is disqualified has lost the bout."),
        "time_up": RuleText("A bout that is not decided in time is drawn."),
    },
    prover="vrg_games.sumo.proof:prove",
    about="Two robots push each other out of a ring; who wins two bouts of three has won.",
)
