"""Pictures of scenes that no window shows."""

import pygame

from vrg.ui.draw import Painter
from vrg.ui.scene import Scene


class Still:
    """Draws scenes as the spectator's window shows them. It needs no display.

    Args:
        size: of the pictures, pixels.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._surface = pygame.Surface(size)
        self._painter = Painter()

    def rgb(self, scene: Scene) -> bytes:
        """Draw a scene, and return the red, green and blue of each pixel, row by row from the top."""
        self._painter.draw(self._surface, scene)
        return pygame.image.tobytes(self._surface, "RGB")
