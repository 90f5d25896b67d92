"""What holds in every window of a match: the same keys, buttons, lease and dead-man's switch."""

import os
import re
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pygame
import pytest

from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.node import Tick
from vrg.bus.pacing import LEASE
from vrg.bus.topics import Keys
from vrg.hal.sensors.ins import Ins
from vrg.testing.views import synthetic
from vrg.testing.views.virtual_pad import UNKNOWN, VirtualPad
from vrg.ui.acts import Act, Press
from vrg.ui.banner import banners
from vrg.ui.driving import SILENCE, SLOW
from vrg.ui.window.pads import connected
from vrg.ui.window.spectator import Spectator
from vrg.ui.window.window_node import NOT_SENT, OVER, WindowNode

RIGHT, START, BACK = (
    pygame.CONTROLLER_BUTTON_RIGHTSHOULDER, pygame.CONTROLLER_BUTTON_START, pygame.CONTROLLER_BUTTON_BACK
)  # fmt: skip
STANDS = m.Manual(forward=0.0, turn=0.0, lease=LEASE)
GIVES_BACK = m.Manual(forward=0.0, turn=0.0, lease=0.0)
CLOSING = {
    "key": lambda _node: pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_q, mod=0)),
    "button": lambda _node: pygame.event.post(pygame.event.Event(pygame.QUIT)),
    "stop": lambda node: (node.stop(), node.stop()),
}


class Bench:
    """A window that the made-up match is told to, and a gamepad that is not in use yet."""

    def __init__(self, node: WindowNode, keys: Keys) -> None:
        self.node, self.keys, self.number = node, keys, 0
        self.stopped = self.taken = False
        self.stage: m.Stage | None = None
        self.tick()
        self.pad = VirtualPad()
        self.tick()
        self.tick()

    def tick(self, *, live: bool = True) -> list[Any]:
        """One tick; what the window published, but for requests of pictures."""
        self.number += 1
        time = 5.0 + self.number / 30
        clock = m.Clock(time=time, tick=self.number, epoch=0, rate=1.0, estop=self.stopped)
        nemo = m.Report(mode="Cross/Go", armed=True, manual=self.taken)
        told = (
            (self.keys.clock, clock),
            (self.keys.referee_state, synthetic.state(time, **({} if self.stage is None else {"stage": self.stage}))),
            (self.keys.report("nemo"), nemo),
            (self.keys.sensor(Ins, "nemo", "ins"), Ins(pose=synthetic.pose_at("nemo", time))),
        )
        for inlet in self.node.mailbox.inlets:
            for topic, body in told:
                if inlet.topic.type is topic.type:
                    inlet.offer(Received(topic.key, time, self.number, body))
        self.node.mailbox.handover(time)
        self.node.tick(Tick(time, live))
        return self.said()

    def said(self) -> list[Any]:
        """What the window published since it was asked last, but for requests of pictures."""
        bodies = [out.message.body for out in self.node.mailbox.collect()]
        return [body for body in bodies if not isinstance(body, m.CameraRequest)]

    def down(self, key: int, times: int = 1, mod: int = 0) -> list[Any]:
        """Press a key so many times; what the window then published."""
        for _ in range(times):
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=mod))
        return self.tick()

    def up(self, key: int) -> list[Any]:
        """Let go of a key; what the window then published."""
        pygame.event.post(pygame.event.Event(pygame.KEYUP, key=key, mod=0))
        return self.tick()

    def button(self, number: int) -> list[Any]:
        """Press and release a button of the gamepad."""
        said = []
        for down in (True, False):
            self.pad.button(number, down)
            said += self.tick()
        return said


def lent(said: list[Any]) -> list[m.Manual]:
    """The commands of a person among what was published."""
    return [body for body in said if isinstance(body, m.Manual)]


def regrip(bench: Bench) -> float:
    """Let go of the dead-man's switch and press it again; how fast the robot then drives."""
    for down in (False, True):
        bench.pad.button(RIGHT, down)
        bench.tick()
    return lent(bench.tick())[-1].forward


class WindowContract:
    """The tests of one window. A subclass makes it.

    Attributes:
        by: who stops the robots there, as the match is told.
    """

    by = "me"

    def make(self, keys: Keys, **more: Any) -> WindowNode:
        """The window; `more` is for its constructor."""
        raise NotImplementedError

    @pytest.fixture
    def bench(self, keys: Keys) -> Iterator[Bench]:
        os.environ["SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS"] = "1"
        made = Bench(self.make(keys), keys)
        yield made
        made.node.stop()

    def test_space_and_the_pads_back_are_the_emergency_stop_also_before_the_pad_is_in_use(self, bench: Bench) -> None:
        stop = m.Estop(by=self.by)
        assert bench.button(BACK) == [stop]
        # Also with a finger on another key, and if the release of SPACE was missed.
        for mod in (0, pygame.KMOD_CTRL, pygame.KMOD_META, pygame.KMOD_SHIFT):
            assert bench.down(pygame.K_SPACE, mod=mod) == [stop]

    def test_m_drives_by_hand_and_held_it_toggles_once(self, bench: Bench) -> None:
        bench.down(pygame.K_m, times=25)
        driven = bench.node.driving.player
        assert driven is not None
        for said in (bench.down(pygame.K_UP), bench.tick()):
            assert said == [m.Manual(forward=SLOW, turn=0.0, lease=LEASE)], "it is published at each tick"
        assert lent(bench.down(pygame.K_LSHIFT))[-1].forward == 1.0
        bench.up(pygame.K_LSHIFT)
        assert lent(bench.up(pygame.K_UP))[-1] == STANDS
        assert lent(bench.down(pygame.K_ESCAPE)) == [GIVES_BACK]
        assert bench.node.driving.player is None

    def test_losing_the_keyboard_lets_go_of_the_arrows(self, bench: Bench) -> None:
        bench.down(pygame.K_m)
        bench.down(pygame.K_UP)
        pygame.event.post(pygame.event.Event(pygame.WINDOWFOCUSLOST))
        assert bench.tick() == [STANDS]

    @pytest.mark.parametrize("how", ["its launcher is gone", "another match begins", "it is over and its clock stops"])
    def test_of_a_match_that_has_ended_a_window_takes_in_nothing_more(self, bench: Bench, how: str) -> None:
        node = bench.node
        bench.down(pygame.K_m)
        assert not node.has_ended(gone=False)
        bench.tick(live=False)
        assert not node.has_ended(gone=False), "a clock may go on again"
        if how == "another match begins":
            bench.number = -100
            bench.tick()
        elif how == "it is over and its clock stops":
            bench.stage = m.Stage.GAME_OVER
            bench.tick()
            assert not node.has_ended(gone=False), "its robots may still be shown"
            bench.tick(live=False)
        seen = node.scene.time
        assert node.has_ended(gone=how == "its launcher is gone")
        assert node.driving.player is None
        bench.said()
        bench.number = 500
        assert bench.down(pygame.K_SPACE) == [], "nobody would hear it"
        assert node.notice == OVER
        bench.up(pygame.K_m)
        assert bench.down(pygame.K_m) == []
        assert node.driving.player is None, "nobody is driven any more"
        assert node.scene.left
        assert node.scene.time == pytest.approx(seen)
        assert "NO CLOCK" not in [banner.heading for banner in banners(node.scene)]
        assert all("Q closes the window" in banner.text for banner in banners(node.scene))
        node.stop()
        assert not node.closed, "it stays as it was left"
        pygame.event.post(pygame.event.Event(pygame.QUIT))
        node.linger(threading.Event())
        assert node.closed

    def test_without_a_clock_nobody_is_driven_but_everything_can_be_stopped(self, bench: Bench) -> None:
        bench.down(pygame.K_m)
        bench.down(pygame.K_UP)
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_SPACE, mod=0))
        assert [type(body) for body in bench.tick(live=False)] == [m.Estop]
        assert not bench.node.scene.live

    def test_a_stop_that_nobody_has_reported_while_the_link_is_cut_is_shown_as_not_sent(self, bench: Bench) -> None:
        bench.down(pygame.K_SPACE)
        assert bench.node.notice != NOT_SENT, "the clock runs: the answer is under way"
        bench.tick(live=False)
        assert bench.node.notice == NOT_SENT
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_w, mod=0))
        bench.tick(live=False)
        assert bench.node.notice == NOT_SENT, "no other key takes it away"
        bench.stopped = True
        bench.tick()
        assert bench.node.notice != NOT_SENT
        assert bench.node.stopped

    def test_a_stop_that_was_reported_before_the_link_was_cut_answers_no_new_one(self, bench: Bench) -> None:
        bench.stopped = True
        bench.tick()
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_SPACE, mod=0))
        bench.tick(live=False)
        assert bench.node.notice == NOT_SENT, "it may have been released since"
        bench.tick()
        assert bench.node.notice != NOT_SENT

    def test_start_drives_by_hand_and_nothing_moves_without_the_deadmans_switch(self, bench: Bench) -> None:
        bench.button(START)
        bench.button(START)
        assert bench.node.driving.player is not None
        bench.pad.axis(pygame.CONTROLLER_AXIS_LEFTY, -1.0)
        bench.tick()
        assert lent(bench.tick())[-1].forward == 0.0
        bench.pad.button(RIGHT, True)
        bench.tick()
        assert lent(bench.tick())[-1].forward == pytest.approx(SLOW)
        bench.pad.unplug()
        assert lent(bench.tick()) == [GIVES_BACK]
        assert "gamepad is lost" in bench.node.notice
        assert lent(bench.tick()) == []

    @pytest.fixture
    def held(self, bench: Bench) -> Bench:
        """A robot that is driven ahead by the gamepad."""
        bench.button(START)
        bench.button(START)
        bench.pad.axis(pygame.CONTROLLER_AXIS_LEFTY, -1.0)
        bench.pad.button(RIGHT, True)
        bench.tick()
        assert lent(bench.tick())[-1].forward == pytest.approx(SLOW)
        return bench

    def test_after_a_stopped_clock_the_switch_must_be_held_anew(self, held: Bench) -> None:
        held.tick(live=False)
        held.pad.axis(pygame.CONTROLLER_AXIS_LEFTY, -0.9)
        for _ in range(3):
            assert lent(held.tick())[-1] == STANDS
        assert regrip(held) > 0.7 * SLOW

    def test_after_a_stopped_clock_so_must_the_arrows(self, bench: Bench) -> None:
        bench.down(pygame.K_m)
        bench.down(pygame.K_UP)
        bench.tick(live=False)
        assert lent(bench.down(pygame.K_UP))[-1] == STANDS, "a key that is held is pressed again and again by itself"
        bench.up(pygame.K_UP)
        assert lent(bench.down(pygame.K_UP))[-1].forward == SLOW

    def test_a_gamepad_whose_battery_is_empty_holds_nothing(self, held: Bench) -> None:
        """Its dongle is still plugged in, and so SDL reports no release."""
        began = held.node.pads.now()
        held.node.pads.now = lambda: began + SILENCE + 0.1
        assert lent(held.tick())[-1] == STANDS
        held.pad.axis(pygame.CONTROLLER_AXIS_LEFTY, -0.9)
        for _ in range(3):
            assert lent(held.tick())[-1] == STANDS, "it has a new battery, and nobody has pressed the switch"
        assert regrip(held) > 0.7 * SLOW

    def test_a_gamepad_that_sdl_cannot_map_is_named(self, bench: Bench) -> None:
        pad = VirtualPad(UNKNOWN)
        bench.tick()
        bench.tick()
        words = r"SDL does not know the buttons of Virtual Joystick \([0-9a-f]{32}\): set SDL_GAMECONTROLLERCONFIG"
        assert re.fullmatch(words, bench.node.notice)
        assert bench.node.notice in connected()
        pad.unplug()
        bench.tick()
        assert not bench.node.pads.unknown

    def test_a_gamepad_whose_plug_bounces_is_no_trouble(self, bench: Bench) -> None:
        """It is gone again before the window has seen it come."""
        VirtualPad(UNKNOWN).unplug()
        bench.tick()
        assert not bench.node.pads.unknown

    def test_an_emergency_stop_gives_the_robot_back_so_that_it_does_not_drive_on(self, bench: Bench) -> None:
        bench.down(pygame.K_m)
        bench.down(pygame.K_UP)
        bench.stopped = True
        said = [body for _ in range(4) for body in lent(bench.tick())]
        assert said[-1].lease == 0.0
        assert "emergency stop" in bench.node.notice
        bench.stopped = False
        assert lent([body for _ in range(4) for body in bench.tick()]) == []

    def test_a_player_that_another_person_drives_is_not_taken(self, bench: Bench) -> None:
        bench.taken = True
        for _ in range(8):
            bench.tick()
        said = [body for _ in range(3) for body in lent(bench.down(pygame.K_TAB) + bench.up(pygame.K_TAB))]
        assert bench.node.driving.player != "nemo"
        if list(bench.node.drivable) == ["nemo"]:
            bench.down(pygame.K_m)
            assert (said, bench.node.driving.player) == ([], None)
        bench.taken = False
        bench.tick()

    def test_what_must_be_read_stays_while_a_key_is_held(self, bench: Bench) -> None:
        bench.down(pygame.K_UP)
        bench.node.notice = "read this"
        bench.down(pygame.K_UP, times=3)
        assert bench.node.notice == "read this"
        bench.up(pygame.K_UP)
        bench.down(pygame.K_UP)
        assert bench.node.notice == ""

    def test_what_the_user_gave_back_can_be_taken_again_at_once(self, bench: Bench) -> None:
        for wanted in (True, False, True):
            bench.down(pygame.K_m)
            assert (bench.node.driving.player is not None) == wanted
            bench.taken = True  # and the player still reports it just after it was given back
            bench.up(pygame.K_m)

    @pytest.mark.parametrize("close", CLOSING.values(), ids=CLOSING)
    def test_closing_gives_the_robot_back_and_the_window_does_not_open_again(
        self, bench: Bench, close: Callable[[WindowNode], object]
    ) -> None:
        bench.down(pygame.K_m)
        assert not bench.node.closed
        close(bench.node)
        assert bench.tick() == [GIVES_BACK]
        assert bench.node.closed
        assert bench.tick() == []
        assert not pygame.display.get_init()

    def test_every_window_leaves_its_pictures_in_the_run_folder(self, keys: Keys, tmp_path: Path) -> None:
        bench = Bench(self.make(keys, run=tmp_path), keys)
        bench.down(pygame.K_p)
        assert [path.name for path in tmp_path.iterdir()] == ["picture-001.png"]
        assert bench.node.notice == f"Picture saved: picture-001.png in {tmp_path}"
        bench.node.stop()

    def test_the_end_key_closes_nothing(self, bench: Bench) -> None:
        bench.down(pygame.K_END)
        assert not bench.node.closed

    def test_question_mark_lists_the_keys_that_the_window_answers_to(self, bench: Bench) -> None:
        assert bench.node.listed == []
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_SLASH, mod=0, unicode="?"))
        bench.tick()
        listed = bench.node.listed
        assert ("SPACE", "emergency stop") in listed
        assert ("H" in dict(listed)) == isinstance(bench.node, Spectator)
        shown = [act for act in Act if act in bench.node.acts and act.value[0]]
        assert listed == [(act.value[0], bench.node.meanings.get(act, act.value[1])) for act in shown]
        if isinstance(bench.node, Spectator):
            assert dict(listed)["TAB"] == "drive the next player"

    def test_a_key_is_looked_up_once_in_the_table_of_the_window(self, bench: Bench) -> None:
        pressed: list[Press] = []
        bench.node.acts = {Act.STOP: pressed.append, Act.MANUAL: pressed.append}
        said = [bench.down(key) for key in (pygame.K_SPACE, pygame.K_m, pygame.K_w, pygame.K_TAB, pygame.K_q)]
        assert [press.act for press in pressed] == [Act.STOP, Act.MANUAL]
        assert said == [[]] * 5
        assert not bench.node.closed
