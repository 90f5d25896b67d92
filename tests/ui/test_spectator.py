"""The window, on SDL's dummy display; keys come as events."""

import os
import subprocess
import sys

import pygame
import pytest

from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.testing.views import synthetic
from vrg.ui.window.spectator import HOLD, Spectator
from vrg.ui.window.window import display_available
from vrg.ui.window.window_node import FRAME


@pytest.fixture
def window(keys, tmp_path, match):
    """The window after its first tick."""
    spectator = Spectator("spectator", Mailbox(), keys, size=(640, 480), run=tmp_path)
    assert not pygame.display.get_init()
    match.step(spectator, 5.0, 0)
    yield spectator
    spectator.stop()


@pytest.fixture
def match(keys):
    return synthetic.SyntheticMatch(keys)


def press(key, mod=0):
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=mod))


def said(node):
    return [out.message.body for out in node.mailbox.collect()]


def test_the_window_opens_at_the_first_tick_and_shows_the_match(window):
    shown = pygame.display.get_surface()
    assert shown.get_size() == (640, 480)
    assert len({tuple(shown.get_at((x, y))) for x in range(0, 640, 7) for y in range(0, 480, 7)}) > 10
    assert window.scene.clock == 5.0


def test_when_it_is_over_enter_asks_to_watch_it_again_if_it_is_recorded(keys, tmp_path, match):
    recorded = []
    file = tmp_path / "no-such-folder" / "again"
    window = Spectator("s", Mailbox(), keys, size=(640, 480), again=lambda: recorded[0] if recorded else None)
    match.step(window, 5.0, 0)
    recorded.append(file)
    press(pygame.K_RETURN)
    match.step(window, 5.1, 1)
    assert not window.notice, "the match is not over"
    match.step(window, 5.2, 2, stage=m.Stage.GAME_OVER)
    match.step(window, 5.3, 3, stage=m.Stage.GAME_OVER)
    press(pygame.K_KP_ENTER)
    match.step(window, 5.4, 4, stage=m.Stage.GAME_OVER)
    assert "cannot be shown again" in window.notice
    file.parent.mkdir()
    pygame.event.post(pygame.event.Event(pygame.KEYUP, key=pygame.K_KP_ENTER, mod=0))
    press(pygame.K_KP_ENTER)
    match.step(window, 5.5, 5, stage=m.Stage.GAME_OVER)
    assert file.exists()
    assert not window.closed, "it stays until the replay draws, or nobody opens one"
    for number in range(6, 6 + HOLD):
        match.step(window, 5.5, number, stage=m.Stage.GAME_OVER)
    assert window.closed


def test_a_player_that_is_gone_is_not_driven(window, match):
    press(pygame.K_TAB)
    match.step(window, 5.1, 1)
    match.step(window, 5.2, 2, players=synthetic.players(5.2)[1:])
    window.mailbox.collect()
    match.step(window, 5.3, 3)
    match.step(window, 5.4, 4)
    assert said(window) == [m.Manual(forward=0.0, turn=0.0, lease=0.0)]


def test_pictures_are_numbered(window, match, tmp_path):
    for number in range(1, 3):
        press(pygame.K_p)
        pygame.event.post(pygame.event.Event(pygame.KEYUP, key=pygame.K_p, mod=0))
        match.step(window, 5.0 + number, number)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["picture-001.png", "picture-002.png"]
    assert pygame.image.load(str(tmp_path / "picture-001.png")).get_size() == (640, 480)


def test_what_a_key_has_done_is_told_where_it_cannot_be_seen(window, match, tmp_path):
    press(pygame.K_l)
    match.step(window, 5.1, 1)
    assert "No player shows a plan" in window.notice
    press(pygame.K_p)
    match.step(window, 5.2, 2)
    assert window.notice == f"Picture saved: picture-001.png in {tmp_path}"
    press(pygame.K_c)
    match.step(window, 5.3, 3)
    assert not window.notice
    [asked] = said(window)
    text, why = "resume is refused: here is the reason", "the emergency stop is engaged"
    for number, answers in enumerate(("another window's", asked.id), 1):
        call = m.Call(
            number=number, rule="refused", text=text, players=(), poses=(), clock=5.0, answers=answers, why=why
        )
        match.say(window.mailbox, match.keys.referee_event, call, 5.4, number)
        match.step(window, 5.4, 3 + number)
        assert window.notice == ("Refused: the emergency stop is engaged" if answers == asked.id else "")


def test_a_picture_that_cannot_be_written_ends_nothing(keys, match, tmp_path, caplog):
    window = Spectator("spectator", Mailbox(), keys, run=tmp_path / "nowhere")
    match.step(window, 5.0, 0)
    press(pygame.K_p)
    match.step(window, 5.1, 1)
    assert "cannot write the picture" in caplog.text
    window.stop()


def test_a_fast_match_is_not_drawn_at_every_tick(window, match, monkeypatch):
    frames = []
    assert window.period == FRAME
    monkeypatch.setattr(pygame.display, "flip", lambda: frames.append(1))
    for number in range(300):
        time = number / 30
        clock = m.Clock(time=time, tick=number, epoch=0, rate=10.0, estop=False)
        match.say(window.mailbox, match.keys.clock, clock, time, number)
        window.mailbox.handover(time)
        window.tick(Tick(time))
        pygame.event.clear()
    assert 30 <= len(frames) <= 40


def test_a_display_that_nobody_sees_is_none():
    assert not display_available()
    assert not pygame.display.get_init()


def test_the_mixer_is_never_started():
    """In a process of its own, since pygame's modules keep their state."""
    program = (
        "import os, pygame\n"
        "from vrg.testing.views import synthetic\n"
        "from vrg.bus.mailbox import Mailbox\n"
        "from vrg.bus.topics import Keys\n"
        "from vrg.ui.window.spectator import Spectator\n"
        "window = Spectator('s', Mailbox(), Keys('m'))\n"
        "synthetic.SyntheticMatch(Keys('m')).step(window, 1.0, 0)\n"
        "assert pygame.mixer.get_init() is None\n"
        "assert os.environ['SDL_AUDIODRIVER'] == 'dummy'\n"
    )
    environment = {**os.environ, "SDL_VIDEODRIVER": "dummy"}
    environment.pop("SDL_AUDIODRIVER")
    subprocess.run([sys.executable, "-c", program], check=True, env=environment, timeout=300)


def test_m_after_tab_gives_the_player_back_and_tells_it(window, match):
    press(pygame.K_TAB)
    match.step(window, 5.1, 1)
    assert window.driving.player == "bruce"
    press(pygame.K_m)
    match.step(window, 5.2, 2)
    assert window.driving.player is None
    assert window.notice == "bruce is given back"
