"""The match's side of a robot: whatever driver it has, the match is obeyed."""

import math
import threading
from collections.abc import Iterator
from dataclasses import replace
from threading import Event

import pytest
from msgspec.structs import astuple

from tests.hal.device_bench import KEYS, Bench
from tests.hal.fake_driver import MODEL, FakeDriver, PhysicalFake
from vrg.bus import messages as m
from vrg.errors import RobotError, StaleDataError
from vrg.hal.actuators import Dribbler, Gripper, Kicker
from vrg.hal.models.crazyflie import CRAZYFLIE
from vrg.hal.permission import REFEREE_TIMEOUT
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.gps import Gps
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.hal.sensors.touch import Touch
from vrg.types import STILL, Pose, Twist, Uncertainty

AHEAD = Twist(0.5, 0.0)


@pytest.fixture
def bench() -> Bench:
    """An armed robot whose referee lets it move."""
    return Bench(FakeDriver()).armed()


@pytest.fixture
def engaged(bench: Bench) -> Bench:
    """The same after the emergency stop."""
    bench.estop()
    assert bench.driver.told == ["emergency stop"]
    bench.tick()
    return bench


def test_a_robot_is_reached_when_the_device_is_started_and_begins_disarmed() -> None:
    assert Bench(FakeDriver()).driver.told == ["connect", "disarm"]


class Handy(FakeDriver):
    """Drives a kicker and a gripper, but not its dribbler."""

    uses = frozenset({"kicker", "gripper"})

    def __init__(self) -> None:
        super().__init__()
        kinds = (Kicker(most=4.0, width=0.1), Gripper(width=0.1), Dribbler(width=0.1, pull=2.0))
        self.features = replace(MODEL, actuators=kinds)

    def use(self, name: str, value: float) -> None:
        self.told.append(f"{name} {value}")


class TestActuators:
    def test_they_are_used_before_the_motion(self) -> None:
        bench = Bench(Handy()).armed()
        bench.device.drive(AHEAD, {"kicker": 4.0, "gripper": 0.0})
        assert bench.driver.told == ["kicker 4.0", "gripper 0.0", "drive 0.50 0.00"]

    @pytest.mark.parametrize("held", [{"halted": "rain"}, {"may_move": False}, {"lease": Twist(0.1, 0.0)}])
    def test_a_robot_that_is_held_or_leased_uses_none(self, held: dict[str, object]) -> None:
        bench = Bench(Handy()).armed()
        bench.referee(**held)  # type: ignore[arg-type]
        bench.device.drive(AHEAD, {"kicker": 4.0, "gripper": 0.0})
        assert not [told for told in bench.driver.told if "kicker" in told or "gripper" in told]

    def test_what_nothing_drives_is_told_once_at_the_start_and_harms_nothing(
        self, caplog: pytest.LogCaptureFixture
    ) -> None:
        bench = Bench(Handy()).armed()
        (said,) = [record.message for record in caplog.records]
        assert said.startswith("a: nothing drives its dribbler, so that using it does nothing: wire it to an output")
        for _ in range(3):
            assert bench.device.drive(AHEAD, {"dribbler": 1.0}) == AHEAD
        assert len(caplog.records) == 1
        with pytest.raises(RobotError, match="expected an actuator that its backend drives, got 'horn'"):
            FakeDriver().use("horn", 1.0)


class TestGateAndLimit:
    @pytest.mark.parametrize("held", [{"halted": "rain"}, {"may_move": False}])
    def test_what_the_referee_holds_stands(self, bench: Bench, held: dict[str, object]) -> None:
        bench.referee(**held)  # type: ignore[arg-type]
        assert bench.device.drive(AHEAD) == STILL
        assert bench.driver.told == ["stop"], "zero speed is commanded on, so that the watchdog is fed"

    @pytest.mark.parametrize("held", [{"halted": "rain"}, {"may_move": False}])
    def test_what_flies_takes_off_only_when_it_may_move(self, held: dict[str, object]) -> None:
        driver = FakeDriver()
        driver.features = CRAZYFLIE
        bench = Bench(driver)
        bench.referee(**held)  # type: ignore[arg-type]
        bench.device.arm()
        assert "arm" not in bench.driver.told
        bench.referee()
        bench.device.arm()
        assert "arm" in bench.driver.told

    def test_a_referee_that_falls_silent_holds_everybody(self, bench: Bench) -> None:
        bench.tick(REFEREE_TIMEOUT - 0.1)
        assert bench.device.drive(AHEAD) == AHEAD
        bench.tick(0.2)
        assert bench.device.drive(AHEAD) == STILL

    def test_the_referees_limit_keeps_the_curve(self, bench: Bench) -> None:
        bench.say(KEYS.speed_limit("a"), m.SpeedLimit(v_max=0.25))
        bench.tick()
        sent = bench.device.drive(Twist(0.5, 0.5))
        assert max(MODEL.drivetrain.speeds(sent)) == pytest.approx(0.25 / MODEL.drivetrain.wheel_radius)
        assert sent.v == pytest.approx(sent.w)
        assert bench.driver.told == [f"drive {sent.v:.2f} {sent.w:.2f}"]

    def test_a_motion_that_is_no_number_is_refused(self, bench: Bench) -> None:
        with pytest.raises(RobotError, match="finite"):
            bench.device.drive(Twist(float("nan"), 0.0))


class TestEmergencyStop:
    def test_it_reaches_the_driver_once_between_two_ticks_and_so_does_the_release(self, engaged: Bench) -> None:
        assert engaged.driver.told == []
        for act in (engaged.device.arm, lambda: engaged.device.drive(AHEAD)):
            with pytest.raises(RobotError, match="emergency stop is engaged"):
                act()
        for _ in range(5):
            engaged.estop()
        assert engaged.driver.told == [], "who repeats the order stops the driver once"
        engaged.tick()
        engaged.release()
        assert engaged.driver.told == ["release"]
        assert not engaged.device.estop

    def test_a_release_of_before_does_not_undo_a_stop_that_sounds_before_it_is_heard(self, engaged: Bench) -> None:
        engaged.say(KEYS.estop_release, m.EstopRelease(by="x"))
        engaged.time += 0.1
        engaged.mailbox.handover(engaged.time)
        engaged.estop()  # on another thread, as it arrives
        engaged.device.hear()
        assert engaged.device.estop
        with pytest.raises(RobotError, match="emergency stop is engaged"):
            engaged.device.arm()
        engaged.tick()
        assert engaged.device.estop
        engaged.release()
        assert not engaged.device.estop

    @pytest.mark.parametrize("command", ["arm", "drive"])
    def test_no_command_that_has_begun_before_it_comes_after_it(self, command: str) -> None:
        begun, go_on, order = threading.Event(), threading.Event(), list[str]()

        class Slow(FakeDriver):
            def arm(self) -> None:
                self._take("arm")

            def drive(self, twist: Twist) -> Twist:
                self._take("drive")
                return twist

            def emergency_stop(self) -> None:
                order.append("emergency stop")

            def _take(self, what: str) -> None:
                begun.set()
                go_on.wait(10.0)
                order.append(what)

        bench = Bench(Slow())
        bench.referee()
        act = bench.device.arm if command == "arm" else lambda: bench.device.drive(AHEAD)
        own = threading.Thread(target=act)
        own.start()
        assert begun.wait(10.0)
        other = threading.Thread(target=bench.estop)
        other.start()
        go_on.set()
        own.join(10.0)
        other.join(10.0)
        assert order == [command, "emergency stop"]

    def test_a_stop_that_was_missed_is_taken_from_the_referee(self, bench: Bench) -> None:
        bench.referee(estop=True)
        assert bench.driver.told == ["emergency stop"]

    def test_a_release_that_was_missed_is_taken_from_the_referee(self, engaged: Bench) -> None:
        engaged.referee(estop=False)
        assert engaged.device.estop, "a state of before the stop does not end it"
        engaged.referee(estop=True)
        engaged.referee(estop=False)
        assert not engaged.device.estop

    def test_a_referee_that_was_restarted_and_hears_no_clock_releases_nothing(self, engaged: Bench) -> None:
        engaged.referee(estop=True)
        for _ in range(20):
            engaged.tick()
        assert engaged.mailbox.now > 1.0
        engaged.referee(stamp=0.0, estop=False)
        assert engaged.device.estop

    def test_a_state_of_before_the_release_does_not_engage_it_again(self, engaged: Bench) -> None:
        engaged.referee(estop=True)
        engaged.release()
        engaged.referee(estop=True)
        assert not engaged.device.estop
        for _ in range(6):
            engaged.referee(estop=True)
        assert engaged.device.estop, "a referee who goes on saying so means it"


class TestRecovery:
    @pytest.fixture
    def slow(self) -> Iterator[tuple[Bench, Event, Event]]:
        """A robot whose recovery takes until the second event is set."""
        begun, done = Event(), Event()

        class Slow(FakeDriver):
            def recover(self) -> None:
                begun.set()
                assert done.wait(20.0)

        yield Bench(Slow()), begun, done
        done.set()

    def test_it_recovers_beside_the_ticks_when_an_official_asks(self, slow: tuple[Bench, Event, Event]) -> None:
        bench, begun, done = slow
        bench.say(KEYS.recover("a"), m.Recover(by="ann"))
        bench.tick()
        assert begun.wait(20.0)
        bench.tick()
        with pytest.raises(RobotError, match="it is being recovered"):
            bench.device.arm()
        done.set()
        bench.device.close()
        bench.device.arm()

    def test_somebody_elses_recovery_is_not_its_own(self, slow: tuple[Bench, Event, Event]) -> None:
        bench, begun, _ = slow
        bench.say(KEYS.recover("b"), m.Recover(by="ann"))
        bench.tick()
        assert not begun.is_set()


def test_a_human_holds_the_lease_for_its_time(bench: Bench) -> None:
    assert bench.device.manual_twist(bench.time) is None
    bench.say(KEYS.manual("a"), m.Manual(forward=0.5, turn=-1.0, side=-0.25, lease=0.3))
    bench.tick()
    assert bench.device.manual_twist(bench.time) == Twist(0.5 * MODEL.v_max, -MODEL.w_max, -0.25 * MODEL.v_max)
    bench.tick(0.3)
    assert bench.device.manual_twist(bench.time) is None


def test_a_human_lets_climb_what_flies_alone() -> None:
    assert CRAZYFLIE.flies is not None
    for model, climb in ((MODEL, 0.0), (CRAZYFLIE, -0.5 * CRAZYFLIE.flies.climb)):
        driver = FakeDriver()
        driver.features = model
        bench = Bench(driver)
        bench.say(KEYS.manual("a"), m.Manual(forward=0.0, turn=0.0, climb=-0.5, lease=0.3))
        bench.tick()
        assert bench.device.manual_twist(bench.time) == Twist(0.0, 0.0, climb=climb)


class TestPhysicalRobots:
    @pytest.fixture
    def physical(self) -> Bench:
        return Bench(PhysicalFake(), start=Pose(10.0, 5.0, 0.0))

    @pytest.fixture
    def fed(self) -> Bench:
        """A robot whose pose is measured by somebody else."""
        bench = Bench(PhysicalFake(), localisation="feed")
        bench.tick()
        return bench

    @pytest.fixture(params=[True, False], ids=["physical", "virtual"])
    def fused(self, request: pytest.FixtureRequest) -> Bench:
        """A robot that the fusion centre tells where it is."""
        bench = Bench(PhysicalFake() if request.param else FakeDriver(), localisation="fusion")
        bench.tick()
        return bench

    @staticmethod
    def published(bench: Bench) -> list[tuple[float, Pose]]:
        """The poses that the world is told, each with its stamp."""
        return [(said.stamp, said.body.pose) for said in bench.reported() if isinstance(said.body, m.MeasuredPose)]

    @staticmethod
    def at(bench: Bench, pose: Pose, age: float = 0.0) -> Pose:
        """Where the robot is when its odometry says so."""
        assert isinstance(bench.driver, PhysicalFake)
        bench.driver.at(pose, bench.time - age, age)
        ins = bench.device.read().latest(Ins)
        assert ins is not None
        return ins.value.pose

    def test_it_begins_where_the_match_file_says(self, physical: Bench) -> None:
        physical.tick()
        assert self.at(physical, Pose(0.0, 0.0, 0.0)) == Pose(10.0, 5.0, 0.0)
        assert self.at(physical, Pose(1.0, 0.5, 0.0)) == Pose(11.0, 5.5, 0.0)
        assert self.published(physical) == [], "before the world has shown it, its place is only believed"

    def test_a_player_that_was_restarted_goes_on_from_where_the_world_saw_its_robot(self, physical: Bench) -> None:
        physical.world_sees(Pose(12.0, 6.0, 0.0))
        # The drives have counted on while nobody asked them.
        assert self.at(physical, Pose(7.0, 0.0, 0.0)) == Pose(12.0, 6.0, 0.0)
        assert self.at(physical, Pose(8.0, 0.0, 0.0)) == Pose(13.0, 6.0, 0.0)

    def test_a_pose_is_stamped_with_when_it_was_measured_unless_it_is_too_old(self, physical: Bench) -> None:
        physical.world_sees(Pose(10.0, 5.0, 0.0))
        physical.tick(1.0)
        self.at(physical, Pose(0.0, 0.0, 0.0), age=0.4)
        assert self.published(physical) == [(pytest.approx(physical.time - 0.4), Pose(10.0, 5.0, 0.0))]
        assert physical.device.read().age == pytest.approx(0.4)
        physical.tick(1.0)
        self.at(physical, Pose(0.0, 0.0, 0.0), age=0.6)
        assert self.published(physical) == []

    def test_a_robot_that_was_carried_is_told_where_it_stands(self, physical: Bench) -> None:
        physical.world_sees(Pose(10.0, 5.0, 0.0))
        self.at(physical, Pose(3.0, 0.0, 1.0))
        physical.say(KEYS.placed("a"), m.Placed(pose=Pose(20.0, 8.0, 0.0), by="ann"))
        physical.tick()
        assert astuple(self.at(physical, Pose(3.0, 0.0, 1.0))) == pytest.approx((20.0, 8.0, 0.0, 0.0))
        here = self.at(physical, Pose(3.0, 2.0, 1.0))
        assert (here.x - 20.0) ** 2 + (here.y - 8.0) ** 2 == pytest.approx(4.0), "it counts on from there"

    def test_a_feed_stands_above_the_odometry_and_neither_is_told_to_the_world(self, fed: Bench) -> None:
        with pytest.raises(StaleDataError, match="expected its pose on vrg/test/robot/a/pose"):
            fed.device.read()
        fed.say(KEYS.robot_pose("a"), m.MeasuredPose(pose=Pose(4.0, 4.0, 0.0)))
        fed.tick(0.2)
        assert self.at(fed, Pose(9.0, 9.0, 0.0)) == Pose(4.0, 4.0, 0.0)
        assert fed.device.read().age == pytest.approx(0.2)
        assert self.published(fed) == []

    def test_fusion_tells_where_it_was_and_odometry_how_far_it_has_come_since(self, fused: Bench) -> None:

        def drives(x: float) -> None:
            fused.driver.samples = [s for s in fused.driver.samples if not isinstance(s.value, Odometry)]
            odometry = Odometry(pose=Pose(x, 0.0, 0.0), twist=Twist(0.5, 0.0))
            fused.driver.samples.append(Sample(fused.time, 0.0, odometry))

        drives(0.0)
        with pytest.raises(StaleDataError, match="a: expected its place from the fusion centre"):
            fused.device.read()
        then, known = fused.time, Uncertainty(1e-4, 0.0, 1e-4, 1e-4)
        said = [(said.stamp, said.body) for said in fused.reported()]
        assert said == [(then, m.Motion(odometry=Pose(0.0, 0.0, 0.0), twist=Twist(0.5, 0.0)))]
        there = m.MeasuredPose(pose=Pose(4.0, 4.0, math.pi / 2), uncertainty=known, unseen=0.1)
        fused.say(KEYS.robot_pose("a"), there, stamp=then)
        fused.tick(0.1)
        drives(0.05)
        ins = fused.device.read().latest(Ins)
        assert ins is not None
        assert astuple(ins.value.pose) == pytest.approx((4.0, 4.05, math.pi / 2, 0.0))
        assert (ins.value.uncertainty, ins.age) == (known, 0.0)
        fused.tick(0.5)
        drives(0.05)
        with pytest.raises(StaleDataError, match=r"a: it is lost: no source has seen it for 0\.7 s"):
            fused.device.read()

    def test_what_a_robot_measures_of_its_own_place_goes_to_the_fusion_centre_once(self, fused: Bench) -> None:
        """But for a virtual robot's INS, which is as good as the truth."""
        here, earth = Pose(3.0, 1.0, 0.2), Gps(latitude=0.6, longitude=-1.8, satellites=7)
        fused.driver.samples = [Sample(fused.time, 0.0, Odometry(pose=Pose(0.0, 0.0, 0.0), twist=STILL))]
        fused.driver.samples += [Sample(fused.time, 0.0, Ins(pose=here)), Sample(fused.time, 0.0, earth)]
        stamp, found = fused.time, []
        for _ in range(2):
            with pytest.raises(StaleDataError):
                fused.device.read()
            found.append(fused.reported()[0].body.own)  # type: ignore[attr-defined]
        gps = m.OwnPlace(stamp, earth=(0.6, -1.8))
        assert found == [(m.OwnPlace(stamp, pose=here), gps) if fused.driver.physical else (gps,), ()]

    def test_a_robot_with_a_feed_does_not_tell_the_world_what_it_measures_itself(self, fed: Bench) -> None:
        fed.driver.samples.append(Sample(fed.time, 0.0, Ins(pose=Pose(1.0, 1.0, 0.0))))
        assert fed.device.read().latest(Ins) is not None
        assert self.published(fed) == []

    def test_a_robot_that_measures_its_pose_itself_is_believed(self, physical: Bench) -> None:
        physical.tick()
        physical.driver.samples.append(Sample(physical.time, 0.0, Ins(pose=Pose(1.0, 1.0, 0.0))))
        readings = physical.device.read()
        assert readings.latest(Ins) is not None
        assert readings.latest(Ins).value.pose == Pose(1.0, 1.0, 0.0)
        assert [pose for _, pose in self.published(physical)] == [Pose(1.0, 1.0, 0.0)]

    def test_what_it_lacks_the_world_synthesises_and_the_rest_is_unknown(self, physical: Bench) -> None:
        scan = Laser(angle_min=0.0, angle_step=0.1, range_max=8.0, data=b"\0\0\0\0")
        physical.say(KEYS.sensor(Laser, "a", "front"), scan)
        physical.tick(0.2)
        self.at(physical, Pose(0.0, 0.0, 0.0))
        readings = physical.device.read()
        assert readings.latest(Laser) is not None
        assert readings.latest(Laser).value == scan
        assert readings.latest(Laser).age == pytest.approx(0.2)
        assert readings.latest(Touch) is None
        assert readings.latest(Battery) is None
