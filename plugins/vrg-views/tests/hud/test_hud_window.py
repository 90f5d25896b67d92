"""The display's window: events become orders, and what the player knows becomes pixels."""

import math
import os
from collections.abc import Iterator
from typing import Any

import pygame
import pytest
from displays import (
    GROUND,
    KEYS,
    ROBOT,
    START,
    ins,
    odometry,
    picture,
    report,
    ring,
    scan,
    sent,
    state,
    status,
    topic_of,
)

from vrg.bus import messages as m
from vrg.bus.access import hears, lines, speaks
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.pacing import LEASE
from vrg.bus.topics import key_matches
from vrg.colours import Rgb
from vrg.seats.seat import Roster, Seat, SeatKind
from vrg.testing.views.virtual_pad import VirtualPad
from vrg.types import Pose, Twist
from vrg.ui import palette
from vrg.ui.acts import Act
from vrg.ui.palette import WARNING
from vrg_views.hud.helm import Goal, Wish
from vrg_views.hud.layout import Layout
from vrg_views.hud.node import Hud

RELEASED = m.Manual(forward=0.0, turn=0.0, lease=0.0)
X = pygame.CONTROLLER_BUTTON_X
BACK = pygame.CONTROLLER_BUTTON_BACK
RIGHT = pygame.CONTROLLER_BUTTON_RIGHTSHOULDER


class Bench:
    """The display of ann, to whom the test tells what there is."""

    def __init__(self, size: tuple[int, int] = (1280, 720)) -> None:
        os.environ["SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS"] = "1"
        self.node = Hud(
            "ann", Mailbox(), KEYS, team="red", robot=ROBOT, start=START, ground=GROUND,
            sizes={"ann": ROBOT.size, "bob": ROBOT.size}, size=size,
        )  # fmt: skip
        self.time = 1.0
        self.pose = START
        self.others = [status("bob", Pose(3.5, 2.0, 0.0))]
        self.changes: dict[str, Any] = {}
        self.report = report(battery=0.8)
        self.more: list[m.Message] = []
        self.tick()
        self.tick()

    def tick(self) -> list[tuple[str, m.Message]]:
        """One tick; what was published, but for requests of pictures."""
        self.time += 0.04
        me = status("ann", self.pose)
        clock = m.Clock(time=self.time, tick=round(self.time * 50), epoch=0, rate=1.0, estop=False)
        bodies = [clock, state(me, *self.others, **self.changes), self.report, ins(self.pose), *self.more]
        for body in bodies:
            self.tell(body)
        self.node.mailbox.handover(self.time)
        self.node.tick(Tick(self.time))
        return [out for out in sent(self.node.mailbox) if not isinstance(out[1], m.CameraRequest)]

    def tell(self, body: m.Message) -> None:
        topic = topic_of(body)
        for inlet in self.node.mailbox.inlets:
            if inlet.topic.key == topic.key:
                inlet.offer(Received(topic.key, self.time, round(self.time * 100), body))

    def key(self, key: int, sign: str = "", *, mod: int = 0) -> list[tuple[str, m.Message]]:
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=mod, unicode=sign))
        said = self.tick()
        pygame.event.post(pygame.event.Event(pygame.KEYUP, key=key, mod=mod))
        return said

    def click(self, place: tuple[float, float]) -> list[tuple[str, m.Message]]:
        at = (round(place[0]), round(place[1]))
        pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=1, pos=at))
        return self.tick()

    def press(self, button: Act) -> list[tuple[str, m.Message]]:
        """Click on a button."""
        return self.click(self.places.buttons[button].center)

    @property
    def places(self) -> Layout:
        """Where things are in the window."""
        assert self.node.shown is not None
        return self.node.shown[0]

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Where a point of the field is in the window."""
        assert self.node.shown is not None
        return self.node.shown[1].point(x, y)

    def count(self, colour: Rgb, area: pygame.Rect | None = None) -> int:
        """The number of pixels of a colour in an area of the window."""
        shown = pygame.display.get_surface()
        assert shown is not None
        pixels = pygame.surfarray.array3d(shown if area is None else shown.subsurface(area))
        return int((pixels == colour).all(axis=-1).sum())


@pytest.fixture
def bench() -> Iterator[Bench]:
    bench = Bench()
    yield bench
    bench.node.stop()


@pytest.fixture
def pad(bench: Bench) -> Iterator[VirtualPad]:
    """A gamepad that is in use: its first press does nothing else."""
    pad = VirtualPad()
    bench.tick()
    pad.button(X, True)
    bench.tick()
    pad.button(X, False)
    bench.tick()
    assert bench.node.pads.active is not None
    assert bench.node.desk.wish is Wish.WATCH
    yield pad
    if bench.node.pads.active is not None:
        pad.unplug()


class TestMouse:
    def test_a_click_on_the_map_sets_the_goal_and_goto_drives_there(self, bench: Bench) -> None:
        assert bench.click(bench.pixel(0.0, 1.0)) == []
        goal = bench.node.desk.goal
        assert goal is not None
        assert (goal.x, goal.y) == pytest.approx((0.0, 1.0), abs=0.05)
        [(key, manual)] = bench.press(Act.GOTO)
        assert key == "player/ann/manual"
        assert isinstance(manual, m.Manual)
        assert manual.lease == LEASE
        assert bench.node.board.mode == "Goto/Drive"
        assert bench.node.board.way, "the way is shown"

    def test_a_click_outside_of_the_map_is_refused_in_words(self, bench: Bench) -> None:
        bench.click(bench.pixel(0.0, 1.0))
        before = bench.node.desk.goal
        bench.click(bench.pixel(-5.5, 0.0))
        assert bench.node.desk.goal == before
        assert "outside of the map" in bench.node.board.notice
        assert bench.count(WARNING, bench.places.notice) > 50

    def test_buttons(self, bench: Bench) -> None:
        bench.press(Act.MANUAL)
        assert bench.node.desk.wish is Wish.MANUAL
        bench.press(Act.BEGIN)
        assert bench.node.board.mode.startswith("Reset/")
        assert ("player/ann/manual", RELEASED) in bench.press(Act.LEAVE)
        assert [body for _, body in bench.press(Act.STOP)] == [m.Estop(by="display of ann")]

    def test_a_field_is_clicked_and_typed_into_and_set(self, bench: Bench) -> None:
        for field, text in zip(bench.places.fields, ("-1.5", "2", "90"), strict=True):
            bench.click(field.center)
            for sign in text:
                bench.key(ord(sign), sign)
        bench.press(Act.TAKE)
        assert bench.node.desk.goal == Goal(-1.5, 2.0, math.pi / 2)
        assert bench.node.desk.wish is Wish.WATCH


class TestKeys:
    def test_goto_by_keys_alone(self, bench: Bench) -> None:
        bench.key(pygame.K_TAB)
        bench.key(pygame.K_1, "1")
        bench.key(pygame.K_TAB)
        bench.key(pygame.K_2, "2")
        bench.key(pygame.K_RETURN)
        assert bench.node.desk.goal == Goal(1.0, 2.0)
        [(_, manual)] = bench.key(pygame.K_g, "g")
        assert isinstance(manual, m.Manual)
        assert ("player/ann/manual", RELEASED) in bench.key(pygame.K_ESCAPE)

    def test_letters_in_a_field_are_refused_and_press_no_buttons(self, bench: Bench) -> None:
        bench.key(pygame.K_TAB)
        bench.key(pygame.K_m, "m")
        assert bench.node.desk.wish is Wish.WATCH
        assert bench.node.board.notice == "x: expected digits, a sign or a point, got 'm'"
        bench.key(pygame.K_LSHIFT)
        bench.key(pygame.K_ESCAPE)
        bench.key(pygame.K_m, "m")
        assert bench.node.desk.wish is Wish.MANUAL

    def test_keys_that_belong_to_a_text_steer_nothing_until_they_are_let_go(self, bench: Bench) -> None:
        def ahead(key: int) -> float:
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=0, unicode=""))
            [(_, manual)] = bench.tick()
            assert isinstance(manual, m.Manual)
            return manual.forward

        bench.key(pygame.K_m, "m")
        bench.key(pygame.K_TAB)
        assert ahead(pygame.K_UP) == 0.0
        assert ahead(pygame.K_ESCAPE) == 0.0
        assert bench.node.desk.form.focus is None
        assert ahead(pygame.K_UP) == 0.0, "it is held"
        pygame.event.post(pygame.event.Event(pygame.KEYUP, key=pygame.K_UP, mod=0))
        assert ahead(pygame.K_UP) > 0.0

    def test_space_stops_everybody_also_while_typing(self, bench: Bench) -> None:
        bench.key(pygame.K_TAB)
        assert bench.key(pygame.K_SPACE, " ") == [("estop", m.Estop(by="display of ann"))]

    def test_backspace_and_shift_tab(self, bench: Bench) -> None:
        bench.key(pygame.K_TAB, mod=pygame.KMOD_SHIFT)
        bench.key(pygame.K_TAB, mod=pygame.KMOD_SHIFT)
        assert bench.node.desk.form.focus == 2
        bench.key(pygame.K_7, "7")
        bench.key(pygame.K_BACKSPACE, "\b")
        assert bench.node.desk.form.texts[2] == ""


class TestPad:
    def test_a_lost_pad_gives_the_robot_back_also_where_it_drives_home(self, bench: Bench, pad: VirtualPad) -> None:
        bench.press(Act.BEGIN)
        pad.unplug()
        assert ("player/ann/manual", RELEASED) in bench.tick()
        assert bench.node.desk.wish is Wish.WATCH
        assert "gamepad is lost" in bench.node.board.notice
        assert bench.tick() == []

    def test_no_button_moves_the_robot_without_the_deadman_button(self, bench: Bench, pad: VirtualPad) -> None:
        bench.click(bench.pixel(0.0, 1.0))
        for number in range(15):
            if number not in (RIGHT, BACK):
                pad.button(number, True)
                said = bench.tick()
                pad.button(number, False)
                said += bench.tick()
                moving = [body for _, body in said if isinstance(body, m.Manual) and (body.forward or body.turn)]
                assert moving == [], number


class TestPixels:
    def test_the_scan_is_drawn_and_its_nearest_echo_marked(self, bench: Bench) -> None:
        area = bench.places.laser
        assert bench.count(palette.SCAN, area) == 0
        bench.more = [scan(4.0, nearest=(90, 1.0))]
        bench.tick()
        assert bench.count(palette.SCAN, area) > 5000
        assert bench.count(palette.ECHO, area) > 100
        left = pygame.Rect(area.left, area.top + 30, area.width // 2, area.height - 30)
        right = left.move(area.width // 2, 0)
        assert bench.count(palette.SCAN, left) == pytest.approx(bench.count(palette.SCAN, right), rel=0.05)

    def test_something_on_the_left_is_drawn_on_the_left(self, bench: Bench) -> None:
        area = bench.places.sonar
        bench.more = [ring(_0=4.5, _1=4.5)]
        bench.tick()
        left = pygame.Rect(area.left, area.top + 30, area.width // 2, area.height - 30)
        assert bench.count(palette.ECHO, left) + bench.count(palette.CAUTION, left) > 500
        assert bench.count(palette.ECHO, left.move(area.width // 2, 0)) == 0

    def test_the_camera_shows_its_picture(self, bench: Bench) -> None:
        camera = bench.places.camera
        assert camera is not None
        bench.more = [picture()]
        bench.tick()
        assert bench.count((0, 200, 0), camera) > 0.3 * camera.width * camera.height

    def test_pictures_are_asked_for_while_the_window_is_open(self, bench: Bench) -> None:
        asked = []
        for _ in range(30):
            bench.tick()
        bench.node.mailbox.collect()
        for _ in range(40):
            bench.time += 0.04
            bench.node.tick(Tick(bench.time))
            asked += [out for out in sent(bench.node.mailbox) if isinstance(out[1], m.CameraRequest)]
        assert {key for key, _ in asked} == {"robot/ann/camera/request"}
        assert 2 <= len(asked) <= 4

    def test_the_active_button_and_the_goal_are_marked(self, bench: Bench) -> None:
        places = bench.places
        x, y = bench.pixel(0.0, 1.0)
        around = pygame.Rect(round(x) - 14, round(y) - 14, 28, 28)
        assert bench.count(palette.CAUTION, around) == 0
        bench.click((x, y))
        assert bench.count(palette.CAUTION, around) > 20
        assert bench.count(palette.CAUTION, places.buttons[Act.GOTO]) == 0
        bench.press(Act.GOTO)
        assert bench.count(palette.CAUTION, places.buttons[Act.GOTO]) > 1000

    def test_robots_are_drawn_where_the_player_is_told_and_nowhere_else(self, bench: Bench) -> None:
        assert {body.name for body in bench.node.scene.bodies} == {"ann", "bob"}
        bench.others = [status("bob", None)]
        bench.tick()
        assert {body.name for body in bench.node.scene.bodies} == {"ann"}
        bench.more = [m.Sight(poses={"ann": START, "bob": Pose(1.0, 2.0, 0.0)})]
        bench.tick()
        poses = {body.name: body.pose for body in bench.node.scene.bodies}
        assert poses == {"ann": START, "bob": Pose(1.0, 2.0, 0.0)}

    def test_the_window_may_have_any_size(self, bench: Bench) -> None:
        bench.more = [scan(4.0), ring(_0=1.0), picture(), odometry(0.4)]
        for size in ((1920, 1080), (700, 1100), (200, 120), (1280, 720)):
            pygame.display.set_mode(size, pygame.RESIZABLE)
            pygame.event.post(pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
            bench.tick()
            assert bench.places.head.width == size[0]


class TestWhatItMayKnow:
    ROSTER = Roster("test", {"ann": "red", "bob": "red", "cid": "blue"})
    SEAT = Seat(SeatKind.HUD, "ann")

    def expressions(self, way: Any) -> list[str]:
        return [key for line in lines() for key in way(self.SEAT, line, self.ROSTER)]

    def test_it_hears_only_what_its_seat_may(self, bench: Bench) -> None:
        heard = self.expressions(hears)
        for inlet in bench.node.mailbox.inlets:
            key = inlet.topic.key.removeprefix("vrg/test/")
            assert any(key_matches(allowed, key) for allowed in heard), key

    def test_it_says_only_what_its_seat_may(self, bench: Bench) -> None:
        said = self.expressions(speaks)
        bench.key(pygame.K_m)
        bench.press(Act.STOP)
        bench.node.stop()
        for key, _ in sent(bench.node.mailbox):
            assert any(key_matches(allowed, key) for allowed in said), key

    def test_its_seat_hears_no_true_poses_and_nothing_of_others(self) -> None:
        heard = self.expressions(hears)
        assert "poses" not in heard
        for foreign in ("robot/bob/sensor/laser/front", "player/bob/report", "player/cid/sketch", "team/blue/sight"):
            assert not any(key_matches(allowed, foreign) for allowed in heard), foreign


def test_the_referees_lease_is_told(bench: Bench) -> None:
    bench.others = []
    bench.changes = {"players": [status("ann", START, lease=Twist(0.1, 0.0))]}
    bench.tick()
    assert bench.node.board.holder == "the referee"
