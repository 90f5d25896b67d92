"""Where everything of the welcome screen and of the configurator is in a window of any size. Functions of pixels."""

from dataclasses import dataclass
from typing import Final

from pygame import Rect

from vrg.ui.draw import scale_of
from vrg.ui.kit import row, title_height
from vrg.ui.welcome.acts import Act
from vrg.ui.welcome.draft import COLUMNS
from vrg.ui.welcome.editor import SETTINGS, Cell
from vrg.ui.welcome.lobby import List, Wish

WIDE: Final = 1.15
"""The proportion of width to height below which the field is above the rest."""
SHARES: Final = (1.35, 1.1, 0.95, 0.85, 1.75, 0.9, 0.9, 0.95)
"""The widths of the columns of the table of players, to each other."""
SETTING_SHARES: Final = (1.2, 1.75, 1.1, 1.15, 1.0, 0.7)
"""The widths of the fields of the match, to each other."""


@dataclass(frozen=True)
class LobbyLayout:
    """The places of the welcome screen, pixels.

    Args:
        ui: by how much letters are scaled. head: the line at the top.
        plates: of the lists, with their titles. rows: of each list. first: the number of the row at the top of each.
        shown: of the match that is chosen. field: of its preview, with its title.
        buttons: by what they ask for. notice: where something is told.
        help: the button that lists the keys.
    """

    ui: float
    head: Rect
    plates: dict[List, Rect]
    rows: dict[List, list[Rect]]
    first: dict[List, int]
    shown: Rect
    field: Rect
    buttons: dict[Wish, Rect]
    notice: Rect
    help: Rect

    def row_at(self, place: tuple[int, int]) -> tuple[List, int] | None:
        """The list and the number of the row at a pixel, or None."""
        for which, rows in self.rows.items():
            for index, rect in enumerate(rows):
                if rect.collidepoint(place):
                    return which, index + self.first[which]
        return None

    def button_at(self, place: tuple[int, int]) -> Wish | None:
        """The button at a pixel, or None."""
        return next((wish for wish, rect in self.buttons.items() if rect.collidepoint(place)), None)


def lobby_layout(size: tuple[int, int], counts: dict[List, int], at: dict[List, int]) -> LobbyLayout:
    """Place the welcome screen.

    Args:
        size: of the window, pixels. counts: the number of rows of each list. at: the chosen row of each.
    """
    width, height = size
    ui = scale_of(width, height)
    gap = round(8 * ui)
    head = Rect(0, 0, width, round(48 * ui))
    room = Rect(gap, head.bottom + gap, max(1, width - 2 * gap), max(1, height - head.height - 2 * gap))
    title = title_height(ui)
    if width >= WIDE * height:
        left = Rect(room.left, room.top, round(0.37 * room.width), room.height)
        right = Rect(left.right + gap, room.top, max(1, room.right - left.right - gap), room.height)
        recent_height = min(round(0.34 * room.height), title + round(30 * ui) * max(2, counts[List.RECENT]) + gap)
        recent = Rect(right.left, right.bottom - recent_height, right.width, recent_height)
        shown = Rect(right.left, right.top, right.width, max(1, recent.top - gap - right.top))
    else:
        shown = Rect(room.left, room.top, room.width, round(0.42 * room.height))
        left = Rect(room.left, shown.bottom + gap, room.width, round(0.38 * room.height))
        recent = Rect(room.left, left.bottom + gap, room.width, max(1, room.bottom - left.bottom - gap))
    maps_height = min(round(0.36 * left.height), title + round(28 * ui) * counts[List.MAPS] + gap)
    maps = Rect(left.left, left.bottom - maps_height, left.width, maps_height)
    games = Rect(left.left, left.top, left.width, max(1, maps.top - gap - left.top))
    plates = {List.GAMES: games, List.MAPS: maps, List.RECENT: recent}
    tallest = {List.GAMES: round(88 * ui), List.MAPS: round(30 * ui), List.RECENT: round(32 * ui)}
    least = {List.GAMES: round(44 * ui), List.MAPS: round(24 * ui), List.RECENT: round(26 * ui)}
    rows, first = {}, {}
    for which, plate in plates.items():
        inside = Rect(plate.left + gap, plate.top + title, plate.width - 2 * gap, plate.height - title - gap // 2)
        rows[which], first[which] = _rows(inside, counts[which], at[which], least[which], tallest[which])
    strip = Rect(shown.left + gap, shown.bottom - round(48 * ui), shown.width - 2 * gap, round(40 * ui))
    notice = Rect(strip.left, strip.top - round(44 * ui), strip.width, round(42 * ui))
    field = Rect(shown.left, shown.top, shown.width, max(1, notice.top - shown.top))
    help_ = Rect(0, 0, round(90 * ui), head.height - 2 * gap)
    help_.midright = (head.right - gap, head.centery)
    buttons = dict(zip((Wish.START, Wish.CHANGE, Wish.WATCH), row(strip, (1.2, 1.0, 1.0), gap), strict=True))
    return LobbyLayout(ui, head, plates, rows, first, shown, field, buttons, notice, help_)


def _rows(inside: Rect, count: int, at: int, least: int, most: int) -> tuple[list[Rect], int]:
    """Places below each other for the rows for which there is room, and the number of the first: `at` is among them."""
    if count == 0:
        return [], 0
    shown = min(count, max(1, inside.height // least))
    high = max(1, min(most, inside.height // shown))
    first = min(max(0, at - shown + 1), count - shown) if at >= shown else 0
    return [Rect(inside.left, inside.top + i * high, inside.width, high) for i in range(shown)], first


@dataclass(frozen=True)
class EditorLayout:
    """The places of the configurator, pixels.

    Args:
        ui: by how much letters are scaled. head: the line at the top.
        settings, players, problems, field: the plates with their titles.
        labels: of the fields of the match, and of the columns of players. cells: the fields.
        numbers: the place of the number of each player that is shown, by the player's number.
        first: the number of the first player that is shown. shown: how many are shown.
        problem_rows: one for each problem for which there is room.
        buttons: by what they ask for. notice: where something is told.
    """

    ui: float
    head: Rect
    settings: Rect
    players: Rect
    problems: Rect
    field: Rect
    labels: dict[Cell, Rect]
    cells: dict[Cell, Rect]
    numbers: dict[int, Rect]
    first: int
    shown: int
    problem_rows: list[Rect]
    buttons: dict[Act, Rect]
    notice: Rect

    def cell_at(self, place: tuple[int, int]) -> Cell | None:
        """The field at a pixel, or None."""
        return next((cell for cell, rect in self.cells.items() if rect.collidepoint(place)), None)

    def button_at(self, place: tuple[int, int]) -> Act | None:
        """The button at a pixel, or None."""
        return next((act for act, rect in self.buttons.items() if rect.collidepoint(place)), None)


def editor_layout(size: tuple[int, int], players: int, first: int, at: int | None) -> EditorLayout:
    """Place the configurator.

    Args:
        size: of the window, pixels. players: how many there are.
        first: the number of the player that was the first one shown. at: the number of the one with the cursor.
    """
    width, height = size
    ui = scale_of(width, height)
    gap, title = round(7 * ui), title_height(ui)
    head = Rect(0, 0, width, round(48 * ui))
    room = Rect(gap, head.bottom + gap, max(1, width - 2 * gap), max(1, height - head.height - 2 * gap))
    if width >= WIDE * height:
        left = Rect(room.left, room.top, round(0.58 * room.width), room.height)
        field = Rect(left.right + gap, room.top, max(1, room.right - left.right - gap), room.height)
    else:
        field = Rect(room.left, room.top, room.width, round(0.42 * room.height))
        left = Rect(room.left, field.bottom + gap, room.width, max(1, room.bottom - field.bottom - gap))
    label, line = round(18 * ui), round(32 * ui)
    settings = Rect(left.left, left.top, left.width, label + line + 2 * gap)
    strip = Rect(left.left, left.bottom - round(40 * ui), left.width, round(40 * ui))
    notice = Rect(left.left, strip.top - gap - round(38 * ui), left.width, round(38 * ui))
    middle = Rect(left.left, settings.bottom + gap, left.width, max(1, notice.top - settings.bottom - 2 * gap))
    least, most, overhead = round(22 * ui), round(34 * ui), title + label + gap
    lines = max(1, middle.height - overhead - gap - title - round(4.2 * 20 * ui))
    shown = max(1, min(players, lines // least))
    high = max(1, min(most, lines // shown))
    if at is not None:
        first = min(max(first, at - shown + 1), at)
    first = min(max(0, first), max(0, players - shown))
    table = Rect(left.left, middle.top, left.width, overhead + shown * high)
    problems = Rect(left.left, table.bottom + gap, left.width, max(1, middle.bottom - table.bottom - gap))
    cells, labels, numbers = {}, {}, {}
    inside = settings.inflate(-2 * gap, 0)
    for name, rect in zip(SETTINGS, row(Rect(inside.left, 0, inside.width, line), SETTING_SHARES, gap), strict=True):
        cell = Cell(name)
        labels[cell] = Rect(rect.left, settings.top + gap // 2, rect.width, label)
        cells[cell] = Rect(rect.left, labels[cell].bottom, rect.width, line)
    count = cells[Cell("players")]
    step = min(count.height, max(1, count.width // 3))
    less = Rect(count.left, count.top, step, count.height)
    plus = Rect(count.right - step, count.top, step, count.height)
    cells[Cell("players")] = Rect(less.right + 2, count.top, max(1, plus.left - less.right - 4), count.height)
    number = round(26 * ui)
    columns = row(Rect(table.left + number, 0, table.width - number - gap, high), SHARES, max(2, gap // 3))
    for name, rect in zip(COLUMNS, columns, strict=True):
        labels[Cell(name, -1)] = Rect(rect.left, table.top + title, rect.width, label)
        for index in range(min(shown, players)):
            top = table.top + title + label + index * high
            cells[Cell(name, first + index)] = Rect(rect.left, top, rect.width, high - max(2, gap // 3))
            numbers[first + index] = Rect(table.left, top, number, high - max(2, gap // 3))
    each = round(20 * ui)
    problem_rows = [
        Rect(problems.left + gap, problems.top + title + i * each, problems.width - 2 * gap, each)
        for i in range(max(0, (problems.height - title - gap // 2) // each))
    ]
    acts = (Act.LEAVE, Act.UNDO, Act.REDO, Act.SAVE, Act.SAVE_AS, Act.PLAY)
    buttons = dict(zip(acts, row(strip, (0.8, 1.0, 1.0, 1.0, 0.9, 1.4), gap), strict=True))
    help_ = Rect(0, 0, round(90 * ui), head.height - 2 * gap)
    help_.midright = (head.right - gap, head.centery)
    return EditorLayout(
        ui, head, settings, table, problems, field, labels, cells, numbers, first, shown, problem_rows,
        buttons | {Act.FEWER: less, Act.MORE: plus, Act.HELP: help_}, notice,
    )  # fmt: skip


def offer_rows(size: tuple[int, int], cell: Rect, count: int, at: int, ui: float) -> tuple[list[Rect], int]:
    """The places of the names that are offered for a field: below it, or above where there is more room.

    Returns:
        the places, and the number of the first name that is shown.
    """
    high, width = round(26 * ui), max(cell.width, round(210 * ui))
    below, above = size[1] - cell.bottom, cell.top
    shown = max(1, min(count, max(below, above) // high - 1, 16))
    first = min(max(0, at - shown // 2), count - shown)
    left = min(cell.left, max(0, size[0] - width))
    top = cell.bottom + 2 if below >= (shown + 1) * high or below >= above else cell.top - 2 - shown * high
    return [Rect(left, top + i * high, width, high) for i in range(shown)], first


def dialog_places(size: tuple[int, int], ui: float) -> tuple[Rect, Rect, Rect, Rect]:
    """The places of a question: its plate, the field of its answer, and the buttons yes and no."""
    plate = Rect(0, 0, min(size[0], round(560 * ui)), min(size[1], round(190 * ui)))
    plate.center = (size[0] // 2, size[1] // 2)
    inside = plate.inflate(-round(40 * ui), -round(32 * ui))
    field = Rect(inside.left, inside.top + round(34 * ui), inside.width, round(36 * ui))
    buttons = Rect(inside.left, inside.bottom - round(38 * ui), inside.width, round(38 * ui))
    yes, no = row(buttons, (1.0, 1.0), round(12 * ui))
    return plate, field, yes, no
