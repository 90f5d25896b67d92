"""The node that receives vision of the league: from its packets to fixes."""

import logging
import math
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest
from real_box import BOX

from league.league import tracker_packet, vision_packet
from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.errors import ConfigError, LaunchError
from vrg.hal.sim.config import BodySetup
from vrg.testing.sources import KEYS, context_of, say_time
from vrg.testing.waiting import wait_until
from vrg.types import Pose
from vrg_locate.ssl.packets import Seen, SeenBall, SeenRobot
from vrg_locate.ssl.source import SslSettings, SslSource

BALL = BodySetup(
    name="ball", kind="ball", pose=Pose(10.0, 5.0, 0.0), radius=0.0215, mass=0.046, height=0.043, friction=0.03,
    restitution=0.5, tracked=True,
)  # fmt: skip
AHEAD = 1e6
"""The clock of vision is so many seconds ahead of this process's."""


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(("127.0.0.1", 0))
        return int(opened.getsockname()[1])


class Bench:
    """A source that has begun to receive, and what sends to it. The match began 10 s before."""

    def __init__(self, **settings: object) -> None:
        self.port = free_port()
        table = {"robots": {"ann": "yellow 3", "bob": "blue 0"}, "address": "127.0.0.1", "port": self.port, **settings}
        things = [body for body in (BALL, BOX) if body.name == settings.get("ball")]
        context = context_of("league", SslSettings.model_validate(table), "ann", "bob", things=things)
        self.vision = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.mailbox = Mailbox()
        self.node = SslSource(context, self.mailbox, KEYS)
        self.began = time.monotonic() - 10.0
        self.ticks = 0
        self.fixes: list[tuple[float, tuple[m.Fix, ...]]] = []
        self.node.start()

    @property
    def now(self) -> float:
        """Match time, s."""
        return time.monotonic() - self.began

    def send(self, data: bytes, sender: socket.socket | None = None) -> None:
        (sender or self.vision).sendto(data, ("127.0.0.1", self.port))

    def tick(self) -> None:
        self.ticks += 1
        say_time(self.mailbox, self.now, self.ticks)
        self.mailbox.handover(self.now)
        self.node.tick(Tick(self.now))
        self.fixes += [(out.message.stamp, out.message.body.fixes) for out in self.mailbox.collect()]  # type: ignore[attr-defined]

    def counted(self, what: str) -> int:
        """The packets that were used, or ignored for a reason."""
        counted = self.node.counted()
        return counted["packets"] if what == "used" else counted["ignored"].get(what, 0)

    def tick_until(self, what: str, count: int) -> None:
        """Tick until the source has counted so many packets of a kind."""
        wait_until(lambda: self.tick() or self.counted(what) >= count, what)


@pytest.fixture
def make() -> Iterator[type[Bench]]:
    made: list[Bench] = []

    class Kept(Bench):
        def __init__(self, **settings: object) -> None:
            super().__init__(**settings)
            made.append(self)

    yield Kept
    for bench in made:
        bench.node.stop()
        bench.vision.close()


def seen(*robots: SeenRobot, late: float = 0.1, balls: tuple[SeenBall, ...] = ()) -> Seen:
    sent = time.monotonic() + AHEAD
    return Seen(sent - late, sent, robots, balls=balls)


def test_a_packet_becomes_fixes_of_the_time_of_its_picture(make: type[Bench]) -> None:
    bench = make(field={"x": 10.0, "y": 5.0, "heading": 90.0}, heading=2.0)
    bench.tick()
    for number in range(20):
        picture, now = seen(SeenRobot("yellow", 3, 1.0, 0.5, 0.25), SeenRobot("blue", 7, 0.0, 0.0, 0.0)), bench.now
        bench.send(vision_packet(picture))
        bench.tick_until("used", number + 1)
    stamp, fixes = bench.fixes[-1]
    # What the least delayed packet was on its way is not known.
    assert now - 0.1 - 0.05 < stamp < now - 0.1 + 0.05
    (fix,) = fixes
    assert fix.robot == "ann"
    assert (fix.pose.x, fix.pose.y, fix.pose.theta) == pytest.approx((9.5, 6.0, 0.25 + math.pi / 2))
    assert (fix.position, fix.heading) == (0.01, pytest.approx(math.radians(2.0)))
    assert bench.node.counted()["unknown"] == {"blue 7": 20}


def test_cameras_that_see_parts_of_the_field_are_one_source(make: type[Bench]) -> None:
    """Vision sends a packet for each of its cameras; where two overlap, both see a robot, at times of their own."""
    bench = make()
    bench.tick()
    for _ in range(5):
        for camera, robots, late in (
            (0, (SeenRobot("yellow", 3, -1.0, 0.0, 0.0),), 0.10),
            (1, (SeenRobot("yellow", 3, -1.0, 0.01, 0.0), SeenRobot("blue", 0, 2.0, 0.0, 0.0)), 0.06),
            (2, (), 0.08),
        ):
            bench.send(vision_packet(replace(seen(*robots, late=late), camera=camera)))
    bench.tick_until("used", 15)
    named = [(stamp, {fix.robot for fix in fixes}) for stamp, fixes in bench.fixes]
    assert [names for _, names in named] == [{"ann"}, {"ann", "bob"}] * 5
    assert all(one < other for (one, _), (other, _) in zip(named[::2], named[1::2], strict=True))


def test_robots_of_which_vision_is_not_sure_and_headings_that_it_has_not_seen_are_no_fixes(make: type[Bench]) -> None:
    bench = make()
    bench.tick()
    bench.send(vision_packet(seen(SeenRobot("yellow", 3, 1.0, 0.5, 0.25, 0.4), SeenRobot("blue", 0, 2.0, 1.0, None))))
    bench.tick_until("used", 1)
    ((_, fixes),) = bench.fixes
    assert fixes == (m.Fix("bob", Pose(2.0, 1.0, 0.0), 0.01, None),)


def test_the_packets_of_a_tracker_are_understood_where_they_are_wanted(make: type[Bench]) -> None:
    bench = make(packets="tracker")
    bench.tick()
    bench.send(tracker_packet(seen(SeenRobot("yellow", 3, 1.0, 0.5, 0.25))))
    bench.tick_until("used", 1)
    assert bench.fixes[0][1][0].pose == Pose(1.0, 0.5, 0.25)
    bench.node._settings = bench.node._settings.model_copy(update={"latency": 0.2})
    again = tracker_packet(seen(SeenRobot("yellow", 3, 1.0, 0.5, 0.25)))
    before = bench.now
    bench.send(again)
    bench.tick_until("used", 2)
    assert bench.fixes[1][0] < before - 0.15, "it was captured before it came"
    bench.send(vision_packet(seen()))
    bench.tick_until("malformed", 1)


@pytest.mark.parametrize(("packets", "packet"), [("vision", vision_packet), ("tracker", tracker_packet)])
def test_the_ball_is_the_thing_that_the_match_file_names(
    make: type[Bench], packets: str, packet: Callable[[Seen], bytes]
) -> None:
    bench = make(packets=packets, ball="ball", field={"x": 10.0, "y": 5.0, "heading": 90.0})
    bench.tick()
    shown = (SeenBall(1.0, 0.5, 0.9), SeenBall(-2.0, 0.0, 0.7), SeenBall(3.0, 0.0, 0.2))
    bench.send(packet(seen(SeenRobot("yellow", 3, 0.0, 0.0, 0.0), balls=shown)))
    bench.tick_until("used", 1)
    bench.send(packet(seen(balls=shown[1:])))
    bench.tick_until("used", 2)
    ((_, fixes),) = bench.fixes  # it is hidden in the second picture, where only the others are
    assert [fix.robot for fix in fixes] == ["ann", "ball"]
    assert (fixes[1].pose.x, fixes[1].pose.y, fixes[1].heading) == (9.5, 6.0, None)
    assert bench.node.counted()["fixes"] == {"ann": 1, "ball": 1}


def test_without_a_name_for_it_the_ball_is_nothing_and_a_box_is_none(make: type[Bench]) -> None:
    bench = make()
    bench.tick()
    bench.send(vision_packet(seen(balls=(SeenBall(1.0, 0.5),))))
    bench.tick_until("used", 1)
    assert not bench.fixes
    with pytest.raises(ConfigError, match="league: ball: expected a body with a radius, got box"):
        make(ball="box")


def test_malformed_packets_and_those_of_another_field_are_told_once(
    make: type[Bench], caplog: pytest.LogCaptureFixture
) -> None:
    bench = make()
    bench.tick()
    caplog.set_level(logging.WARNING)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        for number in range(3):
            bench.send(vision_packet(seen(SeenRobot("yellow", 3, 1.0, 0.5, 0.25))))
            bench.tick_until("used", number + 1)
            bench.send(b"\x0a\xff not a packet")
            bench.tick_until("malformed", number + 1)
            bench.send(vision_packet(seen(SeenRobot("yellow", 3, -1.0, 0.5, 0.25))), other)
            bench.tick_until("other sender", 2 * number + 1)
            theirs = replace(seen(SeenRobot("yellow", 3, -2.0, 0.5, 0.25)), camera=1)
            bench.send(vision_packet(theirs), other)  # also what only that field has
            bench.tick_until("other sender", 2 * number + 2)
    assert {fix.pose.x for _, fixes in bench.fixes for fix in fixes} == {1.0}
    assert caplog.text.count("is ignored: ") == 1
    assert caplog.text.count("Is there another field?") == 1


def test_a_picture_of_the_future_does_not_blind_it(make: type[Bench], caplog: pytest.LogCaptureFixture) -> None:
    bench = make(ball="ball")
    bench.tick()
    for number, late in enumerate((0.1, -30.0, 0.0)):
        bench.send(vision_packet(seen(balls=(SeenBall(1.0, 0.5 + number / 100),), late=late)))
        bench.tick_until("early" if late < 0.0 else "used", 1 if late < 0.0 else number or 1)
    assert [fix.pose.y for _, fixes in bench.fixes for fix in fixes] == [0.5, 0.52]
    assert "30.0 s in the future" in caplog.text


def test_two_computers_of_one_field_count_each_by_its_own_clock(make: type[Bench]) -> None:
    bench = make()
    bench.tick()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        for number in range(20):
            bench.send(vision_packet(seen(SeenRobot("yellow", 3, 1.0, 0.5, 0.25))))
            theirs = seen(SeenRobot("blue", 0, -1.0, 0.5, 0.25))
            theirs = replace(theirs, captured=theirs.captured + 50.0, sent=theirs.sent + 50.0, camera=1)
            bench.send(vision_packet(theirs), other)
            bench.tick_until("used", 2 * number + 2)
    assert {fix.robot for _, fixes in bench.fixes for fix in fixes} == {"ann", "bob"}
    assert all(bench.now - 5.0 < stamp < bench.now for stamp, _ in bench.fixes), "no clock is taken for the other"


def test_an_address_that_this_machine_has_not_is_told() -> None:
    context = context_of("league", SslSettings.model_validate({"robots": {}, "address": "203.0.113.7"}))
    with pytest.raises(LaunchError, match=r"203\.0\.113\.7:10006: expected to receive packets there"):
        SslSource(context, Mailbox(), KEYS).start()


def test_that_nothing_comes_is_told_once(make: type[Bench], caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    bench = make()
    ahead = 0.0
    bench.node._stream._monotonic = lambda: time.monotonic() + ahead
    bench.tick()
    assert not caplog.messages
    ahead = 4.0
    for _ in range(3):
        bench.tick()
    assert [text for text in caplog.messages if "nothing was received at 127.0.0.1" in text] == caplog.messages
    assert len(caplog.messages) == 1
