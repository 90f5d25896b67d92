"""The description of robot pursuit-evasion (thesis 4.2). Only processes that need the rules or a player import them."""

from vrg.colours import PURPLE, SKY_BLUE, VERMILLION
from vrg.games.game import Game, Marker, Moment, Role, RuleText

PURSUER, INTRUDER, SCOUT = "pursuer", "intruder", "scout"
PURSUERS, INTRUDERS = "pursuers", "intruders"
"""The names of the teams."""
WATCHING, DISPATCHED, RETURNING = "watching", "dispatched", "returning"
"""The states of a pursuer."""
SCOUTING = "scouting"
"""The state of a scout."""
WAITING, CROSSING, CAPTURED, ESCAPED, OUT = "waiting", "crossing", "captured", "escaped", "out"
"""The states of an intruder. A robot that is out counts for no other."""
SIGHTINGS_AT_ONCE = 8
"""The number of sightings that one pursuer may report in a tick. If it reports more, none of them counts."""
AREA = "area"
"""The kind of the zone that the pursuers guard."""

_FOLDER = "vrg.games.pursuit_evasion"

GAME = Game(
    name="pursuit-evasion",
    settings=f"{_FOLDER}.settings:Settings",
    rules=f"{_FOLDER}.rules:PursuitEvasion",
    strategy=f"{_FOLDER}.pursuer:Pursuer",
    about="Intruders cross the area; pursuers, who see them only with lasers, capture them. "
    "More captured than escaped wins.",
    match=f"{_FOLDER}/match.toml",
    roles=(
        Role(PURSUER, PURSUERS, SKY_BLUE, Marker.CIRCLE),
        Role(SCOUT, PURSUERS, PURPLE, Marker.SQUARE, strategy=f"{_FOLDER}.scout:Scout"),
        Role(INTRUDER, INTRUDERS, VERMILLION, Marker.TRIANGLE, strategy=f"{_FOLDER}.intruder:Intruder"),
    ),
    score_words={PURSUERS: "captured", INTRUDERS: "escaped"},
    out_of_play=frozenset({CAPTURED, ESCAPED, OUT}),
    plans=True,
    expected={WAITING: "the next intruder may come at any time"},
    moments={
        "capture": Moment("X", "captured", others="by", counts=True),
        "escape": Moment("s", "escaped", counts=True),
        "off_course": Moment("P", "off its course", counts=True),
        "slow": Moment("v", "too slow", counts=True),
        "collision": Moment("D", "out", others="touches"),
        "dispatch": Moment("*", "dispatched", others="to", thought=True),
    },
    rule_texts={
        "launch": RuleText("The first intruder starts at once, and the others at random times.", "thesis 4.2"),
        "scout": RuleText(
            "A scout flies above the others: it reports what it sees as pursuers do, and neither captures nor is met.",
            "thesis 5.2",
        ),
        "enter": RuleText("An intruder whose centre is inside the area has entered it.", "thesis 4.2"),
        "auction": RuleText("An intruder that has been seen twice is auctioned among the pursuers.", "thesis 4.2"),
        "dispatch": RuleText(
            "The pursuer with the lowest bid, its time to intercept, is dispatched; ties go to the lowest name.",
            "thesis 4.2",
        ),
        "lost": RuleText("An intruder that its pursuer cannot meet any more is auctioned again.", "thesis 4.2"),
        "capture": RuleText("A pursuer closer than the capture distance to an intruder captures it.", "thesis 4.2"),
        "escape": RuleText("An intruder that was inside the area and leaves it has escaped.", "thesis 4.2"),
        "off_course": RuleText("An intruder that leaves its straight course counts as captured.", "thesis 4.2.3"),
        "slow": RuleText("An intruder that does not keep its speed counts as captured.", "thesis 4.2.3"),
        "collision": RuleText("An intruder in play that touches another robot is out and counts for nobody."),
        "missed": RuleText("An intruder that passes by the area is out and counts for nobody."),
        "false_alarm": RuleText("A player that reports a robot where there was none is ignored for a while."),
        "time_up": RuleText("The game ends when its time is up.", "thesis 4.2"),
        "all_done": RuleText("The game ends when every intruder is captured or has escaped.", "thesis 4.2"),
        "game_over": RuleText("The team with more points wins.", "thesis 4.2"),
    },
    prover="vrg.games.pursuit_evasion.proof:prove",
)
