"""Robot sumo: its rules on numbers, and whole matches."""

import math
from pathlib import Path

import pytest
from msgspec import structs

import vrg
from vrg.bus.messages import Stage
from vrg.coordinator.rulebook import DRAW, Contestant, Disqualification, Observation
from vrg.errors import ConfigError
from vrg.testing.rulebook import RuleBookContract
from vrg.types import Pose
from vrg_games.sumo.rules import Settings, Sumo

E, W = "a east", "a west"
STONE = """
from vrg.agents import STILL, Strategy


class Stone(Strategy):
    def act(self, view):
        return STILL
"""


def contestants(east: float = 0.5, west: float = -0.5) -> list[Contestant]:
    starts = {"east": Pose(east, 0.0, 0.0), "west": Pose(west, 0.0, math.pi)}
    return [Contestant(name=f"a {r}", role=r, start=at, size=(0.5, 0.49), v_max=0.7) for r, at in starts.items()]


@pytest.fixture
def book() -> Sumo:
    return Sumo(Settings(), contestants(), 7)


@pytest.fixture
def ready(book: Sumo) -> Observation:
    return Observation(book.marks(book.initial()))


def at(east: float, west: float, time: float = 0.0) -> Observation:
    return Observation({E: Pose(east, 0.0, 0.0), W: Pose(west, 0.0, 0.0)}, time=time)


class TestTheRuleBook(RuleBookContract):
    pass


@pytest.mark.parametrize(
    ("east", "west", "called", "winner"),
    [
        (1.9, -1.9, [], None),
        (1.93, 0.0, [E], "west"),
        (0.0, -3.0, [W], "east"),
        (2.0, -3.0, [W], "east"),  # both are out, and the faster one was so first
        (2.5, -2.5, [E, W], None),
    ],
)
def test_whose_centre_leaves_the_ring_first_has_lost_the_bout(
    book: Sumo, east: float, west: float, called: list[str], winner: str | None
) -> None:
    judged = book.judge(book.initial(), at(0.5, -0.5), at(east, west, 0.1), 0.1)
    assert [call.players for call in judged.calls] == ([tuple(called)] if called else [])
    assert judged.round_over == bool(called)
    assert judged.state.points == ({winner: 1} if winner else {})


def stands(book: Sumo, looks: list[tuple[float, float, float]]) -> tuple[str, dict[str, int]]:
    """The rule of the last call, and the points, after looks of (time, x of east, x of west)."""
    state, before = book.initial(), at(*looks[0][1:])
    for clock, east, west in looks:
        judged = book.judge(state, before, now := at(east, west, clock), clock)
        state, before = judged.state, now
    [call] = judged.calls
    return call.rule, dict(judged.state.points)


def test_who_stops_first_and_stands_has_lost_the_bout(book: Sumo) -> None:
    assert stands(book, [(0.1, 1.0, -1.0), (3.0, 1.0, -0.5), (5.1, 1.0, -0.5)]) == ("standstill", {"west": 1})


def test_of_two_that_stop_at_once_who_is_nearer_the_middle_has_won(book: Sumo) -> None:
    assert stands(book, [(0.1, 1.0, 0.4), (1.0, 1.0, 0.5), (5.1, 1.0, 0.5)]) == ("yusei", {"west": 1})
    assert stands(book, [(0.1, 0.3, -0.25), (5.1, 0.3, -0.25)]) == ("locked", {})


def test_a_bout_is_drawn_when_the_time_is_up(book: Sumo) -> None:
    assert stands(book, [(39.0, 1.0, -1.0), (40.0, 0.5, -0.5)]) == ("time_up", {})


def test_two_of_three_bouts_win_and_a_drawn_bout_counts(book: Sumo, ready: Observation) -> None:
    state = book.initial().with_points("west", 1)
    assert book.next_round(state, ready).winner is None
    assert book.next_round(state, ready).state.round == 2
    assert book.next_round(state.with_points("west", 2), ready).winner == "west"
    assert book.next_round(structs.replace(state, round=3), ready).winner == "west"
    assert book.next_round(structs.replace(book.initial(), round=3), ready).winner == DRAW


def test_who_is_disqualified_has_lost_the_bout(book: Sumo, ready: Observation) -> None:
    state = structs.replace(book.initial(), disqualified={E: Disqualification(why="a test")})
    judged = book.judge(state, ready, ready, 1.0)
    assert [call.rule for call in judged.calls] == ["forfeit"]
    assert judged.state.points == {"west": 1}


def test_the_draw_turns_both_alike_and_each_bout_anew(book: Sumo) -> None:
    turns = []
    for number in (1, 2):
        marks = book.marks(structs.replace(book.initial(), round=number))
        assert math.remainder(marks[W].theta - marks[E].theta - math.pi, math.tau) == pytest.approx(0.0)
        turns.append(marks[E].theta)
    assert turns[0] != turns[1]
    assert max(map(abs, turns)) <= math.pi / 2


def test_a_bout_waits_until_both_are_turned_as_drawn(book: Sumo, ready: Observation) -> None:
    pose = ready.poses[E]
    turned = Observation({**ready.poses, E: Pose(pose.x, pose.y, pose.theta + 0.2)})
    assert book.obstacles_to_start(book.initial(), turned) == {E: "is turned 11 degrees away from its mark"}


def test_each_is_shown_on_its_own_side_and_none_is_forgiven_a_push(book: Sumo, ready: Observation) -> None:
    assert [s.role for s in book.statuses(book.initial(), Stage.PLAY_ROUND, ready)] == ["east", "west"]
    assert book.role_of(book.initial(), E) == book.role_of(book.initial(), W)


def test_a_match_that_cannot_be_played_is_refused() -> None:
    with pytest.raises(ConfigError, match="one in the west"):
        Sumo(Settings(), contestants()[:1], 7)
    with pytest.raises(ConfigError, match="starts outside the ring"):
        Sumo(Settings(), contestants(west=-2.0), 7)


def play(folder: Path, seed: int = 0, engine: str = "planar", extra: str = "", **players: str) -> vrg.Run:
    from vrg.games import game_of  # noqa: PLC0415 - only whole matches need it

    text = game_of("sumo").default_match().read_text() + extra
    (folder / "match.toml").write_text(text)
    run = vrg.play(folder / "match.toml", players or None, engine=engine, seed=seed, record=False, runs=folder)
    assert not vrg.judge(run).disagreements
    return run


@pytest.mark.parametrize("engine", ["planar", "mujoco"])
def test_matches_are_decided_by_more_than_one_rule_and_not_always_by_the_same_one(tmp_path: Path, engine: str) -> None:
    runs = [play(tmp_path, seed, engine) for seed in range(5)]
    assert {run.winner for run in runs} == {"east", "west"}
    assert {"out"} < {call.rule for run in runs for call in run.calls} - {"begin", "placed", "game_over"}


def test_who_never_moves_loses_two_bouts(tmp_path: Path) -> None:
    (tmp_path / "stone.py").write_text(STONE)
    run = play(tmp_path, west=str(tmp_path / "stone.py"))
    assert run.winner == "east"
    assert [call.rule for call in run.calls].count("standstill") == 2


def test_a_robot_on_worse_tyres_is_pushed_out_although_it_stands(tmp_path: Path) -> None:
    (tmp_path / "stone.py").write_text(STONE)
    run = play(tmp_path, extra="motion = { brake = 4.0 }\n", west=str(tmp_path / "stone.py"))
    assert run.winner == "east"
    assert [call.rule for call in run.calls].count("out") == 2
