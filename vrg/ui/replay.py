"""The window of a replay. It shows a recorded match as the spectator's window shows a running one, with a time bar."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

import pygame

from vrg.bus.messages import Call
from vrg.ui.branching import Brancher, Taken
from vrg.ui.draw import Painter, scale_of
from vrg.ui.overlay import Overlay
from vrg.ui.panel import PanelPainter
from vrg.ui.playback import Playback
from vrg.ui.scene import Scene
from vrg.ui.text import Fonts
from vrg.ui.timebar import TimeBar, TimeBarPainter
from vrg.ui.timeline import Timeline
from vrg.ui.view import View
from vrg.ui.window import open_window, toggle_whole_screen

FRAMES: Final = 40
"""Frames in a second of real time, at most."""
LONGEST: Final = 0.25
"""s of real time that a frame counts for at most."""

KEYS: Final = (
    ("SPACE", "pause, go on"),
    (".", "one step on"),
    (",", "one step back"),
    ("UP +", "faster"),
    ("DOWN -", "slower"),
    ("RIGHT", "5 s on"),
    ("LEFT", "5 s back"),
    ("W", "why the last call"),
    ("F", "from here on"),
    ("N", "next call"),
    ("P", "previous call"),
    ("HOME", "to the start"),
    ("END", "to the end"),
    ("F11", "whole screen"),
    ("?", "these keys"),
    ("Q", "close window"),
)

MOVES: Final[dict[int, Callable[[Playback], Playback]]] = {
    pygame.K_SPACE: Playback.toggle,
    pygame.K_UP: Playback.faster,
    pygame.K_DOWN: Playback.slower,
    pygame.K_KP_PLUS: Playback.faster,
    pygame.K_KP_MINUS: Playback.slower,
    pygame.K_RIGHT: Playback.skip_on,
    pygame.K_LEFT: Playback.skip_back,
    pygame.K_n: Playback.next_call,
    pygame.K_p: Playback.previous_call,
    pygame.K_HOME: Playback.to_begin,
    pygame.K_END: Playback.to_end,
}
"""What the keys do that are in the same place on every keyboard, or have a letter."""
SIGNS: Final[dict[str, Callable[[Playback], Playback]]] = {
    ".": Playback.step_on,
    ",": Playback.step_back,
    "+": Playback.faster,
    "=": Playback.faster,
    "-": Playback.slower,
}
"""What signs do, which are on other keys on other keyboards. On many, = is + without SHIFT."""
HELD: Final = (pygame.K_RIGHT, pygame.K_LEFT, pygame.K_PERIOD, pygame.K_COMMA)
"""The keys that go on while they are held down."""
_REPEAT: Final = (400, 60)
"""ms of real time until a key that is held counts again, and between the times after that."""


class ReplayWindow:
    """Shows a recorded match.

    Args:
        timeline: of the match. title: of the window.
        note: what the user must know of the recording, in a sentence; empty if there is nothing.
        size: of the window in pixels. run: the run folder, from which calls are explained; None explains none.
        brancher: what takes the match up from an instant; None if nothing can.

    Attributes:
        note: as given.
        playback: where the replay stands.
        scene: what the window showed last. view: where on the field its pixels were, or None before that.
        closed: whether the user closed the window.
    """

    def __init__(
        self,
        timeline: Timeline,
        *,
        title: str,
        note: str = "",
        size: tuple[int, int] = (1280, 720),
        run: Path | None = None,
        brancher: Brancher | None = None,
    ) -> None:
        self.playback = _playback(timeline)
        self.scene = Scene()
        self.view: View | None = None
        self.closed = False
        self._timeline = timeline
        self._title = title
        self.note = note
        self._size = size
        self._help = False
        self._mouse: tuple[int, int] | None = None
        self._drawn: tuple[object, ...] = ()
        self._down: set[int] = set()
        fonts = Fonts()
        self._panel = PanelPainter(fonts, KEYS)
        self._painter = Painter(fonts, self._panel, hints=False)
        self._overlay = Overlay(run, brancher)
        self._bar_painter = TimeBarPainter(fonts)

    def open(self) -> None:
        """Open the window.

        Raises:
            LaunchError: there is no display.
        """
        open_window(self._title, self._size)
        pygame.key.set_repeat(*_REPEAT)

    def close(self) -> None:
        """Close the window. Calling it again does nothing."""
        self.closed = True
        self._overlay.close()
        pygame.display.quit()

    @property
    def bar(self) -> TimeBar:
        """The time bar as it is in the window now."""
        size = pygame.display.get_window_size()
        return TimeBar.below(size, scale_of(*size), self.playback)

    def frame(self, seconds: float) -> None:
        """Handle what the user did, go on by `seconds` of real time, and draw what has changed."""
        for event in pygame.event.get():
            self._handle(event)
            if self.closed:
                return
        self.playback = self.playback.advance(seconds)
        window = pygame.display.get_surface()
        taken = self._overlay.look()
        if taken is not None:
            self._show(taken)
        shown = (self.playback, self._help, self._mouse, window and window.get_size(), self._overlay.card, self.note)
        if window is not None and shown != self._drawn:
            self._drawn = shown
            self._draw(window)

    def _handle(self, event: pygame.event.Event) -> None:
        match event.type:
            case pygame.QUIT:
                self.close()
            case pygame.KEYDOWN:
                again = event.key in self._down
                self._down.add(event.key)
                if not again or event.key in HELD:
                    self._press(event.key, getattr(event, "unicode", ""))
            case pygame.KEYUP:
                self._down.discard(event.key)
            case pygame.MOUSEBUTTONDOWN if event.button == pygame.BUTTON_LEFT:
                self._click(event.pos)
            case pygame.MOUSEBUTTONUP if event.button == pygame.BUTTON_LEFT:
                self.playback = self.playback.release()
            case pygame.MOUSEMOTION:
                self._mouse = event.pos
                self.playback = self.playback.drag(self.bar.time_at(event.pos[0]))
            case pygame.WINDOWLEAVE:
                self._mouse = None
            case pygame.WINDOWFOCUSLOST:
                # The release of keys and buttons will not be seen.
                self._down.clear()
                self.playback = self.playback.release()
            case pygame.WINDOWEXPOSED:
                self._drawn = ()

    def _press(self, key: int, sign: str) -> None:
        if self._overlay.press(key):
            return
        move = SIGNS.get(sign) or MOVES.get(key)
        if move is not None:
            self.playback = move(self.playback)
        elif sign == "?" or key == pygame.K_F1:
            self._help = not self._help
        elif key == pygame.K_q:
            self.close()
        elif key == pygame.K_w:
            self._explain(self.scene.calls[-1] if self.scene.calls else None)
        elif key == pygame.K_f:
            self._pause()
            self._overlay.choose(self.playback.time)
        elif key == pygame.K_ESCAPE:
            self._explain(None)
        elif key == pygame.K_F11:
            toggle_whole_screen()

    def _click(self, place: tuple[int, int]) -> None:
        bar = self.bar
        if bar.button.collidepoint(place):
            self.playback = self.playback.toggle()
        elif bar.is_on_track(place):
            self.playback = self.playback.grab(bar.time_at(place[0]))
        else:
            self._explain(self._panel.call_at(place))

    def _explain(self, call: Call | None) -> None:
        """Show why a call was made; None shows the field again."""
        if call is None:
            self._overlay.close()
            return
        self._pause()
        self._overlay.explain(call, self.scene.game)

    def _pause(self) -> None:
        if self.playback.playing:
            self.playback = self.playback.toggle()

    def _show(self, taken: Taken) -> None:
        """Show a match that was taken up, from that instant on."""
        self._timeline, self.note = taken.timeline, taken.note
        playback = _playback(taken.timeline).to(self._overlay.begun)
        self.playback = replace(playback, speed=self.playback.speed)

    def _draw(self, window: pygame.Surface) -> None:
        self.scene = self._timeline.at(self.playback.time, self.playback.speed)
        bar = self.bar
        above = window.subsurface((0, 0, window.get_width(), max(1, bar.top)))
        self.view = self._painter.draw(above, self.scene, keys=self._help, card=self._overlay.card)
        self._bar_painter.draw(window, bar, self.playback, self._timeline.calls, self.note, self._mouse)
        pygame.display.flip()


def _playback(timeline: Timeline) -> Playback:
    return Playback.of(timeline.instants, [call.time for call in timeline.calls], timeline.end)


def show(window: ReplayWindow) -> None:
    """Show a replay in real time until its user closes it.

    Raises:
        LaunchError: there is no display.
    """
    window.open()
    clock = pygame.time.Clock()
    try:
        while not window.closed:
            # After the computer has slept, the match does not jump.
            window.frame(min(clock.tick(FRAMES) / 1000, LONGEST))
    finally:
        window.close()
