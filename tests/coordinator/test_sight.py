"""The limited view: a team sees its own players, and opponents within reach of one of its own."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.bus.test_codec import assert_immutable
from vrg.bus.messages import Auction, PlayerStatus, RefereeState, Stage
from vrg.coordinator.sight import hidden, seen_by
from vrg.types import Pose

COORDINATE = st.floats(-20, 20, allow_nan=False)


def status(name: str, x: float | None, y: float = 0.0) -> PlayerStatus:
    """A player; the first letter of its name is its team."""
    pose = None if x is None else Pose(x, y, 0.5)
    return PlayerStatus(name=name, team=name[0], role="r", state="s", may_move=True, radius=0.3, pose=pose)


FAR = [status("r1", 0.0), status("r2", 90.0), status("b1", 92.0), status("b2", 50.0)]


@pytest.mark.parametrize(
    ("team", "players", "reach", "seen"),
    [
        ("r", FAR, 1.0, {"r1", "r2"}),
        ("r", FAR, 3.0, {"r1", "r2", "b1"}),
        ("b", FAR, 3.0, {"b1", "b2", "r2"}),
        ("r", [status("r1", 0.0), status("b1", 3.0, 4.0)], 5.0, {"r1", "b1"}),
        ("r", [status("r1", 0.0), status("b1", 3.0, 4.01)], 5.0, {"r1"}),
        ("r", [status("r1", None), status("b1", 0.0)], 5.0, set()),
        ("x", [status("r1", 0.0)], 5.0, set()),
    ],
    ids=["its own always", "near one of them", "the same for both", "just near enough", "just too far",
         "by no eyes whose place is not known", "a team without players"],
)  # fmt: skip
def test_a_team_sees(team: str, players: list[PlayerStatus], reach: float, seen: set[str]) -> None:
    assert seen_by(team, players, reach) == {p.name: p.pose for p in players if p.name in seen}


@given(st.lists(st.tuples(st.sampled_from("rb"), COORDINATE, COORDINATE), max_size=8), st.floats(0, 30))
def test_what_nobody_of_the_team_is_near_is_never_seen(drawn: list[tuple[str, float, float]], reach: float) -> None:
    players = [status(f"{team}{i}", x, y) for i, (team, x, y) in enumerate(drawn)]
    own = [(x, y) for team, x, y in drawn if team == "r"]
    seen = seen_by("r", players, reach)
    for i, (team, x, y) in enumerate(drawn):
        near = any(math.hypot(x - ex, y - ey) <= reach for ex, ey in own)
        assert (f"{team}{i}" in seen) == (team == "r" or near)


def test_the_hidden_state_tells_neither_poses_nor_what_they_follow_from() -> None:
    players = (status("r1", 1.0), status("b1", 2.0))
    auction = Auction(lot="x", bidders=("r1",), opened=1.0, lasts=0.3, bids={"r1": 4.0}, winner="r1")
    state = RefereeState(
        game="g", stage=Stage.PLAY_ROUND, halted=None, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
        rounds=1, score={"r": 1}, players=players, zones=(), auctions=(auction,), estop=False,
    )  # fmt: skip
    told = hidden(state)
    assert [player.pose for player in told.players] == [None, None]
    assert told.auctions[0].bids == {}, "a bid is a time to a place that everybody knows"
    assert told.auctions[0].winner == "r1"
    assert told.score == {"r": 1}
    assert_immutable(told)
    assert players[0].pose is not None, "the state that was handed in is as it was"
