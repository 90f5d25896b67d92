"""Everything has its place in a window of any size, and nothing lies upon anything else."""

import itertools

import pytest
from pygame import Rect

from vrg.ui.acts import Act
from vrg_views.hud.layout import layout

SENSORS = ("laser", "sonar", "camera")
ALL = dict.fromkeys(SENSORS, True)
SIZES = [(1280, 720), (1920, 1080), (1024, 768), (800, 600), (700, 1200), (3840, 2160)]


def test_the_quadrants_share_the_window() -> None:
    wrong = []
    for size, *has in itertools.product(SIZES, *[(True, False)] * 3):
        places = layout(*size, **dict(zip(SENSORS, has, strict=True)))
        sensors = [getattr(places, name) for name in SENSORS]
        areas = [places.head, places.location, places.panel, *(area for area in sensors if area is not None)]
        inside = all(Rect(0, 0, *size).contains(area) for area in areas)
        apart = not any(a.colliderect(b) for a, b in itertools.combinations(areas, 2))
        used = sum(area.width * area.height for area in areas) / (size[0] * size[1])
        if [area is not None for area in sensors] != has or not inside or not apart or used <= 0.93:
            wrong.append(f"{size}, {has=}: {inside=}, {apart=}, {used=}, {sensors=}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("size", SIZES)
def test_buttons_and_fields_are_in_the_panel_apart_from_each_other(size: tuple[int, int]) -> None:
    places = layout(*size, **ALL)
    inside = [*places.fields, *(place for act, place in places.buttons.items() if act is not Act.STOP)]
    inside += [places.notice, places.status]
    assert all(places.panel.contains(place) for place in inside)
    assert not any(a.colliderect(b) for a, b in itertools.combinations(inside, 2))
    assert places.head.contains(places.buttons[Act.STOP])


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080)])
def test_the_status_has_room_for_seven_lines(size: tuple[int, int]) -> None:
    places = layout(*size, **ALL)
    assert places.status.height / 7 >= 20 * places.ui


def test_what_is_at_a_pixel() -> None:
    places = layout(1280, 720, **ALL)
    assert places.button_at(*places.buttons[Act.BEGIN].center) is Act.BEGIN
    assert places.button_at(*places.buttons[Act.TAKE].center) is Act.TAKE
    assert places.field_at(*places.fields[2].center) == 2
    assert places.button_at(*places.location.center) is None
    assert places.field_at(*places.location.center) is None
    assert not places.map_area.collidepoint(places.location.left + 5, places.location.top + 5), "that is its title"


@pytest.mark.parametrize("size", [(1, 1), (60, 40), (300, 200), (200, 3000)])
def test_no_window_is_too_small(size: tuple[int, int]) -> None:
    places = layout(*size, **ALL)
    assert places.location.width >= 0
