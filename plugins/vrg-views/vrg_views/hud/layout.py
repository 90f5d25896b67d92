"""The layout of the head-up display in a window of any size. Pure functions of pixels."""

from dataclasses import dataclass
from typing import Final

from pygame import Rect

from vrg.ui.acts import Act
from vrg.ui.window.draw import letter_scale
from vrg.ui.window.kit import row
from vrg_views.hud.helm import Wish
from vrg_views.hud.kit import title_height

WIDE: Final = 1.0
"""The proportion of width to height below which the quadrants are below each other."""
WISHES: Final = {Act.GOTO: Wish.GOTO, Act.MANUAL: Wish.MANUAL, Act.BEGIN: Wish.RESET}
"""The acts by which a person drives the robot."""
BUTTONS: Final = {Act.GOTO: "Goto", Act.MANUAL: "Manual", Act.BEGIN: "Reset", Act.LEAVE: "Give back"}
"""The labels of the buttons below the fields."""


@dataclass(frozen=True)
class Layout:
    """The places in pixels.

    Args:
        ui: by how much letters are scaled.
        head: the line at the top, with the player's name and what must not be overlooked.
        location, panel: quadrants with their titles, like laser, sonar and camera, which are None where the robot has
            no such sensor: the map then has the room. The picture of the camera stands beside the sonar.
        fields: the fields x, y and heading. buttons: by their acts.
        notice: of the messages to the person. status: of the list about the player and its robot.
    """

    ui: float
    head: Rect
    location: Rect
    laser: Rect | None
    sonar: Rect | None
    camera: Rect | None
    panel: Rect
    fields: tuple[Rect, ...]
    buttons: dict[Act, Rect]
    notice: Rect
    status: Rect

    @property
    def map_area(self) -> Rect:
        """The location quadrant below its title, pixels."""
        title = title_height(self.ui)
        return Rect(self.location.left, self.location.top + title, self.location.width, self.location.height - title)

    def button_at(self, x: int, y: int) -> Act | None:
        """The act of the button at a pixel, or None."""
        return next((act for act, place in self.buttons.items() if place.collidepoint(x, y)), None)

    def field_at(self, x: int, y: int) -> int | None:
        """The number of the field at a pixel, or None."""
        return next((index for index, place in enumerate(self.fields) if place.collidepoint(x, y)), None)


def layout(width: int, height: int, *, laser: bool, sonar: bool, camera: bool) -> Layout:
    """Place everything in a window.

    Args:
        width, height: of the window, pixels. laser, sonar, camera: whether the robot has such a sensor.
    """
    wide = width >= WIDE * height
    ui = letter_scale(width, height) if wide else letter_scale(width, width)
    gap = round(6 * ui)
    below = sonar or camera
    head = Rect(0, 0, width, round(44 * ui))
    room = Rect(gap, head.bottom + gap, max(1, width - 2 * gap), max(1, height - head.height - 2 * gap))
    if wide:
        w, h = max(1, (room.width - gap) // 2), max(1, (room.height - gap) // 2)
        left, right = Rect(room.left, room.top, w, room.height), Rect(room.right - w, room.top, w, room.height)
        location = Rect(left.left, left.top, w, h) if laser and below else left
        scan = Rect(right.left, right.top, w, h)
        # Without a laser what would stand below the map stands beside it.
        rest = Rect(left.left, left.bottom - h, w, h) if laser else scan
        panel = Rect(right.left, right.bottom - h, w, h) if laser or below else right
    else:
        shown = 2 + laser + below
        h = max(1, (room.height - (shown - 1) * gap) // shown)
        rows = iter([Rect(room.left, room.top + i * (h + gap), room.width, h) for i in range(shown)])
        location = next(rows)
        scan = next(rows) if laser else location
        rest = next(rows) if below else location
        panel = next(rows)
    echoes, picture = rest, rest
    if sonar and camera:
        # The picture is wider than it is high, the ring of sonars is round.
        half = min(round(0.48 * rest.width), rest.height)
        echoes = Rect(rest.left, rest.top, half, rest.height)
        picture = Rect(echoes.right + gap, rest.top, max(1, rest.width - half - gap), rest.height)
    inside = panel.inflate(-2 * gap, -2 * gap) if panel.width > 4 * gap else panel.copy()
    line = round(34 * ui)
    top = panel.top + title_height(ui) + round(4 * ui)
    columns = row(Rect(inside.left, top, inside.width, line), (1.0, 1.0, 1.2, 0.7), gap)
    top += line + gap
    wishes = row(Rect(inside.left, top, inside.width, round(40 * ui)), (1.0,) * len(BUTTONS), gap)
    top += round(40 * ui) + gap
    notice = Rect(inside.left, top, inside.width, round(42 * ui))
    status = Rect(inside.left, notice.bottom + gap, inside.width, max(1, inside.bottom - notice.bottom - gap))
    stop = Rect(0, 0, round(150 * ui), head.height - 2 * gap)
    stop.midright = (head.right - gap, head.centery)
    return Layout(
        ui=ui,
        head=head,
        location=location,
        laser=scan if laser else None,
        sonar=echoes if sonar else None,
        camera=picture if camera else None,
        panel=panel,
        fields=tuple(columns[:3]),
        buttons={Act.STOP: stop, Act.TAKE: columns[3], **dict(zip(BUTTONS, wishes, strict=True))},
        notice=notice,
        status=status,
    )
