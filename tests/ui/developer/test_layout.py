"""Where things are in the developers' view."""

import itertools

import pytest

from vrg.ui.developer.layout import layout


def test_nothing_lies_upon_anything_else_and_all_is_in_the_window():
    wrong = []
    for size, players in itertools.product([(1280, 720), (1920, 1080), (1024, 768), (900, 1200)], (2, 7, 16)):
        places = layout(*size, players)
        groups = [places.overlays, places.buttons, places.tabs]
        singles = [places.field, places.notice, places.head, places.players, places.page]
        areas = [area for group in groups for area in group.values()] + singles
        for one, other in itertools.combinations(areas, 2):
            if one.colliderect(other):
                wrong.append(f"{size}, {players} players: {one} and {other}")
        for area in areas:
            if not (0 <= area.left < area.right <= size[0] and 0 <= area.top < area.bottom <= size[1]):
                wrong.append(f"{size}, {players} players: {area}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080)])
def test_all_of_sixteen_players_have_a_row_and_the_tab_has_room(size):
    places = layout(*size, 16)
    assert places.players.height > 16.5 * places.row
    assert places.row >= 15 * places.ui - 1
    assert places.page.height > 0.3 * size[1]


def test_clicks_find_what_is_there():
    places = layout(1280, 720, 4)
    for overlay, area in places.overlays.items():
        assert places.overlay_at(area.center) is overlay
    for button, area in places.buttons.items():
        assert places.button_at(area.center) is button
    for tab, area in places.tabs.items():
        assert places.tab_at(area.center) is tab
    assert places.button_at(places.field.center) is None
