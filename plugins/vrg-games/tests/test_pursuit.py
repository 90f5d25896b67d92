"""Marco Polo and Apollonius' pursuit: the rules on numbers, the circle, and whole matches."""

import math
from itertools import pairwise
from pathlib import Path

import pytest
from msgspec import structs

import vrg
from vrg.agents.interception import intercept
from vrg.bus.messages import Stage
from vrg.coordinator.auctions import auctioned
from vrg.coordinator.rulebook import DRAW, Contestant, Disqualification, GameState, Observation, Offer, Verdict
from vrg.errors import ConfigError
from vrg.games import game_of
from vrg.hal.sensors.spec import Sweep
from vrg.regions import Circle, Rectangle
from vrg.testing.rulebook import RuleBookContract
from vrg.types import Pose
from vrg_games.pursuit import ANSWER
from vrg_games.pursuit.circle import apollonius, nearest_to
from vrg_games.pursuit.rules import Apollonius, Hunt, MarcoPolo
from vrg_games.pursuit.settings import ApolloniusSettings, MarcoPoloSettings


def contestants(*roles: str, sweeps: tuple[Sweep, ...] = ()) -> list[Contestant]:
    """One player of each role, named p0, p1 and so on, at x = -4, 0, 2 and so on."""
    return [
        Contestant(
            name=f"p{i}", role=role, start=Pose(2.0 * i if i else -4.0, 0.0, 0.0), size=(0.5, 0.49), v_max=0.7,
            sweeps=sweeps,
        )
        for i, role in enumerate(roles)
    ]  # fmt: skip


@pytest.fixture
def pool() -> MarcoPolo:
    return MarcoPolo(MarcoPoloSettings(), contestants("marco", "polo", "polo"), 7)


@pytest.fixture
def sea() -> Apollonius:
    return Apollonius(ApolloniusSettings(rounds=3), contestants("pursuer", "evader", "evader"), 7)


class TestTheRuleBookOfMarcoPolo(RuleBookContract):
    @pytest.fixture
    def book(self, pool: MarcoPolo) -> MarcoPolo:
        return pool

    @pytest.fixture
    def ready(self, book: MarcoPolo) -> Observation:
        return Observation(book.marks(book.initial()))


class TestTheRuleBookOfApollonius(RuleBookContract):
    @pytest.fixture
    def book(self, sea: Apollonius) -> Apollonius:
        return sea

    @pytest.fixture
    def ready(self, book: Apollonius) -> Observation:
        return Observation(book.marks(book.initial()))


def field(*places: tuple[float, float], time: float = 0.0) -> Observation:
    return Observation({f"p{i}": Pose(x, y, 0.0) for i, (x, y) in enumerate(places)}, time=time)


def called(verdict: Verdict[GameState]) -> list[tuple[str, tuple[str, ...]]]:
    return [(call.rule, call.players) for call in verdict.calls]


@pytest.mark.parametrize("book", [pytest.param("pool"), pytest.param("sea")])
def test_who_is_passed_within_the_capture_distance_is_caught_and_put_aside(
    book: str, request: pytest.FixtureRequest
) -> None:
    hunt: Hunt = request.getfixturevalue(book)
    before, now = field((-1.0, 0.0), (0.0, 0.7), (3.0, 0.0)), field((1.0, 0.0), (0.0, 0.7), (3.0, 0.0), time=0.1)
    judged = hunt.judge(hunt.initial(), before, now, 0.1)
    assert called(judged) == [("caught", ("p1", "p0"))]
    assert judged.state.points == {hunt.team_of("p0"): 1}
    assert judged.place["p1"].x > 6.0
    assert not hunt.may_play(judged.state, "p1")
    assert called(hunt.judge(judged.state, now, now, 0.2)) == []


def test_what_comes_first_between_two_looks_counts(sea: Apollonius) -> None:
    start = field((-5.9, 0.0), (-4.9, 3.0), (3.0, 0.0))
    home = sea.judge(sea.initial(), start, field((-5.9, 0.0), (-5.1, 3.0), (7.0, 0.0)), 0.1)
    assert called(home) == [("home", ("p1",)), ("out", ("p2",))]
    assert home.state.points == {"evaders": 1, "pursuer": 1}
    assert home.round_over
    late = sea.judge(sea.initial(), start, field((-5.9, 0.0), (-5.9, 0.0), (3.0, 0.0)), 0.1)
    assert called(late) == [("home", ("p1",))]
    early = sea.judge(sea.initial(), field((-4.9, 0.0), (-4.0, 0.0), (3.0, 0.0)), field((-4.9, 0.0), (-5.9, 0.0)), 0.1)
    assert called(early) == [("caught", ("p1", "p0"))]


def test_who_is_left_when_the_time_is_up_has_got_away_from_marco_but_is_lost_at_sea(
    pool: MarcoPolo, sea: Apollonius
) -> None:
    for book, team, time in ((pool, "polos", 120.0), (sea, "pursuer", 120.0)):
        far = field((-4.0, 0.0), (2.0, 0.0), (4.0, 0.0))
        judged = book.judge(book.initial(), far, far, time)
        assert called(judged) == [("time_up", ("p1", "p2"))]
        assert judged.state.points == {team: 2}


def test_without_their_hunter_all_that_are_left_have_got_away(pool: MarcoPolo) -> None:
    state = structs.replace(pool.initial(), disqualified={"p0": Disqualification(why="a test")})
    far = field((-4.0, 0.0), (2.0, 0.0), (4.0, 0.0))
    judged = pool.judge(state, far, far, 1.0)
    assert called(judged) == [("forfeit", ("p0",))]
    assert judged.state.points == {"polos": 2}


def test_marco_hears_about_where_the_others_are_when_it_calls_and_not_sooner_than_after_the_pause(
    pool: MarcoPolo,
) -> None:
    state, now, bid = pool.initial(), field((-4.0, 0.0), (2.2, 0.7), (4.9, -0.1)), [Offer("p0", ANSWER, 0.0)]
    heard = []
    for clock in (1.0, 4.0, 7.9, 8.0):
        state = pool.judge(auctioned(state, bid, clock)[0], now, now, clock).state
        heard.append([(each.name, each.x, each.y) for each in state.objects])
        if clock == 4.0:
            now = field((-4.0, 0.0), (2.2, 1.7), (4.9, -0.1))
    assert heard[0] == []
    assert heard[1] == heard[2] == [("p1", 2.5, 0.5), ("p2", 4.5, -0.5)]
    assert heard[3] == [("p1", 2.5, 1.5), ("p2", 4.5, -0.5)]


def test_nobody_else_can_call(pool: MarcoPolo) -> None:
    _, refused = auctioned(pool.initial(), [Offer("p1", ANSWER, 0.0)], 9.0)
    assert refused


@pytest.mark.parametrize("stage", list(Stage))
def test_all_see_marco_and_nobody_sees_a_polo_that_is_not_caught(pool: MarcoPolo, stage: Stage) -> None:
    now = field((-4.0, 0.0), (2.0, 0.0), (4.0, 0.0))
    seen = pool.statuses(pool.initial().with_state(["p2"], "caught"), stage, now)
    assert [each.pose is not None for each in seen] == [True, False, True]
    assert seen[1].mark is None


def test_evaders_begin_each_round_in_lanes_of_their_own(sea: Apollonius) -> None:
    first = sea.marks(sea.initial())
    later = sea.next_round(sea.initial().with_state(["p1"], "home"), Observation({}))
    assert later.state.round == 2
    assert later.state.states == {}
    assert first["p1"].y < 0.0 < first["p2"].y
    assert sea.marks(later.state)["p1"].y != first["p1"].y
    assert sea.next_round(structs.replace(sea.initial(), round=3), Observation({})).winner == DRAW


def test_a_match_that_cannot_be_played_is_refused() -> None:
    sweep = Sweep(mount=Pose(0.0, 0.0, 0.0), fov=3.0, range_max=5.0)
    with pytest.raises(ConfigError, match="one marco, and others"):
        MarcoPolo(MarcoPoloSettings(), contestants("polo", "polo"), 7)
    with pytest.raises(ConfigError, match="lasers = false"):
        MarcoPolo(MarcoPoloSettings(), contestants("marco", "polo", sweeps=(sweep,)), 7)
    with pytest.raises(ConfigError, match="outside the field"):
        Apollonius(ApolloniusSettings(x=(-5.0, 1.0)), contestants("pursuer", "evader", "evader"), 7)
    with pytest.raises(ValueError, match="low border first"):
        ApolloniusSettings(x=(1.0, -1.0))


LINED_UP = 3.2
"""The match time in s at which all stand on their marks."""
EVADER, PURSUER = (3.0, 1.0), (-2.0, -1.0)


@pytest.mark.parametrize("ratio", [0.2, 0.6, 0.9])
def test_whoever_drives_straight_meets_on_the_circle(ratio: float) -> None:
    circle = apollonius(EVADER, PURSUER, ratio)
    for number in range(12):
        angle = math.tau * number / 12
        meeting = intercept(PURSUER, 1.0, EVADER, (ratio * math.cos(angle), ratio * math.sin(angle)))
        assert meeting is not None
        assert math.dist(meeting.point, circle.middle) == pytest.approx(circle.radius, abs=1e-9)


def test_the_nearest_point_to_a_goal_is_on_the_circle_or_in_both() -> None:
    assert nearest_to(Circle(0.0, 0.0, 2.0), Rectangle(-9.0, -9.0, -5.0, 9.0)) == (-2.0, 0.0)
    assert nearest_to(Circle(0.0, 0.0, 6.0), Rectangle(-9.0, -9.0, -5.0, 9.0)) == (-5.0, 0.0)


def match_of(name: str, folder: Path, **changes: str) -> Path:
    """The default match of a game, with other lines."""
    text = game_of(name).default_match().read_text()
    for old, new in changes.items():
        text = text.replace(next(line for line in text.splitlines() if line.startswith(f"{old} = ")), f"{old} = {new}")
    (folder / "match.toml").write_text(text)
    return folder / "match.toml"


def play(match: Path, seed: int = 0, *, record: bool = False) -> vrg.Run:
    run = vrg.play(match, engine="planar", seed=seed, record=record, runs=match.parent)
    assert not vrg.judge(run).disagreements
    return run


def test_pursuer_and_evader_meet_where_the_circle_is_nearest_to_the_harbour(tmp_path: Path) -> None:
    """The capture comes before the meeting: when the pursuer is still s from it, the evader is ratio * s from it.

    Their distance is then at most the capture distance c, and at least s (1 - ratio). So the evader is within
    ratio * c / (1 - ratio) of the meeting. To that comes what both lose when they set out.
    """
    ratio, reach = 0.6, 0.8
    match = match_of("apollonius", tmp_path, rounds="1", ratio=str(ratio))
    text = match.read_text()
    match.write_text(text[: text.rindex("[[players]]", 0, text.rindex("[[players]]"))])  # guard and ann
    run = play(match, record=True)
    [caught] = [call for call in run.calls if call.rule == "caught"]
    begun = int(run.tracks["ann"].times.searchsorted(LINED_UP))
    starts = [(float(track.x[begun]), float(track.y[begun])) for track in (run.tracks["ann"], run.tracks["guard"])]
    meeting = nearest_to(apollonius(*starts, ratio), Rectangle(-8.0, -5.0, -7.0, 5.0))
    here = caught.poses[0].x, caught.poses[0].y
    assert starts[1] == pytest.approx((-4.0, 0.0), abs=0.05)
    assert math.dist(here, meeting) < ratio * reach / (1.0 - ratio) + 0.2


def test_both_sides_win_at_sea(tmp_path: Path) -> None:
    runs = [play(match_of("apollonius", tmp_path), seed) for seed in (0, 4, 6)]
    assert {run.winner for run in runs} == {"pursuer", "evaders"}
    assert all({"caught", "home"} <= {call.rule for call in run.calls} for run in runs)


def test_both_sides_win_in_the_pool_and_marco_calls_all_the_time(tmp_path: Path) -> None:
    runs = [play(match_of("marco-polo", tmp_path), seed) for seed in (0, 1)]
    assert {run.winner for run in runs} == {"marco", "polos"}
    for run in runs:
        calls = [call.clock for call in run.calls if call.rule == "call"]
        assert max(b - a for a, b in pairwise(calls)) < 15.0
