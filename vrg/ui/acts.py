"""The meanings of the keys and of the gamepad's buttons: one table, because every window uses the same.

A window answers to the acts of its table, and lists those behind `?`. SPACE and the pad's BACK are the emergency stop
wherever a robot can move. A gamepad moves a robot only while its right shoulder button, the dead-man's switch, is held.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import pygame


class Act(Enum):
    """An act of the user, with its key and its meaning, in the order in which `?` lists those that have a key."""

    STOP = ("SPACE", "emergency stop")
    RELEASE = ("U", "release the stop")
    HALT = ("H", "halt")
    CONTINUE = ("C", "start, continue")
    RECOVER = ("R", "recover robots")
    ORDER = ("A B X Y", "set the team's priority")
    PLAYER = ("1 to 4", "drive that player")
    NEXT = ("TAB", "next player, next field")
    PREVIOUS = ("SHIFT TAB", "the previous one")
    GOTO = ("G", "drive to the goal")
    MANUAL = ("M", "drive by hand")
    PAUSE = ("K", "pause, continue")
    STEP = (".", "one step forward")
    STEP_BACK = (",", "one step back")
    FASTER = ("+", "faster")
    SLOWER = ("-", "slower")
    NEXT_CALL = ("PG DN", "next call")
    PREVIOUS_CALL = ("PG UP", "previous call")
    BEGIN = ("HOME", "to the start")
    END = ("END", "to the end")
    STEER = ("ARROWS", "steer, SHIFT: fast")
    CLIMB = ("PG UP, DN", "climb, sink")
    LEAVE = ("ESC", "give it back, close")
    BRANCH = ("F", "from here on")
    WHY = ("W", "why this call")
    PLANS = ("L", "lines of plans")
    TAKE = ("ENTER", "set, watch again")
    PICTURE = ("P", "picture")
    SCREEN = ("F11", "full screen")
    HELP = ("?", "these keys")
    CLOSE = ("Q", "close window")
    PAD_LOST = ("", "the gamepad is lost")
    PAD_UNKNOWN = ("", "a gamepad cannot be used")


OFFICIALS: Final = frozenset({Act.RELEASE, Act.HALT, Act.CONTINUE, Act.RECOVER})
"""The acts that need an official's seat: a router refuses them to others."""
HEARD: Final = OFFICIALS | {
    Act.STOP, Act.ORDER, Act.PLAYER, Act.NEXT, Act.PREVIOUS, Act.GOTO, Act.MANUAL, Act.BEGIN
}  # fmt: skip
"""The acts that a match must hear."""


@dataclass(frozen=True)
class Press:
    """A key or a button that went down.

    Args:
        act: what it asks for; None if it has no meaning but its sign.
        number: which one, from 0, of the acts that have several keys: ORDER, PLAYER.
        key: pygame's number of the key; 0 for a button. sign: what it types, or empty.
        back: SHIFT is held: the other way round. again: the key is held, and this is its repetition.
    """

    act: Act | None
    number: int = 0
    key: int = 0
    sign: str = ""
    back: bool = False
    again: bool = False


_KEYS: Final = {
    pygame.K_SPACE: Act.STOP,
    pygame.K_u: Act.RELEASE,
    pygame.K_h: Act.HALT,
    pygame.K_c: Act.CONTINUE,
    pygame.K_r: Act.RECOVER,
    pygame.K_TAB: Act.NEXT,
    pygame.K_UP: Act.STEER,
    pygame.K_DOWN: Act.STEER,
    pygame.K_LEFT: Act.STEER,
    pygame.K_RIGHT: Act.STEER,
    pygame.K_ESCAPE: Act.LEAVE,
    pygame.K_g: Act.GOTO,
    pygame.K_m: Act.MANUAL,
    pygame.K_HOME: Act.BEGIN,
    pygame.K_END: Act.END,
    pygame.K_k: Act.PAUSE,
    pygame.K_PAGEDOWN: Act.NEXT_CALL,
    pygame.K_PAGEUP: Act.PREVIOUS_CALL,
    pygame.K_f: Act.BRANCH,
    pygame.K_l: Act.PLANS,
    pygame.K_w: Act.WHY,
    pygame.K_p: Act.PICTURE,
    pygame.K_F11: Act.SCREEN,
    pygame.K_F1: Act.HELP,
    pygame.K_q: Act.CLOSE,
    pygame.K_RETURN: Act.TAKE,
    pygame.K_KP_ENTER: Act.TAKE,
    pygame.K_KP_PLUS: Act.FASTER,
    pygame.K_KP_MINUS: Act.SLOWER,
}
_SIGNS: Final = {
    "?": Act.HELP,
    ".": Act.STEP,
    ",": Act.STEP_BACK,
    "+": Act.FASTER,
    "=": Act.FASTER,
    "-": Act.SLOWER,
}
"""The meanings of signs that are on other keys on other keyboards. On many, = is + without SHIFT."""
ORDERS: Final = (pygame.K_a, pygame.K_b, pygame.K_x, pygame.K_y)
DIGITS: Final = tuple(range(pygame.K_1, pygame.K_9 + 1))
_ROWS: Final = ((ORDERS, Act.ORDER), (DIGITS, Act.PLAYER))

AHEAD: Final = {pygame.K_UP: 1.0, pygame.K_DOWN: -1.0}
ASIDE: Final = {pygame.K_LEFT: 1.0, pygame.K_RIGHT: -1.0}
UPWARDS: Final = {pygame.K_PAGEUP: 1.0, pygame.K_PAGEDOWN: -1.0}
FAST: Final = frozenset({pygame.K_LSHIFT, pygame.K_RSHIFT})

PAD: Final = {
    pygame.CONTROLLER_BUTTON_A: Press(Act.ORDER, 0),
    pygame.CONTROLLER_BUTTON_B: Press(Act.ORDER, 1),
    pygame.CONTROLLER_BUTTON_X: Press(Act.ORDER, 2),
    pygame.CONTROLLER_BUTTON_Y: Press(Act.ORDER, 3),
    pygame.CONTROLLER_BUTTON_DPAD_UP: Press(Act.PLAYER, 0),
    pygame.CONTROLLER_BUTTON_DPAD_RIGHT: Press(Act.PLAYER, 1),
    pygame.CONTROLLER_BUTTON_DPAD_DOWN: Press(Act.PLAYER, 2),
    pygame.CONTROLLER_BUTTON_DPAD_LEFT: Press(Act.PLAYER, 3),
    pygame.CONTROLLER_BUTTON_START: Press(Act.MANUAL),
    pygame.CONTROLLER_BUTTON_RIGHTSTICK: Press(Act.NEXT),
    pygame.CONTROLLER_BUTTON_BACK: Press(Act.STOP),
}
"""The acts of the gamepad's buttons. While a player is driven, A and B also drive it ahead and back."""
PAD_AHEAD, PAD_BACK = pygame.CONTROLLER_BUTTON_A, pygame.CONTROLLER_BUTTON_B
DEADMAN: Final = pygame.CONTROLLER_BUTTON_RIGHTSHOULDER
TURBO: Final = pygame.CONTROLLER_BUTTON_LEFTSHOULDER


def press_of(event: pygame.event.Event, *, again: bool = False) -> Press:
    """The meaning of a KEYDOWN event of pygame; `again` is as in Press."""
    key, mod, sign = event.key, getattr(event, "mod", 0), getattr(event, "unicode", "")
    back, control = bool(mod & pygame.KMOD_SHIFT), bool(mod & (pygame.KMOD_CTRL | pygame.KMOD_META))
    if control and key != pygame.K_SPACE:  # a stop stays a stop
        return Press(None, 0, key, "", back, again)
    act, number = _SIGNS.get(sign) or _KEYS.get(key), 0
    for keys, of_row in _ROWS:
        if act is None and key in keys:
            act, number = of_row, keys.index(key)
    if act is Act.NEXT and back:
        act = Act.PREVIOUS
    return Press(act, number, key, sign if sign.isprintable() else "", back, again)
