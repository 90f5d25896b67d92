"""Opens windows, lets them fill the screen, and ends their process with a message when the display goes away."""

import ctypes
import logging
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final, NoReturn

import pygame

from vrg.errors import LaunchError

log = logging.getLogger(__name__)

UNSEEN: Final = ("dummy", "offscreen")
"""The drivers of SDL whose windows nobody sees."""
GONE: Final = (
    "vrg: the display has gone away, so this window ends. The match goes on, and a robot that was driven here plays by "
    "itself again."
)


def open_window(title: str, size: tuple[int, int], gone: Callable[[], str] = lambda: GONE) -> pygame.Surface:
    """Open a window that can be resized.

    Args:
        size: in pixels. gone: returns what to tell if the display goes away; the process ends after that.

    Raises:
        LaunchError: there is no display.
    """
    # This process makes no sound; SDL would otherwise open the sound card, or complain that there is none.
    os.environ.setdefault("SDL_AUDIODRIVER", "dummy")
    # What a task bar calls the program; SDL would take the name of the file that Python runs.
    os.environ.setdefault("SDL_VIDEO_X11_WMCLASS", "vrg")
    try:
        pygame.display.init()
        if pygame.display.get_driver() == "x11":
            # Without a graphics card SDL would draw each frame once more by OpenGL in software, which takes 18 ms for
            # 1920 x 1080 pixels; shared memory takes less than 1 ms. Other drivers have no such way.
            os.environ.setdefault("SDL_FRAMEBUFFER_ACCELERATION", "0")
        pygame.display.set_caption(title)
        window = pygame.display.set_mode(size, pygame.RESIZABLE)
    except pygame.error as error:
        raise _no_display(str(error)) from None
    if pygame.display.get_driver() in UNSEEN and os.environ.get("SDL_VIDEODRIVER") not in UNSEEN:
        # SDL does not say that no screen answers: it draws into memory instead.
        pygame.display.quit()
        raise _no_display("no screen answers")
    _on_gone[0] = gone
    _tell_when_the_display_goes()
    return window


def _no_display(why: str) -> LaunchError:
    return LaunchError(f"no window can be opened: {why}: set DISPLAY or WAYLAND_DISPLAY to a screen")


def toggle_whole_screen() -> None:
    """Let the window fill the screen, or not any more. Where that is impossible, it is logged."""
    try:
        pygame.display.toggle_fullscreen()
    except pygame.error as error:
        log.warning("the window cannot fill the screen: %s", error)


_on_gone: Final[list[Callable[[], str]]] = [lambda: GONE]
"""What tells that the display has gone away."""


def _gone(_display: int) -> NoReturn:
    # Xlib ends the process when this returns, and no code of Python would run any more.
    try:
        print(_on_gone[0](), file=sys.stderr, flush=True)
    finally:
        os._exit(1)


_ON_GONE: Final = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)(_gone)
"""Xlib keeps only its address."""


def _tell_when_the_display_goes() -> None:
    """Let Xlib say what has happened when its server is gone, in place of its own words."""
    if pygame.display.get_driver() != "x11":
        return
    # It must be the very library that SDL has loaded.
    maps = Path("/proc/self/maps")
    lines = maps.read_text(encoding="utf-8").splitlines() if maps.exists() else []
    path = next((line.split()[-1] for line in lines if "/libX11" in line and "/libX11-xcb" not in line), None)
    if path is not None:
        ctypes.CDLL(path).XSetIOErrorHandler(_ON_GONE)
