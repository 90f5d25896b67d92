"""Opens windows, and lets them fill the screen."""

import logging
import os

import pygame

log = logging.getLogger(__name__)


def open_window(title: str, size: tuple[int, int]) -> pygame.Surface:
    """Open a window that can be resized; `size` is in pixels.

    Raises:
        pygame.error: there is no display.
    """
    # This process makes no sound; SDL would otherwise open the sound card, or complain that there is none.
    os.environ.setdefault("SDL_AUDIODRIVER", "dummy")
    pygame.display.init()
    pygame.display.set_caption(title)
    return pygame.display.set_mode(size, pygame.RESIZABLE)


def toggle_whole_screen() -> None:
    """Let the window fill the screen, or not any more. Where that is impossible, it is logged."""
    try:
        pygame.display.toggle_fullscreen()
    except pygame.error as error:
        log.warning("the window cannot fill the screen: %s", error)
