"""What a pursuer does with what it hears and is told: nothing of it may stop the pursuer."""

import math
from collections.abc import Sequence

import pytest
from msgspec import structs

from tests.games.pursuit_evasion.making import STARTS, book, crossing, field, sighting
from vrg.agents.radio import TeamMessage
from vrg.agents.strategy import Action, View
from vrg.bus.codec import checked
from vrg.bus.messages import Auction, Bid, RefereeState, Sighting, Sketch, Stage
from vrg.coordinator.match import Match
from vrg.games.pursuit_evasion.pursuer import Pursuer
from vrg.games.pursuit_evasion.state import State
from vrg.games.pursuit_evasion.talk import words
from vrg.hal.models import robot_model
from vrg.hal.readings import Readings
from vrg.types import STILL, Pose


def told(state: State, time: float) -> RefereeState:
    """What the referee publishes."""
    match = Match(book())
    match.stage, match.game, match.clock, match.total = Stage.PLAY_ROUND, state, time, time
    return match.state(field(book()), estop=False)


def view(
    time: float, *, state: State | None = None, heard: Sequence[TeamMessage] = (), pose: Pose = STARTS["p0"]
) -> View:
    referee = told(state or book().initial(), time)
    me = referee.player("p0")
    assert me is not None
    readings = Readings(stamp=time, age=0.0, armed=True, estop=False)
    return View(
        time=time,
        me=me,
        readings=readings,
        referee=referee,
        velocities={},
        robot=robot_model("P2AT"),
        pose=pose,
        heard=heard,
    )


def pursuer() -> Pursuer:
    return Pursuer("p0", robot_model("P2AT"))


def says(seen: Sequence[Sighting], time: float, speaker: str = "p1") -> TeamMessage:
    return TeamMessage(speaker, time, words(Pose(9.0, 9.0, 0.0), STILL, seen, None))


def can_be_sent(action: Action) -> None:
    """As the player's runtime does it; what cannot be sent is a failure of the strategy."""
    for lot, cost in action.bids.items():
        checked(Bid(lot=lot, cost=cost))
    if action.sketch is not None:
        checked(Sketch(strokes=tuple(action.sketch)))


def auctioned(*, winner: str | None = None, evidence: Sequence[Sighting] = ()) -> State:
    """i0 has been seen twice on its way through the middle of the area at 0.5 m/s."""
    rules = book()
    seen = list(evidence) or [sighting(4.0 + 0.5 * t, 5.0, t) for t in (0.0, 0.5, 1.0, 1.5)]
    auction = Auction(lot="i0", bidders=("p0", "p1", "p2"), opened=0.5, lasts=0.5, winner=winner, evidence=seen)
    state = crossing(rules, "i0", auctions={"i0": auction}, dispatched={} if winner is None else {"i0": (winner, 1.0)})
    return state if winner is None else state.with_state([winner], "dispatched")


def test_it_bids_the_time_until_it_meets_the_intruder() -> None:
    """It drives at 0.7 m/s from (1, 9); the intruder is at (4.75, 5) and drives east at 0.5 m/s."""
    state = auctioned(evidence=[sighting(4.0 + 0.5 * t, 5.0, t) for t in (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5)])
    action = pursuer().act(view(1.5, state=state, pose=Pose(5.0, 8.0, 0.0)))
    (time,) = action.bids.values()
    assert time is not None
    meeting = 4.75 + 0.5 * time, 5.0
    assert math.dist((5.0, 8.0), meeting) / 0.7 == pytest.approx(time, rel=0.05)


def test_it_does_not_bid_for_what_it_cannot_meet_in_the_area() -> None:
    fast = [sighting(4.0 + 2.0 * t, 5.0, t) for t in (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5)]
    assert pursuer().act(view(1.5, state=auctioned(evidence=fast))).bids == {}


def test_it_stands_while_it_watches_and_drives_when_it_is_dispatched() -> None:
    assert pursuer().act(view(1.5, state=auctioned())).twist == STILL
    assert pursuer().act(view(1.5, state=auctioned(winner="p0"))).twist != STILL


def test_who_is_dispatched_does_not_bid() -> None:
    state = auctioned(winner="p0")
    other = structs.replace(state.auctions["i0"], lot="i1", winner=None)
    state = structs.replace(state.with_state(["i1"], "crossing"), auctions={**state.auctions, "i1": other})
    assert pursuer().act(view(1.5, state=state)).bids == {}


def test_what_it_sketches_can_be_sent_however_many_robots_it_knows() -> None:
    """A team mate sees five unknown robots for two seconds: people walk through the scene."""
    player = pursuer()
    for i in range(20):
        time = 0.1 * i
        seen = [sighting(2.0 * robot, 3.0 + 0.5 * time, time) for robot in range(5)]
        can_be_sent(player.act(view(time, heard=[says(seen, time)])))


@pytest.mark.parametrize(
    "wrong",
    [
        {"x": 5e8, "y": 1.0},
        {"time": 5e8},
        {"time": -5e8},
        {"xx": 1e-9, "yy": 1e-9},
        {"xx": 1e8, "yy": 1e8},
        {"xx": 1e-150, "yy": 1e-150},
    ],
    ids=str,
)
def test_what_a_team_mate_says_does_not_stop_it(wrong: dict[str, float]) -> None:
    """A team mate may play by another program, and its numbers may be anything."""
    player = pursuer()
    for i in range(1, 40):
        time = 3.0 * i
        right = sighting(5.0, 5.0, time)
        strange = [structs.replace(sighting(9.0, 2.0, time - 0.2 * k), **wrong) for k in range(2)]
        heard = [says([right], time), *(says([s], time, "p2") for s in strange)]
        can_be_sent(player.act(view(time, heard=heard)))


@pytest.mark.parametrize(
    "said", [None, 3, "hello", b"\x00", [], {"pose": 3}, {"pose": [1, 2, 3, 4, 5], "seen": [[1]]}], ids=repr
)
def test_nonsense_on_the_radio_does_not_stop_it(said: object) -> None:
    can_be_sent(pursuer().act(view(1.0, heard=[TeamMessage("p1", 1.0, said)])))


def test_a_pursuer_says_where_it_is_at_each_tick() -> None:
    said = pursuer().act(view(1.0)).say
    assert isinstance(said, dict)
    assert said["pose"][:3] == (STARTS["p0"].x, STARTS["p0"].y, STARTS["p0"].theta)


def test_it_drives_to_its_post_before_the_round() -> None:
    match = Match(book())
    away = Pose(2.5, 9.0, 0.0)
    now = field(book(), {"p0": (2.5, 9.0)})
    referee = match.state(now, estop=False)
    me = referee.player("p0")
    assert me is not None
    assert me.may_move
    begin = structs.replace(view(1.0, pose=away), referee=referee, me=me)
    player = pursuer()
    player.act(begin)
    twist = player.act(structs.replace(begin, time=1.1)).twist
    assert twist != STILL
    assert player.mode == "Pursuer/Return"


def test_it_bids_for_an_intruder_that_it_can_meet_before_the_intruder_comes_in() -> None:
    """It stands beside the place where the intruder will come in; the meeting is outside, and will be a capture."""
    rules = book()
    seen = [sighting(-3.0 + 0.07 * i, 9.0, 0.1 * i) for i in range(15)]
    auction = Auction(lot="i0", bidders=("p0",), opened=0.0, lasts=0.5, evidence=seen[-8:])
    state = structs.replace(crossing(rules, "i0", entered=False), auctions={"i0": auction})
    player = pursuer()
    player.act(view(1.4, state=state, heard=[says(seen, 1.4)]))
    bids = player.act(view(1.5, state=state)).bids or player.act(view(1.6, state=state)).bids
    assert bids.get("i0") is not None or "i0" in player.act(view(1.7, state=state)).bids
