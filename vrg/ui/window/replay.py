"""The window of a replay. It shows a recorded match as the spectator's window shows a running one, with a time bar."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import ClassVar, Final

import pygame

from vrg.bus.messages import Call
from vrg.ui import palette
from vrg.ui.acts import Act, Press
from vrg.ui.banner import Help
from vrg.ui.branching import Brancher, Taken
from vrg.ui.playback import Playback
from vrg.ui.timeline import Timeline
from vrg.ui.view import Projection
from vrg.ui.window.draw import letter_scale
from vrg.ui.window.explaining import Card, Explain
from vrg.ui.window.overlay import Overlay
from vrg.ui.window.text import Fonts
from vrg.ui.window.timebar import TimeBar, TimeBarPainter
from vrg.ui.window.window import open_window
from vrg.ui.window.window_base import Window

FRAMES: Final = 40
"""Frames in a second of real time, at most."""
MAX_FRAME_TIME: Final = 0.25
"""s of real time that a frame counts for at most."""

MOVES: Final[dict[Act, Callable[[Playback], Playback]]] = {
    Act.PAUSE: Playback.toggle,
    Act.STEP: Playback.step_on,
    Act.STEP_BACK: Playback.step_back,
    Act.FASTER: Playback.faster,
    Act.SLOWER: Playback.slower,
    Act.NEXT_CALL: Playback.next_call,
    Act.PREVIOUS_CALL: Playback.previous_call,
    Act.BEGIN: Playback.to_begin,
    Act.END: Playback.to_end,
}
ARROWS: Final[dict[int, Callable[[Playback], Playback]]] = {
    pygame.K_UP: Playback.faster,
    pygame.K_DOWN: Playback.slower,
    pygame.K_RIGHT: Playback.skip_on,
    pygame.K_LEFT: Playback.skip_back,
}
"""The meanings of the arrows, as there is no robot to steer."""
OPENING: Final = "opening the replay …"
OVER: Final = "HOME watches it again, any key hides this"
STAYS: Final = (Act.PICTURE, Act.SCREEN, Act.HELP, Act.CLOSE)
"""The acts that leave the result of the match where it is."""
NO_STOP: Final = "SPACE is the emergency stop of a match that runs: here K pauses"


class ReplayWindow(Window):
    """Shows a recorded match.

    Args:
        timeline: of the match. title: of the window.
        note: what the user must know of the recording, in a sentence; empty if there is nothing.
        size: of the window in pixels; None fits the screen.
        run: the run folder, for pictures that the user takes. explain: works out why a call was made.
        brancher: what takes the match up from an instant; None if nothing can.

    Attributes:
        note: as given.
        playback: where the replay stands.
        view: where on the field the pixels of its last frame were, or None before that.
    """

    repeated = frozenset({Act.STEP, Act.STEP_BACK, Act.STEER})
    meanings: ClassVar = {Act.STEER: "5 s on or back, speed"}

    def __init__(
        self,
        timeline: Timeline,
        *,
        title: str,
        note: str = "",
        size: tuple[int, int] | None = None,
        run: Path | None = None,
        explain: Explain | None = None,
        brancher: Brancher | None = None,
    ) -> None:
        super().__init__(title, size, run, explain)
        self.playback = _playback(timeline)
        self.view: Projection | None = None
        self.note = note
        self._timeline = timeline
        self._drawn: tuple[object, ...] = ()
        self._overlay = Overlay(brancher)
        fonts = Fonts()
        self.show_calls(fonts, Help.NONE)
        self._bar_painter = TimeBarPainter(fonts)
        self.acts |= {act: partial(self._move, move) for act, move in MOVES.items()}
        self.acts |= {Act.STEER: self._skip, Act.BRANCH: self._choose, Act.LEAVE: lambda _: self.explain(None)}
        self.unlisted = (Act.STOP,)

    def close(self) -> None:
        """Close the window. Calling it again does nothing."""
        self._overlay.close()
        super().close()

    @property
    def bar(self) -> TimeBar:
        """The time bar as it is in the window now."""
        size = pygame.display.get_window_size()
        return TimeBar.below(size, letter_scale(*size), self.playback)

    def frame(self, seconds: float) -> None:
        """Handle what the user did, go on by `seconds` of real time, and draw what has changed."""
        if self.handle_events():
            self._drawn = ()
        if self.closed:
            return
        self.playback = self.playback.advance(seconds)
        window = pygame.display.get_surface()
        self.explainer.look()
        taken = self._overlay.look()
        if taken is not None:
            self._show(taken)
        shown = (self.playback, self.card, self.note, self.notice)
        if window is not None and shown != self._drawn:
            self._drawn = shown
            self._draw(window)
            self.show()

    @property
    def card(self) -> Card | None:
        """What is shown over the field; None if nothing is."""
        return self._overlay.card or super().card

    def takes(self, press: Press) -> bool:
        """Take a key by which a match is being taken up. Most others put the result away."""
        self.shows_result &= press.act in STAYS
        return (not press.again or press.act in self.repeated) and self._overlay.press(press.key)

    def emergency_stop(self, _press: Press) -> None:
        """Tell that nothing moves here."""
        self.notice = NO_STOP

    def click(self, place: tuple[int, int]) -> None:
        """Pause, take the knob of the time bar, or explain the call at a pixel."""
        bar = self.bar
        if bar.button.collidepoint(place):
            self.playback = self.playback.toggle()
        elif bar.is_on_track(place):
            self.playback = self.playback.grab(bar.time_at(place[0]))
        else:
            super().click(place)

    def drag(self, place: tuple[int, int]) -> bool:
        """Move the knob of the time bar, if it is held."""
        self.playback = self.playback.drag(self.bar.time_at(place[0]))
        return True

    def let_go(self) -> None:
        """Let go of the knob of the time bar."""
        self.playback = self.playback.release()

    def explain(self, call: Call | None) -> None:
        """Show why a call was made, in place of all else, while the match stands; None shows the field again."""
        self._overlay.close()
        if call is not None:
            self._pause()
        super().explain(call)

    def _move(self, move: Callable[[Playback], Playback], _press: Press) -> None:
        self.playback = move(self.playback)

    def _skip(self, press: Press) -> None:
        if not (press.again and press.key in (pygame.K_UP, pygame.K_DOWN)):
            self._move(ARROWS[press.key], press)

    def _choose(self, _press: Press) -> None:
        self.explain(None)
        self._pause()
        self._overlay.choose(self.playback.time)

    def _pause(self) -> None:
        if self.playback.playing:
            self.playback = self.playback.toggle()

    def _show(self, taken: Taken) -> None:
        """Show a match that was taken up, from that instant on."""
        self._timeline, self.note, self.explainer.explain = taken.timeline, taken.note, taken.explain
        playback = _playback(taken.timeline).to(self._overlay.begun)
        self.playback = replace(playback, speed=self.playback.speed)

    def _draw(self, window: pygame.Surface) -> None:
        self.scene = self._timeline.at(self.playback.time, self.playback.speed)
        bar = self.bar
        above = window.subsurface((0, 0, window.get_width(), max(1, bar.top)))
        self.view = self.paint(above, over=OVER)
        self._bar_painter.draw(window, bar, self.playback, self._timeline.calls, self.note, self.mouse)


def _playback(timeline: Timeline) -> Playback:
    return Playback.of(timeline.instants, [call.time for call in timeline.calls], timeline.end)


def title_of(match: str) -> str:
    """The title of the window in which a match of this name is shown again."""
    return f"VRG: {match}, recorded"


def hold_place(match: str) -> None:
    """Open the window in which a match of this name will be shown again, with words that it is being opened.

    Raises:
        LaunchError: there is no display.
    """
    window = open_window(title_of(match))
    window.fill(palette.BACKGROUND)
    text = Fonts().render(OPENING, round(28 * letter_scale(*window.get_size())), palette.TEXT)
    window.blit(text, text.get_rect(center=window.get_rect().center))
    pygame.display.flip()
    # Not every window manager has shown it by now.
    pygame.event.pump()
    pygame.display.flip()


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
            window.frame(min(clock.tick(FRAMES) / 1000, MAX_FRAME_TIME))
    finally:
        window.close()
