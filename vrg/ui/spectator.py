"""The spectator's window. It shows the match, and lets a human stop it, halt it, or drive a player."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.regions import Region
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.controls import Controls
from vrg.ui.draw import Painter, save_numbered
from vrg.ui.explaining import Explainer
from vrg.ui.pace import Pace
from vrg.ui.panel import PanelPainter
from vrg.ui.scene import Scene
from vrg.ui.text import Fonts
from vrg.ui.window import UNSEEN, open_window, toggle_whole_screen

FRAME: Final = 1 / 30
"""s of real time between frames."""


def display_available() -> bool:
    """Whether there is a screen to open a window on. Without one SDL draws into memory and nobody sees it."""
    try:
        pygame.display.init()
    except pygame.error:
        return False
    driver = pygame.display.get_driver()
    pygame.display.quit()
    return driver not in UNSEEN


class Spectator(Node):
    """Shows the match in a window. It opens at the first tick; closing it does not end the match.

    Args:
        sizes: length and width of the robots in m, by name.
        obstacles: the ground that the map's walls and obstacles cover, m.
        size: of the window in pixels.
        pictures: the folder where the key P leaves pictures. run: the run folder, from which calls are explained; None
            if it is not on this machine.
        official: False if the user may only watch and stop everything, because this window has no official's seat.

    Raises:
        LaunchError: at the first tick, there is no display.
    """

    kind: ClassVar[str] = "spectator"

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        *,
        sizes: Mapping[str, tuple[float, float]] | None = None,
        obstacles: Sequence[Region] = (),
        size: tuple[int, int] = (1280, 720),
        pictures: Path = Path(),
        run: Path | None = None,
        period: float = FRAME,
        official: bool = True,
    ) -> None:
        super().__init__(name, mailbox, period)
        self._title = f"VRG: {keys.match}"
        self._size = size
        self._pictures = pictures
        self._inlets = SceneInlets(mailbox, keys)
        self._builder = SceneBuilder(sizes=sizes, obstacles=obstacles)
        self._controls = Controls(mailbox, keys, by=name, official=official)
        self._scene = Scene()
        self._window: pygame.Surface | None = None
        self._panel: PanelPainter | None = None
        self._painter: Painter | None = None
        self._explainer = Explainer(run)
        self._pace = Pace(FRAME)
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether the user closed the window: the node need not be ticked any more."""
        return self._closed

    @property
    def scene(self) -> Scene:
        """What the window showed last."""
        return self._scene

    def tick(self, tick: Tick) -> None:
        """Take messages and keys in, publish what the keys ask for, draw at most one frame."""
        if self._closed:
            return
        if self._window is None:
            self._open()
        self._inlets.feed(self._builder)
        players = [player.name for player in self._scene.players]
        asked = self._handle_events(players) | self._explainer.look()
        if self._controls.quit:
            self._close()
            return
        if self._controls.driving is not None and self._controls.driving not in players:
            self._controls.give_back()
        if tick.live:
            self._controls.steer()
        if self._pace.due(tick, self._scene.rate) or asked:
            self._draw(tick)

    def stop(self) -> None:
        """Give the driven player back and close the window. Calling it again does nothing."""
        self._controls.give_back()
        self._explainer.close()
        self._close()

    def _open(self) -> None:
        self._window = open_window(self._title, self._size)
        fonts = Fonts()
        self._panel = PanelPainter(fonts)
        self._painter = Painter(fonts, self._panel)

    def _close(self) -> None:
        self._closed = True
        if self._window is not None:
            self._window = None
            pygame.display.quit()

    def _handle_events(self, players: Sequence[str]) -> bool:
        """Handle the keys, and return whether anything happened that should be seen at once."""
        controls = self._controls
        seen = False
        for event in pygame.event.get():
            match event.type:
                case pygame.KEYDOWN if event.key == pygame.K_ESCAPE and self._explainer.card is not None:
                    self._explainer.close()
                case pygame.MOUSEBUTTONDOWN if event.button == pygame.BUTTON_LEFT:
                    self._click(event.pos)
                case pygame.KEYDOWN:
                    # On most keyboards ? is another key with SHIFT.
                    key = pygame.K_QUESTION if getattr(event, "unicode", "") == "?" else event.key
                    controls.press(key, players, shift=bool(event.mod & pygame.KMOD_SHIFT))
                case pygame.KEYUP:
                    controls.release(event.key)
                case pygame.WINDOWFOCUSLOST:
                    controls.let_go()
                case pygame.QUIT:
                    controls.close()
                case pygame.VIDEORESIZE | pygame.WINDOWEXPOSED:
                    pass
                case _:
                    continue
            seen = True
        if controls.why:
            controls.why = False
            self._explain(self._scene.calls[-1] if self._scene.calls else None)
        return seen

    def _click(self, place: tuple[int, int]) -> None:
        self._explain(None if self._panel is None else self._panel.call_at(place))

    def _explain(self, call: Call | None) -> None:
        """Show why a call was made; None shows the field again."""
        self._explainer.ask(call, self._scene.game)

    def _draw(self, tick: Tick) -> None:
        self._scene = self._builder.build(tick.live)
        window = pygame.display.get_surface()
        if window is None or self._painter is None:
            return
        if self._controls.whole_screen:
            self._controls.whole_screen = False
            toggle_whole_screen()
        self._painter.draw(
            window, self._scene, self._controls.driving, keys=self._controls.help, card=self._explainer.card
        )
        pygame.display.flip()
        if self._controls.picture:
            self._controls.picture = False
            save_numbered(window, self._pictures)
