"""A match with emulated motor controllers in one process: simulated time, the driver of real robots, equal journals."""

from pathlib import Path

import pytest

from tests.playing.test_in_process import Witness
from vrg.bus.messages import RefereeState, Stage
from vrg.bus.node import Tick
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.playing.in_process import Ending
from vrg.testing import matches

MIXED = Path("examples/mixed.toml")
PHYSICAL = ("player2", "player5")


class Tour(Witness):
    """Also measures how far each robot has come, and remembers why the referee has halted."""

    def __init__(self, setup: MatchSetup) -> None:
        super().__init__(setup)
        self.ways: dict[str, float] = {}
        self.halts: set[str | None] = set()
        self._before: dict[str, tuple[float, float]] = {}

    def tick(self, tick: Tick) -> None:
        super().tick(tick)
        assert self.poses.latest is not None
        for body in self.poses.latest.body.bodies:
            x, y = self._before.get(body.name, (body.pose.x, body.pose.y))
            self.ways[body.name] = self.ways.get(body.name, 0.0) + abs(body.pose.x - x) + abs(body.pose.y - y)
            self._before[body.name] = (body.pose.x, body.pose.y)
        if self.states.latest is not None:
            self.halts.add(self.states.latest.body.halted)


def played(folder: Path, setup: MatchSetup, limit: float, *, strict: bool = False) -> tuple[Ending, Tour, bytes]:
    """Play a match; how it ended, what was seen, and its journal."""
    tour = Tour(setup)
    ending, run = matches.played(setup.at_rate(0.0), folder, tour, limit=limit, strict=strict)
    return ending, tour, run.journal.read_bytes()


def test_two_runs_have_equal_journals_and_every_robot_plays(tmp_path: Path) -> None:
    setup = load_match(MIXED, engine="planar", lasers=False)
    first, tour, journal = played(tmp_path / "a", setup, 20.0, strict=True)
    _, _, again = played(tmp_path / "b", setup, 20.0)
    assert journal == again
    state: RefereeState = first.state
    assert state.stage is Stage.PLAY_ROUND
    assert tour.halts == {None}
    assert not first.failures
    assert min(tour.ways[name] for name in PHYSICAL) > 1.0, tour.ways
    assert not tour.out
    assert not tour.touches


def test_real_motor_controllers_are_refused(tmp_path: Path) -> None:
    (tmp_path / "match.toml").write_text(MIXED.read_text().replace("emulate = true", "emulate = false"))
    with pytest.raises(ConfigError, match=r"player2, player5: expected virtual robots, or drives on an emulated"):
        played(tmp_path / "run", load_match(tmp_path / "match.toml"), 1.0)
