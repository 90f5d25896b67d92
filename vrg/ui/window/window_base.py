"""The base of all windows: a key or a button that goes down is looked up once, in the window's table of acts."""

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Final

import pygame

from vrg.bus.messages import Call, Stage
from vrg.ui.acts import Act, Press
from vrg.ui.banner import Help
from vrg.ui.scene import Scene
from vrg.ui.view import Projection
from vrg.ui.window.draw import Painter
from vrg.ui.window.explaining import Card, Explain, Explainer
from vrg.ui.window.pads import Pads
from vrg.ui.window.panel import PanelPainter
from vrg.ui.window.text import Fonts
from vrg.ui.window.window import open_window, save_numbered, toggle_whole_screen

_EVENTS: Final = 1000
"""The most events that are answered to before the next frame."""


class Window:
    """A window of SDL. A process has one at a time. A subclass draws it, and adds to its table what its user can do.

    Args:
        title: of the window. size: in pixels; None fits the screen.
        pictures: the folder where the key P leaves pictures.
        explain: works out why a call was made; None if what the run has left is not on this machine.

    Attributes:
        acts: what answers to each act. `?` lists those of them that have a key and are not `unlisted`.
        meanings: what a key does here, where that differs from the table of all keys.
        repeated: the acts whose keys count again while they are held.
        pads: the keyboard and, where a match runs, the gamepads. mouse: the pixel at which it points, or None.
        closed: the window was closed, and is not used any more. help: the keys are listed.
        scene: what the window showed last. shows_result: False once its user has put the result of the match away.
        notice: what the user must read, until the next thing that the user does.
        painter: draws the field. panel: the panel with the calls that is beside it; None without one.
    """

    repeated: ClassVar[frozenset[Act]] = frozenset()
    meanings: ClassVar[Mapping[Act, str]] = {}
    painter: Painter
    panel: PanelPainter | None = None

    def __init__(
        self,
        title: str,
        size: tuple[int, int] | None = None,
        pictures: Path | None = None,
        explain: Explain | None = None,
    ) -> None:
        self.acts: dict[Act, Callable[[Press], object]] = {
            Act.STOP: self.emergency_stop,
            Act.PICTURE: self._take_picture,
            Act.SCREEN: lambda _: toggle_whole_screen(),
            Act.HELP: self._switch_help,
            Act.CLOSE: lambda _: self.close(),
        }
        self.unlisted: Collection[Act] = ()
        self.pads = Pads()
        self.mouse: tuple[int, int] | None = None
        self.closed = self.help = False
        self.scene = Scene()
        self.shows_result = True
        self.notice = ""
        self.explainer = Explainer(explain)
        self._title = title
        self._size = size
        self._pictures = pictures or Path()
        self._picture = False
        self._opened = False

    # What a subclass does.

    def emergency_stop(self, _press: Press) -> None:
        """Stop all robots, where there are any."""
        raise NotImplementedError

    def takes(self, press: Press) -> bool:
        """Take a key before its act is looked up, such as a letter of a text; return whether it was taken."""
        return False

    def click(self, place: tuple[int, int]) -> None:
        """The left button of the mouse was pressed at a pixel: explain a call there; elsewhere show the field again."""
        if self.panel is not None:
            self.explain(self.panel.call_at(place))

    def drag(self, place: tuple[int, int]) -> bool:
        """The mouse has moved to a pixel. Return whether that can be seen."""
        return False

    def let_go(self) -> None:
        """The left button of the mouse was released, or it and all keys can no longer be heard."""

    # What all do.

    def open(self) -> None:
        """Open the window.

        Raises:
            LaunchError: there is no display.
        """
        if not self._opened:
            open_window(self._title, self._size)
            self._opened = True

    def close(self) -> None:
        """Close the window. Calling it again does nothing."""
        self.closed = True
        self.explainer.close()
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
            press = self.pads.take(event)
            seen |= self._handle(event) if press is None else self.press(press)
            if self.closed:
                return False
        return seen

    def press(self, press: Press) -> bool:
        """Answer to a key or a button that went down; return whether it should be seen at once."""
        if not press.again:
            self.notice = ""
        if self.takes(press):
            return True
        # A stop always counts: the release of its key may have been missed.
        if press.again and press.act is not Act.STOP and press.act not in self.repeated:
            return False
        if press.act in self.acts:
            self.acts[press.act](press)
        return True

    def _handle(self, event: pygame.event.Event) -> bool:
        """Answer to an event that is neither a key nor a button that went down."""
        match event.type:
            case pygame.MOUSEBUTTONDOWN if event.button == pygame.BUTTON_LEFT:
                self.notice = ""
                self.click(event.pos)
            case pygame.MOUSEBUTTONUP if event.button == pygame.BUTTON_LEFT:
                self.let_go()
            case pygame.MOUSEMOTION:
                self.mouse = event.pos
                return self.drag(event.pos)
            case pygame.MOUSEWHEEL:
                if self.panel is not None:
                    self.panel.scroll(self.mouse or pygame.mouse.get_pos(), -event.y)
            case pygame.WINDOWLEAVE:
                self.mouse = None
            case pygame.WINDOWFOCUSLOST:
                # The release of the mouse's button will not be seen.
                self.let_go()
            case pygame.QUIT:
                self.close()
            case pygame.VIDEORESIZE | pygame.WINDOWEXPOSED:
                pass
            case _:
                return False
        return True

    @property
    def listed(self) -> Sequence[tuple[str, str]]:
        """The keys to list now, with their meanings; empty while they are not asked for."""
        shown = [act for act in Act if act in self.acts and act not in self.unlisted and act.value[0]]
        return [(act.value[0], self.meanings.get(act, act.value[1])) for act in shown] if self.help else []

    @property
    def hand(self) -> str:
        """What the user must read below the field."""
        return self.notice

    @property
    def card(self) -> Card | None:
        """What is shown over the field; None if nothing is."""
        return self.explainer.card

    def explain(self, call: Call | None) -> None:
        """Show why a call was made, in place of the keys; None shows the field again."""
        self.help = False
        self.explainer.ask(call, self.scene.game)

    def explain_last(self, _press: Press) -> None:
        """Show why the last call was made."""
        self.explain(self.scene.calls[-1] if self.scene.calls else None)

    def show_calls(self, fonts: Fonts, help_: Help) -> None:
        """Draw the field, and beside it the panel whose calls the user can scroll and ask about."""
        self.panel = PanelPainter(fonts)
        self.painter = Painter(fonts, self.panel, help_=help_)
        self.acts |= {Act.WHY: self.explain_last, Act.PLANS: self._switch_plans}

    def paint(self, surface: pygame.Surface, driven: str | None = None, over: str = "") -> Projection:
        """Draw the scene, and what lies over it, upon a surface.

        Args:
            driven: the player that the user drives by hand. over: what the user can do once the game is over.
        """
        self.shows_result |= self.scene.stage is not Stage.GAME_OVER
        over = over if self.shows_result else ""
        return self.painter.draw(
            surface, self.scene, driven, hand=self.hand, keys=self.listed, card=self.card, over=over
        )

    def show(self) -> None:
        """Show what was drawn upon the window's surface, and leave a picture of it if the user wants one."""
        pygame.display.flip()
        window = pygame.display.get_surface()
        if self._picture and window is not None:
            self._picture = False
            self.notice = save_numbered(window, self._pictures)

    def _take_picture(self, _press: Press) -> None:
        self._picture = True

    def _switch_help(self, _press: Press) -> None:
        self.help = not self.help

    def _switch_plans(self, _press: Press) -> None:
        self.notice = self.painter.switch_plans(self.scene)
