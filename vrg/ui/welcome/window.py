"""The welcome window: a thin shell that turns events into what the states understand, and draws what they hold."""

import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pygame

from vrg.ui.text import Fonts
from vrg.ui.view import View
from vrg.ui.welcome import words
from vrg.ui.welcome.acts import Act
from vrg.ui.welcome.checking import Check, Checker
from vrg.ui.welcome.choices import Choices, physical_backends
from vrg.ui.welcome.draft import Draft
from vrg.ui.welcome.editor import Editor, Save
from vrg.ui.welcome.editor_painter import EditorPainter
from vrg.ui.welcome.field_painter import DraftPainter
from vrg.ui.welcome.ground import grip_at
from vrg.ui.welcome.help import draw_keys
from vrg.ui.welcome.keys import HELD, LETTERS, act_of
from vrg.ui.welcome.layout import EditorLayout, LobbyLayout, dialog_places, offer_rows
from vrg.ui.welcome.lobby import Lobby, Recent, Wish
from vrg.ui.welcome.lobby_painter import LobbyPainter
from vrg.ui.window import open_window, toggle_whole_screen

FRAMES: Final = 60
"""Frames in a second of real time, at most."""
_REPEAT: Final = (400, 40)
"""ms of real time until a key that is held counts again, and between the times after that."""


@dataclass(frozen=True)
class Outcome:
    """What the person wants once the window is closed.

    Args:
        play: a match file to play. watch: a run folder to watch again. Both None: nothing.
    """

    play: str | None = None
    watch: Path | None = None


@dataclass(frozen=True)
class Tools:
    """What the window needs of the rest of VRG.

    Args:
        check: checks a draft. places: checks a draft for the places of new players; it imports no strategies.
        save: writes a match file. choices: what can be chosen in a folder.
        recent: finds the recent matches, the newest first.
    """

    check: Check
    places: Check
    save: Save
    choices: Choices
    recent: Callable[[], Sequence[Recent]]


class WelcomeWindow:
    """The window.

    Args:
        tools: what it needs of the rest of VRG. base: the folder in which new matches are made.
        draft: a match file that is opened; None begins with the welcome screen.
        size: of the window in pixels.

    Attributes:
        lobby: the state of the welcome screen; None where a file was opened.
        editor: the state of the configurator; None while the welcome screen is shown.
        outcome: what the person wants; None while the window is open.
        places, view: where everything was in the window last, and where on the field its pixels were.
    """

    def __init__(
        self, tools: Tools, base: Path, draft: Draft | None = None, *, size: tuple[int, int] = (1280, 720)
    ) -> None:
        self.lobby = Lobby(base, tools.choices, tools.recent) if draft is None else None
        self.editor = None if draft is None else self._edit(draft, tools)
        self.outcome: Outcome | None = None
        self.places: LobbyLayout | EditorLayout | None = None
        self.view: View | None = None
        self._tools = tools
        self._size = size
        self._help = False
        self._mouse: tuple[int, int] | None = None
        self._dirty = True
        self._down: set[int] = set()
        fonts = Fonts()
        field = DraftPainter(fonts, physical_backends())
        self._fonts = fonts
        self._lobby_painter = LobbyPainter(fonts, field)
        self._editor_painter = EditorPainter(fonts, field)
        self._executor = ThreadPoolExecutor(1, thread_name_prefix="check")
        self._checker = Checker(tools.check, self._executor)

    @staticmethod
    def _edit(draft: Draft, tools: Tools) -> Editor:
        return Editor(draft, tools.choices, tools.places, tools.save)

    def open(self) -> None:
        """Open the window.

        Raises:
            LaunchError: there is no display.
        """
        open_window(f"VRG: {words.TITLE}", self._size, self._gone)
        pygame.key.set_repeat(*_REPEAT)

    def close(self) -> None:
        """Close the window. Calling it again does nothing."""
        self.outcome = self.outcome or Outcome()
        self._executor.shutdown(wait=False, cancel_futures=True)
        pygame.display.quit()

    def rescue(self) -> str:
        """Keep what is not saved; return what to tell, which is empty if all is saved."""
        return "" if self.editor is None else self.editor.rescue()

    def _gone(self) -> str:
        return f"{words.DISPLAY_GONE}\n{self.rescue()}".strip()

    @property
    def busy(self) -> bool:
        """Whether a check of what is shown is still to come."""
        return self._checker.busy

    def frame(self, now: float) -> None:
        """Handle what the user did, and draw what has changed.

        Args:
            now: the real time, s, from any beginning.
        """
        for event in pygame.event.get():
            self._dirty = True
            self._handle(event)
            if self.outcome is not None:
                return
        self._check(now)
        window = pygame.display.get_surface()
        if window is not None and self._dirty:
            self._dirty = False
            self._draw(window)

    def _check(self, now: float) -> None:
        state = self.editor or self.lobby
        if state is None or state.draft is None:
            return
        found = self._checker.look(state.draft, now)
        if found is not None:
            state.see(*found)
            self._dirty = True

    def _draw(self, window: pygame.Surface) -> None:
        if self.editor is not None:
            self.places, self.view = self._editor_painter.draw(window, self.editor, self._mouse)
        elif self.lobby is not None:
            self.places, self.view = self._lobby_painter.draw(window, self.lobby), None
        if self._help and self.places is not None:
            keys = words.LOBBY_KEYS if self.editor is None else words.EDITOR_KEYS
            draw_keys(window, keys, self.places.ui, self._fonts)
        pygame.display.flip()

    # -- events

    def _handle(self, event: pygame.event.Event) -> None:
        match event.type:
            case pygame.QUIT:
                self._quit()
            case pygame.KEYDOWN | pygame.KEYUP:
                self._held(event)
            case pygame.MOUSEBUTTONDOWN if event.button == pygame.BUTTON_LEFT:
                self._help = False
                self._click(event.pos)
            case pygame.MOUSEBUTTONUP if event.button == pygame.BUTTON_LEFT and self.editor is not None:
                self.editor.let_go()
            case pygame.MOUSEMOTION:
                self._mouse = event.pos
                if self.editor is not None and self.view is not None:
                    self.editor.drag(self.view.place(*event.pos))
            case pygame.MOUSEWHEEL:
                state = self.editor or self.lobby
                if state is not None:
                    state.press(Act.DOWN if event.y < 0 else Act.UP)
            case pygame.WINDOWLEAVE:
                self._mouse = None
            case pygame.WINDOWFOCUSLOST:
                # The release of keys and buttons will not be seen.
                self._down.clear()
                if self.editor is not None:
                    self.editor.let_go()
        self._follow()

    def _held(self, event: pygame.event.Event) -> None:
        """Take in a key, which counts again while it is held only if it is one of HELD."""
        again = event.key in self._down
        if event.type == pygame.KEYUP:
            self._down.discard(event.key)
            return
        self._down.add(event.key)
        if not again or event.key in HELD:
            self._key(event)

    def _key(self, event: pygame.event.Event) -> None:
        sign = getattr(event, "unicode", "")
        act = act_of(event.key, event.mod)
        if self._help and act not in (Act.SCREEN, None):
            self._help = False
            if act in (Act.HELP, Act.LEAVE):
                return
        if self.editor is None:
            act = act or LETTERS.get(sign.lower())
        if act is Act.SCREEN:
            toggle_whole_screen()
        elif act is Act.HELP:
            self._help = True
        elif self.editor is not None:
            if act is not None:
                self.editor.press(act)
            elif sign and sign.isprintable() and not event.mod & (pygame.KMOD_CTRL | pygame.KMOD_META):
                self.editor.type(sign)
        elif self.lobby is not None and act is not None:
            self.lobby.press(act)

    def _click(self, place: tuple[int, int]) -> None:
        if isinstance(self.places, LobbyLayout) and self.lobby is not None:
            wish, found = self.places.button_at(place), self.places.row_at(place)
            if self.places.help.collidepoint(place):
                self._help = True
            elif wish is not None:
                self.lobby.ask(wish)
            elif found is not None:
                self.lobby.click(*found)
        elif isinstance(self.places, EditorLayout) and self.editor is not None:
            self._click_editor(self.editor, self.places, place)

    def _click_editor(self, editor: Editor, places: EditorLayout, place: tuple[int, int]) -> None:
        size = pygame.display.get_window_size()
        if editor.dialog is not None:
            _, _, yes, no = dialog_places(size, places.ui)
            if yes.collidepoint(place) or no.collidepoint(place):
                editor.answer(yes=bool(yes.collidepoint(place)))
            return
        if editor.offer is not None and editor.cell in places.cells:
            rows, first = offer_rows(
                size, places.cells[editor.cell], len(editor.offer.names), editor.offer.at, places.ui
            )
            for index, rect in enumerate(rows):
                if rect.collidepoint(place):
                    editor.choose(first + index)
                    return
        button, cell = places.button_at(place), places.cell_at(place)
        problem = next((i for i, rect in enumerate(places.problem_rows) if rect.collidepoint(place)), None)
        if button is Act.HELP:
            self._help = True
        elif button is not None:
            editor.press(button)
        elif cell is not None:
            editor.click(cell)
        elif problem is not None and problem < len(editor.problems):
            editor.jump(editor.problems[problem])
        elif self.view is not None and places.field.collidepoint(place):
            grip = grip_at(place, editor.draft, editor.poses, editor.cell.player, self.view, places.ui)
            if grip is not None:
                editor.take_hold(grip[0], self.view.place(*place), turning=grip[1])

    def _quit(self) -> None:
        """Take in that the window is to be closed; ask first if something would be lost, but only once."""
        editor = self.editor
        if editor is not None and editor.dialog is None and editor.changed:
            self.lobby = None
            editor.leave()
        else:
            self.outcome = Outcome()

    def _follow(self) -> None:
        """Do what the states ask for."""
        editor, lobby = self.editor, self.lobby
        if editor is not None:
            if editor.play is not None:
                self.outcome = Outcome(play=str(editor.play))
            elif editor.left:
                self.editor = None
                if lobby is None:
                    self.outcome = Outcome()
                else:
                    lobby.refresh()
            return
        if lobby is None or lobby.wish is None:
            return
        wish, lobby.wish = lobby.wish, None
        recent = lobby.chosen
        if wish is Wish.CLOSE:
            self.outcome = Outcome()
        elif wish is Wish.WATCH and recent is not None:
            self.outcome = Outcome(watch=recent.run)
        elif wish is Wish.START and recent is not None:
            self.outcome = Outcome(play=str(recent.match))
        elif wish is Wish.START and lobby.draft is not None:
            self._start(lobby, lobby.draft)
        elif wish is Wish.CHANGE and lobby.draft is not None:
            self.editor = self._edit(lobby.draft, self._tools)
            if lobby.checked and lobby.verdict is not None:
                self.editor.see(lobby.draft, lobby.verdict)

    def _start(self, lobby: Lobby, draft: Draft) -> None:
        """Play the default match of a game; on another map it is a match of its own, which has to be saved."""
        if draft.text == Draft.of_game(draft.game, draft.base).text:
            self.outcome = Outcome(play=draft.game)
            return
        self.editor = self._edit(draft, self._tools)
        if lobby.verdict is not None:
            self.editor.see(draft, lobby.verdict)
        self.editor.press(Act.PLAY)


def show(window: WelcomeWindow) -> Outcome:
    """Show the window until the person has decided.

    Raises:
        LaunchError: there is no display.
    """
    window.open()
    clock = pygame.time.Clock()
    try:
        while window.outcome is None:
            window.frame(time.monotonic())
            clock.tick(FRAMES)
        return window.outcome
    except BaseException:
        if told := window.rescue():
            print(told, file=sys.stderr)
        raise
    finally:
        window.close()
