"""What a player does while the referee drives its robot, what it is told of its team, and what its commander wants."""

import logging
from collections.abc import Mapping

import pytest

from tests.hal.fake_driver import MODEL, POSE, FakeDriver
from vrg.agents.player import Player
from vrg.agents.strategy import Strategy, View
from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.radio import Radio
from vrg.bus.topics import Keys, Topic
from vrg.hal.device import Device
from vrg.types import STILL, Pose, Twist

KEYS = Keys("m")
OWN, LEASE = Twist(0.35, 0.0), Twist(0.2, 0.1)


class Watcher(Strategy):
    """Drives ahead, and remembers what it has seen."""

    priorities = ("hail-mary", "team-flag")

    def __init__(self) -> None:
        super().__init__("a", MODEL)
        self.views: list[View] = []

    def act(self, view: View) -> Twist:
        self.views.append(view)
        return OWN


class Bench:
    """A player of the team `t`, whose referee and commander are played by the test."""

    def __init__(self) -> None:
        self.robot, self.mailbox, self.strategy = FakeDriver(), Mailbox(), Watcher()
        device = Device(self.robot, KEYS, self.mailbox)
        radio = Radio(KEYS, self.mailbox, "a", "t")
        self.player = Player(self.mailbox, KEYS, device, self.strategy, team="t", radio=radio)
        self.time = 0.0
        self._sequence = 0

    def say(self, topic: Topic[m.Message], body: m.Message, stamp: float | None = None) -> None:
        self._sequence += 1
        for inlet in self.mailbox.inlets:
            if inlet.topic.key == topic.key:
                inlet.offer(Received(topic.key, self.time if stamp is None else stamp, self._sequence, body))

    def tick(self, lease: Twist | None = None, *, pose: Pose | None = POSE, **options: object) -> str:
        """One tick; the last thing that the robot was told in it."""
        self.time = round(self.time + 0.1, 6)
        self.say(KEYS.referee_state, referee(lease, pose, **options))  # type: ignore[arg-type]
        self.robot.told.clear()
        self.mailbox.handover(self.time)
        self.player.tick(Tick(self.time, True))
        return self.robot.told[-1]

    def by_hand(self, lease: float = 1.0) -> None:
        self.say(KEYS.manual("a"), m.Manual(forward=-0.5, turn=0.0, lease=lease))

    def order(self, priority: str | None, lease: float = 1.0, team: str = "t") -> None:
        self.say(KEYS.order(team), m.TeamOrder(priority=priority, lease=lease))

    def report(self) -> m.Report:
        said = [out.message.body for out in self.mailbox.collect()]
        reports = [body for body in said if isinstance(body, m.Report)]
        return reports[-1]

    @property
    def view(self) -> View:
        return self.strategy.views[-1]


def referee(
    lease: Twist | None, pose: Pose | None, *, may_move: bool = True, halted: str | None = None
) -> m.RefereeState:
    players = [
        m.PlayerStatus(
            name=name, team=team, role="r", state="s", may_move=may_move, radius=0.35, pose=pose,
            lease=lease if name == "a" else None,
        )
        for name, team in (("a", "t"), ("b", "t"), ("c", "u"))
    ]  # fmt: skip
    return m.RefereeState(
        game="g", stage=m.Stage.PLAY_ROUND, halted=halted, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
        rounds=1, score={}, players=players, zones=(), estop=False,
    )  # fmt: skip


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.tick()
    return bench


def told(twist: Twist) -> str:
    return f"drive {twist.v:.2f} {twist.w:.2f}"


class TestWhoDrives:
    def test_the_referee_drives_instead_of_the_strategy(self, bench: Bench) -> None:
        assert bench.tick(LEASE) == told(LEASE)

    def test_the_referee_drives_instead_of_a_human(self, bench: Bench) -> None:
        bench.by_hand()
        assert bench.tick(LEASE) == told(LEASE)
        report = bench.report()
        assert (report.mode, report.manual) == ("Referee", True), "so that no other person takes the player meanwhile"

    def test_a_human_drives_instead_of_the_strategy(self, bench: Bench) -> None:
        bench.by_hand()
        assert bench.tick() == told(Twist(-0.5 * MODEL.v_max, 0.0))
        assert bench.report().manual

    def test_after_the_lease_the_human_drives_and_after_that_the_strategy(self, bench: Bench) -> None:
        bench.by_hand(0.35)
        driven = [bench.tick(lease) for lease in (LEASE, LEASE, None, None, None)]
        by_hand = told(Twist(-0.5 * MODEL.v_max, 0.0))
        assert driven == [told(LEASE), told(LEASE), by_hand, told(OWN), told(OWN)]

    def test_the_report_tells_who_drives(self, bench: Bench) -> None:
        modes = []
        for lease in (LEASE, None):
            bench.tick(lease)
            modes.append(bench.report().mode)
        assert modes[0] == "Referee"
        assert modes[1] != "Referee"

    def test_the_strategy_is_asked_also_while_the_referee_drives(self, bench: Bench) -> None:
        before = len(bench.strategy.views)
        bench.tick(LEASE)
        assert len(bench.strategy.views) == before + 1
        assert bench.view.me.lease == LEASE

    def test_a_lease_to_stand_makes_it_stand(self, bench: Bench) -> None:
        assert bench.tick(STILL) == "stop"

    def test_a_halt_and_a_held_robot_beat_the_lease(self, bench: Bench) -> None:
        assert bench.tick(LEASE, halted="rain") == "stop"
        assert bench.tick(LEASE, may_move=False) == "stop"


class TestPriorities:
    def test_what_the_commander_wants_reaches_the_strategy(self, bench: Bench) -> None:
        assert bench.view.priority is None
        bench.order("hail-mary")
        bench.tick()
        assert bench.view.priority == "hail-mary"

    def test_the_newest_order_counts(self, bench: Bench) -> None:
        bench.order("hail-mary")
        bench.tick()
        bench.order("team-flag")
        bench.tick()
        assert bench.view.priority == "team-flag"

    def test_an_order_ends_when_the_commander_wants_nothing_any_more(self, bench: Bench) -> None:
        bench.order("hail-mary")
        bench.tick()
        bench.order(None)
        bench.tick()
        assert bench.view.priority is None

    def test_an_order_expires(self, bench: Bench) -> None:
        bench.order("hail-mary", lease=0.35)
        wanted = []
        for _ in range(6):
            bench.tick()
            wanted.append(bench.view.priority)
        assert wanted == ["hail-mary"] * 3 + [None] * 3

    def test_the_order_of_another_team_is_not_heard(self, bench: Bench) -> None:
        bench.order("hail-mary", team="u")
        bench.tick()
        assert bench.view.priority is None

    def test_what_the_strategy_does_not_know_is_ignored_with_one_warning(
        self, bench: Bench, caplog: pytest.LogCaptureFixture
    ) -> None:
        with caplog.at_level(logging.WARNING):
            for _ in range(3):
                bench.order("dance")
                bench.tick()
        assert bench.view.priority is None
        warnings = [record.getMessage() for record in caplog.records]
        assert len(warnings) == 1
        assert "hail-mary, team-flag" in warnings[0]
        assert "'dance'" in warnings[0]


class TestSight:
    def see(self, bench: Bench, poses: Mapping[str, Pose], team: str = "t") -> View:
        bench.say(KEYS.sight(team), m.Sight(poses=dict(poses)))
        bench.tick(pose=None)
        return bench.view

    def test_the_poses_that_only_the_team_is_told_are_filled_in(self, bench: Bench) -> None:
        view = self.see(bench, {"a": POSE, "c": Pose(3, 4, 0)})
        seen = {player.name: player.pose for player in view.referee.players}
        assert seen == {"a": POSE, "b": None, "c": Pose(3, 4, 0)}
        assert view.me.pose == POSE

    def test_what_another_team_sees_is_not_heard(self, bench: Bench) -> None:
        view = self.see(bench, {"a": POSE, "c": Pose(3, 4, 0)}, team="u")
        assert all(player.pose is None for player in view.referee.players)

    def test_without_a_limited_view_everybody_is_seen(self, bench: Bench) -> None:
        assert all(player.pose == POSE for player in bench.view.referee.players)

    def test_what_was_seen_long_ago_does_not_count(self, bench: Bench) -> None:
        self.see(bench, {"a": POSE, "c": Pose(3, 4, 0)})
        for _ in range(5):
            bench.tick(pose=None)
        assert all(player.pose is None for player in bench.view.referee.players)

    def test_velocities_are_worked_out_of_what_the_team_sees(self, bench: Bench) -> None:
        for i in range(10):
            view = self.see(bench, {"a": POSE, "c": Pose(3 + 0.05 * i, 4, 0)})
        assert view.velocities["c"][0] == pytest.approx(0.5, abs=0.05)
