"""The developers' view on SDL's dummy display: events become decisions, and what is known becomes pixels."""

import itertools
import time

import pygame
import pytest

from tests.ui.developer.making import KEYS, ROBOT, Bench
from vrg.bus import messages as m
from vrg.hal.sensors.laser import LaserSpec
from vrg.types import Pose
from vrg.ui import palette
from vrg.ui.developer import words
from vrg.ui.developer.choices import Layer, Tab
from vrg.ui.developer.deciding import Button


def pixel(x, y):
    return tuple(pygame.display.get_surface().get_at((round(x), round(y))))[:3]


def places(bench):
    return bench.node.shown.layout


@pytest.mark.parametrize(
    ("button", "said"),
    [
        (Button.RESUME, m.Official(action=m.OfficialAction.RESUME, by="test")),
        (Button.HALT, m.Official(action=m.OfficialAction.HALT, by="test")),
        (Button.RECOVER, m.Official(action=m.OfficialAction.RECOVER, by="test")),
        (Button.STOP, m.Estop(by="test")),
        (Button.RELEASE, m.EstopRelease(by="test")),
    ],
)
def test_buttons_and_their_keys_say_the_same(bench, button, said):
    keys = {Button.RESUME: "c", Button.HALT: "h", Button.RECOVER: "r", Button.STOP: "space", Button.RELEASE: "u"}
    assert bench.click(places(bench).buttons[button].center) == [said]
    assert bench.press(pygame.key.key_code(keys[button])) == [said]


def test_a_player_is_selected_on_the_field_or_in_the_list_and_then_disqualified(bench):
    place = places(bench).buttons[Button.DISQUALIFY].center
    assert bench.click(place) == []
    view = bench.node.shown.view
    pose = bench.pose("robot2")
    bench.click(tuple(map(round, view.point(pose.x, pose.y))))
    assert bench.node.choices.selected == "robot2"
    decision = m.Official(action=m.OfficialAction.DISQUALIFY, by="test", subject="robot2")
    assert bench.click(place) == [decision]
    bench.states["robot2"] = {"state": m.DISQUALIFIED}
    bench.ticks(2)
    assert bench.click(place) == [], "it is out already"
    again = bench.click(places(bench).buttons[Button.REINSTATE].center)
    assert again == [m.Official(action=m.OfficialAction.REINSTATE, by="test", subject="robot2")]
    row = next(found for found in bench.node.shown.players if found.name == "robot3")
    bench.click(row.area.center)
    assert bench.node.choices.selected == "robot3"


def test_without_an_officials_seat_it_stops_everything_and_decides_nothing():
    bench = Bench(official=False)
    try:
        for button, place in places(bench).buttons.items():
            assert bench.click(place.center) == ([m.Estop(by="test")] if button is Button.STOP else [])
        assert bench.press(pygame.K_h) == []
        assert bench.press(pygame.K_TAB) == []
        heard = {inlet.topic.key for inlet in bench.node.mailbox.inlets}
        assert not heard & {KEYS.manual().key, KEYS.links().key, KEYS.robot_pose().key}
        assert "player/{player}/bid" in bench.node.insight.unheard
    finally:
        bench.node.stop()


def test_what_the_referee_refuses_is_told_until_the_next_decision(bench):
    line = places(bench).notice

    def written():
        return any(
            pixel(x, y) == palette.WARNING for x in range(line.left, line.right) for y in range(line.top, line.bottom)
        )

    assert not written()
    bench.call(4, "refused", "resume, asked for by test, is refused: play is not halted")
    bench.ticks(2)
    assert written()
    bench.press(pygame.K_h)
    bench.ticks(1)
    assert not written()


def test_scans_are_drawn_where_the_robot_was_when_they_were_made(bench):
    for _ in range(3):
        bench.scan("robot1", 2.0)
        bench.tick()
    view, pose = bench.node.shown.view, bench.pose("robot1")
    # The laser's 92nd beam of 181, which meets something, points 1 degree to the left of straight ahead.
    mount = ROBOT.sensor(LaserSpec).x
    at = view.point(pose.x + mount + 2.0, pose.y + 0.035)
    colour = palette.ECHO
    assert any(pixel(at[0] + dx, at[1] + dy) == colour for dx in (-2, -1, 0, 1, 2) for dy in (-2, -1, 0, 1, 2))
    bench.press(pygame.K_1, mod=pygame.KMOD_CTRL)
    assert Layer.SCANS not in bench.node.choices.shown
    bench.tick()
    assert not any(pixel(at[0] + dx, at[1] + dy) == colour for dx in (-2, 0, 2) for dy in (-2, 0, 2))


def test_where_a_physical_robot_was_measured_is_outlined(bench):
    pose = bench.pose("robot1")
    bench.tell(KEYS.robot_pose("robot1"), m.MeasuredPose(pose=Pose(pose.x + 3.0, pose.y, 0.0)))
    bench.ticks(1)
    x, y = bench.node.shown.view.point(pose.x + 2.0, pose.y)
    assert palette.CAUTION in {pixel(x, y + dy) for dy in (-1, 0, 1)}, "a line leads from one to the other"
    bench.click(places(bench).overlays[Layer.MEASURED].center)
    assert palette.CAUTION not in {pixel(x, y + dy) for dy in (-1, 0, 1)}


def test_each_tab_is_opened_by_click_and_key_and_shows_something_of_its_own(bench):
    bench.processes()
    seen = set()
    for tab, key in zip(Tab, (pygame.K_F2, pygame.K_F3, pygame.K_F4, pygame.K_F5), strict=True):
        bench.click(places(bench).tabs[tab].center)
        assert bench.node.choices.tab is tab
        page = pygame.display.get_surface().subsurface(places(bench).page)
        seen.add(pygame.image.tobytes(page, "RGB"))
        bench.press(pygame.K_F2)
        bench.press(key)
        assert bench.node.choices.tab is tab
    assert len(seen) == len(Tab)


def test_a_heading_sorts_the_streams_and_the_wheel_scrolls_them(bench):
    bench.press(pygame.K_F4)
    heading = next(found for found in bench.node.shown.page if found.heading == "Hz")
    bench.click(heading.area.center)
    assert bench.node.choices.sort == ("Hz", True)
    bench.click(heading.area.center)
    assert bench.node.choices.sort == ("Hz", False)


def test_a_click_on_a_call_tells_why(bench):
    bench.call(1)
    bench.ticks(10)
    place = next(found.area.center for found in bench.node.shown.page if found.call)
    bench.click(place)
    deadline = time.monotonic() + 60.0
    while bench.node.explainer.card.busy and time.monotonic() < deadline:
        bench.ticks(1)
    assert bench.node.explainer.card.heading == "why call 1 was made"
    bench.press(pygame.K_ESCAPE)
    assert bench.node.explainer.card is None


def test_every_overlay_and_tab_has_its_words():
    assert set(words.OVERLAYS) == set(Layer)
    assert set(words.TABS) == set(Tab)


SIZES = ((1280, 720), (1920, 1080), (800, 600), (500, 800), (120, 90), (3000, 500))
USUAL = [(0, (800, 600)), (2, (120, 90)), (16, (1280, 720)), (40, (500, 800))]
OTHERS = [case for case in itertools.product((0, 2, 16, 40), SIZES) if case not in USUAL]


@pytest.mark.parametrize(
    ("players", "size"), [*USUAL, *(pytest.param(*case, marks=pytest.mark.thorough) for case in OTHERS)]
)
def test_every_size_of_window_is_drawn(size, players):
    bench = Bench(players, size)
    try:
        for name in bench.names:
            bench.scan(name)
            bench.ring(name)
        bench.press(pygame.K_2, mod=pygame.KMOD_CTRL)
        bench.press(pygame.K_QUESTION)
        for key in (pygame.K_F2, pygame.K_F3, pygame.K_F4, pygame.K_F5):
            bench.press(key)
        assert pygame.display.get_surface().get_size() == size
    finally:
        bench.node.stop()
