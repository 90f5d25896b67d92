"""Writes text on a surface, with the same fonts on every machine, wrapped and shortened to fit."""

import importlib.util
import itertools
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Final

import pygame

from vrg.colours import Rgb
from vrg.ui.letters import font_for

RENDERED_LIMIT: Final = 600
"""Rendered texts that are kept; beyond it all of them are forgotten."""


class Face(Enum):
    """The faces of DejaVu Sans, of matplotlib or the system. Where it is missing, pygame's own font replaces them."""

    REGULAR = "DejaVuSans.ttf"
    BOLD = "DejaVuSans-Bold.ttf"
    MONO = "DejaVuSansMono-Bold.ttf"


class Fonts:
    """Keeps fonts by size, and what was written with them lately."""

    def __init__(self) -> None:
        pygame.font.init()
        self._fonts: dict[tuple[Face, int], pygame.font.Font] = {}
        self._others: dict[tuple[Path, int], pygame.font.Font] = {}
        self._rendered: dict[tuple[str, Face, int, Rgb], pygame.Surface] = {}

    def font(self, size: int, face: Face = Face.REGULAR) -> pygame.font.Font:
        """The font of a face at `size` pixels."""
        if (face, size) not in self._fonts:
            self._fonts[face, size] = pygame.font.Font(_file(face), size)
        return self._fonts[face, size]

    def render(self, text: str, size: int, colour: Rgb, face: Face = Face.REGULAR) -> pygame.Surface:
        """Write the text in one line upon a transparent surface. That surface is kept: do not draw upon it."""
        key = (text, face, size, colour)
        surface = self._rendered.get(key)
        if surface is None:
            if len(self._rendered) >= RENDERED_LIMIT:
                self._rendered.clear()
            surface = _joined([font.render(part, True, colour) for part, font in self._parts(text, size, face)])
            self._rendered[key] = surface
        return surface

    def width(self, text: str, size: int, face: Face = Face.REGULAR) -> int:
        """Pixels that the text takes in one line."""
        return sum(font.size(part)[0] for part, font in self._parts(text, size, face))

    def _parts(self, text: str, size: int, face: Face) -> list[tuple[str, pygame.font.Font]]:
        """A text in parts, each with the font that has its letters."""
        text = text.replace("\0", " ")  # the one character that SDL cannot write
        if text.isascii():
            return [(text, self.font(size, face))]
        return [
            ("".join(letters), self.font(size, face) if other is None else self._other(other, size))
            for other, letters in itertools.groupby(text, lambda letter: self._instead(letter, size, face))
        ]

    def _instead(self, letter: str, size: int, face: Face) -> Path | None:
        """The font for a letter that the font of a face has not; None if it has it, or no font has."""
        # Whether it has it this font knows itself, in no time.
        return None if letter.isspace() or self.font(size, face).metrics(letter)[0] is not None else font_for(letter)

    def _other(self, path: Path, size: int) -> pygame.font.Font:
        font = self._others.get((path, size))
        if font is None:
            font = self._others[path, size] = pygame.font.Font(str(path), size)
        return font

    def shorten(self, text: str, width: int, size: int, face: Face = Face.REGULAR) -> str:
        """The text, or as much of its beginning as fits into `width` pixels with an ellipsis."""
        if self.width(text, size, face) <= width:
            return text
        while text and self.width(text + "…", size, face) > width:
            text = text[:-1]
        return text.rstrip() + "…" if text else ""

    def shorten_middle(self, text: str, width: int, size: int, face: Face = Face.REGULAR) -> str:
        """The text, or its beginning and its last three letters with an ellipsis between, in `width` pixels."""
        if self.width(text, size, face) <= width:
            return text
        head, tail = text[:-3], text[-3:]
        while head and self.width(f"{head}…{tail}", size, face) > width:
            head = head[:-1]
        return f"{head}…{tail}"

    def wrap(self, text: str, width: int, size: int, face: Face = Face.REGULAR, lines: int = 100) -> list[str]:
        """The text in lines of at most `width` pixels; what exceeds `lines` is cut with an ellipsis."""
        wrapped: list[str] = []
        line = ""
        for word in text.split():
            longer = f"{line} {word}" if line else word
            if line and self.width(longer, size, face) > width:
                wrapped.append(line)
                line = word
            else:
                line = longer
        if line:
            wrapped.append(line)
        if len(wrapped) > lines:
            wrapped = [*wrapped[: lines - 1], " ".join(wrapped[lines - 1 :])]
        return [self.shorten(line, width, size, face) for line in wrapped]


def _joined(parts: list[pygame.Surface]) -> pygame.Surface:
    """Surfaces side by side, each in the middle of the height."""
    if len(parts) == 1:
        return parts[0]
    height = max(part.get_height() for part in parts)
    joined = pygame.Surface((sum(part.get_width() for part in parts), height), pygame.SRCALPHA)
    x = 0
    for part in parts:
        joined.blit(part, (x, (height - part.get_height()) // 2))
        x += part.get_width()
    return joined


@cache
def _file(face: Face) -> str | None:
    """The font file of a face: matplotlib's, or one that is installed; None if there is none."""
    # Found without importing matplotlib, which takes longer than to open the window.
    spec = importlib.util.find_spec("matplotlib")
    if spec is not None and spec.submodule_search_locations:
        path = Path(spec.submodule_search_locations[0], "mpl-data", "fonts", "ttf", face.value)
        if path.is_file():
            return str(path)
    found = pygame.font.match_font(face.value.partition("-")[0].removesuffix(".ttf"), bold="Bold" in face.value)
    return found if found and Path(found).name == face.value else None  # not a condensed face, which it may take for it
