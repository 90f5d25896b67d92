"""What the spectator's keys mean."""

import pygame
import pytest

from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.ui.controls import LEASE, Controls

PLAYERS = ["bruce", "nemo", "dory"]


@pytest.fixture
def controls(keys):
    return Controls(Mailbox(), keys, by="spectator")


def said(controls):
    return [(out.message.key.removeprefix("vrg/test/"), out.message.body) for out in controls.mailbox.collect()]


def test_space_stops_everything(controls):
    controls.press(pygame.K_SPACE, PLAYERS)
    assert said(controls) == [("estop", m.Estop(by="spectator"))]


def test_space_never_releases(controls):
    for shift in (False, True):
        controls.press(pygame.K_SPACE, PLAYERS, shift=shift)
    assert {type(body) for _, body in said(controls)} == {m.Estop}


def test_releasing_is_a_key_of_its_own(controls):
    controls.press(pygame.K_u, PLAYERS)
    assert said(controls) == [("estop/release", m.EstopRelease(by="spectator"))]


@pytest.mark.parametrize(
    ("key", "action"),
    [
        (pygame.K_h, m.OfficialAction.HALT),
        (pygame.K_c, m.OfficialAction.RESUME),
        (pygame.K_r, m.OfficialAction.RECOVER),
    ],
)
def test_halt_continue_and_recover_go_to_the_referee(controls, key, action):
    controls.press(key, PLAYERS)
    [(topic, official)] = said(controls)
    assert (topic, official.action, official.by, official.subject) == ("official", action, "spectator", None)


def test_tab_goes_through_the_players_and_gives_each_back(controls):
    seen = []
    for _ in range(4):
        controls.press(pygame.K_TAB, PLAYERS)
        seen.append(controls.driving)
    assert seen == ["bruce", "nemo", "dory", "bruce"]
    assert [(topic, body.lease) for topic, body in said(controls)] == [
        ("player/bruce/manual", 0.0),
        ("player/nemo/manual", 0.0),
        ("player/dory/manual", 0.0),
    ]


def test_tab_with_shift_goes_backwards(controls):
    controls.press(pygame.K_TAB, PLAYERS, shift=True)
    assert controls.driving == "dory"
    controls.press(pygame.K_TAB, PLAYERS, shift=True)
    assert controls.driving == "nemo"


def test_without_players_tab_selects_nobody(controls):
    controls.press(pygame.K_TAB, [])
    controls.steer()
    assert (controls.driving, said(controls)) == (None, [])


def test_arrows_steer_the_selected_player_as_long_as_they_are_held(controls):
    controls.press(pygame.K_TAB, PLAYERS)
    controls.press(pygame.K_UP, PLAYERS)
    controls.press(pygame.K_LEFT, PLAYERS)
    controls.steer()
    controls.release(pygame.K_UP)
    controls.steer()
    assert said(controls) == [
        ("player/bruce/manual", m.Manual(forward=1.0, turn=1.0, lease=LEASE)),
        ("player/bruce/manual", m.Manual(forward=0.0, turn=1.0, lease=LEASE)),
    ]


def test_opposite_arrows_cancel(controls):
    controls.press(pygame.K_TAB, PLAYERS)
    for key in (pygame.K_UP, pygame.K_DOWN, pygame.K_LEFT, pygame.K_RIGHT):
        controls.press(key, PLAYERS)
    controls.steer()
    assert said(controls) == [("player/bruce/manual", m.Manual(forward=0.0, turn=0.0, lease=LEASE))]


def test_arrows_without_a_selected_player_drive_nobody(controls):
    controls.press(pygame.K_UP, PLAYERS)
    controls.steer()
    assert said(controls) == []


def test_a_key_that_was_held_when_the_keyboard_left_does_not_stick(controls):
    controls.press(pygame.K_TAB, PLAYERS)
    controls.press(pygame.K_UP, PLAYERS)
    controls.let_go()
    controls.steer()
    assert said(controls)[-1][1].forward == 0.0


def test_escape_gives_the_player_back_at_once(controls):
    controls.press(pygame.K_TAB, PLAYERS)
    controls.press(pygame.K_ESCAPE, PLAYERS)
    controls.steer()
    assert said(controls) == [("player/bruce/manual", m.Manual(forward=0.0, turn=0.0, lease=0.0))]


@pytest.mark.parametrize("key", [pygame.K_q, pygame.K_END])
def test_closing_gives_the_player_back_and_ends_no_match(controls, key):
    controls.press(pygame.K_TAB, PLAYERS)
    controls.press(key, PLAYERS)
    assert controls.quit
    assert [topic for topic, _ in said(controls)] == ["player/bruce/manual"]


def test_other_keys_do_nothing(controls):
    controls.press(pygame.K_x, PLAYERS)
    assert (said(controls), controls.quit, controls.picture) == ([], False, False)


def test_the_keys_are_listed_until_the_key_is_pressed_again(controls):
    for wanted in (True, False):
        controls.press(pygame.K_QUESTION, PLAYERS)
        assert controls.help is wanted
    assert said(controls) == []


def test_f11_asks_for_the_whole_screen(controls):
    controls.press(pygame.K_F11, PLAYERS)
    assert controls.whole_screen
    assert said(controls) == []
