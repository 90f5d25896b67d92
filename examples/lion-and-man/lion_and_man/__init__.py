"""The lion and the man (R. Rado, about 1925): in a closed arena both are equally fast. Can the lion catch the man?

For points that turn at once the lion comes as near as it wants, but never catches the man (Besicovitch, 1952). Robots
have a size, so here the man is caught within the capture distance, and wins if the time is up before.
"""

from vrg.colours import SKY_BLUE, VERMILLION
from vrg.games.game import Game, Marker, Moment, Role, RuleText

LION, MAN = "lion", "man"

GAME = Game(
    name="lion-and-man",
    settings="lion_and_man.rules:Settings",
    rules="lion_and_man.rules:LionAndMan",
    strategy="lion_and_man.players:Man",
    match="lion_and_man/match.toml",
    roles=(
        Role(LION, LION, VERMILLION, Marker.TRIANGLE, strategy="lion_and_man.players:Lion"),
        Role(MAN, MAN, SKY_BLUE, Marker.CIRCLE),
    ),
    score_words={LION: "men caught", MAN: "chases survived"},
    moments={"caught": Moment("X", "caught", others="by"), "out": Moment("s", "left the arena")},
    rule_texts={
        "caught": RuleText("A man whose centre comes within the capture distance of the lion's is caught.", "R. Rado"),
        "out": RuleText("Who leaves the arena loses."),
        "forfeit": RuleText("Who is disqualified loses."),
        "time_up": RuleText("A man who is not caught in time wins.", "Besicovitch, 1952: points never meet"),
    },
    prover="lion_and_man.proof:prove",
)
