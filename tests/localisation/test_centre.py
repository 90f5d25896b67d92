"""The fusion centre as a node: what it hears and publishes, and what becomes of fixes that are of nobody or wrong."""

import math
from collections.abc import Collection
from typing import Any

import pytest

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import LOST, Fix, Fixes, MeasuredPose, Message, Motion, OwnPlace, Placed
from vrg.bus.node import Tick
from vrg.bus.topics import Topic
from vrg.hal.models import robot_model
from vrg.hal.sensors.gps import to_wgs84
from vrg.localisation.centre import PERIOD, FusionCentre, own_fix
from vrg.localisation.motion import motion_noise
from vrg.testing.sources import HERE, KEYS, say
from vrg.types import STILL, Pose, Twist


class Bench:
    """A centre that locates ann and bob, and what is said to it."""

    def __init__(self, things: Collection[str] = ()) -> None:
        self.mailbox = Mailbox()
        model = robot_model("P2AT")
        starts = {"ann": HERE, "bob": Pose(5.0, 0.0, 0.0)}
        robots = {name: (model, start) for name, start in starts.items()}
        self.centre = FusionCentre(self.mailbox, KEYS, robots, things=things)
        self.time = 0.0
        self._number = 0

    def say(self, topic: Topic[Any], body: Message, stamp: float) -> None:
        self._number += 1
        say(self.mailbox, topic, body, stamp, self._number)

    def moves(self, name: str, pose: Pose) -> None:
        self.say(KEYS.motion(name), Motion(odometry=pose, twist=Twist(0.5, 0.0)), self.time)

    def sees(self, stamp: float, **poses: Pose) -> None:
        fixes = tuple(Fix(name, pose, 0.01, 0.02) for name, pose in poses.items())
        self.say(KEYS.fixes("overhead"), Fixes(fixes=fixes), stamp)

    def tick(self) -> dict[str, tuple[float, MeasuredPose]]:
        """Tick, and return what is published, by the name of the robot or thing, with its stamp."""
        self.mailbox.handover(self.time)
        self.centre.tick(Tick(self.time))
        found = {}
        for out in self.mailbox.collect():
            body = out.message.body
            assert isinstance(body, MeasuredPose)
            found[out.topic.key.split("/")[3]] = out.message.stamp, body
        self.time += PERIOD
        return found


def test_where_a_robot_is_comes_with_how_well_that_is_known() -> None:
    bench = Bench()
    bench.moves("ann", HERE)
    ((stamp, first),) = bench.tick().values()
    assert (stamp, first.pose, first.twist) == (0.0, HERE, Twist(0.5, 0.0))
    assert first.lost, "no source has seen it yet"
    bench.sees(0.0, ann=Pose(0.1, 0.0, 0.0), bob=Pose(5.0, 0.1, 0.0))
    bench.moves("ann", Pose(0.05, 0.0, 0.0))
    published = bench.tick()
    assert list(published) == ["ann"], "bob has not reported a motion"
    _, second = published["ann"]
    assert second.pose.x == pytest.approx(0.15, abs=0.01)
    assert second.unseen == pytest.approx(PERIOD)
    assert not second.lost
    assert first.uncertainty is not None
    assert second.uncertainty is not None
    assert second.uncertainty.xx < 0.01 * first.uncertainty.xx


def test_a_robot_that_nothing_sees_is_lost() -> None:
    bench = Bench()
    for number in range(20):
        bench.moves("ann", HERE)
        if number < 5:
            bench.sees(bench.time, ann=HERE)
        ((_, pose),) = bench.tick().values()
        assert pose.lost is (pose.unseen > LOST)
    assert pose.unseen == pytest.approx(15 * PERIOD)


def test_fixes_that_are_of_nobody_or_wrong_change_nothing_and_are_counted() -> None:
    bench = Bench()
    bench.moves("ann", HERE)
    bench.sees(0.0, ann=HERE, ghost=Pose(1.0, 1.0, 0.0))
    bench.tick()
    bench.sees(3.0, ann=HERE)
    bench.sees(0.0, ann=Pose(9.0, 0.0, 0.0))
    bench.moves("ann", HERE)
    _, pose = bench.tick()["ann"]
    assert pose.pose.x == pytest.approx(0.0, abs=1e-6)
    counted = bench.centre.counted()
    assert counted["fixes"] == {"ann": {"used": 1, "early": 1, "far": 1}, "bob": {}}
    assert counted["unknown"] == {"ghost": 1}
    noise = motion_noise(robot_model("P2AT"))
    wanted = {"way": (0.0, noise.longer), "turn": (0.0, noise.wider), "bend": (0.0, noise.bend)}
    assert counted["learned"]["bob"] == wanted
    assert pose.twist != STILL


def test_a_tag_that_is_turned_is_named_once_until_an_official_places_the_robot(
    caplog: pytest.LogCaptureFixture,
) -> None:
    bench = Bench()
    for number in range(60):
        x = 0.025 * max(0, number - 20)
        bench.moves("ann", Pose(x, 0.0, 0.0))
        bench.sees(bench.time, ann=Pose(x, 0.0, math.pi))
        pose = bench.tick()["ann"][1]
    assert pose.lost
    told = [record.getMessage() for record in caplog.records if "turned by 180 degrees" in record.getMessage()]
    assert len(told) == 1
    bench.say(KEYS.placed("ann"), Placed(pose=Pose(x, 0.0, 0.0), by="official"), bench.time)
    for _ in range(3):
        bench.moves("ann", Pose(x, 0.0, 0.0))
        bench.sees(bench.time, ann=Pose(x, 0.0, 0.0))
        pose = bench.tick()["ann"][1]
    assert not pose.lost


def test_what_a_robot_measures_of_its_own_place_counts_as_much_as_it_is_worth() -> None:
    """An inertial navigation system corrects it. GPS, whose error stays for minutes, only pulls a little."""
    origin = (math.radians(35.0), math.radians(-106.0))
    bench = Bench()
    centre = bench.centre = FusionCentre(bench.mailbox, KEYS, {"ann": (robot_model("P2AT"), HERE)}, origin)

    def says(own: tuple[OwnPlace, ...]) -> MeasuredPose:
        body = Motion(odometry=HERE, twist=STILL, own=own)
        bench.say(KEYS.motion("ann"), body, bench.time)
        return bench.tick()["ann"][1]

    far = to_wgs84((0.4, 0.0), origin)
    for _ in range(100):
        found = says((OwnPlace(bench.time, earth=far),))
    assert found.lost, "no source has seen it"
    assert 0.0 < found.pose.x < 0.1, "a hundred readings of GPS in five seconds are worth less than one"
    found = says((OwnPlace(bench.time, pose=Pose(0.3, 0.2, 0.1)),))
    assert found.lost, "nor has it now"
    assert (found.pose.x, found.pose.y, found.pose.theta) == pytest.approx((0.3, 0.2, 0.1), abs=0.01)
    assert found.uncertainty is not None
    assert found.uncertainty.ellipse[0] < 0.03
    says((OwnPlace(bench.time),))  # a sensor that has measured nothing
    assert centre.counted()["fixes"] == {"ann": {}}, "these are no fixes of a source"


def test_own_places_are_fixes_with_the_noise_of_their_sensors() -> None:
    model = robot_model("P2AT")
    assert own_fix("ann", model, OwnPlace(1.0), (0.0, 0.0)) is None
    gps = own_fix("ann", model, OwnPlace(1.0, earth=(0.0, 0.0)), (0.0, 0.0))
    assert gps is not None
    assert (gps.heading, gps.pose) == (None, HERE)
    assert gps.position == pytest.approx(1.5 * math.sqrt(120.0))
    ins = own_fix("ann", model, OwnPlace(1.0, pose=Pose(1.0, 2.0, 0.3)), (0.0, 0.0))
    assert ins is not None
    assert (ins.position, ins.heading, ins.pose) == (0.02, 0.005, Pose(1.0, 2.0, 0.3))


def test_a_robot_that_an_official_has_placed_is_there() -> None:
    bench = Bench()
    bench.moves("ann", HERE)
    bench.sees(0.0, ann=HERE)
    bench.tick()
    bench.say(KEYS.placed("ann"), Placed(pose=Pose(7.0, 3.0, 1.0), by="official"), bench.time)
    bench.moves("ann", HERE)
    (_, found) = bench.tick()["ann"]
    assert found.pose == Pose(7.0, 3.0, 1.0)
    assert found.lost, "until a source has seen it there"


def test_a_thing_is_published_where_and_when_it_was_seen_and_its_fixes_are_counted() -> None:
    bench = Bench(things=("ball",))
    bench.time = 1.0
    bench.sees(0.9, ball=Pose(2.0, 1.0, 0.0))
    assert bench.tick() == {"ball": (0.9, MeasuredPose(pose=Pose(2.0, 1.0, 0.0)))}
    bench.sees(0.85, ball=Pose(9.0, 9.0, 0.0))
    bench.sees(2.0, ball=Pose(9.0, 9.0, 0.0))
    assert bench.tick() == {}, "one is older than the last, one of the future"
    bench.sees(1.0, ball=Pose(2.1, 1.0, 0.0))
    ((stamp, moved),) = bench.tick().values()
    assert stamp == 1.0
    assert moved.twist.v > 0.5
    assert bench.centre.counted()["fixes"]["ball"] == {"used": 2, "late": 1, "early": 1}
