"""Who may command a robot, from the strongest to the weakest."""

from typing import Any

import pytest

from vrg.agents.control import STILL, Twist
from vrg.agents.player import REFEREE_TIMEOUT, Player
from vrg.agents.strategy import Strategy, View
from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.errors import RobotError, StaleDataError
from vrg.hal.models import robot_model
from vrg.hal.robot import Readings, Robot, Wheels

KEYS = Keys("m")
MODEL = robot_model("P2AT")
POSE = m.Pose(1.0, 2.0, 0.0)


class FakeRobot(Robot):
    """Remembers what it was told."""

    def __init__(self) -> None:
        super().__init__("a", MODEL)
        self.armed = False
        self.told: list[str] = []
        self.age = 0.0
        self.fault: str | None = None
        self.latched = False
        self.blind = False

    def connect(self) -> None:
        self.told.append("connect")

    def arm(self) -> None:
        self.told.append("arm")
        self.armed = True

    def drive(self, left: float, right: float) -> Wheels:
        if not self.armed:
            raise RobotError("not armed")
        self.told.append(f"drive {left:.2f} {right:.2f}")
        return Wheels(left, right)

    def read(self) -> Readings:
        if self.blind:
            raise StaleDataError("a: no reading has come yet")
        return Readings(
            stamp=0.0, age=self.age, ins=POSE, odometry=POSE, v=0.0, w=0.0, encoders=(0, 0), touch=(),
            battery=1.0, armed=self.armed, estop=False, fault=self.fault, laser=None,
            latched=self.latched,
        )  # fmt: skip

    def stop(self) -> None:
        self.told.append("stop")

    def disarm(self) -> None:
        self.armed = False
        self.told.append("disarm")

    def close(self) -> None:
        self.disarm()
        self.told.append("close")


class Ahead(Strategy):
    """Drives ahead, and counts how often it was asked."""

    asked = 0

    def act(self, view: View) -> Twist:
        self.asked += 1
        return Twist(0.35, 0.0)


class Bench:
    """A player whose referee, world and robot are played by the test."""

    def __init__(self) -> None:
        self.robot = FakeRobot()
        self.mailbox = Mailbox()
        self.strategy = Ahead("a", MODEL)
        self.player = Player(self.mailbox, KEYS, self.robot, self.strategy)
        self.time = 0.0
        self.sequence = 0
        self.robot.told.clear()

    def hear(self, body: m.Message, key: str = "k") -> None:
        self.sequence += 1
        for inlet in self.mailbox.inlets:
            if inlet.topic.type is type(body):
                inlet.offer(Received(key, self.time, self.sequence, body))

    def tick(self, *, referee: bool = True, live: bool = True, advance: float = 0.1, **state: Any) -> list[str]:
        """One tick; what the robot was told in it."""
        self.time += advance
        if referee:
            self.hear(referee_state(**state), "referee")
        self.mailbox.handover(self.time)
        self.robot.told.clear()
        self.player.tick(Tick(self.time, live))
        return list(self.robot.told)

    def report(self) -> m.Report:
        body = self.mailbox.collect()[-1].message.body
        assert isinstance(body, m.Report)
        return body


def referee_state(
    may_move: bool = True, halted: str | None = None, estop: bool = False, name: str = "a"
) -> m.RefereeState:
    status = m.PlayerStatus(name=name, team="t", role="r", state="active", may_move=may_move, radius=0.35, pose=POSE)
    return m.RefereeState(
        game="g", stage=m.Stage.PLAY_ROUND, halted=halted, waiting=[], clock=0.0, total=0.0, round=1, rounds=1,
        score={}, players=[status], zones=[], estop=estop,
    )  # fmt: skip


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_the_strategy_drives_when_nothing_is_stronger(bench: Bench) -> None:
    told = bench.tick()
    wheel = 0.35 / MODEL.wheel_radius
    assert told == ["arm", f"drive {wheel:.2f} {wheel:.2f}"]
    assert bench.tick() == [f"drive {wheel:.2f} {wheel:.2f}"], "it is armed once"


def test_a_new_player_begins_disarmed() -> None:
    robot = FakeRobot()
    Player(Mailbox(), KEYS, robot, Ahead("a", MODEL))
    assert robot.told == ["connect", "disarm"]


def test_without_a_referee_nothing_moves(bench: Bench) -> None:
    assert bench.tick(referee=False) == ["stop"]
    assert bench.strategy.asked == 0


def test_a_silent_referee_stops_the_robot(bench: Bench) -> None:
    bench.tick()
    assert bench.tick(referee=False)[-1].startswith("drive")
    assert bench.tick(referee=False, advance=REFEREE_TIMEOUT) == ["stop"]
    assert bench.report().mode == "Stop/no referee"


def test_a_stopped_clock_stops_the_robot(bench: Bench) -> None:
    bench.tick()
    assert bench.tick(live=False) == ["stop"]
    assert bench.report().mode == "Stop/no clock"


def test_halt_stops_the_robot_and_it_stays_armed(bench: Bench) -> None:
    bench.tick()
    assert bench.tick(halted="x") == ["stop"]
    assert bench.tick()[-1].startswith("drive")


def test_who_may_not_move_stands_but_its_strategy_sees_what_happens(bench: Bench) -> None:
    bench.tick()
    asked = bench.strategy.asked
    assert bench.tick(may_move=False) == ["stop"]
    assert bench.strategy.asked == asked + 1


@pytest.mark.parametrize("way", ["message", "referee"])
def test_an_emergency_stop_disarms_and_arms_again_only_when_released(bench: Bench, way: str) -> None:
    bench.tick()
    if way == "message":
        bench.hear(m.Estop(engaged=True, by="x"))
    assert bench.tick(estop=way == "referee") == ["disarm"]
    assert bench.tick(estop=way == "referee") == ["disarm"]
    bench.hear(m.Estop(engaged=False, by="x"))
    assert bench.tick(halted="emergency stop by x") == ["stop"], "released, but play is still halted"
    assert bench.tick()[0] == "arm"


def test_a_human_with_a_lease_drives_instead(bench: Bench) -> None:
    bench.tick()
    bench.hear(m.Manual(forward=-0.5, turn=0.0, lease=0.5), "manual")
    wheel = -0.5 * MODEL.v_max / MODEL.wheel_radius
    assert bench.tick() == [f"drive {wheel:.2f} {wheel:.2f}"]
    assert bench.report().manual


def test_when_the_lease_ends_the_player_is_its_own_again(bench: Bench) -> None:
    bench.tick()
    bench.hear(m.Manual(forward=0.0, turn=1.0, lease=0.3), "manual")
    bench.tick()
    own = f"drive {0.35 / MODEL.wheel_radius:.2f}"
    told = [bench.tick()[-1] for _ in range(4)]
    assert not told[0].startswith(own)
    assert told[-1].startswith(own)


def test_a_lease_moves_nobody_who_may_not_move(bench: Bench) -> None:
    bench.tick()
    bench.hear(m.Manual(forward=1.0, turn=0.0, lease=1.0), "manual")
    assert bench.tick(may_move=False) == ["stop"]
    bench.hear(m.Manual(forward=1.0, turn=0.0, lease=1.0), "manual")
    assert bench.tick(halted="x") == ["stop"]


def test_a_blind_robot_stands_and_says_why(bench: Bench) -> None:
    bench.robot.blind = True
    assert bench.tick() == ["stop"]
    assert bench.report().fault == "a: no reading has come yet"


def test_old_readings_stop_the_robot(bench: Bench) -> None:
    bench.tick()
    bench.robot.age = 0.5
    assert bench.tick() == ["stop"]
    assert "0.5 s old" in (bench.report().fault or "")


def test_a_fault_of_the_robot_is_reported(bench: Bench) -> None:
    bench.robot.fault = "left wheel: over-current"
    assert bench.tick() == ["stop"]
    assert bench.report().fault == "left wheel: over-current"


def test_a_robot_that_lost_its_arming_stops_and_is_armed_again(bench: Bench) -> None:
    bench.tick()
    bench.robot.armed = False
    assert bench.tick()[0] == "arm"


def test_a_player_that_is_not_in_the_match_stands(bench: Bench) -> None:
    assert bench.tick(name="b") == ["stop"]
    assert bench.report().mode == "Stop/not in this match"


def test_at_the_end_the_robot_is_let_go(bench: Bench) -> None:
    bench.tick()
    bench.player.stop()
    assert bench.robot.told[-2:] == ["disarm", "close"]


def test_a_strategy_that_fails_is_not_swallowed(bench: Bench) -> None:
    def broken(_view: View) -> Twist:
        raise ZeroDivisionError

    bench.strategy.act = broken  # type: ignore[method-assign]
    with pytest.raises(ZeroDivisionError):
        bench.tick()


def test_a_strategy_may_stand_still(bench: Bench) -> None:
    bench.strategy.act = lambda _view: STILL  # type: ignore[method-assign]
    assert bench.tick() == ["arm", "stop"]


def test_a_fault_that_has_latched_is_reported_as_such(bench: Bench) -> None:
    bench.robot.fault, bench.robot.latched = "a: node 0: no heartbeat", True
    assert bench.tick() == ["stop"]
    report = bench.report()
    assert report.latched
    assert report.fault == "a: node 0: no heartbeat"
    bench.robot.fault, bench.robot.latched = None, False
    bench.tick()
    assert not bench.report().latched
