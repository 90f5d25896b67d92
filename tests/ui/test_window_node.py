"""The windows of a match, each tried by the contract of all, and what holds in one of them."""

from typing import Any

import pygame
import pytest

from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.pacing import LEASE, MAX_LEASE, lease
from vrg.bus.topics import Keys
from vrg.testing.views.window import Bench, WindowContract
from vrg.ui import acts
from vrg.ui.acts import Act
from vrg.ui.commander.node import Commander
from vrg.ui.window.replay import ReplayWindow
from vrg.ui.window.spectator import REFUSED, Spectator
from vrg.ui.window.window import SIZE, fitting
from vrg.ui.window.window_node import WindowNode


class TestSpectator(WindowContract):
    def make(self, keys: Keys, **more: Any) -> WindowNode:
        return Spectator("me", Mailbox(), keys, size=(900, 600), **more)


class TestCommander(WindowContract):
    by = "commander of minnows"

    def make(self, keys: Keys, **more: Any) -> WindowNode:
        return Commander("minnows", Mailbox(), keys, size=(900, 600), **more)


def test_whoever_may_only_watch_is_offered_no_key_that_is_refused(keys: Keys) -> None:
    window = Spectator("me", Mailbox(), keys, size=(640, 480), official=False)
    bench = Bench(window, keys)
    window.help = True
    for key, name in ((pygame.K_h, "H"), (pygame.K_u, "U"), (pygame.K_m, "M"), (pygame.K_TAB, "TAB")):
        assert name not in dict(window.listed)
        assert bench.down(key) == []
        assert window.notice == REFUSED
    assert bench.down(pygame.K_SPACE) == [m.Estop(by="me")]
    window.stop()


def test_a_lease_is_of_real_time_and_within_the_bound_of_the_message() -> None:
    assert lease(1.0) == LEASE
    assert lease(2.0) == pytest.approx(2 * LEASE)
    assert lease(100.0) == lease(0.0) == MAX_LEASE


def test_no_key_is_listed_with_two_meanings() -> None:
    keys = [act.value[0] for act in Act if act.value[0]]
    assert len(keys) == len(set(keys))
    assert set(ReplayWindow.meanings) == {Act.STEER}, "there is nothing to steer"
    assert {press.act for press in acts.PAD.values()} <= set(Act)


@pytest.mark.parametrize(
    ("screen", "size"),
    [((1280, 720), (1280, 640)), ((1920, 1080), (1440, 810)), ((3840, 2160), (2880, 1620)), ((800, 600), (800, 520))],
)
def test_a_window_fits_its_screen_below_the_decorations(screen: tuple[int, int], size: tuple[int, int]) -> None:
    assert fitting(screen) == size
    assert SIZE == (1280, 720)
