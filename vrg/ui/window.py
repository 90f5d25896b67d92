"""The base of all windows: opening, events, keys, frames, pictures, closing, and a display that goes away."""

import ctypes
import io
import logging
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar, Final, NoReturn

import pygame

from vrg.errors import LaunchError
from vrg.files import write_whole
from vrg.ui import palette, shapes
from vrg.ui.acts import Act, Press, press_of

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
_EVENTS: Final = 1000
"""The most events that are answered to before the next frame."""


class Window:
    """A window of SDL. A process has one at a time. A subclass draws it, and answers to what its user does.

    Args:
        title: of the window. size: in pixels; None fits the screen.
        pictures: the folder where the key P leaves pictures.

    Attributes:
        repeated: the acts whose keys count again while they are held.
        closed: the window was closed, and is not used any more. help: the keys are listed.
        mouse: the pixel at which the mouse points, or None.
    """

    repeated: ClassVar[frozenset[Act]] = frozenset()

    def __init__(self, title: str, size: tuple[int, int] | None = None, pictures: Path | None = None) -> None:
        self.closed = False
        self.help = False
        self.mouse: tuple[int, int] | None = None
        self._title = title
        self._size = size
        self._pictures = pictures or Path()
        self._picture = False
        self._opened = False
        self._down: set[int] = set()

    # What a subclass answers to. Each does nothing here.

    def press(self, press: Press) -> None:
        """A key or a button went down that the window itself does not answer to."""

    def click(self, place: tuple[int, int]) -> None:
        """The left button of the mouse was pressed at a pixel."""

    def drag(self, place: tuple[int, int]) -> bool:
        """The mouse has moved to a pixel. Return whether that can be seen."""
        return False

    def let_go(self) -> None:
        """The left button of the mouse was released, or it and all keys can no longer be heard."""

    def scroll(self, place: tuple[int, int], steps: int) -> None:
        """The wheel was turned by so many steps, down if they are positive, at a pixel."""

    def tell(self, text: str) -> None:
        """Tell the user what has come of something, such as where a picture is."""

    def gone(self) -> str:
        """Return the message for a display that goes away; the process ends after that."""
        return GONE

    @property
    def typing(self) -> bool:
        """True if keys are letters of a text now."""
        return False

    # The window itself.

    def open(self) -> None:
        """Open the window.

        Raises:
            LaunchError: there is no display.
        """
        if not self._opened:
            open_window(self._title, self._size, self.gone)
            pygame.key.set_repeat(*_REPEAT)
            self._opened = True

    def leave(self) -> None:
        """The user wants the window closed."""
        self.close()

    def close(self) -> None:
        """Close the window. Calling it again does nothing."""
        self.closed = True
        if self._opened:
            self._opened = False
            pygame.display.quit()

    def handle_events(self) -> bool:
        """Answer to what the user did since this was last called; return whether it should be seen at once."""
        seen = False
        for _ in range(_EVENTS):
            try:
                event = pygame.event.poll()
            except SystemError:
                continue  # pygame 2.6 raises it for a gamepad that is gone before it was opened, as by a loose plug
            if event.type == pygame.NOEVENT:
                break
            seen |= self.handle(event)
            if self.closed:
                return False
        return seen

    def handle(self, event: pygame.event.Event) -> bool:
        """Answer to one event; return whether it should be seen at once."""
        match event.type:
            case pygame.KEYDOWN:
                again = event.key in self._down
                self._down.add(event.key)
                return self._key(press_of(event, again=again))
            case pygame.KEYUP:
                self._down.discard(event.key)
            case pygame.MOUSEBUTTONDOWN if event.button == pygame.BUTTON_LEFT:
                self.click(event.pos)
            case pygame.MOUSEBUTTONUP if event.button == pygame.BUTTON_LEFT:
                self.let_go()
            case pygame.MOUSEMOTION:
                self.mouse = event.pos
                return self.drag(event.pos)
            case pygame.MOUSEWHEEL:
                self.scroll(self.mouse or pygame.mouse.get_pos(), -event.y)
            case pygame.WINDOWLEAVE:
                self.mouse = None
            case pygame.WINDOWFOCUSLOST:
                # The release of keys and buttons will not be seen.
                self._down.clear()
                self.let_go()
            case pygame.QUIT:
                self.leave()
            case pygame.VIDEORESIZE | pygame.WINDOWEXPOSED:
                pass
            case _:
                return False
        return True

    def _key(self, press: Press) -> bool:
        # A stop always counts: the release of its key may have been missed.
        counts = press.act in self.repeated or (self.typing and (press.sign or not press.act)) or press.act is Act.STOP
        if press.again and not counts:
            return False
        match press.act:
            case Act.SCREEN:
                toggle_whole_screen()
            case Act.HELP if not self.typing or not press.sign:
                self.help = not self.help
            case Act.PICTURE if not self.typing:
                self._picture = True
            case Act.CLOSE if not self.typing:
                self.leave()
            case _:
                self.press(press)
        return True

    def show(self) -> None:
        """Show what was drawn upon the window's surface, and leave a picture of it if the user wants one."""
        pygame.display.flip()
        window = pygame.display.get_surface()
        if self._picture and window is not None:
            self._picture = False
            self.tell(save_numbered(window, self._pictures))


def display_available() -> bool:
    """True if there is a screen to open a window on. Without one SDL draws into memory, and no one sees it."""
    try:
        pygame.display.init()
    except pygame.error:
        return False
    driver = pygame.display.get_driver()
    pygame.display.quit()
    return driver not in UNSEEN


def open_window(
    title: str, size: tuple[int, int] | None = None, gone: Callable[[], str] = lambda: GONE
) -> pygame.Surface:
    """Open a window that can be resized.

    Args:
        size: in pixels; None fits the screen.
        gone: returns what to print if the display goes away; the process ends after that.

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
    _on_gone[0] = gone
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


_on_gone: Final[list[Callable[[], str]]] = [lambda: GONE]
"""Returns the message about a display that has gone away."""


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
