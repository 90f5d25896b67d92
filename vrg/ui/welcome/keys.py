"""What the keys mean in the welcome window and the configurator."""

from typing import Final

import pygame

from vrg.ui.welcome.acts import Act

PLAIN: Final[dict[int, Act]] = {
    pygame.K_UP: Act.UP,
    pygame.K_DOWN: Act.DOWN,
    pygame.K_LEFT: Act.LEFT,
    pygame.K_RIGHT: Act.RIGHT,
    pygame.K_TAB: Act.NEXT,
    pygame.K_RETURN: Act.TAKE,
    pygame.K_KP_ENTER: Act.TAKE,
    pygame.K_ESCAPE: Act.LEAVE,
    pygame.K_BACKSPACE: Act.ERASE,
    pygame.K_DELETE: Act.REMOVE,
    pygame.K_F1: Act.HELP,
    pygame.K_F8: Act.PROBLEM,
    pygame.K_F11: Act.SCREEN,
}
"""What keys mean alone."""
WITH_CTRL: Final[dict[int, Act]] = {
    pygame.K_UP: Act.MOVE_UP,
    pygame.K_DOWN: Act.MOVE_DOWN,
    pygame.K_LEFT: Act.MOVE_LEFT,
    pygame.K_RIGHT: Act.MOVE_RIGHT,
    pygame.K_PAGEUP: Act.TURN_LEFT,
    pygame.K_PAGEDOWN: Act.TURN_RIGHT,
    pygame.K_z: Act.UNDO,
    pygame.K_y: Act.REDO,
    pygame.K_s: Act.SAVE,
    pygame.K_p: Act.PLAY,
    pygame.K_PLUS: Act.MORE,
    pygame.K_EQUALS: Act.MORE,
    pygame.K_KP_PLUS: Act.MORE,
    pygame.K_MINUS: Act.FEWER,
    pygame.K_KP_MINUS: Act.FEWER,
}
"""What keys mean together with CTRL."""
LETTERS: Final[dict[str, Act]] = {
    "c": Act.CHANGE,
    "w": Act.WATCH,
    "?": Act.HELP,
    "q": Act.LEAVE,
}
"""What signs mean in the welcome screen, where nothing is typed."""
HELD: Final = (
    pygame.K_UP,
    pygame.K_DOWN,
    pygame.K_LEFT,
    pygame.K_RIGHT,
    pygame.K_PAGEUP,
    pygame.K_PAGEDOWN,
    pygame.K_BACKSPACE,
)
"""The keys that go on while they are held down."""


def act_of(key: int, modifiers: int) -> Act | None:
    """What a key asks for; None if it is a sign to type, or nothing."""
    if modifiers & pygame.KMOD_CTRL:
        return WITH_CTRL.get(key)
    if key == pygame.K_TAB and modifiers & pygame.KMOD_SHIFT:
        return Act.PREVIOUS
    return PLAIN.get(key)
