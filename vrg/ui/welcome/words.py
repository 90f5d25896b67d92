"""The words of the welcome window and of the configurator."""

from typing import Final

TITLE: Final = "Virtual Robotic Games"
GAMES, MAPS, RECENT, PLAYERS, PROBLEMS, FIELD = "GAMES", "MAPS", "RECENT MATCHES", "PLAYERS", "PROBLEMS", "FIELD"
SETTINGS: Final = {
    "name": "match",
    "game": "game",
    "players": "players",
    "map": "map",
    "engine": "engine",
    "seed": "seed",
}
"""The label of each field of a match."""
COLUMNS: Final = {
    "name": "name",
    "role": "role",
    "model": "robot",
    "backend": "backend",
    "strategy": "strategy",
    "x": "x, m",
    "y": "y, m",
    "heading": "heading, °",
}
"""The label of each field of a player."""
DEFAULT_STRATEGY: Final = "(default)"
OWN_MAP: Final = "the game's own map"

START, CHANGE, WATCH = ("Start", "ENTER"), ("Change", "C"), ("Watch again", "W")
PLAY, SAVE, SAVE_AS = ("Play", "CTRL P"), ("Save", "CTRL S"), ("Save as", "")
UNDO, REDO, LEAVE, HELP = ("Undo", "CTRL Z"), ("Redo", "CTRL Y"), ("Back", "ESC"), ("Keys", "F1")
MORE, FEWER = ("+", ""), ("−", "")
YES, NO = ("Yes", "ENTER"), ("No", "ESC")
OK, CANCEL = ("Save", "ENTER"), ("Cancel", "ESC")

GOOD: Final = "none: ready to play"
CHECKING: Final = "checking …"
COUNT: Final = "{count} found"
MORE_PROBLEMS: Final = "{count} more"
WRONG_CHOICE: Final = "It cannot start: {problem}"
HINT: Final = "Drag a robot to move it, and the ring before it to turn it. Type into any field. F1 lists the keys."
LOBBY_HINT: Final = "Arrows and TAB choose, ENTER starts. ? lists the keys."
NO_RECENT: Final = "none in this folder yet"
NO_FIELD: Final = "nothing to show"
UNSAVED: Final = "not saved"
MATCH_FILE: Final = "match file"
NEW_MATCH: Final = "new match"

ASK_NAME: Final = "Save as which name? The file gets it, too."
ASK_REPLACE: Final = "{file} is already there. Replace it?"
ASK_LEAVE: Final = "The match is not saved. Leave it all the same?"
SAVED: Final = "Saved as {file}."
SAVED_WITH: Final = "Saved as {file}. It cannot be played yet: {count} problems."
NOT_SAVED: Final = "{file} cannot be written: {why}"
NOT_PLAYED: Final = "It cannot be played yet. {problem}"
NOT_CHECKED: Final = "It is still being checked."
NEW_GAME: Final = "This is the default match of {game} now. CTRL Z brings the other one back."
NOT_A_COUNT: Final = "players: expected a whole number from 1 to {most}, got {got!r}"
BY_HAND: Final = "Only a text editor can change this: {why}"
DISPLAY_GONE: Final = "vrg: the display has gone away, so this window ends."
RESCUED: Final = "vrg: what was not saved is in {file} now."
NOT_RESCUED: Final = "vrg: what was not saved is lost: {why}"
BROKEN: Final = "The file is no TOML, so only a text editor can mend it."
GONE: Final = "{what} is gone: {path}"
UNREADABLE: Final = "{path} cannot be read: {why}"
NOTHING_TO_WATCH: Final = "There is no recording of this match. ENTER plays it, C changes it."

LOBBY_KEYS: Final = (
    ("UP DOWN", "choose"),
    ("TAB", "next list"),
    ("ENTER", "start the match"),
    ("C", "change the match"),
    ("W", "watch a recent match again"),
    ("F11", "whole screen"),
    ("? F1", "these keys"),
    ("ESC Q", "close the window"),
)
EDITOR_KEYS: Final = (
    ("arrows TAB", "go to another field"),
    ("any sign", "type into the field"),
    ("ENTER", "choose, or take what is typed"),
    ("ESC", "back, or as it was"),
    ("CTRL arrows", "move the robot by 0.1 m"),
    ("CTRL PAGE UP, DOWN", "turn the robot by 5°"),
    ("CTRL + and −", "more or fewer players"),
    ("DELETE", "take the player out"),
    ("F8", "next problem"),
    ("CTRL Z, CTRL Y", "undo, redo"),
    ("CTRL S", "save"),
    ("CTRL P", "save and play"),
    ("F11", "whole screen"),
    ("F1", "these keys"),
)
