"""Soccer of small robots, two to six a side, by rules of RoboCup's Small Size League.

Taken from the league's rules (https://robocup-ssl.github.io/ssl-rules/sslrules.html): the field with its goals, centre
circle and defence areas; goals, kick-off, free kick, goal kick and corner kick; the distance that opponents keep; one
keeper in the defence area, and no attacker; no pushing; no progress. Not taken: penalty kicks, cards, half times, ball
placement by robots, double touch, the speed limit of kicks, and the ball's height.
"""

from typing import Final

from vrg.colours import ORANGE, SKY_BLUE, VERMILLION
from vrg.games.game import Game, Marker, Moment, Priority, Role, RuleText, Shown, ThingStyle

REDS, BLUES = "reds", "blues"
OTHER: Final = {REDS: BLUES, BLUES: REDS}
RED, BLUE, RED_KEEPER, BLUE_KEEPER = "red", "blue", "red-keeper", "blue-keeper"
KEEPERS: Final = {REDS: RED_KEEPER, BLUES: BLUE_KEEPER}
TEAMS: Final = {RED: REDS, RED_KEEPER: REDS, BLUE: BLUES, BLUE_KEEPER: BLUES}
BALL, GOAL, AREA = "ball", "goal", "area"
"""The kind of the ball, and those of zones that belong to a team."""
KICK: Final = "kick for {team}"
"""The number that the referee publishes while a team has a free kick."""
ATTACK, DEFEND = "attack", "defend"

GAME = Game(
    name="soccer",
    settings="vrg_games.soccer.settings:Settings",
    rules="vrg_games.soccer.rules:Soccer",
    strategy="vrg_games.soccer.player:Footballer",
    match="vrg_games.soccer/match.toml",
    roles=(
        Role(RED, REDS, VERMILLION, Marker.TRIANGLE),
        Role(RED_KEEPER, REDS, VERMILLION, Marker.SQUARE),
        Role(BLUE, BLUES, SKY_BLUE, Marker.TRIANGLE),
        Role(BLUE_KEEPER, BLUES, SKY_BLUE, Marker.SQUARE),
    ),
    round_word="kick-off",
    score_words={REDS: "goal{s}", BLUES: "goal{s}"},
    moments={
        "goal": Moment("*", "goal", counts=True),
        "free_kick": Moment("o", "out"),
        "foul": Moment("X", "foul", others="by"),
        "no_progress": Moment("D", "no progress"),
    },
    priorities=(
        Priority(ATTACK, "Attack", "All but the keeper go forward."),
        Priority(DEFEND, "Defend", "All but one stay in front of their own goal."),
    ),
    rule_texts={
        "goal": RuleText("A goal is scored when the whole ball has passed the goal line between the posts.", "SSL 4"),
        "free_kick": RuleText(
            "When the whole ball has left the field, the team that did not touch it last has a kick: beside the place "
            "where it left, or, over a goal line, a goal kick or a corner kick.",
            "SSL 5.3",
        ),
        "foul": RuleText(
            "Nobody pushes an opponent. In a defence area only the keeper of its team touches the ball. Opponents of "
            "a free kick do not touch the ball before it is in play. The other team then has a free kick.",
            "SSL 8.4",
        ),
        "no_progress": RuleText("A ball that has not moved for a while is put on the nearest neutral spot.", "SSL 8.1"),
        "time_up": RuleText("The match ends with its time; the team with more goals has won."),
    },
    prover="vrg_games.soccer.proof:prove",
    things={BALL: ThingStyle(ORANGE, height=0.043)},
    numbers={KICK.format(team=team): Shown(f"the {team} have the kick") for team in (REDS, BLUES)},
    about="Two teams push and kick a ball into each other's goal.",
)
