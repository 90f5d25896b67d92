"""The referee's lease of a robot, from the gate over the robot's device to the world."""

import pytest

from tests.hal.device_bench import KEYS, Bench, referee_state, status
from tests.hal.fake_driver import MODEL, FakeDriver
from tests.hal.world_bench import Wire, config
from vrg.bus import messages as m
from vrg.bus.topics import Topic
from vrg.hal.permission import REFEREE_TIMEOUT, Permission
from vrg.types import STILL, Twist

AHEAD = Twist(0.5, 0.0)
HOMEWARDS = Twist(0.3, -0.2)


def state(
    lease: Twist | None = HOMEWARDS, *, name: str = "a", may_move: bool = True, **options: object
) -> m.RefereeState:
    """A state of the referee in which one player is leased, and another one is not."""
    return referee_state([status(name, may_move, lease), status("b")], **options)  # type: ignore[arg-type]


class TestPermission:
    def heard(self, **options: object) -> Permission:
        permission = Permission()
        permission.hear(10.0, state(**options))  # type: ignore[arg-type]
        return permission

    @pytest.mark.parametrize("lease", [HOMEWARDS, STILL])
    def test_the_lease_beats_what_the_player_wants_and_nobody_else_is_leased(self, lease: Twist) -> None:
        permission = self.heard(lease=lease)
        assert permission.motion("a", MODEL, AHEAD, 10.0) == lease
        assert permission.motion("b", MODEL, AHEAD, 10.0) == AHEAD
        assert permission.motion("somebody else", MODEL, AHEAD, 10.0) == AHEAD

    def test_each_state_renews_the_lease_and_tells_the_newest_motion(self) -> None:
        permission = self.heard()
        permission.hear(10.2, state(Twist(0.1, 0.0)))
        assert permission.motion("a", MODEL, AHEAD, 10.2 + REFEREE_TIMEOUT) == Twist(0.1, 0.0)

    @pytest.mark.parametrize(("name", "driven"), [("a", HOMEWARDS), ("b", AHEAD)], ids=["leased", "not leased"])
    def test_without_a_state_everybody_stands_in_the_end(self, name: str, driven: Twist) -> None:
        permission = self.heard()
        assert permission.motion(name, MODEL, AHEAD, 10.0 + REFEREE_TIMEOUT) == driven
        assert permission.motion(name, MODEL, AHEAD, 10.0 + REFEREE_TIMEOUT + 0.01) is None
        assert permission.motion(name, MODEL, AHEAD, 10.0 + REFEREE_TIMEOUT + 5.0) is None

    def test_an_expired_lease_counts_again_as_soon_as_the_referee_is_heard(self) -> None:
        permission = self.heard()
        assert permission.motion("a", MODEL, AHEAD, 12.0) is None
        permission.hear(12.0, state())
        assert permission.motion("a", MODEL, AHEAD, 12.0) == HOMEWARDS

    def test_a_state_without_the_lease_gives_the_robot_back(self) -> None:
        permission = self.heard()
        permission.hear(10.1, state(None))
        assert permission.motion("a", MODEL, AHEAD, 10.1) == AHEAD

    @pytest.mark.parametrize("held", [{"halted": "rain"}, {"estop": True}, {"may_move": False}])
    def test_a_halt_a_stop_and_a_held_robot_beat_the_lease(self, held: dict[str, object]) -> None:
        assert self.heard(**held).motion("a", MODEL, AHEAD, 10.0) is None

    def test_a_lease_of_before_the_world_stepped_back_counts_no_longer(self) -> None:
        assert self.heard().motion("a", MODEL, AHEAD, 5.0) is None


@pytest.fixture
def bench() -> Bench:
    """An armed robot's device."""
    return Bench(FakeDriver()).armed()


def hear(bench: Bench, referee: m.RefereeState) -> None:
    """The device hears a state of the referee."""
    bench.say(KEYS.referee_state, referee)
    bench.tick()


class TestDevice:
    def test_the_device_drives_by_the_lease_whatever_its_player_wants(self, bench: Bench) -> None:
        hear(bench, state())
        assert bench.device.drive(AHEAD) == HOMEWARDS
        assert bench.driver.told[-1] == "drive 0.30 -0.20"

    def test_the_lease_beats_a_human_who_drives_by_hand(self, bench: Bench) -> None:
        bench.say(KEYS.manual("a"), m.Manual(forward=1.0, turn=0.0, lease=1.0))
        hear(bench, state())
        by_hand = bench.device.manual_twist(bench.time)
        assert by_hand is not None
        assert bench.device.drive(by_hand) == HOMEWARDS

    def test_the_human_has_the_robot_again_when_the_lease_is_given_back(self, bench: Bench) -> None:
        hear(bench, state())
        bench.say(KEYS.manual("a"), m.Manual(forward=0.5, turn=0.0, lease=1.0))
        hear(bench, state(None))
        by_hand = bench.device.manual_twist(bench.time)
        assert by_hand == Twist(0.5 * MODEL.v_max, 0.0)
        assert bench.device.drive(by_hand) == by_hand

    def test_the_limits_of_the_referee_and_of_the_robot_hold_during_a_lease(self, bench: Bench) -> None:
        hear(bench, state(Twist(50.0, 0.0)))
        assert bench.device.drive(AHEAD) == Twist(pytest.approx(MODEL.v_max), 0.0)
        bench.say(KEYS.speed_limit("a"), m.SpeedLimit(v_max=0.2))
        hear(bench, state(Twist(0.6, 0.0)))
        assert bench.device.drive(AHEAD).v == pytest.approx(0.2)

    def test_an_emergency_stop_beats_the_lease(self, bench: Bench) -> None:
        bench.estop()
        assert bench.driver.told == ["emergency stop"]
        hear(bench, state())
        assert bench.device.estop


DRIVE_A = (KEYS.drive("a"), m.Drive(twist=AHEAD))
DRIVE_B = (KEYS.drive("b"), m.Drive(twist=AHEAD))


BACKWARDS = Twist(-0.4, 0.0)


def leased(lease: Twist | None = BACKWARDS, **options: object) -> tuple[Topic[m.RefereeState], m.RefereeState]:
    return KEYS.referee_state, state(lease, **options)  # type: ignore[arg-type]


@pytest.fixture
def wire() -> Wire:
    """Robots a and b on open ground."""
    return Wire(config(("a", 0.0, 0.0, 0.0), ("b", 0.0, 3.0, 0.0)))


def x_of(wire: Wire, name: str = "a") -> float:
    return wire.node.world.pose(name).x


def speed(wire: Wire, name: str = "a") -> float:
    return next(body.twist.v for body in wire.last(KEYS.poses).bodies if body.name == name)


class TestWorld:
    def test_what_a_player_sends_over_the_bus_does_not_beat_the_lease(self, wire: Wire) -> None:
        wire.tick(100, each=[leased(), DRIVE_A, DRIVE_B])
        assert speed(wire) == pytest.approx(-0.4, abs=0.02)
        assert x_of(wire) < -0.5
        assert x_of(wire, "b") > 0.5, "the other one drives as its player wants"

    def test_a_lease_that_is_given_back_lets_the_player_drive_at_once(self, wire: Wire) -> None:
        wire.tick(60, each=[leased(), DRIVE_A])
        wire.tick(60, each=[leased(None), DRIVE_A])
        assert speed(wire) == pytest.approx(0.5, abs=0.02)

    def test_if_the_referee_falls_silent_the_leased_robot_stands(self, wire: Wire) -> None:
        wire.tick(60, each=[leased(), DRIVE_A, DRIVE_B])
        ticks = round(REFEREE_TIMEOUT / wire.node.period)
        wire.tick(ticks - 1, each=[DRIVE_A, DRIVE_B])
        assert speed(wire) < -0.3
        wire.tick(8, each=[DRIVE_A, DRIVE_B])
        assert -0.3 < speed(wire) <= 0.0, "it brakes"
        assert 0.0 <= speed(wire, "b") < 0.3, "and so does one that is not leased"
        wire.tick(100, each=[DRIVE_A, DRIVE_B])
        assert speed(wire) == speed(wire, "b") == 0.0

    def test_an_emergency_stop_beats_the_lease(self, wire: Wire) -> None:
        wire.tick(60, each=[leased(), DRIVE_A])
        wire.say(KEYS.estop, m.Estop(by="me"))
        wire.tick(10, each=[leased(), DRIVE_A])
        assert speed(wire) == 0.0

    def test_a_robot_whose_device_is_not_armed_is_not_driven(self, wire: Wire) -> None:
        wire.tick(60, each=[leased()])
        assert x_of(wire) == 0.0
        wire.tick(60, each=[leased(), (KEYS.drive("a"), m.Drive(twist=AHEAD, armed=False))])
        assert x_of(wire) == 0.0

    def test_a_speed_limit_holds_during_a_lease(self, wire: Wire) -> None:
        wire.say(KEYS.speed_limit("a"), m.SpeedLimit(v_max=0.2))
        wire.tick(60, each=[leased(), DRIVE_A])
        assert speed(wire) == pytest.approx(-0.2, abs=0.02)
