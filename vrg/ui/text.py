"""Writes text on a surface, with the same fonts on every machine, wrapped and shortened to fit."""

import importlib.util
from enum import Enum
from pathlib import Path
from typing import Final

import pygame

from vrg.colours import Rgb

RENDERED_LIMIT: Final = 600
"""Rendered texts that are kept; beyond it all of them are forgotten."""


class Face(Enum):
    """The faces of DejaVu Sans, which matplotlib carries. Without it, pygame's own font replaces them all."""

    REGULAR = "DejaVuSans.ttf"
    BOLD = "DejaVuSans-Bold.ttf"
    MONO = "DejaVuSansMono-Bold.ttf"


class Fonts:
    """Keeps fonts by size, and what was written with them lately."""

    def __init__(self) -> None:
        pygame.font.init()
        self._folder = _folder()
        self._fonts: dict[tuple[Face, int], pygame.font.Font] = {}
        self._rendered: dict[tuple[str, Face, int, Rgb], pygame.Surface] = {}

    def font(self, size: int, face: Face = Face.REGULAR) -> pygame.font.Font:
        """The font of a face at `size` pixels."""
        font = self._fonts.get((face, size))
        if font is None:
            path = self._folder / face.value if self._folder is not None else None
            usable = path is not None and path.is_file()
            font = pygame.font.Font(str(path) if usable else None, size)
            self._fonts[face, size] = font
        return font

    def render(self, text: str, size: int, colour: Rgb, face: Face = Face.REGULAR) -> pygame.Surface:
        """Write the text in one line upon a transparent surface. That surface is kept: do not draw upon it."""
        key = (text, face, size, colour)
        surface = self._rendered.get(key)
        if surface is None:
            if len(self._rendered) >= RENDERED_LIMIT:
                self._rendered.clear()
            # A null character is the one that SDL cannot write.
            surface = self.font(size, face).render(text.replace("\0", " "), True, colour)
            self._rendered[key] = surface
        return surface

    def width(self, text: str, size: int, face: Face = Face.REGULAR) -> int:
        """Pixels that the text takes in one line."""
        return self.font(size, face).size(text.replace("\0", " "))[0]

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


def _folder() -> Path | None:
    # Found without importing matplotlib, which takes longer than to open the window.
    spec = importlib.util.find_spec("matplotlib")
    if spec is None or not spec.submodule_search_locations:
        return None
    return Path(spec.submodule_search_locations[0]) / "mpl-data" / "fonts" / "ttf"
