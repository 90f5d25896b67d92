"""A match as ROS 2 sees it: which topics there are, and what they hold."""

import json
import math
from collections.abc import Callable, Sequence
from fnmatch import fnmatch
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from msgspec import structs

from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.topics import Keys, Topic
from vrg.hal.models import robot_model
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.gps import Gps
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.sonar import Sonar
from vrg.regions import Rectangle
from vrg.testing.omni import OMNI
from vrg.testing.views import synthetic
from vrg.types import Pose, Twist, Uncertainty
from vrg_ros import messages as ros
from vrg_ros.cdr import decode, encode
from vrg_ros.publisher import REPUBLISH_PERIOD, RosPublisher
from vrg_ros.strategy import RosDriven
from vrg_ros.wire import ros_name

KEYS, MODEL = Keys("m"), robot_model("P2AT")
WALL = Rectangle(1.0, 0.0, 2.0, 1.0)


class Bench:
    """A publisher, and what it has published: the newest message of each topic, as it comes out of its bytes."""

    def __init__(self) -> None:
        self.mailbox, self.time, self._number = Mailbox(), 0.0, 0
        self.found: dict[str, tuple[str, dict[str, Any], bool]] = {}
        self.counts: dict[str, int] = {}
        self.advertised: dict[str, str] = {}
        self.unwanted: set[str] = set()
        self.node = RosPublisher("ros", self.mailbox, KEYS, "/m", self, robots={"ann": MODEL}, obstacles=(WALL,))

    def advertise(self, topic: str, of: str, lasting: bool = False) -> None:
        self.advertised[topic] = of

    def publish(self, topic: str, of: str, message: ros.Fields, lasting: bool = False) -> None:
        self.found[topic] = of, decode(of, encode(of, message)), lasting
        self.counts[topic] = self.counts.get(topic, 0) + 1

    def wanted(self, topic: str, of: str) -> bool:
        return topic not in self.unwanted

    def offer(self, topic: str, of: str, make: Callable[[], Sequence[ros.Fields]]) -> None:
        if self.wanted(topic, of):
            for message in make():
                self.publish(topic, of, message)

    def say(self, topic: Topic[Any], body: m.Message, stamp: float | None = None) -> None:
        self._number += 1
        for inlet in self.mailbox.inlets:
            if fnmatch(topic.key, inlet.topic.key) and inlet.admits(topic.key):
                inlet.offer(Received(topic.key, self.time if stamp is None else stamp, self._number, body, "x/y"))

    def tick(self, time: float) -> None:
        self.time = time
        self.mailbox.handover(time)
        self.node.tick(Tick(time))


def poses(known: Uncertainty | None = None, age: float = 0.0) -> m.Poses:
    body = m.Body(
        name="ann", pose=Pose(3.0, 4.0, math.pi / 2), twist=Twist(0.5, 0.2), physical=known is not None, age=age,
        uncertainty=known,
    )  # fmt: skip
    return m.Poses(bodies=(body,))


def state() -> m.RefereeState:
    zone = m.Zone(name="field", kind="field", region=Rectangle(-2.0, -1.0, 2.0, 1.0))
    return synthetic.state(1.0, game="practice", players=(), zones=(zone,))


def test_poses_become_odometry_and_frames() -> None:
    bench = Bench()
    bench.say(KEYS.poses, poses(Uncertainty(0.01, 0.002, 0.02, 0.03), age=0.5), 2.0)
    bench.tick(2.0)
    of, odometry, _ = bench.found["/m/ann/odom"]
    assert of == "nav_msgs/Odometry"
    assert odometry["header"] == {"stamp": {"sec": 1, "nanosec": 500_000_000}, "frame_id": "ann/odom"}
    assert odometry["child_frame_id"] == "ann/base_link"
    assert odometry["pose"]["pose"]["position"] == {"x": 3.0, "y": 4.0, "z": 0.0}
    turn = odometry["pose"]["pose"]["orientation"]
    assert (turn["z"], turn["w"]) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)))
    matrix = np.reshape(odometry["pose"]["covariance"], (6, 6))
    assert (matrix[0, 0], matrix[0, 1], matrix[1, 0], matrix[1, 1], matrix[5, 5]) == (0.01, 0.002, 0.002, 0.02, 0.03)
    assert odometry["twist"]["twist"]["linear"]["x"] == 0.5
    assert odometry["twist"]["twist"]["angular"]["z"] == 0.2
    (frame,) = bench.found["/tf"][1]["transforms"]
    assert (frame["header"]["frame_id"], frame["child_frame_id"]) == ("ann/odom", "ann/base_link")
    assert bench.found["/m/ann/pose"][1]["header"]["frame_id"] == "map"


def test_what_late_subscribers_need_comes_again() -> None:
    bench = Bench()
    for n in range(int(2.5 * REPUBLISH_PERIOD / 0.1)):
        bench.say(KEYS.referee_state, state())
        bench.tick(0.1 * n + 0.1)
    assert bench.counts["/m/map"] == bench.counts["/tf_static"] == bench.counts["/m/ann/robot_description"] == 3
    _, grid, lasting = bench.found["/m/map"]
    assert lasting
    info = grid["info"]
    cells = np.reshape(grid["data"], (info["height"], info["width"]))
    x0, y0 = info["origin"]["position"]["x"], info["origin"]["position"]["y"]

    def cell(x: float, y: float) -> int:
        return int(cells[int((y - y0) / 0.1), int((x - x0) / 0.1)])

    assert (cell(1.5, 0.5), cell(-0.5, 0.5), cell(1.5, -0.5)) == (100, 0, 0)
    robot = ElementTree.fromstring(bench.found["/m/ann/robot_description"][1]["data"])
    assert robot.find("link/visual/geometry/box").get("size") == f"{MODEL.length:g} {MODEL.width:g} {MODEL.height:g}"  # type: ignore[union-attr]
    frames = {link.get("name") for link in robot.findall("link")}
    static = {frame["child_frame_id"] for frame in bench.found["/tf_static"][1]["transforms"]}
    assert static == frames - {"ann/base_link"} | {"ann/odom"}
    zone, name = bench.found["/m/markers"][1]["markers"]
    assert len(zone["points"]) == 5
    assert name["text"] == "field"


def test_readings_become_messages_in_frames_that_are_there() -> None:
    bench = Bench()
    bench.say(KEYS.referee_state, state())
    bench.tick(0.9)
    names = {spec.kind: spec.name for spec in MODEL.sensors}
    ranges = np.array([1.0, 8.0, 0.0], dtype=np.float32)
    laser = Laser(angle_min=-0.5, angle_step=0.5, range_max=8.0, data=ranges.tobytes())
    bench.say(KEYS.sensor(Laser, "ann", names["laser"]), laser)
    bench.say(KEYS.sensor(Battery, "ann", names["battery"]), Battery(charge=0.75))
    bench.say(KEYS.sensor(Sonar, "ann", names["sonar"]), Sonar(range_max=3.0, ranges=(3.0,) * 15 + (0.5,)))
    gps = Gps(latitude=0.6, longitude=-1.8, satellites=7)
    bench.say(KEYS.sensor(Gps, "ann", names["gps"]), gps)
    bench.tick(1.0)
    static = {frame["child_frame_id"] for frame in bench.found["/tf_static"][1]["transforms"]}
    scan = bench.found["/m/ann/scan"][1]
    assert scan["ranges"] == pytest.approx([1.0, math.inf, math.nan], nan_ok=True), "0 is no measurement"
    assert (scan["angle_min"], scan["angle_max"], scan["range_max"]) == pytest.approx((-0.5, 0.5, 8.0))
    reach = bench.found["/m/ann/range"][1]
    assert bench.counts["/m/ann/range"] == 16
    assert reach["range"] == 0.5
    charge = bench.found["/m/ann/battery_state"][1]
    assert (charge["percentage"], charge["present"]) == (0.75, True)
    assert math.isnan(charge["voltage"])
    fix = bench.found["/m/ann/fix"][1]
    assert fix["latitude"] == pytest.approx(math.degrees(0.6))
    assert {scan["header"]["frame_id"], reach["header"]["frame_id"], fix["header"]["frame_id"]} <= static


def test_readings_are_taken_only_while_somebody_subscribes_to_them() -> None:
    bench = Bench()
    (name,) = (spec.name for spec in MODEL.sensors if spec.kind == "battery")
    (inlet,) = (inlet for inlet in bench.mailbox.inlets if inlet.topic.type is Battery)
    counts = []
    for number, wanted in enumerate((False, True, True, False, False)):
        bench.unwanted = set() if wanted else {"/m/ann/battery_state"}
        bench.tick(number)
        bench.say(KEYS.sensor(Battery, "ann", name), Battery(charge=0.75))
        counts.append(len(inlet.waiting))
        bench.tick(number + 0.5)
    assert counts == [0, 1, 1, 0, 0]
    assert bench.counts["/m/ann/battery_state"] == 2


def test_the_clock_and_the_referee_are_there() -> None:
    bench = Bench()
    bench.say(KEYS.clock, m.Clock(time=3.25, tick=163, epoch=0, rate=1.0, estop=False))
    bench.say(KEYS.referee_state, state())
    bench.tick(3.25)
    assert bench.found["/clock"][1] == {"clock": {"sec": 3, "nanosec": 250_000_000}}
    told = json.loads(bench.found["/m/referee/state"][1]["data"])
    assert (told["game"], told["stage"]) == ("practice", "play_round")


def test_flags_are_where_their_carriers_are_and_calls_stand_for_a_while() -> None:
    bench = Bench()
    free = m.FieldObject(name="red flag", kind="flag", x=1.0, y=2.0)
    bench.say(KEYS.referee_state, structs.replace(state(), objects=(free, structs.replace(free, carrier="ann"))))
    bench.say(KEYS.poses, poses())
    bench.tick(1.0)
    flags = bench.found["/m/markers"][1]["markers"]
    assert [(f["ns"], f["id"], f["pose"]["position"]["x"]) for f in flags] == [("flag", 0, 1.0), ("flag", 1, 3.0)]
    call = m.Call(number=4, rule="tag", text="ann is tagged", players=("ann",), poses=(Pose(5.0, 6.0, 0.0),), clock=1.0)
    bench.say(KEYS.referee_event, call)
    bench.tick(1.1)
    (note,) = bench.found["/m/markers"][1]["markers"]
    assert (note["ns"], note["id"], note["text"], note["lifetime"]["sec"]) == ("calls", 4, "ann is tagged", 4)
    assert json.loads(bench.found["/m/referee/calls"][1]["data"])["rule"] == "tag"


@pytest.mark.parametrize(("name", "plain"), [("ann", "ann"), ("red-1", "red_1"), ("3po", "n3po"), ("größe", "gr__e")])
def test_names_are_such_as_ros_allows(name: str, plain: str) -> None:
    assert ros_name(name) == plain


def test_every_topic_that_does_not_last_is_advertised_before_its_first_message() -> None:
    bench = Bench()
    before = dict(bench.advertised)
    test_readings_become_messages_in_frames_that_are_there()
    assert before["/m/referee/calls"] == "std_msgs/String"
    assert {topic.rpartition("/")[2] for topic in before} == {
        "clock", "tf", "state", "calls", "odom", "pose", "scan", "range", "battery_state", "fix",
    }  # fmt: skip


def test_commands_become_a_lease_of_a_player() -> None:
    """Shares of what the robot can do, within its limits; what is no number is left out, and what waited too long."""
    bench, waiting = Bench(), list[ros.Fields]()

    def newest() -> ros.Fields | None:
        return waiting.pop() if waiting else None

    bench.node = RosPublisher("ros", bench.mailbox, KEYS, "/m", bench, robots={"ann": MODEL}, driven={"ann": newest})

    def drives(v: float, w: float, time: float, side: float = 0.0) -> list[m.Manual]:
        waiting[:] = [{"linear": {"x": v, "y": side, "z": 0.0}, "angular": {"z": w}}]
        bench.tick(time)
        return [out.message.body for out in bench.mailbox.collect() if isinstance(out.message.body, m.Manual)]

    assert drives(0.3, 0.0, 1.0) == [], "it came before the first tick"
    (manual,) = drives(MODEL.v_max / 2, -MODEL.w_max / 4, 1.1)
    assert (manual.forward, manual.turn, manual.lease) == (0.5, -0.25, 0.3)
    (fast,) = drives(2 * MODEL.v_max, -MODEL.w_max / 2, 1.2, side=9.0)
    assert (fast.forward, fast.turn, fast.side) == (1.0, -0.25, 0.0), "on the curve that was asked for"
    assert drives(math.nan, 0.0, 1.3) == []
    assert drives(0.3, 0.0, 4.0) == [], "this process was frozen meanwhile"
    assert drives(0.3, 0.0, 4.1) != []
    assert RosDriven("ann", MODEL).mode == "ROS"


def test_a_robot_that_can_is_driven_sideways() -> None:
    bench, commands = (
        Bench(),
        iter([None, {"linear": {"x": 0.0, "y": -2 * OMNI.v_max, "z": 0.3}, "angular": {"z": 0.0}}]),
    )
    bench.node = RosPublisher(
        "ros", bench.mailbox, KEYS, "/m", bench, robots={"ann": OMNI}, driven={"ann": lambda: next(commands)}
    )
    bench.tick(1.0)
    bench.tick(1.1)
    (manual,) = [out.message.body for out in bench.mailbox.collect() if isinstance(out.message.body, m.Manual)]
    assert (manual.forward, manual.turn, manual.side, manual.climb) == (0.0, 0.0, -1.0, 0.0), "it does not fly"


def test_a_robot_that_flies_climbs() -> None:
    flying = robot_model("Crazyflie")
    assert flying.flies is not None
    command = {"linear": {"x": 0.0, "y": 0.0, "z": -flying.flies.climb / 2}, "angular": {"z": 0.0}}
    bench, commands = Bench(), iter([None, command])
    bench.node = RosPublisher(
        "ros", bench.mailbox, KEYS, "/m", bench, robots={"ann": flying}, driven={"ann": lambda: next(commands)}
    )
    bench.tick(1.0)
    bench.tick(1.1)
    (manual,) = [out.message.body for out in bench.mailbox.collect() if isinstance(out.message.body, m.Manual)]
    assert (manual.forward, manual.climb) == (0.0, -0.5)
