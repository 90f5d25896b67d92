"""What the keys and the buttons of a gamepad mean at the head-up display."""

from enum import Enum
from typing import Final

import pygame

from vrg.games.hud.helm import Wish
from vrg.ui.pads import Act


class Press(Enum):
    """What a key asks for, besides the wishes."""

    STOP = "stop"
    SET = "set"
    LEAVE = "leave"
    NEXT = "next"
    ERASE = "erase"
    SCREEN = "screen"
    CLOSE = "close"


KEYS: Final[dict[int, Wish | Press]] = {
    pygame.K_g: Wish.GOTO,
    pygame.K_m: Wish.MANUAL,
    pygame.K_r: Wish.RESET,
    pygame.K_b: Wish.WATCH,
    pygame.K_SPACE: Press.STOP,
    pygame.K_RETURN: Press.SET,
    pygame.K_KP_ENTER: Press.SET,
    pygame.K_ESCAPE: Press.LEAVE,
    pygame.K_TAB: Press.NEXT,
    pygame.K_F11: Press.SCREEN,
    pygame.K_q: Press.CLOSE,
}
"""What each key means while nobody types into a field."""
TYPING: Final[dict[int, Press]] = {
    pygame.K_SPACE: Press.STOP,
    pygame.K_RETURN: Press.SET,
    pygame.K_KP_ENTER: Press.SET,
    pygame.K_ESCAPE: Press.LEAVE,
    pygame.K_TAB: Press.NEXT,
    pygame.K_BACKSPACE: Press.ERASE,
    pygame.K_F11: Press.SCREEN,
}
"""What each key means while somebody types into a field; all others are characters."""
PAD: Final[dict[Act, Wish | Press]] = {
    Act.FACE_3: Wish.GOTO,
    Act.FACE_4: Wish.RESET,
    Act.PAGE: Wish.MANUAL,
    Act.ESTOP: Press.STOP,
    Act.CLOSE: Press.CLOSE,
}
"""What each button of a gamepad means: X, Y, START and BACK. A and B drive ahead and back in Manual."""
ARROWS: Final[dict[Act, tuple[int, int]]] = {
    Act.PLAYER_1: (0, -1),
    Act.PLAYER_2: (1, 0),
    Act.PLAYER_3: (0, 1),
    Act.PLAYER_4: (-1, 0),
}
"""Where each arrow of a gamepad moves the goal in the window: to the right and down."""
