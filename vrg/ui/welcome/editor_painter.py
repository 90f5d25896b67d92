"""Draws the configurator."""

import math

import pygame

from vrg.colours import Rgb
from vrg.games import game_of
from vrg.ui import palette, shapes
from vrg.ui.kit import button, field, frame, write
from vrg.ui.text import Face, Fonts
from vrg.ui.view import View
from vrg.ui.welcome import words
from vrg.ui.welcome.acts import Act
from vrg.ui.welcome.draft import NUMBERS
from vrg.ui.welcome.editor import Cell, Editor
from vrg.ui.welcome.field_painter import DraftPainter
from vrg.ui.welcome.layout import EditorLayout, dialog_places, editor_layout, offer_rows
from vrg.ui.welcome.telling import said

_BUTTONS = {
    Act.LEAVE: words.LEAVE,
    Act.UNDO: words.UNDO,
    Act.REDO: words.REDO,
    Act.SAVE: words.SAVE,
    Act.SAVE_AS: words.SAVE_AS,
    Act.PLAY: words.PLAY,
    Act.HELP: words.HELP,
    Act.MORE: words.MORE,
    Act.FEWER: words.FEWER,
}


class EditorPainter:
    """Draws the configurator."""

    def __init__(self, fonts: Fonts, field_: DraftPainter) -> None:
        self._fonts = fonts
        self._field = field_

    def draw(
        self, surface: pygame.Surface, editor: Editor, mouse: tuple[int, int] | None = None
    ) -> tuple[EditorLayout, View | None]:
        """Draw everything.

        Args:
            mouse: where the mouse is; the problems of the field below it are told.

        Returns:
            where everything is, and how the field's coordinates became pixels.
        """
        size, fonts = surface.get_size(), self._fonts
        places = editor_layout(size, len(editor.draft.players), editor.first, editor.cell.player)
        editor.first = places.first
        ui = places.ui
        surface.fill(palette.BACKGROUND)
        self._head(surface, editor, places)
        shapes.pill(surface, places.settings, palette.PANEL, radius=round(8 * ui))
        count = len(editor.draft.players)
        shown = "" if places.shown >= count else f"{places.first + 1} to {places.first + places.shown} of {count}"
        frame(surface, places.players, words.PLAYERS, shown, ui, fonts)
        small = max(11, round(13 * ui))
        for cell, rect in places.labels.items():
            label = (words.SETTINGS if cell.player is None else words.COLUMNS)[cell.field]
            write(surface, label, rect, small, palette.MUTED, fonts)
        for number, rect in places.numbers.items():
            self._number(surface, editor, number, rect, ui)
        for cell, rect in places.cells.items():
            self._cell(surface, editor, cell, rect, ui)
        selected = editor.cell.player
        view = self._field.draw(
            surface, places.field, editor.draft, editor.verdict, ui,
            poses=editor.poses, selected=selected, says=self._pose(editor),
        )  # fmt: skip
        self._problems(surface, editor, places)
        self._notice(surface, editor, places)
        for act, rect in places.buttons.items():
            ready = act is Act.PLAY and editor.checked and not editor.problems
            colour = palette.GOOD if ready else palette.CALM if act in (Act.SAVE, Act.PLAY) else palette.RAISED
            button(surface, rect, *_BUTTONS[act], colour, ui, fonts)
        if editor.dialog is not None:
            self._dialog(surface, editor, ui)
        elif editor.offer is not None:
            self._offer(surface, editor, places)
        else:
            under = None if mouse is None else places.cell_at(mouse)
            self._bubble(surface, editor, places, under or editor.cell)
        return places, view

    def _head(self, surface: pygame.Surface, editor: Editor, places: EditorLayout) -> None:
        ui, fonts, draft = places.ui, self._fonts, editor.draft
        pygame.draw.rect(surface, palette.PANEL, places.head)
        inside = places.head.inflate(-round(28 * ui), 0)
        inside.width = max(1, places.buttons[Act.HELP].left - inside.left - round(14 * ui))
        title, size = game_of(draft.game).title or draft.game, round(22 * ui)
        write(surface, title, inside, size, palette.TEXT, fonts, Face.BOLD)
        used = fonts.width(title, size, Face.BOLD) + round(18 * ui)
        rest = pygame.Rect(inside.left + used, inside.top, max(1, inside.width - used), inside.height)
        name = str(draft.file.name) if draft.file is not None else words.NEW_MATCH
        told = f"{name}, {words.UNSAVED}" if editor.changed else name
        write(surface, told, rest, round(15 * ui), palette.CAUTION if editor.changed else palette.MUTED, fonts)

    def _number(self, surface: pygame.Surface, editor: Editor, number: int, rect: pygame.Rect, ui: float) -> None:
        """Draw the sign of a player's role at the left of its row."""
        entry = editor.draft.players[number]
        if editor.verdict is not None and editor.verdict.of_player(number):
            mark = pygame.Rect(rect.left, rect.top, round(4 * ui), rect.height)
            pygame.draw.rect(surface, palette.WARNING, mark)
        style = game_of(editor.draft.game).style(entry.role)
        centre = (rect.centerx + 2, rect.centery)
        shapes.marker(surface, centre, 0.0, min(7 * ui, rect.height / 2.5), style.colour, style.marker)

    def _cell(self, surface: pygame.Surface, editor: Editor, cell: Cell, rect: pygame.Rect, ui: float) -> None:
        focused = cell == editor.cell
        typing = focused and editor.typed is not None
        text, ink = editor.shown(cell), palette.TEXT
        if not text and not typing:
            text, ink = self._default(editor, cell), palette.MUTED
        wrong = bool(editor.verdict is not None and editor.verdict.of(cell.player, cell.field))
        edge = palette.CAUTION if focused else palette.WARNING if wrong else palette.LINE
        selected = cell.player is not None and cell.player == editor.cell.player
        fill = palette.BACKGROUND if typing else palette.RAISED if selected else palette.FIELD
        by = round(4 * ui)
        pygame.draw.rect(surface, fill, rect, border_radius=by)
        pygame.draw.rect(surface, edge, rect, max(1, round(2 * ui)) if focused or wrong else 1, border_radius=by)
        inside, size = rect.inflate(-round(12 * ui), 0), max(11, min(round(14 * ui), rect.height - 4))
        if editor.choices(cell):
            x, y, r = inside.right - 3 * ui, rect.centery, 4 * ui
            shapes.polygon(surface, [(x - r, y - r / 2), (x + r, y - r / 2), (x, y + r / 2 + 1)], palette.MUTED)
            inside.width = max(1, inside.width - round(12 * ui))
        ink = palette.WARNING if wrong and not typing else ink
        if typing:
            self._typed(surface, text, inside, size)
        elif cell.field in NUMBERS:
            shown = self._fonts.render(self._fonts.shorten(text, inside.width, size), size, ink)
            surface.blit(shown, shown.get_rect(midright=inside.midright))
        else:
            write(surface, text, inside, size, ink, self._fonts)

    def _typed(self, surface: pygame.Surface, text: str, inside: pygame.Rect, size: int) -> None:
        """Write what is being typed; of a long text the end is seen."""
        text += "|"
        while len(text) > 1 and self._fonts.width(text, size) > inside.width:
            text = text[1:]
        write(surface, text, inside, size, palette.TEXT, self._fonts)

    @staticmethod
    def _default(editor: Editor, cell: Cell) -> str:
        """What holds where a field is empty, in words."""
        default = editor.draft.default(cell.field, cell.player)
        if cell.field == "strategy":
            return f"({default})" if default else words.DEFAULT_STRATEGY
        return default

    @staticmethod
    def _pose(editor: Editor) -> str:
        """Where the selected robot is, in words."""
        player = editor.cell.player
        pose = editor.poses[player] if player is not None else None
        if player is None or pose is None:
            return ""
        degrees = round(math.degrees(pose.theta)) + 0
        return f"{editor.draft.players[player].name}: x {pose.x:.2f} m   y {pose.y:.2f} m   {degrees}°"

    def _problems(self, surface: pygame.Surface, editor: Editor, places: EditorLayout) -> None:
        ui, fonts, problems = places.ui, self._fonts, editor.problems
        says = words.COUNT.format(count=len(problems)) if problems else words.GOOD
        frame(surface, places.problems, words.PROBLEMS, says if editor.checked else words.CHECKING, ui, fonts)
        size, rows = max(11, round(13 * ui)), places.problem_rows
        for index, (problem, rect) in enumerate(zip(problems, rows, strict=False)):
            left = len(problems) - index
            if index == len(rows) - 1 and left > 1:
                write(surface, words.MORE_PROBLEMS.format(count=left), rect, size, palette.MUTED, fonts)
            else:
                write(surface, said(problem, editor.draft), rect, size, palette.WARNING, fonts)

    def _notice(self, surface: pygame.Surface, editor: Editor, places: EditorLayout) -> None:
        size, top = max(12, round(14 * places.ui)), places.notice.top
        colour = palette.CAUTION if editor.notice else palette.MUTED
        for line in self._fonts.wrap(editor.notice or words.HINT, places.notice.width, size, lines=2):
            surface.blit(self._fonts.render(line, size, colour), (places.notice.left, top))
            top += round(19 * places.ui)

    def _bubble(self, surface: pygame.Surface, editor: Editor, places: EditorLayout, cell: Cell) -> None:
        """Tell the problems of a field beside it."""
        rect = places.cells.get(cell)
        problems = () if editor.verdict is None else editor.verdict.of(cell.player, cell.field)
        if rect is None or not problems:
            return
        ui, size = places.ui, max(12, round(14 * places.ui))
        width = min(round(430 * ui), surface.get_width())
        pad, step = round(9 * ui), round(19 * ui)
        lines = [line for p in problems for line in self._fonts.wrap(p.text, width - 2 * pad, size, lines=5)][:8]
        plate = pygame.Rect(rect.left, rect.bottom + 3, width, len(lines) * step + 2 * pad)
        if plate.bottom > surface.get_height():
            plate.bottom = rect.top - 3
        plate.clamp_ip(surface.get_rect())
        self._plate(surface, plate, palette.WARNING, ui)
        for index, line in enumerate(lines):
            surface.blit(
                self._fonts.render(line, size, palette.WARNING), (plate.left + pad, plate.top + pad + index * step)
            )

    def _plate(self, surface: pygame.Surface, plate: pygame.Rect, edge: Rgb, ui: float) -> None:
        shapes.pill(surface, plate, palette.BACKGROUND, radius=round(6 * ui))
        pygame.draw.rect(surface, edge, plate, max(1, round(1.5 * ui)), border_radius=round(6 * ui))

    def _offer(self, surface: pygame.Surface, editor: Editor, places: EditorLayout) -> None:
        """Draw the names that a field can have."""
        offer, rect = editor.offer, places.cells.get(editor.cell)
        if offer is None or rect is None:
            return
        rows, first = offer_rows(surface.get_size(), rect, len(offer.names), offer.at, places.ui)
        self._plate(surface, rows[0].unionall(rows).inflate(6, 6), palette.CAUTION, places.ui)
        for index, place in enumerate(rows):
            name = offer.names[first + index]
            if first + index == offer.at:
                shapes.pill(surface, place, palette.CALM, radius=4)
            ink = palette.TEXT if name else palette.MUTED
            shown = name or self._default(editor, editor.cell)
            write(surface, shown, place.inflate(-round(14 * places.ui), 0), round(14 * places.ui), ink, self._fonts)

    def _dialog(self, surface: pygame.Surface, editor: Editor, ui: float) -> None:
        """Draw what is asked."""
        dialog = editor.dialog
        assert dialog is not None
        veil = pygame.Surface(surface.get_size(), pygame.SRCALPHA)
        veil.fill((*palette.BACKGROUND, 170))
        surface.blit(veil, (0, 0))
        plate, place, yes, no = dialog_places(surface.get_size(), ui)
        self._plate(surface, plate, palette.CAUTION, ui)
        head = pygame.Rect(place.left, place.top - round(38 * ui), place.width, round(30 * ui))
        write(surface, dialog.says, head, round(16 * ui), palette.TEXT, self._fonts, Face.BOLD)
        if dialog.typed is not None:
            field(surface, place, "", f"{dialog.typed.text}|", ui, self._fonts, focused=True)
        if dialog.wrong:
            below = pygame.Rect(place.left, place.bottom, place.width, yes.top - place.bottom)
            write(surface, dialog.wrong, below, max(11, round(12 * ui)), palette.WARNING, self._fonts)
        named = dialog.typed is not None
        button(surface, yes, *(words.OK if named else words.YES), palette.GOOD, ui, self._fonts)
        button(surface, no, *(words.CANCEL if named else words.NO), palette.RAISED, ui, self._fonts)
