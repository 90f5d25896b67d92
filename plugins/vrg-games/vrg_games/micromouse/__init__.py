"""Micromouse: a robot that does not know the maze finds the middle of it, and then runs there as fast as it can.

The contest began in 1977 as the Amazing Micro-Mouse Maze Contest of IEEE Spectrum; the maze of 16 x 16 cells is that
of later contests. The thesis names it in chapter 2. The maze and the score are those of the rules of the APEC contest.
"""

from pathlib import Path

from vrg.colours import ORANGE
from vrg.games.game import Game, Marker, Moment, Role, RuleText, Shown

MOUSE = "mouse"
MAP = Path(__file__).with_name("maze.toml")
"""The map `maze`, as `python -m vrg_games.micromouse 9` writes it."""

GAME = Game(
    name="micromouse",
    about="A mouse explores a maze, and runs to the middle as fast as it can.",
    settings="vrg_games.micromouse.rules:Settings",
    rules="vrg_games.micromouse.rules:Micromouse",
    strategy="vrg_games.micromouse.player:FloodFill",
    match="vrg_games.micromouse/match.toml",
    roles=(Role(MOUSE, MOUSE, ORANGE, Marker.TRIANGLE),),
    numbers={"run": Shown("running for {:.1f} s", since=True), "best": Shown("best score {:.2f} s")},
    score_words={MOUSE: "hundredth{s} of a second below the time"},
    moments={
        "run": Moment("^", "began a run"),
        "goal": Moment("*", "reached the middle", counts=True),
        "home": Moment("s", "returned during a run"),
    },
    rule_texts={
        "run": RuleText("A run begins when the centre of the mouse leaves the start cell.", "APEC: run time"),
        "goal": RuleText(
            "A run is complete when the centre enters the four cells in the middle. Its score is its time and 1/30 of "
            "the time of play before it; the best score counts.",
            "APEC: run time and maze time",
        ),
        "home": RuleText("A run that comes back to the start cell is over."),
        "forfeit": RuleText("A mouse that is disqualified runs no more."),
        "time_up": RuleText("The match ends when the time is up.", "APEC allows ten minutes"),
    },
    prover="vrg_games.micromouse.proof:prove",
)
