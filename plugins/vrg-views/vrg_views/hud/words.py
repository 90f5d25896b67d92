"""The words of the head-up display."""

from typing import Final

from vrg_views.hud.helm import Wish

LOCATION: Final = "LOCATION"
GOTO: Final = "GOTO"

FIELDS: Final = (("x", "m"), ("y", "m"), ("heading", "°"))
"""The name and the unit of each field of the goto panel."""
HINTS: Final = {
    Wish.WATCH: "Click the map or type a goal, then Goto. Manual drives by gamepad or arrow keys, Reset drives home.",
    Wish.GOTO: "The robot drives to the goal and stands there until it is given back. A click moves the goal.",
    Wish.MANUAL: "Stick with the right shoulder button held, or arrow keys. Left shoulder button or SHIFT: full speed.",
    Wish.RESET: "The robot drives back to where it began, and stands there until it is given back.",
}
"""The next steps of a person, by the present wish."""

MODE, LEASE, SPEED, BATTERY = "MODE", "DRIVEN BY", "SPEED", "BATTERY"
FAULT, LINK, PAD, RANGES = "FAULT", "LINK", "PAD", "RANGES"
OF_PLAYER, OF_ROBOT, OF_REFEREE, NEVER = "player", "robot", "referee", "never"
NOTHING: Final = "none"
UNKNOWN: Final = "not known"
NOT_MEASURED: Final = "not measured"
WAITING: Final = "Waiting for the referee"
NEAREST: Final = "nearest {distance:.2f} m at {bearing:+.0f}°"
NOTHING_NEAR: Final = "nothing within {reach:g} m"

OWN_STRATEGY: Final = "its own strategy"
REFEREE: Final = "the referee"
YOU: Final = "you, at this display"
YOU_SOON: Final = "asked for by you, not yet granted"
ANOTHER: Final = "another person"

NO_REFEREE: Final = "the referee is silent"
NO_POSE: Final = "the robot does not report where it is"
NO_SCAN: Final = "no scan yet"
NO_ECHO: Final = "no echo yet"
NO_READING: Final = "no reading yet"
NO_PICTURE: Final = "no picture yet"
BAD_PICTURE: Final = "the picture is damaged"
NOT_SIMULATED: Final = "none in this match (lasers = false)"
TAKEN: Final = "{player} is driven by another person: wait until it is given back"
NO_GOAL: Final = "There is no goal yet: type x and y, or click the map"
NOT_A_SIGN: Final = "{field}: expected digits, a sign or a point, got {got!r}"
NOT_A_NUMBER: Final = "{field}: expected a number of {unit}, got {got!r}"
OUTSIDE: Final = (
    "The goal ({x:.2f}, {y:.2f}) is outside of the map, which reaches from x = {x_min:g} to {x_max:g} m and from "
    "y = {y_min:g} to {y_max:g} m"
)
AT_BORDER: Final = (
    "The goal ({x:.2f}, {y:.2f}) is nearer to the map's border than the {radius:.2f} m that the robot needs"
)
IN_WALL: Final = "The goal ({x:.2f}, {y:.2f}) is in a wall or an obstacle"
AT_WALL: Final = "The goal ({x:.2f}, {y:.2f}) is {distance:.2f} m from a wall, and the robot needs {radius:.2f} m"
TAKEN_PLACE: Final = "The goal ({x:.2f}, {y:.2f}) is where {other} stands"
KEPT: Final = "{reason}. The goal stays ({x:.2f}, {y:.2f})."
UNITS: Final = {"m": "metres", "°": "degrees"}
