"""The description of robot pursuit-evasion (thesis 4.2). Only processes that need the rules or a player import them."""

from vrg.colours import SKY_BLUE, VERMILLION
from vrg.games.game import Game, Marker, Moment, Role

PURSUER, INTRUDER = "pursuer", "intruder"
PURSUERS, INTRUDERS = "pursuers", "intruders"
"""The names of the teams."""
WATCHING, DISPATCHED, RETURNING = "watching", "dispatched", "returning"
"""The states of a pursuer."""
WAITING, CROSSING, CAPTURED, ESCAPED = "waiting", "crossing", "captured", "escaped"
"""The states of an intruder."""
SIGHTINGS_AT_ONCE = 8
"""The number of sightings that one pursuer may tell the referee in a tick. If it tells more, none of them counts."""
AREA = "area"
"""The kind of the zone that the pursuers guard."""

_FOLDER = "vrg.games.pursuit_evasion"

GAME = Game(
    name="pursuit-evasion",
    settings=f"{_FOLDER}.settings:Settings",
    rules=f"{_FOLDER}.rules:PursuitEvasion",
    strategy=f"{_FOLDER}.pursuer:Pursuer",
    match=f"{_FOLDER}/match.toml",
    roles=(
        Role(PURSUER, PURSUERS, SKY_BLUE, Marker.CIRCLE),
        Role(INTRUDER, INTRUDERS, VERMILLION, Marker.TRIANGLE, strategy=f"{_FOLDER}.intruder:Intruder"),
    ),
    score_words={PURSUERS: "intruders captured", INTRUDERS: "intruders escaped"},
    out_of_play=frozenset({CAPTURED, ESCAPED}),
    moments={
        "capture": Moment("X", "captured", others="by"),
        "escape": Moment("s", "escaped"),
        "dispatch": Moment("*", "dispatched", others="to", thought=True),
    },
)
