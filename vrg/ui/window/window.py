"""SDL's window: it is opened and fills the screen, its pictures are kept, and its display goes away."""

import ctypes
import io
import logging
import os
import sys
from pathlib import Path
from typing import Final, NoReturn

import pygame

from vrg.errors import LaunchError
from vrg.files import write_whole
from vrg.ui import palette
from vrg.ui.window import shapes

log = logging.getLogger(__name__)

UNSEEN: Final = ("dummy", "offscreen")
"""The drivers of SDL without a visible window."""
GONE: Final = (
    "vrg: the display has gone away, so this window ends. The match goes on, and a robot that was driven here plays by "
    "itself again."
)


SIZE: Final = (1280, 720)
"""The size of a window in pixels on a screen of usual size."""
_DECORATIONS: Final = 80
"""Pixels of a screen's height that title bars and task bars take."""
_REPEAT: Final = (400, 50)
"""ms of real time until a key that is held counts again, and between the times after that."""


def display_available() -> bool:
    """True if there is a screen to open a window on. Without one SDL draws into memory, and no one sees it."""
    try:
        pygame.display.init()
    except pygame.error:
        return False
    driver = pygame.display.get_driver()
    pygame.display.quit()
    return driver not in UNSEEN


def open_window(title: str, size: tuple[int, int] | None = None) -> pygame.Surface:
    """Open a window that can be resized. If its display goes away, GONE is printed, and the process ends.

    Args:
        size: in pixels; None fits the screen.

    Raises:
        LaunchError: there is no display.
    """
    # This process makes no sound; SDL would otherwise open the sound card, or complain that there is none.
    os.environ.setdefault("SDL_AUDIODRIVER", "dummy")
    # What a task bar calls the program; pygame has set the name of the file that Python runs when it was imported.
    os.environ["SDL_VIDEO_X11_WMCLASS"] = os.environ["SDL_VIDEO_WAYLAND_WMCLASS"] = "VRG"
    try:
        pygame.display.init()
        if pygame.display.get_driver() == "x11":
            # Without a graphics card SDL would draw each frame once more by OpenGL in software, which takes 18 ms for
            # 1920 x 1080 pixels; shared memory takes less than 1 ms. Other drivers have no such way.
            os.environ.setdefault("SDL_FRAMEBUFFER_ACCELERATION", "0")
        pygame.display.set_caption(title)
        pygame.display.set_icon(_icon())
        window = pygame.display.set_mode(size or fitting(pygame.display.get_desktop_sizes()[0]), pygame.RESIZABLE)
    except pygame.error as error:
        raise _no_display(str(error)) from None
    if pygame.display.get_driver() in UNSEEN and os.environ.get("SDL_VIDEODRIVER") not in UNSEEN:
        # SDL does not say that no screen answers: it draws into memory instead.
        pygame.display.quit()
        raise _no_display("no screen answers")
    pygame.key.set_repeat(*_REPEAT)
    _tell_when_the_display_goes()
    return window


def fitting(screen: tuple[int, int]) -> tuple[int, int]:
    """The size of a new window on a screen, both in pixels: three quarters of it, SIZE at least, if that has room."""
    width, height = (max(usual, round(0.75 * of)) for usual, of in zip(SIZE, screen, strict=True))
    width, height = min(width, screen[0]), min(height, screen[1] - _DECORATIONS)
    return min(width, round(height * 16 / 9)) if screen[0] > SIZE[0] else width, max(height, 1)


def _icon() -> pygame.Surface:
    """The sign of VRG: a robot with its nose, as on the page."""
    icon = pygame.Surface((64, 64), pygame.SRCALPHA)
    pygame.draw.rect(icon, palette.PANEL, icon.get_rect(), border_radius=14)
    pygame.draw.rect(icon, palette.SAFE, (10, 18, 34, 28), border_radius=6)
    shapes.polygon(icon, [(44, 22), (56, 32), (44, 42)], palette.TEXT)
    return icon


def png(surface: pygame.Surface) -> bytes:
    """A surface as the content of a PNG file."""
    picture = io.BytesIO()
    pygame.image.save(surface, picture, "picture.png")
    return picture.getvalue()


def save_png(surface: pygame.Surface, path: Path) -> None:
    """Write a surface to a PNG file.

    Raises:
        OSError: the file cannot be written.
    """
    try:
        write_whole(path, png(surface))
    except OSError as error:
        raise OSError(f"{path}: cannot write the picture: {error.strerror}") from None


def save_numbered(surface: pygame.Surface, folder: Path) -> str:
    """Write a surface into the first free of the files picture-001.png and so on; log and return where, or why not."""
    number = 1
    while (path := folder / f"picture-{number:03d}.png").exists():
        number += 1
    try:
        save_png(surface, path)
    except OSError as error:
        log.error("%s", error)
        return str(error)
    log.info("picture saved: %s", path)
    # The name comes first: a window may cut the end.
    return f"Picture saved: {path.name} in {folder.resolve()}"


def _no_display(why: str) -> LaunchError:
    return LaunchError(f"no window can be opened: {why}: set DISPLAY or WAYLAND_DISPLAY to a screen")


def toggle_whole_screen() -> None:
    """Let the window fill the screen, or not any more. Where that is impossible, it is logged."""
    try:
        pygame.display.toggle_fullscreen()
    except pygame.error as error:
        log.warning("the window cannot fill the screen: %s", error)


def _gone(_display: int) -> NoReturn:
    # Xlib ends the process when this returns, and no code of Python would run any more.
    try:
        print(GONE, file=sys.stderr, flush=True)
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
