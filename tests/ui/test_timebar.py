"""The time bar: which time is at which pixel, and what is drawn there."""

import itertools

import pygame
import pytest

from vrg.bus.messages import Call
from vrg.ui import palette
from vrg.ui.playback import Playback
from vrg.ui.timeline import CallMark
from vrg.ui.window.text import Fonts
from vrg.ui.window.timebar import TimeBar, TimeBarPainter

PLAYBACK = Playback.of([10.0, 60.0, 110.0], [35.0], 110.0)
SIZES = [(320, 240), (640, 480), (1280, 720), (1920, 1080)]


def bar_of(size, playback=PLAYBACK):
    ui = 1.0 if size[0] < 1920 else 1.5
    return TimeBar.below(size, ui, playback)


@pytest.fixture
def bar() -> TimeBar:
    """The bar of a window of a usual size."""
    return bar_of((1280, 720))


@pytest.mark.parametrize("size", SIZES)
def test_the_bar_is_at_the_lower_edge_and_its_parts_are_beside_each_other(size):
    bar = bar_of(size)
    assert bar.area.bottomright == size
    assert bar.area.contains(bar.button)
    assert bar.area.contains(bar.track)
    assert bar.button.right < bar.track.left
    assert bar.track.width > 60


@pytest.mark.parametrize("size", SIZES)
def test_the_ends_of_the_track_are_the_ends_of_the_match(size):
    bar = bar_of(size)
    assert (bar.x_of(10.0), bar.x_of(110.0)) == (bar.track.left, bar.track.right)
    assert (bar.time_at(bar.track.left), bar.time_at(bar.track.right)) == (10.0, 110.0)
    assert bar.x_of(60.0) == pytest.approx(bar.track.centerx, abs=1)


def test_a_pixel_and_its_time_belong_together(bar):
    for x in range(bar.track.left, bar.track.right + 1, 7):
        assert bar.x_of(bar.time_at(x)) == x


def test_beyond_the_ends_there_is_no_other_time(bar):
    assert (bar.time_at(-50), bar.time_at(5000)) == (10.0, 110.0)
    assert (bar.x_of(0.0), bar.x_of(999.0)) == (bar.track.left, bar.track.right)


def test_a_match_of_one_instant_has_a_bar():
    bar = bar_of((1280, 720), Playback.of([5.0], [], 5.0))
    assert bar.x_of(5.0) == bar.track.left
    assert bar.time_at(bar.track.centerx) == 5.0


def test_the_knob_is_taken_somewhat_beside_the_line_but_not_at_the_button_or_on_the_field(bar):
    x, y = bar.track.center
    assert bar.is_on_track((x, y - 12))
    assert bar.is_on_track((bar.track.left - 5, y))
    assert not bar.is_on_track(bar.button.center)
    assert not bar.is_on_track((x, bar.top - 1))


def drawn(playback=PLAYBACK, calls=(), note="", mouse=None, size=(1280, 720)):
    surface = pygame.Surface(size)
    bar = bar_of(size, playback)
    TimeBarPainter(Fonts()).draw(surface, bar, playback, calls, note, mouse)
    return surface, bar


def test_the_knob_is_where_its_time_is():
    wrong = []
    for time, size in itertools.product((10.0, 47.0, 110.0), SIZES):
        surface, bar = drawn(PLAYBACK.to(time), size=size)
        y = bar.track.centery - round(5 * bar.ui)
        near = range(bar.track.left - round(9 * bar.ui), bar.track.right + round(9 * bar.ui))
        white = [x for x in near if tuple(surface.get_at((x, y)))[:3] == palette.TEXT]
        if not white or abs(sum(white) / len(white) - bar.x_of(time)) > 1.5:
            wrong.append(f"{time} s, {size}: {white}, expected {bar.x_of(time)}")
    assert not wrong, "\n".join(wrong)


def test_calls_are_marked_where_they_were_made():
    calls = [
        CallMark(35.0, Call(rule="tag", text="a is tagged"), True),
        CallMark(80.0, Call(rule="pass", text="pass 1 is over"), False),
    ]
    surface, bar = drawn(calls=calls)
    y = bar.track.centery - 7
    assert tuple(surface.get_at((bar.x_of(35.0), y)))[:3] == palette.CAUTION
    assert tuple(surface.get_at((bar.x_of(80.0), y)))[:3] == palette.MUTED
    assert tuple(surface.get_at((bar.x_of(55.0), y)))[:3] == palette.PANEL


def below(surface, bar):
    """What is written below the track."""
    top = bar.track.bottom + round(14 * bar.ui)
    return pygame.image.tobytes(surface.subsurface((0, top, bar.width, bar.area.bottom - top)), "RGB")


def test_a_note_is_seen_and_the_mouse_on_the_track_replaces_it():
    calls = [CallMark(35.0, Call(rule="tag", text="a is tagged"), True)]
    plain, bar = drawn(calls=calls)
    noted, _ = drawn(calls=calls, note="The recording ends early.")
    assert below(plain, bar) != below(noted, bar)
    at_the_call, _ = drawn(calls=calls, note="The recording ends early.", mouse=(bar.x_of(35.0) + 3, bar.track.centery))
    elsewhere, _ = drawn(calls=calls, note="The recording ends early.", mouse=(bar.x_of(70.0), bar.track.centery))
    on_the_field, _ = drawn(calls=calls, note="The recording ends early.", mouse=(bar.x_of(70.0), 100))
    assert below(on_the_field, bar) == below(noted, bar)
    assert len({below(surface, bar) for surface in (noted, at_the_call, elsewhere)}) == 3


def test_the_button_shows_what_it_does():
    playing, bar = drawn()
    paused, _ = drawn(PLAYBACK.toggle())
    one, other = (pygame.image.tobytes(surface.subsurface(bar.button), "RGB") for surface in (playing, paused))
    assert one != other
