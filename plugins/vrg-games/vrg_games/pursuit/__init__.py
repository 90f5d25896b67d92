"""Two pursuits that the thesis names beside the lion and the man (chapter 2): Marco Polo, and Apollonius' pursuit.

In Marco Polo, a game of children in a swimming pool, Marco sees nobody. When Marco calls, all others must answer, by
which Marco learns where they are. In Apollonius' pursuit a fast pursuer guards a harbour from slower evaders, and plays
by the circle of Apollonius: the places that both can reach at the same time.
"""

from vrg.colours import ORANGE, SKY_BLUE, VERMILLION
from vrg.games.game import Game, Marker, Moment, Role, RuleText, Shown

MARCO, POLO, POLOS = "marco", "polo", "polos"
PURSUER, EVADER, EVADERS = "pursuer", "evader", "evaders"
CAUGHT, HOME, OUT = "caught", "home", "out"
ANSWER = "answer"
"""The lot for which Marco bids to call."""
RATIO = "speed ratio"
"""The number of the rules of Apollonius' pursuit."""

_COMMON = {
    "caught": RuleText("Who comes within the capture distance of the hunter, between centres, is caught."),
    "out": RuleText("Who leaves the field counts as caught."),
    "forfeit": RuleText("If the hunter is disqualified, all that are left have got away."),
}

MARCO_POLO = Game(
    name="marco-polo",
    settings="vrg_games.pursuit.settings:MarcoPoloSettings",
    rules="vrg_games.pursuit.rules:MarcoPolo",
    strategy="vrg_games.pursuit.players:Polo",
    match="vrg_games.pursuit/marco_polo.toml",
    roles=(
        Role(MARCO, MARCO, VERMILLION, Marker.TRIANGLE, strategy="vrg_games.pursuit.players:Marco"),
        Role(POLO, POLOS, SKY_BLUE, Marker.CIRCLE),
    ),
    score_words={MARCO: "caught", POLOS: "not caught"},
    out_of_play=frozenset({CAUGHT, OUT}),
    moments={
        "caught": Moment("X", "caught", others="by", counts=True),
        "out": Moment("s", "out", counts=True),
        "call": Moment("1", "calls"),
    },
    rule_texts={
        **_COMMON,
        "call": RuleText("When Marco calls, all must answer: it learns about where they are.", "a game of children"),
        "time_up": RuleText("Those that are not caught in time have got away."),
    },
    prover="vrg_games.pursuit.proof:prove",
    about="Marco sees nobody, calls, and hunts those that must answer.",
)

APOLLONIUS = Game(
    name="apollonius",
    settings="vrg_games.pursuit.settings:ApolloniusSettings",
    rules="vrg_games.pursuit.rules:Apollonius",
    strategy="vrg_games.pursuit.players:Evader",
    match="vrg_games.pursuit/apollonius.toml",
    roles=(
        Role(PURSUER, PURSUER, VERMILLION, Marker.TRIANGLE, strategy="vrg_games.pursuit.players:Pursuer"),
        Role(EVADER, EVADERS, ORANGE, Marker.CIRCLE),
    ),
    score_words={PURSUER: "caught", EVADERS: "at home"},
    out_of_play=frozenset({CAUGHT, OUT, HOME}),
    moments={
        "caught": Moment("X", "caught", others="by", counts=True),
        "home": Moment("*", "at home", counts=True),
        "out": Moment("s", "out", counts=True),
    },
    rule_texts={
        **_COMMON,
        "home": RuleText("An evader whose centre comes into the harbour is at home."),
        "time_up": RuleText("Those that are not at home in time count as caught."),
    },
    prover="vrg_games.pursuit.proof:prove",
    about="A fast pursuer guards a harbour from slower evaders.",
    numbers={RATIO: Shown("evaders have {:.0%} of the pursuer's speed")},
    plans=True,
)
