"""The window of a replay, on SDL's dummy display; keys and the mouse come as events."""

from dataclasses import replace

import pygame
import pytest

from tests.ui.pictures import close_to, colours_near, content
from vrg.games import game_of
from vrg.recording.recorded import read_recorded
from vrg.testing.views import synthetic
from vrg.ui.acts import Act
from vrg.ui.timeline import Timeline
from vrg.ui.window.replay import MOVES, ReplayWindow, show
from vrg.ui.window.text import Fonts

SIZE = (1280, 720)


@pytest.fixture(scope="module")
def timeline(recorded):
    return Timeline(read_recorded(recorded), obstacles=synthetic.OBSTACLES)


@pytest.fixture
def window(timeline):
    window = ReplayWindow(timeline, title="test", size=SIZE)
    window.open()
    window.frame(0.0)
    yield window
    window.close()


SIGNS = {".": pygame.K_PERIOD, ",": pygame.K_COMMA, "+": pygame.K_PLUS, "-": pygame.K_MINUS, "?": pygame.K_SLASH}


def press(window, *keys, seconds=0.0):
    """Press and release keys, one after the other, and let the window draw."""
    for key in keys:
        code, sign = (SIGNS[key], key) if isinstance(key, str) else (key, "")
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=code, mod=0, unicode=sign))
        pygame.event.post(pygame.event.Event(pygame.KEYUP, key=code, mod=0))
    window.frame(seconds)


def mouse(window, kind, x, y=None):
    y = window.bar.track.centery if y is None else y
    fields = {"pos": (x, y), "rel": (0, 0), "buttons": (1, 0, 0)} if kind == pygame.MOUSEMOTION else {
        "pos": (x, y), "button": pygame.BUTTON_LEFT,
    }  # fmt: skip
    pygame.event.post(pygame.event.Event(kind, **fields))
    window.frame(0.0)


def picture_of(window):
    window.frame(0.0)
    return content()


def test_it_opens_and_plays_from_the_beginning(window):
    assert pygame.display.get_window_size() == SIZE
    assert window.scene.time == 0.0
    window.frame(0.5)
    assert window.scene.time == 0.5


def test_the_scene_and_the_panel_are_those_of_the_match(window):
    window.playback = window.playback.to(21.0)
    window.frame(0.0)
    assert window.scene.clock == pytest.approx(1.0)
    assert (window.scene.round, window.scene.stage) == (2, "play_round")
    assert dict(window.scene.score) == {"sharks": 2, "minnows": 0}
    assert [call.rule for call in window.scene.calls] == ["tag", "out_of_bounds"]


@pytest.mark.parametrize("time", [0.0, 8.0, 30.0])
def test_robots_are_drawn_where_the_recording_says(window, time):
    window.playback = window.playback.to(time).toggle()
    window.frame(0.0)
    shown = pygame.display.get_surface()
    style = game_of("sharks-and-minnows").style
    for name in ("nemo", "dory", "squirt", "anchor"):
        pose = synthetic.pose_at(name, time)
        [status] = [player for player in synthetic.players(time) if player.name == name]
        colour = style(status.role, status.state).colour
        assert close_to(colours_near(shown, window.view.point(pose.x, pose.y), 9), colour, 29) > 20, name


def test_k_pauses_and_goes_on(window):
    press(window, pygame.K_k, seconds=1.0)
    assert (window.playback.playing, window.scene.time) == (False, 0.0)
    press(window, pygame.K_k, seconds=1.0)
    assert window.scene.time == 1.0


def test_space_does_not_pause_as_it_is_the_emergency_stop_elsewhere(window):
    before = picture_of(window)
    press(window, pygame.K_SPACE)
    assert window.playback.playing
    assert picture_of(window) != before, "the window tells which key pauses"


@pytest.mark.parametrize(
    ("keys", "speed"),
    [
        ([pygame.K_UP], 2.0),
        (["+", "+"], 4.0),
        ([pygame.K_KP_PLUS], 2.0),
        ([pygame.K_DOWN], 0.5),
        (["-", "-"], 0.25),
        ([pygame.K_UP] * 9, 16.0),
    ],
)
def test_the_speed(window, keys, speed):
    press(window, *keys, seconds=0.5)
    assert window.scene.time == pytest.approx(0.5 * speed)
    assert window.scene.rate == speed


def test_keys_step_skip_and_go_to_calls_and_ends(window):
    press(window, pygame.K_k, ".", ".", ".", seconds=1.0)
    assert window.scene.time == 0.3
    for keys, time in (
        ([","], 0.2),
        ([pygame.K_HOME, pygame.K_RIGHT, pygame.K_RIGHT], 10.0),
        ([pygame.K_LEFT], 5.0),
        ([pygame.K_END], 39.9),
        ([pygame.K_HOME], 0.0),
        ([pygame.K_PAGEDOWN, pygame.K_PAGEDOWN], synthetic.OUT_AT),
        ([pygame.K_PAGEUP], synthetic.TAGGED_AT),
    ):
        press(window, *keys)
        assert window.scene.time == time, keys
    assert [flash.word for flash in window.scene.flashes] == ["tag"]


def test_a_key_that_is_held_goes_on_stepping_but_pauses_only_once(window):
    for _ in range(5):
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_PERIOD, mod=0, unicode="."))
    window.frame(0.0)
    assert window.scene.time == 0.5
    for _ in range(4):
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_k, mod=0, unicode=" "))
    window.frame(0.0)
    assert window.playback.playing


def test_a_click_on_the_bar_goes_there_and_the_replay_plays_on(window):
    bar = window.bar
    mouse(window, pygame.MOUSEBUTTONDOWN, bar.x_of(20.0))
    assert window.scene.time == pytest.approx(20.0, abs=0.05)
    window.frame(3.0)
    assert window.scene.time == pytest.approx(20.0, abs=0.05), "the knob is held"
    mouse(window, pygame.MOUSEBUTTONUP, bar.x_of(20.0))
    window.frame(3.0)
    assert window.scene.time == pytest.approx(23.0, abs=0.05)


def test_the_knob_can_be_dragged_back_and_forth_also_off_the_bar(window):
    bar = window.bar
    mouse(window, pygame.MOUSEBUTTONDOWN, bar.x_of(10.0))
    for time in (30.0, 5.0, 17.0):
        mouse(window, pygame.MOUSEMOTION, bar.x_of(time), y=40)
        assert window.scene.time == pytest.approx(time, abs=0.05)
    mouse(window, pygame.MOUSEMOTION, 5000)
    assert window.scene.time == 39.9
    mouse(window, pygame.MOUSEBUTTONUP, 5000)
    mouse(window, pygame.MOUSEMOTION, bar.x_of(3.0))
    assert window.scene.time == 39.9, "it was let go"


def test_a_click_on_the_button_pauses_and_one_on_the_field_does_nothing(window):
    x, y = window.bar.button.center
    mouse(window, pygame.MOUSEBUTTONDOWN, x, y)
    assert not window.playback.playing
    before = window.playback
    mouse(window, pygame.MOUSEBUTTONDOWN, 300, 300)
    assert window.playback == before


def test_the_keyboard_going_elsewhere_lets_go_of_the_knob(window):
    mouse(window, pygame.MOUSEBUTTONDOWN, window.bar.x_of(20.0))
    pygame.event.post(pygame.event.Event(pygame.WINDOWFOCUSLOST))
    window.frame(0.0)
    assert not window.playback.held


def test_the_window_can_be_resized(window):
    pygame.display.set_mode((1920, 1080), pygame.RESIZABLE)
    window.frame(0.1)
    assert window.bar.area.bottomright == (1920, 1080)
    shown = pygame.display.get_surface()
    assert len({tuple(shown.get_at((x, window.bar.track.centery))) for x in range(1920)}) > 3
    pygame.display.set_mode((200, 90), pygame.RESIZABLE)
    window.frame(0.1)
    assert window.bar.area.bottomright == (200, 90)


def test_a_question_mark_lists_the_keys_and_takes_them_away(window):
    press(window, pygame.K_k)
    plain = picture_of(window)
    press(window, "?")
    assert picture_of(window) != plain
    press(window, pygame.K_F1)
    assert picture_of(window) == plain


def test_the_keys_beside_the_field_and_in_banners_are_those_of_this_window(timeline, window):
    """In the spectator's window H halts and U releases the emergency stop; here nobody can."""
    words = []
    render = Fonts.render
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Fonts, "render", lambda self, text, *rest: words.append(text) or render(self, text, *rest))
        stopped = replace(timeline.at(5.0), estop=True)
        patch.setattr(timeline, "at", lambda *_: stopped)
        press(window, pygame.K_k, pygame.K_RIGHT)
        press(window, "?")
    assert {"EMERGENCY STOP", "pause, continue", "next call"} <= set(words)
    assert not [text for text in words if "releases" in text or text == "H"]


def test_a_mouse_that_leaves_the_window_points_at_nothing(window):
    press(window, pygame.K_k)
    before = picture_of(window)
    mouse(window, pygame.MOUSEMOTION, window.bar.x_of(synthetic.TAGGED_AT))
    assert picture_of(window) != before
    pygame.event.post(pygame.event.Event(pygame.WINDOWLEAVE))
    assert picture_of(window) == before


def test_all_keys_are_listed(window):
    press(window, "?")
    acts = {act.value for act in (*MOVES, Act.BRANCH, Act.WHY, Act.PLANS, Act.LEAVE, Act.PICTURE, Act.CLOSE)}
    assert acts | {("ARROWS", "5 s on or back, speed")} <= set(window.listed)
    assert "SPACE" not in dict(window.listed), "it stops nothing here"


@pytest.mark.parametrize("how", ["key", "button"])
def test_closing_the_window(window, how):
    if how == "key":
        press(window, pygame.K_q)
    else:
        pygame.event.post(pygame.event.Event(pygame.QUIT))
        window.frame(0.0)
    assert window.closed
    assert not pygame.display.get_init()


def test_a_paused_replay_is_not_drawn_again_and_again(window, monkeypatch):
    frames = []
    monkeypatch.setattr(pygame.display, "flip", lambda: frames.append(1))
    press(window, pygame.K_k)
    for _ in range(20):
        window.frame(0.03)
    assert len(frames) == 1


def test_it_runs_in_real_time_until_it_is_closed(timeline):
    window = ReplayWindow(timeline, title="test", size=(640, 480))
    seen = []

    def frame(seconds):
        seen.append(seconds)
        if len(seen) == 3:
            window.close()

    window.frame = frame
    show(window)
    assert len(seen) == 3
    assert not pygame.display.get_init()
