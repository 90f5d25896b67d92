"""The description of RoboFlag (thesis 4.4). Only processes that need the rules or a player import them."""

from vrg import colours
from vrg.games.game import Game, Marker, Moment, Priority, Role, RuleText

RED, BLUES = "red", "blue"
"""The names of the teams, which are also those of the roles: a player never changes its team."""
TEAMS = (RED, BLUES)
NORMAL, TAGGED, FLAGGED = "normal", "tagged", "flagged"
"""The states of a player. A flagged player carries the flag of the other team."""
SCOUTS = {RED: "red-scout", BLUES: "blue-scout"}
"""The roles of those that fly above the others, by team."""
SCOUTING = "scouting"
"""The state of a scout."""
FLAG = "flag"
"""The kind of a flag among the objects of the field."""
HALF, HOME, FLAG_ZONE = "half", "home", "flag_zone"
"""The kinds of the zones that each team has."""
TAG_DISTANCE = "tag distance"
"""The published number with the distance at which an opponent tags, m."""
TEAM_FLAG, TAG_DEFENSE, FLAGGED_SAFETY, HAIL_MARY = "team-flag", "tag-defense", "flagged-safety", "hail-mary"
"""The priorities that the person who commands a team may set (thesis 4.4.4)."""


def other(team: str) -> str:
    """The team that a team plays against."""
    return BLUES if team == RED else RED


def flag_of(team: str) -> str:
    """The name of a team's flag."""
    return f"{team} flag"


def attack_of(team: str) -> str:
    """The lot of the auction in which a team finds out who goes for the other team's flag."""
    return f"{team} attack"


_FOLDER = "vrg.games.roboflag"

GAME = Game(
    name="roboflag",
    label="RoboFlag",
    settings=f"{_FOLDER}.settings:Settings",
    rules=f"{_FOLDER}.rules:RoboFlag",
    strategy=f"{_FOLDER}.strategies:Balanced",
    about="Take the other team's flag and bring it to your own home without being tagged. The most flags win.",
    match=f"{_FOLDER}/match.toml",
    roles=(
        Role(RED, RED, colours.RED, Marker.TRIANGLE),
        Role(BLUES, BLUES, colours.BLUE, Marker.CIRCLE),
        *(
            Role(SCOUTS[team], team, colour, Marker.SQUARE, strategy=f"{_FOLDER}.scout:Scout")
            for team, colour in ((RED, colours.RED), (BLUES, colours.BLUE))
        ),
    ),
    score_words={RED: "flag{s} captured", BLUES: "flag{s} captured"},
    out_of_play=frozenset({TAGGED}),
    moments={
        "tag": Moment("X", "tag", others="by"),
        "flag": Moment("^", "takes the flag"),
        "capture": Moment("*", "flag captured", counts=True),
    },
    priorities=(
        Priority(TEAM_FLAG, "Team Flag", "guard the team's own flag, and tag whoever carries it"),
        Priority(TAG_DEFENSE, "Tag Defense", "tag every opponent on the team's own half"),
        Priority(FLAGGED_SAFETY, "Flagged Safety", "shield the player that carries the flag"),
        Priority(HAIL_MARY, "Hail Mary", "everybody goes for the opponents' flag"),
    ),
    rule_texts={
        "tag": RuleText(
            "A normal player within the tag distance of an opponent is tagged on the opponents' half, and a carrier of "
            "a flag anywhere; nobody is tagged inside a flag zone. The flag of a tagged carrier returns.",
            "thesis 4.4",
        ),
        "scout": RuleText(
            "A scout flies above the others. Its team sees by it; it does not tag, is not tagged, and takes no flag.",
            "thesis 5.2",
        ),
        "home": RuleText("A tagged player in reach of its own home becomes normal.", "thesis 4.4"),
        "flag": RuleText(
            "A normal player in reach of the opponents' flag takes it; a flag has one carrier.", "thesis 4.4"
        ),
        "capture": RuleText("A carrier in reach of its own home scores, and the flag returns.", "thesis 4.4"),
        "flag_returns": RuleText("The flag of a carrier that is disqualified returns to its place."),
        "time": RuleText("A round lasts ten minutes of play, and sudden death five.", "thesis 4.4"),
        "sudden_death": RuleText("A tie after two rounds is decided by the first capture of a third.", "thesis 4.4"),
        "game_over": RuleText("Three captures (`captures`), or more after two rounds, win the game.", "thesis 4.4"),
    },
    prover="vrg.games.roboflag.proof:prove",
)
