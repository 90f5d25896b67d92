"""What a pursuer finds out with its own laser and from what its team says."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from msgspec import structs

from tests.agents.perception.scenes import HALF_TURN, box, ranges_in, room, together
from tests.games.pursuit_evasion.making import book, field, sighting
from vrg.agents.perception.scan import Floats
from vrg.agents.radio import TeamMessage
from vrg.agents.strategy import View
from vrg.bus.messages import SensorMessage, Stage
from vrg.coordinator.match import Match
from vrg.games.pursuit_evasion.talk import words
from vrg.games.pursuit_evasion.watch import MATE_FORGOTTEN, SNAPSHOT_SCANS, IntruderDetector
from vrg.hal.models import robot_model
from vrg.hal.readings import Readings
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.laser import Laser, LaserSpec
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.types import STILL, Pose, Twist, Uncertainty, Vector

ROBOT = robot_model("P2AT")
POST = Pose(1.0, 1.0, math.radians(45.0))
SCENE = room(-2.0, -2.0, 9.0, 9.0)


def ahead(pose: Pose) -> Pose:
    """Where the laser is on a robot."""
    laser = ROBOT.sensor(LaserSpec)
    assert laser is not None
    return Pose(
        pose.x + laser.x * math.cos(pose.theta),
        pose.y + laser.x * math.sin(pose.theta),
        pose.theta,
    )


def view(
    time: float,
    scene: Floats = SCENE,
    *,
    pose: Pose = POST,
    scanned: tuple[float, Pose] | None = None,
    twist: Twist = STILL,
    heard: Sequence[TeamMessage] = (),
    out: Vector | None = None,
) -> View:
    """What p0 is told at a tick.

    Args:
        scanned: when and from where its newest scan was made; now and from `pose` if None.
        out: where i1 stands, which has been captured.
    """
    at, origin = scanned or (time, pose)
    ranges = ranges_in(scene, ahead(origin), *HALF_TURN, 8.0).astype("<f4")
    laser = Laser(angle_min=HALF_TURN[1], angle_step=math.radians(1.0), range_max=8.0, data=ranges.tobytes())
    said: list[tuple[float, SensorMessage]] = [
        (at, laser),
        (time, Ins(pose=pose)),
        (time, Odometry(pose=pose, twist=twist)),
    ]
    samples = [Sample(stamp, time - stamp, value, "front") for stamp, value in said]
    rules = book()
    match = Match(rules)
    match.stage, match.total = Stage.PLAY_ROUND, time
    match.game = rules.initial() if out is None else rules.initial().with_state(["i1"], "captured")
    referee = match.state(field(rules, {} if out is None else {"i1": out}), estop=False)
    me = referee.player("p0")
    assert me is not None
    return View(
        time=time,
        me=me,
        readings=Readings(stamp=time, age=0.0, armed=True, estop=False, samples=samples),
        referee=referee,
        velocities={},
        robot=ROBOT,
        pose=pose,
        heard=heard,
    )


def watching() -> IntruderDetector:
    """It has stood at its post and seen the empty scene, until 1 s."""
    watch = IntruderDetector(ROBOT)
    for i in range(10):
        watch.look(view(0.1 * (i + 1)), standing=True)
    return watch


@pytest.fixture
def watch() -> IntruderDetector:
    """It has stood at its post for 1 s."""
    return watching()


def test_an_empty_scene_has_nobody_in_it(watch: IntruderDetector) -> None:
    assert watch.fresh == []
    assert watch.tracker.tracks == []
    assert watch.own is not None


def test_an_intruder_is_seen_where_it_is(watch: IntruderDetector) -> None:
    watch.look(view(1.1, together(SCENE, box(4.0, 5.0, 0.3))), standing=True)
    (seen,) = watch.fresh
    assert math.dist((seen.x, seen.y), (4.0, 5.0)) < 0.2
    assert seen.time == 1.1
    assert len(watch.tracker.tracks) == 1


def test_one_scan_is_looked_at_once(watch: IntruderDetector) -> None:
    scene = together(SCENE, box(4.0, 5.0, 0.3))
    watch.look(view(1.1, scene), standing=True)
    watch.look(view(1.2, scene, scanned=(1.1, POST)), standing=True)
    assert watch.fresh == []
    assert watch.tracker.tracks[0].line.count == 1


def test_the_empty_scene_is_the_one_that_was_seen_first(watch: IntruderDetector) -> None:
    """An intruder that stands still later does not become a part of it."""
    for i in range(3 * SNAPSHOT_SCANS):
        watch.look(view(1.1 + 0.1 * i, together(SCENE, box(4.0, 5.0, 0.3))), standing=True)
    assert len(watch.fresh) == 1


def test_who_does_not_know_where_it_is_takes_no_snapshot() -> None:
    """It has just been found. As soon as it knows its place, it looks at the scene."""
    watch, time = IntruderDetector(ROBOT), 0.0
    for error, turn, known in ((0.2, 0.01, False), (0.02, 0.05, False), (0.02, 0.01, True)):
        unsure = Uncertainty(error**2, 0.0, error**2, turn**2)
        for _ in range(10):
            time += 0.1
            watch.look(structs.replace(view(time), uncertainty=unsure), standing=True)
        assert (watch.own is not None) == known


def test_who_is_unsure_where_it_is_is_unsure_of_what_it_sees() -> None:
    scene, seen = together(SCENE, box(4.0, 5.0, 0.3)), []
    for error in (0.0, 0.2):
        watch = watching()
        watch.look(
            structs.replace(view(1.1, scene), uncertainty=Uncertainty(error**2, 0.0, error**2, 0.0)), standing=True
        )
        seen += watch.fresh
    assert seen[1].xx - seen[0].xx == pytest.approx(0.04)
    assert seen[1].yy - seen[0].yy == pytest.approx(0.04)


def test_who_does_not_stand_takes_no_snapshot() -> None:
    watch = IntruderDetector(ROBOT)
    for i in range(10):
        watch.look(view(0.1 * (i + 1)), standing=False)
    assert watch.own is None


@pytest.mark.parametrize("age", [0.0, 0.05, 0.1, 0.3])
def test_a_scan_that_comes_late_is_of_where_the_robot_was_then(age: float) -> None:
    """It drives and turns. The scan was made some time ago; its own pose is of now."""
    watch, twist = watching(), Twist(0.7, 1.0)
    then = Pose(2.0, 2.0, 0.6)
    turn = then.theta + twist.w * age
    radius = twist.v / twist.w
    now = Pose(
        then.x + radius * (math.sin(turn) - math.sin(then.theta)),
        then.y - radius * (math.cos(turn) - math.cos(then.theta)),
        turn,
    )
    scene = together(SCENE, box(4.5, 5.0, 0.3))
    watch.look(view(2.0 + age, scene, pose=now, scanned=(2.0, then), twist=twist), standing=False)
    (seen,) = watch.fresh
    assert seen.time == 2.0
    assert math.dist((seen.x, seen.y), (4.5, 5.0)) < 0.2


def mate(time: float, pose: Pose, twist: Twist = STILL) -> TeamMessage:
    return TeamMessage("p1", time, words(pose, twist, [], None))


def test_a_team_mate_that_says_where_it_is_is_no_intruder(watch: IntruderDetector) -> None:
    scene = together(SCENE, box(4.0, 5.0, 0.3, (0.5, 0.49)))
    watch.look(view(1.1, scene, heard=[mate(1.1, Pose(4.0, 5.0, 0.3))]), standing=True)
    assert watch.fresh == []
    watch.look(view(100.0, scene), standing=True)
    assert watch.fresh == [], "it stands, so it is still there"


def test_a_team_mate_that_drives_is_where_it_has_driven_to(watch: IntruderDetector) -> None:
    watch.look(view(1.1, heard=[mate(1.0, Pose(3.0, 5.0, 0.0), Twist(0.7, 0.0))]), standing=True)
    watch.look(view(2.5, together(SCENE, box(4.05, 5.0, 0.0, (0.5, 0.49)))), standing=True)
    assert watch.fresh == []
    watch.look(view(1.0 + MATE_FORGOTTEN + 0.2, together(SCENE, box(5.0, 5.0, 0.0, (0.5, 0.49)))), standing=True)
    assert len(watch.fresh) == 1, "for some time; then nobody knows where it is"


def test_who_is_out_of_play_is_no_intruder(watch: IntruderDetector) -> None:
    scene = together(SCENE, box(4.0, 5.0, 0.3))
    watch.look(view(1.1, scene, out=(4.0, 5.0)), standing=True)
    assert watch.fresh == []
    watch.look(view(1.2, scene, out=(6.0, 2.0)), standing=True)
    assert len(watch.fresh) == 1


def test_an_intruder_beside_a_team_mate_is_seen_where_it_is(watch: IntruderDetector) -> None:
    """They are half a metre apart, and the mate says where it is."""
    body, other = box(4.0, 5.0, math.pi / 4, (0.7, 0.64)), box(4.75, 4.25, math.pi / 4, (0.5, 0.49))
    watch.look(view(1.1, together(SCENE, body, other), heard=[mate(1.1, Pose(4.75, 4.25, 0.785))]), standing=True)
    assert [math.dist((s.x, s.y), (4.0, 5.0)) < 0.25 for s in watch.fresh] == [True]


def test_what_a_team_mate_has_seen_through_is_free_for_all() -> None:
    """It sees behind a wall, where p0 has seen nothing. Then p0 drives there."""
    scene = together(SCENE, box(4.0, 4.0, math.radians(45.0), (0.2, 4.0)))
    behind, there = box(6.0, 6.0), Pose(7.0, 3.0, math.radians(100.0))
    theirs = IntruderDetector(ROBOT)
    for i in range(SNAPSHOT_SCANS):
        theirs.look(view(0.1 * (i + 1), scene, pose=Pose(8.0, 8.0, math.radians(-135.0))), standing=True)
    for told in (False, True):
        watch = IntruderDetector(ROBOT)
        for i in range(SNAPSHOT_SCANS):
            watch.look(view(0.1 * (i + 1), scene), standing=True)
        said = words(Pose(8.0, 8.0, 0.0), STILL, [], theirs.own if told else None)
        now = view(1.0, together(scene, behind), pose=there, heard=[TeamMessage("p1", 1.0, said)])
        watch.look(now, standing=False)
        assert len(watch.fresh) == (1 if told else 0)


def test_the_sightings_of_the_team_and_its_own_are_of_one_robot(watch: IntruderDetector) -> None:
    for i in range(10):
        time = 1.1 + 0.1 * i
        scene = together(SCENE, box(3.0 + 0.07 * i, 5.0, 0.0))
        theirs = np.array([3.0 + 0.07 * (i - 0.5), 5.0])
        s = words(Pose(8.0, 8.0, 0.0), STILL, [sighting(*theirs.tolist(), time - 0.05)], None)
        watch.look(view(time, scene, heard=[TeamMessage("p1", time, s)]), standing=True)
    (track,) = watch.tracker.tracks
    assert track.line.count == 20
    assert track.line.velocity == pytest.approx((0.7, 0.0), abs=0.15)


def test_a_robot_without_a_laser_hears_all_the_same() -> None:
    watch = IntruderDetector(ROBOT)
    bare = view(1.0, heard=[mate(1.0, Pose(3.0, 3.0, 0.0))])
    blind = View(
        time=1.0, me=bare.me, readings=Readings(1.0, 0.0, True, False), referee=bare.referee, velocities={},
        robot=ROBOT, pose=POST, heard=bare.heard,
    )  # fmt: skip
    watch.look(blind, standing=True)
    assert watch.own is None
    assert watch.places(1.0) == {"p1": (3.0, 3.0)}


def test_a_halt_is_no_time_for_a_course(watch: IntruderDetector) -> None:
    """Match time goes on in a halt, and everybody stands."""
    for i in range(10):
        time = 1.1 + 0.1 * i
        watch.look(view(time, together(SCENE, box(3.0 + 0.07 * i, 5.0, 0.0))), standing=True)
    before = watch.tracker.tracks[0].line.at(2.1)
    after = view(32.1, together(SCENE, box(3.7, 5.0, 0.0)))
    after = structs.replace(after, referee=structs.replace(after.referee, total=2.1))
    watch.look(after, standing=True)
    (track,) = watch.tracker.tracks
    assert track.line.at(32.1) == pytest.approx(before, abs=0.1)
    assert track.line.velocity == pytest.approx((0.7, 0.0), abs=0.15)
    [told] = watch.timely([sighting(3.0, 5.0, 1.1)])
    assert told.time == pytest.approx(31.1, abs=0.2), "what the referee published before counts the same way"
    assert [s.time for s in watch.timely([sighting(3.0, 5.0, 32.1)])] == [32.1]


def test_a_snapshot_is_of_one_place() -> None:
    watch = IntruderDetector(ROBOT)
    watch.look(view(1.0, pose=Pose(2.0, 2.0, 0.0)), standing=True)
    watch.look(view(1.1), standing=True)
    own = view(1.1).pose
    assert watch.own is not None
    assert math.dist(watch.own.origin, (own.x, own.y)) < 0.5
