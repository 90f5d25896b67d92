"""Draws the head of a window: what the match is about or what must not be overlooked, the score with its reason, the
clock; and the card that tells how a game has ended."""

from typing import Final

import pygame
from pygame import Rect

from vrg.bus.messages import Stage
from vrg.games.game import capitalised
from vrg.ui import palette
from vrg.ui.banner import Banner, Help, banners
from vrg.ui.headline import Headline, headline, result_lines, winner_words
from vrg.ui.palette import ink_on
from vrg.ui.scene import Scene
from vrg.ui.window import kit, shapes
from vrg.ui.window.ground import strip_height
from vrg.ui.window.text import Face, Fonts

HEIGHT: Final = 88
"""The height of the head in pixels at the usual size of a window. It stays the same, so that the field never moves."""
_SHARES: Final = (0.47, 0.38, 0.15)
"""The parts of the width for the words, the score and the clock."""
_LINES: Final = 6
"""The most lines of a banner, which then covers a part of what is below the head."""
_TIGHT: Final = 0.84
"""By how much the lines of a banner are brought closer where that lets it fit into the head."""


class HeaderPainter:
    """Draws the head of a window.

    Args:
        fonts: to write with. help_: how those who look at it can help.
    """

    def __init__(self, fonts: Fonts, help_: Help) -> None:
        self._fonts = fonts
        self._help = help_

    def draw(self, surface: pygame.Surface, area: Rect, scene: Scene, ui: float, *, result: bool = True) -> None:
        """Draw the head into an area. A banner with many lines reaches below it.

        Args:
            result: False where the result of a game that is over stands elsewhere.
        """
        pygame.draw.rect(surface, palette.PANEL, area)
        pygame.draw.line(surface, palette.LINE, area.bottomleft, area.bottomright)
        head, gap = headline(scene), round(10 * ui)
        inside = area.inflate(-2 * gap, -gap)
        if area.width < 700 * ui:
            words, score, clock = kit.row(inside, (0.0, 0.7, 0.3), gap)
        else:
            words, score, clock = kit.row(inside, _SHARES, gap)
        if scene.stage is not None:
            self._clock(surface, clock, head, ui)
            self._score(surface, score, head, ui)
        found = banners(scene, self._help) if result or scene.stage is not Stage.GAME_OVER else []
        grave = [banner for banner in found if not banner.brief]
        if grave:
            self._banner(surface, words if words.width > 1 else inside, grave, ui)
        elif words.width > 1:
            self._words(surface, words, head, found, ui)

    def _words(self, surface: pygame.Surface, place: Rect, head: Headline, news: list[Banner], ui: float) -> None:
        fonts, size = self._fonts, round(21 * ui)
        room = place.width - fonts.width(head.stage, round(13 * ui), Face.BOLD) - round(30 * ui)
        words = fonts.shorten(head.title, room, size, Face.BOLD)
        title = fonts.render(words, size, palette.TEXT, Face.BOLD)
        surface.blit(title, (place.left, place.top + round(2 * ui)))
        if head.stage:
            at = (place.left + title.get_width() + round(10 * ui), place.top + round(3 * ui))
            kit.chip(surface, at, head.stage, head.colour, ui, fonts)
        lines, colour = head.about, palette.TEXT
        if news:
            more = f" and {len(news[0].lines) - 1} more" if len(news[0].lines) > 1 else ""
            lines, colour = f"{news[0].heading}: {news[0].lines[0]}{more}", palette.CAUTION
        y = place.top + round(34 * ui)
        for line in fonts.wrap(lines, place.width, round(14 * ui), lines=2):
            surface.blit(fonts.render(line, round(14 * ui), colour), (place.left, y))
            y += round(19 * ui)

    def _banner(self, surface: pygame.Surface, place: Rect, grave: list[Banner], ui: float) -> None:
        fonts, size = self._fonts, round(14 * ui)
        first, rest = grave[0], grave[1:]
        texts = [*first.lines, *(f"{banner.heading}: {banner.text}" for banner in rest)]
        room = place.width - round(24 * ui)
        steps = [line for text in first.steps for line in fonts.wrap(text, room, size, Face.BOLD, lines=1)]
        lines = [line for text in texts for line in fonts.wrap(text, room, size, lines=2)][: _LINES - len(steps)]
        step, head = round(18 * ui), round(30 * ui)
        plate = Rect(place.left, place.top, place.width, 0)
        # The steps to take stand beside each other, so that they need one line.
        whole = "   ".join(steps)
        steps = [whole] if fonts.width(whole, size, Face.BOLD) <= room else steps
        plate.height = head + step * (len(lines) + len(steps)) + round(8 * ui)
        heading = fonts.shorten(first.heading, room, round(20 * ui), Face.BOLD)
        beside = fonts.width(heading, round(20 * ui), Face.BOLD) + round(14 * ui)
        reason = ""
        if plate.height > place.height and lines and beside + fonts.width(lines[0], size) <= room:
            reason, plate.height = lines.pop(0), plate.height - step
        tight = round(_TIGHT * step)
        if plate.height > place.height >= head + tight * (len(lines) + len(steps)):
            # One line too many makes all of them closer, so that the plate does not hang out of the head.
            step, plate.height = tight, place.height
        plate.height = max(place.height, plate.height)
        shapes.pill(surface, plate, first.colour, radius=round(8 * ui))
        ink = ink_on(first.colour)
        x, y = plate.left + round(12 * ui), plate.top + round(5 * ui)
        surface.blit(fonts.render(heading, round(20 * ui), ink, Face.BOLD), (x, y))
        surface.blit(fonts.render(reason, size, ink), (x + beside, y + round(5 * ui)))
        y += head - round(4 * ui)
        for line, face in [*((line, Face.REGULAR) for line in lines), *((line, Face.BOLD) for line in steps)]:
            surface.blit(fonts.render(fonts.shorten(line, room, size, face), size, ink, face), (x, y))
            y += step

    def _score(self, surface: pygame.Surface, place: Rect, head: Headline, ui: float) -> None:
        """Draw what decides: the scores on plates in the teams' colours, or the count that stands for them."""
        fonts, size = self._fonts, round(15 * ui)
        high = round(38 * ui)
        if head.count:
            text = fonts.render(fonts.shorten(head.count, place.width, round(24 * ui), Face.BOLD), round(24 * ui),
                                palette.TEXT, Face.BOLD)  # fmt: skip
            surface.blit(text, text.get_rect(midleft=(place.left, place.top + high // 2)))
        elif head.teams:
            plates = kit.row(Rect(place.left, place.top, place.width, high), (1.0,) * len(head.teams), round(8 * ui))
            for team, plate in zip(head.teams, plates, strict=True):
                shapes.pill(surface, plate, team.colour, radius=round(6 * ui))
                ink, pad = ink_on(team.colour), round(12 * ui)
                points = fonts.render(str(team.points), round(28 * ui), ink, Face.BOLD)
                surface.blit(points, points.get_rect(midright=(plate.right - pad, plate.centery)))
                room = plate.inflate(-2 * pad, 0)
                room.width -= points.get_width() + pad
                kit.write(surface, team.team, room, round(17 * ui), ink, fonts, Face.BOLD)
                room.left += fonts.width(team.team, round(17 * ui), Face.BOLD) + pad
                if fonts.width(team.counts, round(13 * ui)) <= plate.right - pad - points.get_width() - pad - room.left:
                    kit.write(surface, team.counts, room, round(13 * ui), ink, fonts)
        below = Rect(place.left, place.top + high + round(2 * ui), place.width, round(19 * ui))
        for line, colour, face in (
            (head.reason, palette.TEXT, Face.REGULAR),
            (capitalised(head.drama), palette.CAUTION, Face.BOLD),
        ):
            if line:
                kit.write(surface, line, below, size, colour, fonts, face)
                below.top += below.height

    def _clock(self, surface: pygame.Surface, place: Rect, head: Headline, ui: float) -> None:
        text = self._fonts.render(head.clock, round(36 * ui), palette.TEXT, Face.MONO)
        surface.blit(text, text.get_rect(topright=(place.right, place.top)))
        words = self._fonts.render(head.left or head.timed, round(13 * ui), palette.MUTED)
        surface.blit(words, words.get_rect(topright=(place.right, place.top + round(44 * ui))))


class ResultPainter:
    """Draws the card that tells how a game has ended, with a picture of the moment that brought it nearest to its end.

    Args:
        fonts: to write with.
    """

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._moment: tuple[int, str, pygame.Surface] | None = None

    def remember(self, surface: pygame.Surface, area: Rect, scene: Scene, ui: float) -> None:
        """Keep a picture of the field in an area if a call that counts has just been made."""
        call = scene.reason
        if call is not None and (self._moment is None or self._moment[0] != call.number):
            shown = surface.subsurface(area.clip(surface.get_rect()))
            shown = shown.subsurface((0, 0, shown.get_width(), max(1, shown.get_height() - strip_height(ui))))
            small = pygame.transform.smoothscale(shown, (shown.get_width() // 2, shown.get_height() // 2))
            self._moment = call.number, headline(scene).reason, small

    def draw(self, surface: pygame.Surface, area: Rect, scene: Scene, hint: str, ui: float) -> Rect:
        """Draw the card in the middle of an area, with a hint of what can be done; return where it is."""
        fonts, pad = self._fonts, round(18 * ui)
        heading, colour = winner_words(scene)
        width = min(area.width - 2 * pad, round(700 * ui))
        lines = [line for text in result_lines(scene) for line in fonts.wrap(text, width - 2 * pad, round(16 * ui))]
        step, top = round(23 * ui), round(70 * ui)
        room = area.height - top - step * (len(lines) + 2) - 5 * pad
        picture = self._picture(width - 2 * pad, min(room, round(340 * ui)))
        high = 0 if picture is None else picture.get_height() + step
        card = Rect(0, 0, width, top + step * len(lines) + high + step + 2 * pad)
        card.center = area.center
        kit.plate(surface, card, ui)
        plate = Rect(card.left, card.top, card.width, top)
        shapes.pill(surface, plate, colour, radius=round(10 * ui))
        size = round(40 * ui)
        while size > 12 and fonts.width(heading, size, Face.BOLD) > plate.width - 2 * pad:
            size -= 1
        text = fonts.render(heading, size, ink_on(colour), Face.BOLD)
        surface.blit(text, text.get_rect(center=plate.center))
        y = plate.bottom + pad
        for line in lines:
            text = fonts.render(line, round(16 * ui), palette.TEXT)
            surface.blit(text, text.get_rect(midtop=(card.centerx, y)))
            y += step
        if picture is not None and self._moment is not None:
            where = surface.blit(picture, picture.get_rect(midtop=(card.centerx, y)))
            pygame.draw.rect(surface, palette.LINE, where, 1)
            text = fonts.render(fonts.shorten(self._moment[1], width - 2 * pad, round(13 * ui)), round(13 * ui),
                                palette.MUTED)  # fmt: skip
            surface.blit(text, text.get_rect(midtop=(card.centerx, where.bottom + round(4 * ui))))
        text = fonts.render(hint, round(14 * ui), palette.CAUTION)
        surface.blit(text, text.get_rect(midbottom=(card.centerx, card.bottom - pad // 2)))
        return card

    def _picture(self, width: int, height: int) -> pygame.Surface | None:
        if self._moment is None or height < 60:
            return None
        picture = self._moment[2]
        scale = min(width / picture.get_width(), height / picture.get_height())
        size = (max(1, round(picture.get_width() * scale)), max(1, round(picture.get_height() * scale)))
        return pygame.transform.smoothscale(picture, size)
