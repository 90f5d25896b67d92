"""The layout of the developers' view in a window of any size. Pure functions of pixels."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from pygame import Rect

from vrg.ui.developer.choices import Layer, Tab
from vrg.ui.developer.deciding import Button
from vrg.ui.draw import letter_scale
from vrg.ui.header import HEIGHT

WIDE: Final = 1.1
"""The proportion of width to height below which the panel is below the field."""
PLAYERS: Final = 0.46
"""The part of the panel's height that the list of players may have."""
ROW: Final = 20
LEAST_ROW: Final = 15
"""The height of a row where there is room, and the least one, in pixels at the usual size of a window."""


@dataclass(frozen=True)
class Layout:
    """The places in pixels.

    Args:
        ui: by how much letters are scaled.
        overlays: the switches of what the field shows. field: the field with its banners.
        notice: of the messages. buttons: those of an official.
        head: the match, over the whole width. panel: everything beside the field. players: their list.
        tabs: the tabs. page: what the tab shows. row: the height of a row of a list.
    """

    ui: float
    overlays: dict[Layer, Rect]
    field: Rect
    notice: Rect
    buttons: dict[Button, Rect]
    panel: Rect
    head: Rect
    players: Rect
    tabs: dict[Tab, Rect]
    page: Rect
    row: int

    def overlay_at(self, place: tuple[int, int]) -> Layer | None:
        """The switch at a pixel, or None."""
        return next((overlay for overlay, area in self.overlays.items() if area.collidepoint(place)), None)

    def button_at(self, place: tuple[int, int]) -> Button | None:
        """The button at a pixel, or None."""
        return next((button for button, area in self.buttons.items() if area.collidepoint(place)), None)

    def tab_at(self, place: tuple[int, int]) -> Tab | None:
        """The tab at a pixel, or None."""
        return next((tab for tab, area in self.tabs.items() if area.collidepoint(place)), None)


def layout(width: int, height: int, players: int) -> Layout:
    """Place everything in a window.

    Args:
        width, height: of the window, pixels. players: how many there are.
    """
    wide = width >= WIDE * height
    ui = letter_scale(width, height)
    gap = round(8 * ui)
    head = Rect(0, 0, width, min(round(HEIGHT * ui), height // 3))
    top, rest = head.bottom, height - head.height
    if wide:
        beside = round(min(520 * ui, 0.44 * width))
        panel, left = Rect(width - beside, top, beside, rest), Rect(0, top, width - beside, rest)
    else:
        above = round(0.48 * rest)
        panel, left = Rect(0, top + above, width, rest - above), Rect(0, top, width, above)
    chips = Rect(left.left + gap, left.top + gap, max(1, left.width - 2 * gap), round(24 * ui))
    buttons = Rect(left.left + gap, 0, max(1, left.width - 2 * gap), round(34 * ui))
    buttons.bottom = left.bottom - gap
    notice = Rect(buttons.left, 0, buttons.width, round(20 * ui))
    notice.bottom = buttons.top - round(4 * ui)
    field = Rect(left.left, chips.bottom, left.width, max(1, notice.top - chips.bottom))
    inside = Rect(panel.left + 2 * gap, panel.top + gap, max(1, panel.width - 4 * gap), max(1, panel.height - 2 * gap))
    room = round(PLAYERS * panel.height)
    row = round(min(ROW * ui, max(LEAST_ROW * ui, room / (players + 1))))
    listed = Rect(inside.left, inside.top, inside.width, min(row * (players + 1), max(row * 2, room)))
    tabs = Rect(inside.left, listed.bottom + gap, inside.width, round(26 * ui))
    page = Rect(inside.left, tabs.bottom + gap, inside.width, max(1, inside.bottom - tabs.bottom - gap))
    return Layout(
        ui=ui,
        overlays=dict(zip(Layer, _beside(chips, len(Layer), gap), strict=True)),
        field=field,
        notice=notice,
        buttons=dict(zip(Button, _beside(buttons, len(Button), gap), strict=True)),
        panel=panel,
        head=head,
        players=listed,
        tabs=dict(zip(Tab, _beside(tabs, len(Tab), round(4 * ui)), strict=True)),
        page=page,
        row=row,
    )


def _beside(area: Rect, count: int, gap: int) -> Sequence[Rect]:
    """So many places of one width beside each other."""
    step = (area.width + gap) / count
    return [
        Rect(area.left + round(index * step), area.top, max(1, round(step) - gap), area.height)
        for index in range(count)
    ]
