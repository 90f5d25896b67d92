"""In a match in one process a strategy holds the very state that the referee has published."""

from tests.bus.test_codec import assert_immutable
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Contestant, Observation
from vrg.games.roboflag.rules import RoboFlag
from vrg.games.roboflag.settings import Settings
from vrg.types import Pose


def test_it_cannot_be_changed() -> None:
    places = {"red1": Pose(-3.0, 0.0, 0.0), "blue1": Pose(3.0, 0.0, 0.0)}
    book = RoboFlag(
        Settings(),
        [Contestant(name=n, role=n.rstrip("1"), start=p, size=(0.5, 0.5), v_max=0.7) for n, p in places.items()],
    )
    match, now = Match(book), Observation(places)
    for _ in range(3):
        match.step(0.1, now, [])
    state = match.state(now, estop=False)
    assert state.auctions, "the attack is auctioned"
    assert_immutable(state)
