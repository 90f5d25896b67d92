"""What a player does while the referee drives its robot, what it is told of its team, and what its commander wants."""

import logging
from collections.abc import Mapping
from typing import Any

import pytest

from tests.agents.bench import KEYS, Bench
from tests.hal.fake_driver import MODEL, POSE
from vrg.agents.strategy import Strategy, View
from vrg.bus import messages as m
from vrg.types import STILL, Pose, Twist

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


@pytest.fixture
def bench() -> Bench[Watcher]:
    bench = Bench(Watcher())
    bench.tick()
    return bench


def driven(bench: Bench[Watcher], lease: Twist | None = None, **state: Any) -> str:
    """The last thing that the robot is told in a tick."""
    return bench.tick(lease=lease, **state)[-1]


def by_hand(bench: Bench[Watcher], lease: float = 1.0) -> None:
    bench.hear(m.Manual(forward=-0.5, turn=0.0, lease=lease))


def priority(bench: Bench[Watcher], wanted: str | None, lease: float = 1.0, team: str = "t") -> str | None:
    """What the strategy is to do after an order of a commander."""
    bench.hear(m.TeamOrder(priority=wanted, lease=lease), KEYS.order(team).key)
    bench.tick()
    return bench.strategy.views[-1].priority


def told(twist: Twist) -> str:
    return f"drive {twist.v:.2f} {twist.w:.2f}"


BY_HAND = Twist(-0.5 * MODEL.v_max, 0.0)


class TestWhoDrives:
    def test_the_referee_drives_instead_of_the_strategy_which_is_still_asked(self, bench: Bench[Watcher]) -> None:
        before = len(bench.strategy.views)
        assert driven(bench, LEASE) == told(LEASE)
        assert bench.report().mode == "Referee"
        assert len(bench.strategy.views) == before + 1
        assert bench.strategy.views[-1].me.lease == LEASE
        assert driven(bench) == told(OWN)
        assert bench.report().mode != "Referee"

    def test_the_referee_drives_instead_of_a_human(self, bench: Bench[Watcher]) -> None:
        by_hand(bench)
        assert driven(bench, LEASE) == told(LEASE)
        report = bench.report()
        assert (report.mode, report.manual) == ("Referee", True), "so that no other person takes the player meanwhile"

    def test_a_human_drives_instead_of_the_strategy(self, bench: Bench[Watcher]) -> None:
        by_hand(bench)
        assert driven(bench) == told(BY_HAND)
        assert bench.report().manual

    def test_after_the_lease_the_human_drives_and_after_that_the_strategy(self, bench: Bench[Watcher]) -> None:
        by_hand(bench, 0.35)
        motions = [driven(bench, lease) for lease in (LEASE, LEASE, None, None, None)]
        assert motions == [told(LEASE), told(LEASE), told(BY_HAND), told(OWN), told(OWN)]

    def test_a_lease_to_stand_a_halt_and_a_held_robot_make_it_stand(self, bench: Bench[Watcher]) -> None:
        assert driven(bench, STILL) == "stop"
        assert driven(bench, LEASE, halted="rain") == "stop"
        assert driven(bench, LEASE, may_move=False) == "stop"


class TestPriorities:
    def test_the_newest_order_of_its_own_commander_reaches_the_strategy_until_it_ends(
        self, bench: Bench[Watcher]
    ) -> None:
        assert bench.strategy.views[-1].priority is None
        assert priority(bench, "hail-mary", team="u") is None, "that of another team is not heard"
        assert [priority(bench, wanted) for wanted in ("hail-mary", "team-flag", None)] == [
            "hail-mary",
            "team-flag",
            None,
        ]

    def test_an_order_expires(self, bench: Bench[Watcher]) -> None:
        priority(bench, "hail-mary", lease=0.35)
        for _ in range(5):
            bench.tick()
        assert [view.priority for view in bench.strategy.views[1:]] == ["hail-mary"] * 3 + [None] * 3

    def test_what_the_strategy_does_not_know_is_ignored_with_one_warning(
        self, bench: Bench[Watcher], caplog: pytest.LogCaptureFixture
    ) -> None:
        with caplog.at_level(logging.WARNING):
            assert [priority(bench, "dance") for _ in range(3)] == [None] * 3
        (warning,) = [record.getMessage() for record in caplog.records]
        assert "hail-mary, team-flag" in warning
        assert "'dance'" in warning


SEEN = {"a": POSE, "c": Pose(3, 4, 0)}


class TestSight:
    def see(self, bench: Bench[Watcher], poses: Mapping[str, Pose], team: str = "t") -> View:
        bench.hear(m.Sight(poses=dict(poses)), KEYS.sight(team).key)
        bench.tick(pose=None)
        return bench.strategy.views[-1]

    def test_poses_that_only_the_team_is_told_are_filled_in_and_soon_forgotten(self, bench: Bench[Watcher]) -> None:
        view = self.see(bench, SEEN)
        assert {player.name: player.pose for player in view.referee.players} == {"b": None, **SEEN}
        assert view.me.pose == POSE
        for _ in range(5):
            bench.tick(pose=None)
        assert all(player.pose is None for player in bench.strategy.views[-1].referee.players)

    def test_what_another_team_sees_is_not_heard(self, bench: Bench[Watcher]) -> None:
        assert all(player.pose is None for player in self.see(bench, SEEN, team="u").referee.players)

    def test_without_a_limited_view_everybody_is_seen(self, bench: Bench[Watcher]) -> None:
        assert all(player.pose == POSE for player in bench.strategy.views[-1].referee.players)

    def test_velocities_are_worked_out_of_what_the_team_sees(self, bench: Bench[Watcher]) -> None:
        for i in range(10):
            view = self.see(bench, {"a": POSE, "c": Pose(3 + 0.05 * i, 4, 0)})
        assert view.velocities["c"][0] == pytest.approx(0.5, abs=0.05)
