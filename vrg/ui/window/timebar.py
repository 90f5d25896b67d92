"""The time bar of a replay: a track with a knob for the time that is shown, and a mark for each call."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import pygame

from vrg.ui import palette
from vrg.ui.playback import Playback
from vrg.ui.scene import clock_text
from vrg.ui.timeline import CallMark
from vrg.ui.window import shapes
from vrg.ui.window.text import Face, Fonts

NEAR: Final = 6
"""Pixels from a mark within which the mouse points at it."""
NARROW: Final = 560
"""Pixels; in a narrower window the bar leaves out the time of the end."""


@dataclass(frozen=True)
class TimeBar:
    """The geometry of the bar: the places of its parts, and the time at each pixel.

    Args:
        left, top, width, height: of the whole bar, pixels. ui: scales letters and lengths.
        begin, end: the times at both ends of the track, s.
    """

    left: int
    top: int
    width: int
    height: int
    ui: float
    begin: float
    end: float

    @classmethod
    def below(cls, size: tuple[int, int], ui: float, playback: Playback) -> "TimeBar":
        """The bar at the lower edge of a window of a size in pixels."""
        width, height = size
        own = min(round(64 * ui), height)
        return cls(0, height - own, width, own, ui, playback.begin, playback.end)

    @property
    def area(self) -> pygame.Rect:
        """The whole bar."""
        return pygame.Rect(self.left, self.top, self.width, self.height)

    @property
    def button(self) -> pygame.Rect:
        """The button that pauses and goes on."""
        side = round(34 * self.ui)
        return pygame.Rect(self.left + round(14 * self.ui), self._middle - side // 2, side, side)

    @property
    def track(self) -> pygame.Rect:
        """The line of time; its ends are where the knob can be."""
        left = self.button.right + round((96 if self.width < NARROW else 176) * self.ui)
        right = self.left + self.width - round(76 * self.ui)
        height = max(4, round(6 * self.ui))
        return pygame.Rect(left, self._middle - height // 2, max(1, right - left), height)

    @property
    def _middle(self) -> int:
        return self.top + round(26 * self.ui)

    def x_of(self, time: float) -> int:
        """The pixel of a time, s."""
        lasts = self.end - self.begin
        share = min(max((time - self.begin) / lasts, 0.0), 1.0) if lasts > 0 else 0.0
        return self.track.left + round(share * self.track.width)

    def time_at(self, x: int) -> float:
        """The time, s, at a pixel; beyond the ends of the track that of the end."""
        share = min(max((x - self.track.left) / self.track.width, 0.0), 1.0)
        return self.begin + share * (self.end - self.begin)

    def is_on_track(self, place: tuple[int, int]) -> bool:
        """True if a press of the mouse here takes the knob. More than the thin line counts."""
        reach = round(10 * self.ui)
        track = self.track
        return self.area.collidepoint(place) and track.left - reach <= place[0] <= track.right + reach


class TimeBarPainter:
    """Draws the bar."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts

    def draw(
        self,
        surface: pygame.Surface,
        bar: TimeBar,
        playback: Playback,
        calls: Sequence[CallMark],
        note: str,
        mouse: tuple[int, int] | None,
    ) -> None:
        """Draw it.

        Args:
            calls: what is marked. note: what the user must know of the recording, or empty.
            mouse: the pixel at which the mouse points, or None; where it is on the track, the bar tells what is there.
        """
        ui = bar.ui
        pygame.draw.rect(surface, palette.PANEL, bar.area)
        pygame.draw.line(surface, palette.LINE, bar.area.topleft, (bar.area.right, bar.top))
        self._button(surface, bar, playback)
        words = clock_text(playback.time)
        if bar.width >= NARROW:
            words += f" / {clock_text(playback.end)}"
        self._write(surface, words, (bar.button.right + round(12 * ui), bar.track.centery), ui, Face.MONO)
        self._write(surface, f"×{playback.speed:g}", (bar.track.right + round(22 * ui), bar.track.centery), ui)
        self._track(surface, bar, playback, calls)
        below = note
        if mouse is not None and bar.is_on_track(mouse):
            below = _pointed(bar, mouse[0], calls)
        self._below(surface, bar, below, palette.TEXT if below != note else palette.CAUTION)

    def _write(
        self, surface: pygame.Surface, words: str, left: tuple[int, int], ui: float, face: Face = Face.BOLD
    ) -> None:
        text = self._fonts.render(words, round(15 * ui), palette.TEXT, face)
        surface.blit(text, text.get_rect(midleft=left))

    def _button(self, surface: pygame.Surface, bar: TimeBar, playback: Playback) -> None:
        """Draw what the button does: two bars pause, a triangle goes on."""
        button, unit = bar.button, bar.button.width / 10
        shapes.pill(surface, button, palette.RAISED, radius=button.width // 2)
        x, y = button.center
        if playback.playing:
            for left in (x - 2.2 * unit, x + 0.7 * unit):
                pygame.draw.rect(surface, palette.TEXT, (round(left), round(y - 2 * unit), round(1.5 * unit), 4 * unit))
        else:
            corners = [(x - 1.5 * unit, y - 2.3 * unit), (x + 2.4 * unit, y), (x - 1.5 * unit, y + 2.3 * unit)]
            shapes.polygon(surface, corners, palette.TEXT)

    def _track(self, surface: pygame.Surface, bar: TimeBar, playback: Playback, calls: Sequence[CallMark]) -> None:
        track, ui = bar.track, bar.ui
        knob = (bar.x_of(playback.time), track.centery)
        shapes.pill(surface, track, palette.LINE, radius=track.height // 2)
        done = pygame.Rect(track.left, track.top, knob[0] - track.left, track.height)
        shapes.pill(surface, done, palette.BORDER, radius=track.height // 2)
        # Those that the game wants marked are drawn last, and so above the others.
        for call in sorted(calls, key=lambda call: call.marked):
            reach = round((11 if call.marked else 8) * ui)
            mark = pygame.Rect(0, 0, max(2, round(2.5 * ui)), 2 * reach)
            mark.center = (bar.x_of(call.time), track.centery)
            pygame.draw.rect(surface, palette.CAUTION if call.marked else palette.MUTED, mark)
        shapes.disc(surface, knob, 9 * ui, palette.PANEL)
        shapes.disc(surface, knob, 7 * ui, palette.TEXT)

    def _below(self, surface: pygame.Surface, bar: TimeBar, words: str, colour: tuple[int, int, int]) -> None:
        """Write a line below the track."""
        size, room = round(12 * bar.ui), bar.width - 2 * round(14 * bar.ui)
        left = bar.track.left if self._fonts.width(words, size) <= bar.area.right - bar.track.left else bar.button.left
        text = self._fonts.render(self._fonts.shorten(words, room, size), size, colour)
        surface.blit(text, text.get_rect(bottomleft=(left, bar.area.bottom - round(4 * bar.ui))))


def _pointed(bar: TimeBar, x: int, calls: Sequence[CallMark]) -> str:
    """The time at which the mouse points, and the nearest call."""
    near = [call for call in calls if abs(bar.x_of(call.time) - x) <= NEAR * bar.ui]
    if not near:
        return clock_text(bar.time_at(x))
    call = min(near, key=lambda call: (abs(bar.x_of(call.time) - x), not call.marked))
    return f"{clock_text(call.time)}  {call.text}"
